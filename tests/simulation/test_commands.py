"""Commands of scenarios on shipped robots: accepted, refused with the reason, projected, simulated."""

import math
from typing import Any

import numpy as np
import pytest

import rollerbench as rb

BASE: dict[str, Any] = {"name": "base", "robot": "youbot_base", "duration": 4.0, "recording": {"html": False}}
CART = {**BASE, "robot": "differential_cart"}


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ({"type": "twist"}, ["v_xyw_B: this field is required"]),
        ({"type": "twist", "pieces": [{"duration": 5.0, "v_xyw_B": [1, 0, 0]}]}, ["last 5 s", "at most"]),
        (
            {"type": "twist", "ramp": 1.0, "pieces": [{"duration": 0.5, "v_xyw_B": [1, 0, 0]}]},
            ["duration = 0.5", "ramp"],
        ),
        ({"type": "wheel_speeds", "steps": {"left": []}}, ["steps.left", "front_left", "all"]),
        (
            {"type": "wheel_speeds", "steps": {"all": [{"start": 1, "stop": 1, "height_deg": 5}]}},
            ["stop = 1.0", "later than start"],
        ),
        ({"type": "path", "name": "helix"}, ["command.name = 'helix'", "'figure_eight'"]),
        ({"type": "path", "name": "arc", "radius": 1.0}, ["angle_deg: this field is required for a arc"]),
        ({"type": "path", "name": "circle", "radius": 1.0, "length": 2.0}, ["length: a circle has none", "radius"]),
        ({"type": "path", "name": "line", "length": 4.0, "speed": 0.1}, ["command.speed = 0.1", "takes 53"]),
        ({"type": "waypoints", "waypoints": [[1]]}, ["waypoints[0] = [1]", "at least 2"]),
        ({"type": "waypoints", "waypoints": [[0, 0]]}, ["no length"]),
        ({"type": "waypoints", "waypoints": [[9, 0]], "speed_law": "time_optimal"}, ["duration = 4", "takes 6.6"]),
        ({"type": "path", "name": "line", "length": 1, "margin": 0.5}, ["margin: not with speed_law: trapezoidal"]),
        (
            {"type": "path", "name": "line", "length": 1, "speed": 1, "speed_law": "time_optimal"},
            ["speed: not with", "margin"],
        ),
        ({"type": "path", "name": "circle", "radius": 1, "heading": "free"}, ["heading = 'free'", "no points"]),
        ({"type": "path", "name": "spline", "points": [[1, 0, 90]]}, ["yaw_deg belongs to heading: free"]),
        ({"type": "path", "name": "spline", "points": [[1, 0]], "deviation": 0.1}, ["deviation: a spline has none"]),
        ({"type": "path", "name": "clothoid", "points": [[1, 0], [0, 0]]}, ["command: point 1", "turns by 180 deg"]),
    ],
)
def test_a_fault_is_named(command: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_scenario({**BASE, "command": command})
    for word in words:
        assert word in str(caught.value)


def test_time_optimal_runs_go_at_once_and_then_rest() -> None:
    path = {"type": "path", "name": "clothoid", "points": [[1, 0], [1, 1, 90]], "heading": "free"}
    scenario = rb.load_scenario({**BASE, "command": {**path, "speed_law": "time_optimal", "margin": 0.8}})
    legs = [rb.paths.clothoid([[1, 0], [1, 1]], yaw=[math.nan, math.pi / 2])]
    fastest = rb.paths.time_optimal("youbot_base", legs, margin=0.8)
    twist = scenario.motion.twist
    assert twist.breaks[-1] == fastest.duration < 4.0
    assert twist(4.0) == pytest.approx(np.zeros(3))
    assert scenario.motion.wheel_speeds.peak.max() == pytest.approx(0.8 * 30.0, rel=1e-3)


def test_steered_wheels_turn_in_the_rests_of_time_optimal_legs() -> None:
    command = {"type": "waypoints", "waypoints": [[1, 0], [1, 1, 90]], "speed_law": "time_optimal", "margin": 0.9}
    motion = rb.load_scenario({**BASE, "robot": "swerve_base", "command": command}).motion
    assert motion.steers
    assert motion.steering_angles.peak_rate.max() < 15.0
    assert motion.wheel_speeds.peak.max() <= 0.9 * 60.0


@pytest.mark.parametrize(("limit", "value"), [("effort", {"max_effort": 1.5}), ("adhesion", {"friction": 0.3})])
def test_a_cart_in_drake_uses_its_limits_as_planned(limit: str, value: dict[str, float]) -> None:
    """Wheel speeds exactly; efforts within 1 % for 98 % of the time: the step of the acceleration rings shortly."""
    cart = rb.load_robot("differential_cart").model_dump(mode="json", exclude_none=True)
    cart["wheels"] = [{**wheel, **({} if wheel["type"] == "castor" else value)} for wheel in cart["wheels"]]
    path = {"type": "path", "name": "clothoid", "points": [[1.5, 0], [1.5, 1.5]], "speed_law": "time_optimal"}
    scenario = rb.load_scenario(
        {
            **{**BASE, "robot": rb.load_robot(cart), "duration": 3.6, "plant": {"time_step": 0.002}},
            **{"ground": {"friction": value.get("friction", 0.8)}, "command": {**path, "margin": 0.9}},
        }
    )
    fastest = scenario.fastest
    assert fastest.usage[limit].max() == pytest.approx(0.9, rel=1e-3)
    recording = rb.run(scenario, save=False).recording
    assert (np.abs(recording.wheels("measured")[:, :2]) <= 0.9 * 15.0 * 1.002).all()
    efforts = np.abs(recording.wheels("effort")[:, :2]).max(axis=1)
    moving = (recording.time > 0.02) & (recording.time < fastest.duration - 0.02)
    planned = np.interp(recording.time, fastest.time, fastest.usage["effort"]) * cart["wheels"][0]["max_effort"]
    off = (efforts - planned)[moving] / planned.max()
    assert np.mean(off < 0.01) > 0.98
    # Without slip: friction has what it needs.
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))[:, :2]
    assert np.percentile(slip[moving], 98) < 0.01


