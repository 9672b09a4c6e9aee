"""Gear errors, backlash and encoders: what they do to the path, and what odometry believes."""

import math
from typing import Any

import numpy as np
import pytest

import rollerbench as rb

RADIUS, TRACK = 0.1, 0.4
LINE: dict[str, Any] = {
    **{"name": "line", "robot": "differential_cart", "duration": 8.0, "recording": {"html": False}},
    "command": {"type": "path", "name": "line", "length": 3.0},
}


def _run(errors: dict[str, Any], **changes: Any) -> rb.Recording:
    return rb.run({**LINE, "errors": errors, **changes}, save=False).recording


@pytest.fixture(scope="module")
def exact() -> rb.Recording:
    return _run({})


@pytest.mark.parametrize(
    ("constant", "amplitude", "phase_deg", "cycles"),
    [(0.0, 1e-3, 90.0, 1), (0.0, 5e-3, 0.0, 1), (0.0, 1e-3, 90.0, 0.5), (5e-4, 0.0, 0.0, 1), (5e-4, 5e-3, 45.0, 1)],
)
def test_one_gear_bends_the_straight_line(constant: float, amplitude: float, phase_deg: float, cycles: float) -> None:
    """Lateral path y(x) = e x^2 / (2B) + A cos(p) x / (B k) - A (sin(k x + p) - sin(p)) / (B k^2), k = cycles / R."""
    gear = {"constant": constant, "amplitude": amplitude, "phase_deg": phase_deg, "cycles": cycles}
    recording = _run({"gear_error": {"right": gear}})
    x, y, _ = recording.q_xyt.T
    k, p = cycles / RADIUS, math.radians(phase_deg)
    wave = math.cos(p) * x / k - (np.sin(k * x + p) - math.sin(p)) / k**2
    expected = (0.5 * constant * x**2 + amplitude * wave) / TRACK
    # 2 % of the largest deviation: the servos' lag of half a millisecond shifts the wave, most of all where cos(p) = 0.
    assert np.abs(y - expected).max() < 0.02 * np.abs(expected).max()
    # The encoders sit on the motors and saw none of it.
    assert np.abs(recording.odometry_q_xyt[:, 1]).max() < 0.02 * np.abs(expected).max()


def test_the_odometry_sees_no_gear_error_under_load_either() -> None:
    """On a slope the servos droop, by a little more where the ratio is larger; the wave itself stays unseen."""
    command = {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.0]}
    gear = {"gear_error": {"right": {"amplitude": 0.1}}}
    recording = _run(gear, command=command, duration=10.0, ground={"slope_deg": 10.0})
    assert np.abs(recording.odometry_q_xyt[:, 2]).max() < math.radians(0.05)
    assert np.abs(recording.q_xyt[:, 2]).max() > math.radians(1.0)


def test_the_same_gears_on_both_sides_only_stretch_the_line(exact: rb.Recording) -> None:
    stretched = _run({"gear_error": {"all": {"constant": 0.01}}})
    # Both wheels see the same numbers: 1e-12 is rounding.
    assert np.abs(stretched.q_xyt[:, 1] - exact.q_xyt[:, 1]).max() < 1e-12
    # 1e-6: the servos' lag at the end grows with the speed.
    assert stretched.q_xyt[-1, 0] / exact.q_xyt[-1, 0] == pytest.approx(1.01, abs=1e-6)
    assert stretched.odometry_q_xyt[-1, 0] == pytest.approx(exact.odometry_q_xyt[-1, 0], abs=1e-6)


def test_backlash_is_lost_at_the_reversal() -> None:
    """Half of the play is lost at the start, all of it at the reversal: the wheel ends half a play too far ahead."""
    play = math.radians(2.0)
    pieces = [{"duration": 3.0, "v_xyw_B": [speed, 0.0, 0.0]} for speed in (0.1, -0.1)]
    # From 0 to 0.1 m/s, to -0.1 m/s and to 0 in a second each, so that the wheels hardly skid when the play ends.
    command = {"type": "twist", "pieces": pieces, "ramp": 1.0}
    with_play = _run({"backlash_deg": {"all": 2.0}}, command=command, duration=6.0)
    without = _run({}, command=command, duration=6.0)
    lag = with_play.columns["left.angle"] - without.columns["left.angle"]
    middle = np.argmax(without.columns["left.angle"])
    # 1e-5: what the servos' lag differs by.
    assert lag[middle] == pytest.approx(-play / 2, abs=1e-5)
    assert lag[-1] == pytest.approx(play / 2, abs=1e-5)
    assert lag[-1] - lag[middle] == pytest.approx(play, abs=1e-5)
    # 4 % of the loss: the wheels skid a little when the play ends.
    assert with_play.q_xyt[-1, 0] - without.q_xyt[-1, 0] == pytest.approx(RADIUS * play / 2, rel=0.04)
    assert with_play.odometry_q_xyt[-1] == pytest.approx(without.odometry_q_xyt[-1], abs=1e-5 * RADIUS)


