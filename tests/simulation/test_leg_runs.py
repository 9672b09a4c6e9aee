"""Runs of robots on legs: within the published bounds, refused in words, kept when they fail."""

from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.report.figures import run_figures
from rollerbench.simulation.scenario import load_scenario

Data = dict[str, Any]

MILLIMETRE, DEGREE = 1e-3, np.radians(1.0)


def gait(*pieces: Data, **settings: Any) -> Data:
    return {"type": "gait", "pieces": list(pieces), **settings}


def shortened(name: str, *pieces: Data, rest: float = 0.0, **overrides: Any) -> rb.Scenario:
    """A shipped scenario with other pieces, which take its time but for a rest."""
    duration = sum(piece["duration"] for piece in pieces) + rest
    changes = {key.replace("__", "."): value for key, value in overrides.items()}
    command = changes.pop("command", {})
    return load_scenario(
        name,
        overrides={"duration": duration, "command": {**gait(*pieces), **command}, "recording.html": False, **changes},
    )


def ran(scenario: rb.Scenario) -> tuple[rb.Recording, Data]:
    result = rb.run(scenario, save=False)
    assert result.summary["status"] == "ok"
    return result.recording, result.summary["legs"]


def off_course(recording: rb.Recording) -> float:
    """Largest distance from the reference [m]."""
    return float(np.hypot(*(recording.q_xyt - recording.reference_q_xyt)[:, :2].T).max())


def test_the_hexapod_stands_where_it_was_put() -> None:
    recording, legs = ran(shortened("hexapod_stand", {"duration": 0.6}))
    assert legs["height_error"] < 0.5 * MILLIMETRE
    assert legs["tilt_error"] < 0.1 * DEGREE
    assert off_course(recording) < 0.1 * MILLIMETRE
    assert legs["steps"] == 0
    figures = run_figures(recording)
    assert set(figures) == {"trajectory", "pose_error", "body", "gait", "feet", "joint_efforts"}
    assert all(len(svg) > 1000 for svg in figures.values())


def test_an_insect_walks_with_the_tripod_gait() -> None:
    scenario = shortened("hexapod_tripod_walk", {"duration": 2.5, "v_xyw_B": [0.2, 0, 0]})
    recording, legs = ran(scenario)
    assert recording.reference_q_xyt[-1, 0] == pytest.approx(0.2 * (2.5 - 1.45 / 2), abs=1e-3)
    assert off_course(recording) < 3 * MILLIMETRE
    assert legs["height_error"] < 3 * MILLIMETRE
    assert legs["tilt_error"] < 0.3 * DEGREE
    assert legs["largest_slip"] < 3 * MILLIMETRE
    assert legs["planned_static_margin"] > 50 * MILLIMETRE
    assert 0 < legs["largest_effort"] <= 60.0
    again, _ = ran(scenario)
    for name, column in recording.columns.items():
        assert np.array_equal(column, again.columns[name]), name


def test_a_mammal_walks_with_its_feet_for_odometry() -> None:
    walk = {"duration": 4.0, "v_xyw_B": [0.15, 0, 0], "posture": "mammal"}
    recording, legs = ran(shortened("hexapod_mammal_walk", walk))
    path = recording.reference_q_xyt[-1, 0]
    assert path > 0.45
    assert np.hypot(*(recording.q_xyt - recording.reference_q_xyt)[-1, :2]) < 0.010 * path
    assert np.hypot(*(recording.odometry_q_xyt - recording.q_xyt)[-1, :2]) < 0.010 * path
    assert legs["tilt_error"] < 0.3 * DEGREE


@pytest.mark.parametrize("posture", ["insect", "mammal"])
def test_a_drive_on_six_wheels(posture: str) -> None:
    drive = {"duration": 2.5, "v_xyw_B": [0.4, 0, 0], "motion": "drive", "posture": posture}
    recording, legs = ran(shortened("hexapod_drive", drive))
    path = recording.reference_q_xyt[-1, 0]
    assert path > 0.75
    assert off_course(recording) < 0.02 * path
    assert legs["steps"] == 0
    assert legs["tilt_error"] < 0.3 * DEGREE