def test_time_optimal_commands_know_the_ground() -> None:
    path = {"type": "path", "name": "line", "length": 0.2, "speed_law": "time_optimal"}
    data = {**BASE, "duration": 4.0, "command": path}
    dry, icy = (
        rb.load_scenario({**data, "ground": {"friction": friction}}).fastest.duration for friction in (0.8, 0.1)
    )
    # Grip alone limits both: times go by the root of the combined friction, but for loads that accelerations shift.
    combined = [2 * 0.8 * ground / (0.8 + ground) for ground in (0.8, 0.1)]
    assert icy / dry == pytest.approx(math.sqrt(combined[0] / combined[1]), rel=0.1)
    with pytest.raises(rb.DescriptionError, match=r"ground.slope_deg = 5.* level ground"):
        rb.load_scenario({**data, "ground": {"slope_deg": 5.0}})
    with pytest.raises(rb.DescriptionError, match="at least; accepted: a duration of that or more"):
        rb.load_scenario({**data, "duration": 0.1})


def test_pieces_follow_each_other() -> None:
    pieces = [{"duration": 2.0, "v_xyw_B": [0.3, 0, 0]}, {"duration": 2.0, "v_xyw_B": [0, 0, 0.5]}]
    scenario = rb.load_scenario({**BASE, "command": {"type": "twist", "pieces": pieces, "ramp": 0.4}})
    twist = scenario.motion.twist
    assert twist([1.0, 3.0, 4.0]) == pytest.approx(np.array([[0.3, 0, 0], [0, 0, 0.5], [0, 0, 0]]), abs=1e-12)
    # Every change takes 0.4 s from the start of its piece; the stop is the end of the last piece.
    assert twist.integral(np.array([0.0, 4.0]))[0] == pytest.approx([0.3 * 2.0, 0, 0.5 * 1.6], abs=1e-12)


def test_a_tyre_that_would_skid_is_named_or_the_twist_projected() -> None:
    command = {"type": "path", "name": "arc", "radius": 1.0, "angle_deg": 60, "heading": "fixed"}
    with pytest.raises(rb.InfeasibleTwist, match=r"skid sideways \(left at .* right at"):
        _ = rb.load_scenario({**CART, "command": command}).motion
    projected = rb.load_scenario({**CART, "command": {**command, "infeasible": "project"}}).motion.twist
    assert projected(np.linspace(0, 4, 50))[:, 1] == pytest.approx(np.zeros(50), abs=1e-12)


def test_a_cart_looks_along_its_path_unless_told_otherwise() -> None:
    command = {"type": "path", "name": "square", "length": 0.5}
    cart = rb.load_scenario({**CART, "command": command}).motion.twist(np.linspace(0, 4, 400))
    youbot = rb.load_scenario({**BASE, "command": command}).motion.twist(np.linspace(0, 4, 400))
    assert np.abs(cart[:, 1]).max() < 1e-12 < np.abs(cart[:, 2]).max()
    assert np.abs(youbot[:, 2]).max() < 1e-12 < np.abs(youbot[:, 1]).max()