def test_an_encoder_counts_and_does_not_drift(exact: rb.Recording) -> None:
    counts = 1024
    recording = _run({"encoder_counts": {"all": counts}})
    count = 2 * math.pi / counts
    # The motion is the same, to rounding.
    assert recording.q_xyt == pytest.approx(exact.q_xyt, abs=1e-12)
    measured = recording.columns["right.measured"] * 0.005 / count
    assert measured == pytest.approx(np.round(measured), abs=1e-9)
    assert np.isnan(recording.columns["castor.measured"]).all()
    # Angles within half a count of the true ones at any time.
    difference = recording.odometry_q_xyt[:, 0] - exact.odometry_q_xyt[:, 0]
    assert 0.1 * RADIUS * count < np.abs(difference).max() <= 0.5 * RADIUS * count * (1 + 1e-9)


def test_without_errors_the_measurement_is_the_speed(exact: rb.Recording) -> None:
    for name in ("left", "right"):
        assert (exact.columns[f"{name}.measured"] == exact.columns[f"{name}.speed"]).all()


def test_steered_robots_measure_with_their_encoders_too() -> None:
    command = {"type": "path", "name": "line", "length": 0.5, "heading": "fixed", "direction_deg": 30.0}
    errors = {"gear_error": {"all": {"constant": 0.02}}}
    result = _run(errors, robot="swerve_base", command=command, duration=3.0)
    way, believed = (np.linalg.norm(path[-1, :2]) for path in (result.q_xyt, result.odometry_q_xyt))
    assert way / believed == pytest.approx(1.02, abs=2e-3)  # tyres roll 0.05 % short
    assert believed == pytest.approx(0.5, rel=2e-3)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        ({"gear_error": {"castor": {"constant": 0.1}}}, ["errors.gear_error.castor", "driven", "left, right, all"]),
        ({"gear_error": {"left": 0.01}}, ["errors.gear_error.left = 0.01"]),
        ({"gear_error": {"left": {"constant": 0.3, "amplitude": -0.3}}}, ["gear_error.left", "-0.3", "at most 0.5"]),
        ({"gear_error": {"left": {"cycles": 0}}}, ["errors.gear_error.left.cycles = 0", "greater than 0"]),
        ({"gear_error": {"left": {"phase": 0}}}, ["errors.gear_error.left.phase", "did you mean phase_deg"]),
        ({"gear_error": {"left": {"constant": math.nan}}}, ["errors.gear_error.left.constant = nan"]),
        ({"backlash_deg": {"left": -1.0}}, ["errors.backlash_deg.left = -1", "greater than or equal to 0"]),
        ({"backlash_deg": {"castor": 1.0}}, ["errors.backlash_deg.castor", "driven", "left, right, all"]),
        ({"backlash_deg": {"left": "2 deg"}}, ["errors.backlash_deg.left = '2 deg'"]),
        ({"encoder_counts": {"left": 0}}, ["errors.encoder_counts.left = 0", "greater than 0"]),
        ({"encoder_counts": {"left": 10.5}}, ["errors.encoder_counts.left = 10.5"]),
        ({"encoder_counts": {"middle": 8}}, ["errors.encoder_counts.middle", "left, right, all"]),
        ({"encoder_counts": {"left": 10**12}}, ["errors.encoder_counts.left", "10000000"]),
    ],
)
def test_impossible_drivetrains_are_refused(errors: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_scenario({**LINE, "errors": errors})
    for word in words:
        assert word in str(caught.value)


def test_a_drivetrain_needs_no_other_robot() -> None:
    scenario = rb.load_scenario({**LINE, "errors": {"backlash_deg": {"all": 1.0}}})
    assert scenario.simulated_robot is scenario.robot
