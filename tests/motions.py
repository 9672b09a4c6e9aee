"""What every run of the ten motions of Huai and Jin (2022) must satisfy."""

import math

import numpy as np
import pytest

import rollerbench as rb
from rollerbench.kinematics import finite_roller_factor


def assert_translation(result: rb.RunResult) -> None:
    """The robot goes as the equations say, but for finite rollers."""
    error, path = result.summary["pose_error"], result.summary["path_length"]
    vx, vy, _ = result.scenario.command.v_xyw_B  # type: ignore[union-attr]
    shortfall = 1 - finite_roller_factor(12)
    # At constant wheel speed the contact wanders over the roller pitch: sideways all of the shortfall, on a diagonal,
    # where two wheels stand still, half of it.
    expected = {(1, 0): 0.0, (0, 1): shortfall, (1, 1): 0.5 * shortfall}[(int(vx != 0), int(vy != 0))]
    short = -error["along_track"] / path
    if vy == 0:
        assert abs(short) < 0.001
    assert short == pytest.approx(expected, abs=0.002)
    assert abs(error["cross_track"]) < 0.001 * path
    assert error["max_yaw"] < math.radians(0.05)
    # 0.25 mm for every 0.1 m of wheel radius.
    assert result.summary["height_ripple"] < 0.0025 * result.scenario.robot.wheels[0].radius


def assert_turn(result: rb.RunResult) -> None:
    """The wheels contradict each other in a turn, so its shortfall follows friction and servo: no law, a range."""
    error, rotation = result.summary["pose_error"], result.summary["rotation"]
    assert error["max_position"] < 1e-3
    short = -error["final_yaw"] * np.sign(result.recording.reference_q_xyt[-1, 2]) / rotation
    assert 0.005 < short < 0.03