@pytest.mark.parametrize(("start", "end"), [("insect", "mammal"), ("mammal", "insect")])
def test_a_robot_steps_from_posture_to_posture(start: str, end: str) -> None:
    pieces = {"duration": 0.1, "posture": start}, {"duration": 4.9, "posture": end, "change": "stepping"}
    recording, legs = ran(shortened(f"hexapod_to_{end}_stepping", *pieces))
    _assert_posture(recording, end)
    assert legs["steps"] == 6
    assert legs["planned_static_margin"] > 50 * MILLIMETRE
    assert legs["height_error"] < 1 * MILLIMETRE
    assert off_course(recording) < 2 * MILLIMETRE


def test_a_robot_rolls_into_the_other_posture() -> None:
    """With all six wheels on the ground; the wheels slide by some millimetres."""
    recording, legs = ran(
        load_scenario("hexapod_to_mammal_rolling", overrides=["recording.html=false", "plant.time_step=0.005"])
    )
    _assert_posture(recording, "mammal")
    assert legs["steps"] == 0
    assert legs["planned_static_margin"] > 150 * MILLIMETRE
    assert legs["height_error"] < 2 * MILLIMETRE
    assert legs["tilt_error"] < 0.3 * DEGREE
    assert np.hypot(*(recording.q_xyt - recording.reference_q_xyt)[-1, :2]) < 10 * MILLIMETRE


def _assert_posture(recording: rb.Recording, name: str) -> None:
    robot = rb.load_robot("wheel_leg_hexapod")
    for leg in robot.legs:
        joints = [recording.columns[f"{leg.name}.joint_{k + 1}"][-1] for k in range(4)]
        # 1 deg: what the servos give way, and the feet slid.
        assert np.abs(joints - leg.posture(name)).max() < 1 * DEGREE


def test_a_walk_up_a_slope() -> None:
    recording, legs = ran(shortened("hexapod_slope", {"duration": 2.5, "v_xyw_B": [0.15, 0, 0]}))
    assert off_course(recording) < 3 * MILLIMETRE
    assert legs["tilt_error"] < 0.3 * DEGREE
    assert legs["largest_slip"] < 3 * MILLIMETRE


def test_a_walk_over_a_step_that_feet_feel() -> None:
    step = {"start": 0.4, "end": 0.65, "height": 0.02}
    walk = {"duration": 4.4, "v_xyw_B": [0.15, 0, 0]}
    recording, legs = ran(
        shortened("hexapod_step", walk, ground={"steps": [step]}, plant__time_step=0.004, command={"lift": 0.06})
    )
    # The front feet, 0.33 m ahead, are over the step and some have left it.
    assert recording.q_xyt[-1, 0] > 0.5
    on_step = [recording.columns[f"{name}.foot_z"].max() for name in ("front_left", "front_right")]
    assert min(on_step) > 0.02
    assert np.hypot(*(recording.q_xyt - recording.reference_q_xyt)[-1, :2]) < 20 * MILLIMETRE
    assert legs["tilt_error"] < 3 * DEGREE
    assert legs["height_error"] < 15 * MILLIMETRE


def test_a_robot_stands_on_without_one_leg() -> None:
    recording, legs = ran(shortened("hexapod_stand", {"duration": 1.0}, errors={"lost_legs": {"front_left": 0.3}}))
    lost = recording.time > 0.35
    assert not recording.columns["front_left.effort_2"][lost].any()
    assert np.abs(recording.columns["front_left.effort_2"][~lost]).max() > 1.0
    assert legs["height_error"] < 1 * MILLIMETRE


def test_a_leg_lost_on_the_way_halts_the_robot_and_what_was_recorded_is_kept() -> None:
    lost = {"lost_legs": {"middle_left": 1.3}}
    scenario = shortened("hexapod_tripod_walk", {"duration": 2.2, "v_xyw_B": [0.2, 0, 0]}, errors=lost)
    with pytest.raises(
        rb.SimulationError, match=r"at t = 1\.\d\d s the robot halted: leg middle_left does not follow"
    ) as e:
        rb.run(scenario, save=False)
    result = e.value.result
    assert result.summary["status"] == "failed"
    assert result.recording.time[-1] == pytest.approx(2.2, abs=0.01)
    assert all(np.isfinite(column).all() for column in result.recording.columns.values())
    # It stands.
    assert np.abs(result.recording.columns["vx"][-20:]).max() < 0.02


