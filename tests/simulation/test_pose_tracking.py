"""Closed loops with imperfect robots: how far from the reference they are, where open loops are far off."""

import re

import numpy as np
import pytest

import robots
import rollerbench as rb

EIGHT = {"type": "path", "name": "figure_eight", "length": 2.0, "laps": 2}
TRACKING = {"type": "pose_tracking"}
YOUBOT = {
    "radius_scale": {"all": 1.03},
    "gear_error": {"front_left": {"constant": 0.02}},
    "heading_offset_deg": {"front_left": 0.5},
}
# The castor grows with the tyres, or it would hang in the air.
CART = {
    "radius_scale": {"left": 1.03, "right": 1.03, "castor": 1.075},
    "gear_error": {"left": {"constant": 0.02}},
    "heading_offset_deg": {"left": 0.5},
}


def errors(robot, errors, controller, command=EIGHT, duration=32.5):
    """Largest distance [m] and angle [rad] between robot and reference in the second half of the way, and the run."""
    scenario = {
        "name": "closed_loop",
        "robot": robot,
        "duration": duration,
        "command": command,
        "errors": errors,
        "controller": controller,
    }
    result = rb.run(scenario, save=False)
    reference, off = result.recording.reference_q_xyt, result.recording.q_xyt - result.recording.reference_q_xyt
    way = np.cumsum(np.hypot(*np.diff(reference[:, :2], axis=0, prepend=0.0).T))
    later = way >= 0.5 * way[-1]
    turn = (off[later, 2] + np.pi) % (2 * np.pi) - np.pi
    return np.hypot(*off[later, :2].T).max(), np.abs(turn).max(), result


def test_feedback_keeps_an_imperfect_mecanum_base_on_its_eight() -> None:
    distance, angle, result = errors("youbot_base", YOUBOT, TRACKING)
    # At 0.5 m/s on a figure of eight of 2 m by 1 m.
    speed = np.hypot(*result.recording.v_xyw_B[len(result.recording.time) // 2, :2])
    assert speed == pytest.approx(0.5, rel=0.02)
    assert distance < 0.010
    assert np.degrees(angle) < 0.5
    # What the feedback did is part of the budget, which still adds up.
    budget = rb.error_budget(result.recording)
    assert np.abs(budget.parts["feedback"][:, :2]).max() > 0.02
    off = result.recording.q_xyt - result.recording.reference_q_xyt
    assert np.abs(budget.total[:, :2] - off[:, :2]).max() < 1e-9


def test_feedback_keeps_an_imperfect_cart_on_its_eight() -> None:
    distance, _, _ = errors("differential_cart", CART, TRACKING)
    assert distance < 0.020


def test_open_loops_are_far_off() -> None:
    assert errors("differential_cart", CART, {"type": "open_loop"})[0] > 0.5
    assert errors("youbot_base", YOUBOT, {"type": "open_loop"}, {**EIGHT, "laps": 1}, 16.0)[0] > 0.03


TURN = {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.3]}
LARGER = {"radius_scale": {"all": 1.03}}


@pytest.mark.parametrize("robot", ["kiwi", "six_wheel", "swerve_base", "mecanum_platform"])
def test_every_wheeled_robot_tracks(robot: str) -> None:
    distance, angle, result = errors(robot, LARGER, TRACKING, TURN, 3.0)
    # The open loop's distance is 3 % of the way, 23 mm.
    assert distance < 0.006
    assert np.degrees(angle) < 0.5
    assert result.summary["status"] == "ok"


@pytest.mark.parametrize(
    ("robot", "changes"),
    # Half of a period, and with steering one more; the mean that limits the jerk takes 20 twists.
    [(robots.car(), {"period": 0.05}), ("kiwi", {"max_wheel_acceleration": 60.0, "max_wheel_jerk": 600.0})],
)
def test_the_feedforward_is_ahead_by_what_the_loop_is_late(robot: str | dict, changes: dict) -> None:
    distance, _, _ = errors(robot, {}, {**TRACKING, **changes}, {**TURN, "ramp": 0.5}, 1.2)
    # Late, they would be 10 and 19 mm off.
    assert distance < 0.004


def test_a_car_tracks_with_its_steering() -> None:
    car = robots.car()
    distance, _, _ = errors(
        car, LARGER, TRACKING, {"type": "path", "name": "arc", "radius": 2.0, "angle_deg": 40.0}, 4.0
    )
    assert distance < 0.015


def test_feedback_of_odometry_alone_does_not_see_wrong_radii() -> None:
    distance, _, result = errors("kiwi", LARGER, {**TRACKING, "feedback": "odometry"}, TURN, 3.0)
    assert distance > 0.015
    off = result.recording.odometry_q_xyt[-1] - result.recording.reference_q_xyt[-1]
    assert np.hypot(*off[:2]) < 0.005


def test_wheels_stay_within_their_limits() -> None:
    tracking = {**TRACKING, "max_wheel_acceleration": 5.0}
    _, _, result = errors("kiwi", {}, tracking, {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.0], "ramp": 0.1}, 2.0)
    commands = np.column_stack([result.recording.columns[f"{name}.command"] for name in result.recording.wheel_names])
    periods = commands[1::2]
    assert np.abs(np.diff(periods, axis=0)).max() <= 5.0 * 0.01 * (1 + 1e-9)


