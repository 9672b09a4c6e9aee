"""The ten motions of Huai and Jin (2022), youBot and paper size: what the equations say, but for finite rollers."""

import math

import numpy as np
import pytest

import rollerbench as rb
from budgets import assert_parts_add_up
from rollerbench.kinematics import finite_roller_factor
from rollerbench.resources import scenario_files

NAMES = [name for name in scenario_files() if name.startswith(("mecanum_", "youbot_")) and "closed" not in name]
TRANSLATIONS = [name for name in NAMES if "turn" not in name]
TURNS = [name for name in NAMES if "turn" in name]


def test_there_are_ten_for_each() -> None:
    assert len(TRANSLATIONS) == 16
    assert len(TURNS) == 4


@pytest.mark.parametrize("name", TRANSLATIONS)
def test_translation(name: str) -> None:
    scenario = rb.load_scenario(name)
    result = rb.run(scenario, save=False)
    assert_parts_add_up(result.recording)
    error, path = result.summary["pose_error"], result.summary["path_length"]
    vx, vy, _ = scenario.command.v_xyw_B
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
    assert result.summary["height_ripple"] < 0.0025 * scenario.robot.wheels[0].radius


@pytest.mark.parametrize("name", TURNS)
def test_turns_stay_on_the_spot_and_fall_short(name: str) -> None:
    """The wheels contradict each other in a turn, so its shortfall follows friction and servo: no law, a range."""
    result = rb.run(name, save=False)
    assert_parts_add_up(result.recording)
    error, rotation = result.summary["pose_error"], result.summary["rotation"]
    assert error["max_position"] < 1e-3
    short = -error["final_yaw"] * np.sign(result.recording.reference_q_xyt[-1, 2]) / rotation
    assert 0.005 < short < 0.03


def test_a_heavy_robot_follows_as_well_as_a_light_one() -> None:
    """The servo's gain follows from mass and wheel radius: wheels lag the same way on 20 kg and on 200 kg."""
    lags = []
    for name in ("youbot_plus_x", "mecanum_plus_x"):
        recording = rb.run(name, save=False).recording
        command, speed = recording.wheels("command"), recording.wheels("speed")
        lags.append(np.abs(speed[1:] - command[:-1]).max() / command.max())
    assert max(lags) < 0.005
    assert lags[0] == pytest.approx(lags[1], rel=0.5)