REFUSED = [
    (
        {"command": gait({"duration": 3.0, "v_xyw_B": [1.0, 0, 0]})},
        r"at t = 0\.02 s the command is beyond the legs' reach.*; accepted: up to v_xyw_B = \[0\.\d+, 0, 0\]",
    ),
    ({"command": gait({"duration": 3.0, "body": {"z": 0.3}})}, r"at t = \d\.\d\d s .*; accepted: a slower or smaller"),
    ({"command": gait({"duration": 3.0, "posture": "sit"})}, r"pieces.*posture = 'sit': accepted: insect, mammal"),
    ({"command": {"type": "twist", "v_xyw_B": [0.1, 0, 0]}}, r"wheel_leg_hexapod stands on legs; accepted: gait"),
    ({"controller": {"type": "open_loop", "servo": "pid"}}, r"wheel_leg_hexapod stands on legs; accepted: legs"),
    ({"engine": "mujoco"}, r"stands on legs, which only Drake simulates; accepted: drake"),
    ({"engine": "both"}, r"stands on legs, which only Drake simulates; accepted: drake"),
    ({"controller": {"type": "legs", "period": 0.007}}, r"period.*accepted: a multiple of the plant's step, 0\.002"),
    ({"controller": {"type": "legs", "period": 0.001}}, r"period.*accepted: a multiple of the plant's step, 0\.002"),
    ({"command": gait({"duration": 9.0})}, r"the pieces last 9 s; accepted: at most the scenario's duration, 3 s"),
    ({"ground": {"roll_resistance": 0.1}}, r"roll_resistance.*accepted: 0 for a robot on legs"),
    ({"errors": {"lost_legs": {"tail": 1.0}}}, r"lost_legs.*accepted: front_left"),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_legs_cannot_do_is_refused_before_the_simulation(
    changes: Data, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("simulated all the same")

    monkeypatch.setattr("rollerbench.simulation.leg_engine.LegStation", never)
    base = {"name": "base", "robot": "wheel_leg_hexapod", "duration": 3.0, "recording": {"html": False}}
    base |= {"command": gait({"duration": 3.0}), "plant": {"time_step": 0.002}}
    with pytest.raises(rb.DescriptionError, match=message):
        rb.run({**base, **changes}, save=False)


def test_wheels_walk_with_no_gait() -> None:
    base = {"name": "base", "robot": robots.cart(), "duration": 3.0, "command": gait({"duration": 3.0})}
    with pytest.raises(rb.DescriptionError, match="test_cart has no legs; accepted: twist, wheel_speeds"):
        rb.run(base, save=False)


def quadruped_walk(name: str) -> Data:
    walk = {"duration": 3.0, "v_xyw_B": [0.03, 0, 0], "gait": name}
    return {
        **{"name": name, "robot": robots.quadruped(), "duration": 3.0, "recording": {"html": False}},
        **{"command": gait(walk, period=2.0, lift=0.03), "plant": {"time_step": 0.002}},
    }


def test_a_quadruped_on_two_feet_tips_over() -> None:
    with pytest.raises(rb.DescriptionError, match=r"at t = .* the robot would tip over: with .* in the air"):
        rb.run(quadruped_walk("tripod"), save=False)


def test_an_octopod_walks_in_two_groups_of_four() -> None:
    walk = {"duration": 2.5, "v_xyw_B": [0.1, 0, 0]}
    recording, legs = ran(
        load_scenario(
            {
                **{"name": "octopod", "robot": robots.octopod(), "duration": 2.5, "recording": {"html": False}},
                **{"command": gait(walk), "plant": {"time_step": 0.005}},
            }
        )
    )
    assert off_course(recording) < 5 * MILLIMETRE
    assert legs["steps"] >= 12
    assert legs["planned_static_margin"] > 50 * MILLIMETRE