def stuck() -> dict:
    """The cart with more tyres, of which no two look the same way."""
    data = robots.cart()
    wheel = {**data["wheels"][0], "driven": False}
    more = [
        {**wheel, "name": "ahead", "position": [0.3, 0.0], "heading_deg": 90.0},
        {**wheel, "name": "behind", "position": [-0.3, 0.1], "heading_deg": 45.0},
    ]
    return {**data, "name": "stuck", "wheels": [*data["wheels"], *more]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"controller": {**TRACKING, "position": -1}}, "controller.position"),
        ({"controller": {**TRACKING, "position": 100}}, "position = 100: accepted: up to 50"),
        ({"controller": {**TRACKING, "period": 0.0123}}, "controller.period = 0.0123: accepted: a multiple"),
        ({"controller": {**TRACKING, "max_wheel_jerk": 9.0}}, "controller.max_wheel_jerk"),
        ({"controller": TRACKING, "engine": "mujoco"}, "engine"),
        ({"controller": TRACKING, "command": {"type": "wheel_efforts", "wheel_efforts": {}}}, "command.type"),
        ({"controller": TRACKING, "robot": "wheel_leg_hexapod"}, "controller.type"),
        ({"command": {**EIGHT, "name": "line", "length": 1.0}}, "a line does not close"),
        (
            {"controller": {**TRACKING, "max_wheel_acceleration": 20.0, "max_wheel_jerk": 100.0}},
            "controller.max_wheel_jerk = 100.0: it takes a mean of 40 periods of control, by which the feedback would "
            "be too late at gains of 4/s; accepted: 166.7 or more",
        ),
        (
            {"controller": {**TRACKING, "max_wheel_acceleration": 20.0, "max_wheel_jerk": 1.0}},
            "controller.max_wheel_jerk = 1.0: it takes a mean of more than 500 periods",
        ),
        (
            {"controller": {**TRACKING, "lateral": 150.0}, "robot": "differential_cart"},
            "lateral = 150.0: at 0.3 m/s the heading would follow at a rate of 67.64/s; accepted: up to 108.4,",
        ),
        ({"controller": TRACKING, "robot": stuck()}, "controller.type = 'pose_tracking': stuck: its tyres allow no"),
    ],
)
def test_what_cannot_be_tracked_is_refused(changes: dict, message: str) -> None:
    with pytest.raises(rb.DescriptionError, match=re.escape(message)):
        rb.load_scenario({"name": "x", "robot": "kiwi", "duration": 1.0, "command": TURN, **changes})


def test_what_is_accepted_instead_is() -> None:
    data = {"name": "x", "robot": "kiwi", "duration": 1.0, "command": TURN}
    jerk = {"max_wheel_acceleration": 20.0, "max_wheel_jerk": 166.7}
    assert rb.load_scenario({**data, "controller": {**TRACKING, **jerk}}).tracking is not None
    for robot in ("differential_cart", "six_wheel"):
        fastest = {**TURN, "v_xyw_B": [float(rb.limits.max_speed(robot, 0.0).value), 0.0, 0.0]}
        assert rb.load_scenario({**data, "robot": robot, "command": fastest, "controller": TRACKING}).tracking
    lateral = {**TRACKING, "lateral": 108.4}
    assert rb.load_scenario({**data, "robot": "differential_cart", "controller": lateral}).tracking


def test_a_controller_without_a_type_is_the_one_that_has_its_fields() -> None:
    data = {"name": "x", "robot": "kiwi", "duration": 1.0, "command": TURN}
    for controller, expected in (
        ({}, "open_loop"),
        ({"servo": "pid"}, "open_loop"),
        ({"position": 2.0}, "pose_tracking"),
        ({"period": 0.02}, "pose_tracking"),
        ({"servo": "pid", "lateral": 2.0}, "pose_tracking"),
    ):
        assert rb.load_scenario({**data, "controller": controller}).controller.type == expected
    legs = rb.load_scenario("hexapod_stand", overrides={"controller": {"period": 0.01}})
    assert legs.controller.type == "legs"