def test_a_wheel_is_not_asked_beyond_its_limit() -> None:
    with pytest.raises(rb.DescriptionError, match=r"asks wheel front_left for 42.11 rad/s; accepted: up to .* 30"):
        _ = rb.load_scenario({**BASE, "command": {"type": "twist", "v_xyw_B": [2.0, 0, 0]}}).motion


def test_straight_run_of_wang_in_drake() -> None:
    """Wang et al. (2016), figures 9 to 11: 0.4202 m; sideways below 0.1 mm, yaw below 0.01 deg."""
    result = rb.run("six_wheel_straight", save=False)
    x, y, yaw = result.summary["simulated_final_pose"]
    assert x == pytest.approx(0.4202, abs=2e-4)
    assert abs(y) < 1e-4
    assert abs(math.degrees(yaw)) < 0.01


def test_pivot_of_wang_in_drake() -> None:
    """Wang et al. (2016), figures 12 to 15: 65.01 deg clockwise; the centre stays, with the mass in the middle."""
    result = rb.run("six_wheel_pivot", save=False)
    assert math.degrees(result.summary["reference_final_pose"][2]) == pytest.approx(-65.01, abs=0.005)
    assert math.degrees(result.summary["simulated_final_pose"][2]) == pytest.approx(-65.01, rel=0.005)
    assert result.summary["pose_error"]["max_position"] < 1e-3


@pytest.mark.parametrize("name", ["cart_arc", "cart_tight_arc", "cart_turn"])
def test_arcs_of_the_cart(name: str) -> None:
    error = rb.run(rb.load_scenario(name, overrides={"recording.html": False}), save=False).summary["pose_error"]
    assert error["percent_of_path"] is None or error["percent_of_path"] < 0.2
    assert abs(error["final_yaw"]) < math.radians(0.3)


@pytest.mark.parametrize("name", ["omni_platform", "kiwi"])
def test_random_twists_of_omni_wheels(name: str) -> None:
    """Within 0.3 % and 0.3 deg, if each wheel rolls over two rollers: one that stands keeps its contact in one row."""
    kinematics = rb.WheelKinematics(name)
    pitches = 2 * kinematics.robot.wheels[0].ring.pitch
    rng = np.random.default_rng(3)
    speed, direction, rate = rng.uniform((0.4, 0, -0.5), (0.8, 2 * np.pi, 0.5), (20, 3)).T
    twists = np.column_stack([speed * np.cos(direction), speed * np.sin(direction), rate])
    rolling = twists[(np.abs(kinematics.inverse(twists)) * 2.5 > pitches).all(axis=1)]
    for v_xyw_B in rolling[:4].tolist():
        command = {"type": "twist", "v_xyw_B": v_xyw_B}
        scenario = {"name": "random", "robot": name, "duration": 3.0, "command": command, "plant": {"time_step": 0.002}}
        error = rb.run(scenario, save=False).summary["pose_error"]
        assert error["percent_of_path"] < 0.3
        assert abs(error["final_yaw"]) < math.radians(0.3)


@pytest.mark.parametrize("name", ["swerve_crab", "swerve_arc", "swerve_figure_eight"])
def test_swerve(name: str) -> None:
    """Also where the wheels steer on the way: the odometry then uses their measured angles."""
    summary = rb.run(rb.load_scenario(name, overrides={"recording.html": False}), save=False).summary
    assert summary["pose_error"]["percent_of_path"] < 0.5
    assert summary["pose_error"]["max_yaw"] < math.radians(0.3)
    odometry, simulated = summary["odometry_final_pose"], summary["simulated_final_pose"]
    assert np.hypot(odometry[0] - simulated[0], odometry[1] - simulated[1]) < 0.003 * summary["path_length"]


def test_a_wheel_placed_by_azimuth() -> None:
    """Omni wheels at azimuth a, rolling along the circle: the row is [-sin a, cos a, d] / R."""
    robot = rb.load_robot("omni_platform")
    azimuth = np.radians([wheel.azimuth_deg for wheel in robot.wheels])
    expected = np.column_stack([-np.sin(azimuth), np.cos(azimuth), np.full(4, 0.28)]) / 0.09
    assert rb.WheelKinematics(robot).drive_matrix == pytest.approx(expected, abs=1e-12)
    data = robot.model_dump(mode="json", exclude_none=True)
    data["wheels"][0]["position"] = [0.2, 0.2]
    with pytest.raises(rb.DescriptionError, match=r"wheels\[0\].position .* besides distance and azimuth_deg"):
        rb.load_robot(data)
