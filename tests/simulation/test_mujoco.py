"""MuJoCo as a second opinion: the same robot, and the same motions."""

import json
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.resources import robot_names, scenario_files
from rollerbench.sdf import robot_to_mjcf
from rollerbench.simulation.log import versions

YOUBOT = [name for name in scenario_files() if name.startswith("youbot_") and "closed" not in name]
SHORT: dict[str, Any] = {
    **{"name": "short", "robot": "youbot_base", "duration": 1.0, "recording": {"html": False}, "engine": "mujoco"},
    "command": {"type": "twist", "v_xyw_B": [0.2, 0.1, 0.4]},
}


@pytest.mark.parametrize("name", YOUBOT)
def test_both_engines_agree(name: str) -> None:
    """Within 0.6 % of the path, and 1.5 deg in the turns."""
    result = rb.run(rb.load_scenario(name, overrides={"engine": "both", "recording.html": False}), save=False)
    assert result.cross_check is not None
    apart = result.cross_check.q_xyt[-1] - result.recording.q_xyt[-1]
    assert np.hypot(*apart[:2]) < max(0.006 * result.summary["path_length"], 1e-4)
    assert abs(math.degrees(apart[2])) < 1.5
    second = result.summary["cross_check"]
    assert second["engine"] == "mujoco"
    assert second["simulated_final_pose"] == pytest.approx(result.cross_check.q_xyt[-1])
    # Both say of the same part that it is the cause.
    key = "yaw_share" if "turn" in name else "position_share"
    main = [
        max(budget, key=lambda part, of=budget: abs(of[part][key] or 0.0))
        for budget in (result.summary["error_budget"]["parts"], second["error_budget"]["parts"])
    ]
    assert result.summary["path_length"] < 1e-6 or name in ("youbot_plus_x", "youbot_minus_x") or main[0] == main[1]


@pytest.mark.parametrize("name", robot_names())
def test_the_model_is_the_robot(name: str) -> None:
    robot = rb.load_robot(name)
    model = mujoco.MjModel.from_xml_string(robot_to_mjcf(robot))
    data = mujoco.MjData(model)
    if robot.legs:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert model.body_subtreemass[1] == pytest.approx(robot.mass)
    body = data.body("body")
    assert data.subtree_com[1] - body.xpos == pytest.approx(robot.inertia.com, abs=1e-9)
    # The yaw inertia from the kinetic energy as the whole robot turns about Bo at 1 rad/s.
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data.qvel[5] = 1.0
    mujoco.mj_forward(model, data)
    x, y = robot.inertia.com[:2]
    inertia = robot.inertia.moment[2, 2] + robot.mass * (x**2 + y**2)
    assert 2 * data.energy[1] == pytest.approx(inertia, rel=1e-9)
    of_legs = sum(len(leg.links) + leg.wheel.driven for leg in robot.legs)
    assert model.nu == len(robot.driven_wheels) + len(robot.steered_wheels) + of_legs


@pytest.mark.parametrize("make", robots.ALL.values(), ids=robots.ALL.keys())
def test_any_robot_runs_in_mujoco(make: Any) -> None:
    command = {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.0]}
    result = rb.run({**SHORT, "robot": make(), "command": command, "duration": 2.0}, save=False)
    assert result.summary["engine"] == "mujoco"
    # 1 %: a wheel of the mixed robot slips for some millimetres as it settles; the others stay below 0.05 %.
    assert result.summary["pose_error"]["percent_of_path"] < 1.0
    budget = rb.error_budget(result.recording)
    assert np.abs(budget.parts["rest"][:, :2]).max() < 5e-4


@pytest.mark.parametrize("name", ["cart_arc", "youbot_plus_y", "mecanum_plus_x"])
def test_wheels_do_not_slide_on_the_way_either(name: str) -> None:
    """A robot that runs ahead of its wheels as it accelerates and brakes would end well all the same."""
    recording = rb.run(rb.load_scenario(name, overrides={"engine": "mujoco"}), save=False).recording
    slip = rb.error_budget(recording).parts["slip"][:, :2]
    assert np.hypot(*slip.T).max() < 1e-4 * max(1.0, np.abs(recording.q_xyt).max())


def test_steered_wheels_follow_as_in_drake() -> None:
    result = rb.run(rb.load_scenario("swerve_figure_eight", overrides={"engine": "both", "duration": 8.0}), save=False)
    x, y, yaw = result.summary["cross_check"]["apart"]
    assert math.hypot(x, y) < 2e-3
    assert abs(yaw) < math.radians(0.1)


def test_a_motor_at_its_limit_pulls_as_hard_as_in_drake() -> None:
    """Half a second with 0.3 N m at each of two tyres, on a cart that would need far more for its command."""
    data = rb.load_robot("differential_cart").model_dump(mode="json", exclude_none=True)
    for wheel in data["wheels"][:2]:
        wheel["max_effort"] = 0.3
    command = {"type": "twist", "v_xyw_B": [1.0, 0, 0], "ramp": 0.1}
    result = rb.run({**SHORT, "robot": data, "engine": "both", "duration": 0.5, "command": command}, save=False)
    assert result.cross_check is not None
    assert result.cross_check.columns["left.effort"].max() == pytest.approx(0.3)
    assert result.recording.q_xyt[-1, 0] < 0.1
    assert result.cross_check.q_xyt[-1, 0] == pytest.approx(result.recording.q_xyt[-1, 0], rel=0.03)


def test_slope_friction_and_effort_limits_count() -> None:
    standing = {**SHORT, "command": {"type": "wheel_speeds", "wheel_speeds": {}}}
    uphill = rb.run({**standing, "ground": {"slope_deg": 5.0}}, save=False).recording
    level = rb.run(standing, save=False).recording
    robot = rb.load_robot("youbot_base")
    assert level.wheels("effort")[-50:].sum(axis=1).mean() == pytest.approx(0.0, abs=1e-3)
    pull = robot.mass * 9.81 * math.sin(math.radians(5)) * 0.0475
    assert uphill.wheels("effort")[-50:].sum(axis=1).mean() == pytest.approx(pull, rel=0.02)
    weak = robots.cart()
    weak["wheels"][0]["max_effort"] = 0.01
    recording = rb.run({**SHORT, "robot": weak, "command": {"type": "twist", "v_xyw_B": [0.5, 0, 0]}}, save=False)
    assert np.nanmax(np.abs(recording.recording.columns[f"{weak['wheels'][0]['name']}.effort"])) <= 0.01 + 1e-9


@pytest.mark.usefixtures("undrawn")
def test_a_cross_check_that_fails_keeps_the_first_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def cannot(*_: object) -> None:
        raise rb.SimulationError("it cannot stand")

    monkeypatch.setattr("rollerbench.simulation.mujoco_engine._stand_at_rest", cannot)
    with pytest.raises(rb.SimulationError, match="it cannot stand") as caught:
        rb.run({**SHORT, "engine": "both"}, output=tmp_path / "run")
    assert caught.value.result.summary["status"] == "ok"
    assert rb.Recording.read(tmp_path / "run").time[-1] == pytest.approx(1.0)


@pytest.mark.usefixtures("undrawn")
def test_an_interrupted_cross_check_says_so(tmp_path: Path) -> None:
    seen: list[float] = []

    def stop(now: float) -> None:
        seen.append(now)
        if len(seen) > 2 and now < seen[-2]:
            raise KeyboardInterrupt

    with pytest.raises(rb.SimulationError, match="the cross-check with MuJoCo: interrupted") as caught:
        rb.run({**SHORT, "engine": "both"}, output=tmp_path / "run", progress=stop)
    assert "interrupted" in caught.value.result.summary["cross_check"]["failure"]
    assert caught.value.result.summary["status"] == "ok"


@pytest.mark.usefixtures("undrawn")
def test_a_run_folder_repeats_itself(tmp_path: Path) -> None:
    first = rb.run({**SHORT, "engine": "both"}, output=tmp_path / "first")
    again = rb.run(tmp_path / "first" / "scenario.yaml", output=tmp_path / "again")
    for name in ("recording.parquet", "cross_check.parquet"):
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    assert again.summary["cross_check"] == first.summary["cross_check"]
    summary = json.loads((tmp_path / "first" / "summary.json").read_text())
    assert summary["cross_check"]["engine"] == "mujoco"


@pytest.mark.parametrize(
    "errors", [{"backlash_deg": {"all": 1.0}}, {"ground_bumps": {"height": 0.001, "width": 0.05, "density": 5}}]
)
def test_what_mujoco_does_not_simulate_is_refused(errors: dict[str, Any]) -> None:
    with pytest.raises(rb.DescriptionError, match=r"simulated by Drake only; accepted: engine: drake"):
        rb.run({**SHORT, "errors": errors}, save=False)


def test_forces_are_recorded_by_drake_only() -> None:
    with pytest.raises(rb.DescriptionError, match=r"recording\.forces = True: .*accepted: engine: drake or both"):
        rb.run({**SHORT, "recording": {"forces": True}}, save=False)


@pytest.mark.parametrize(("engine", "named"), [("drake", False), ("mujoco", True), ("both", True)])
def test_versions_name_mujoco_where_it_simulated(engine: str, named: bool) -> None:
    assert versions(engine).get("mujoco") == (mujoco.__version__ if named else None)


def test_without_mujoco_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(rb.ResourceError, match=r"pip install 'rollerbench\[mujoco\]'"):
        rb.run(SHORT, save=False)


def test_a_robot_that_tips_over_fails_here_too() -> None:
    data = robots.mecanum()
    data["body"] = {"size": [0.3, 0.2, 1.5], "mass": 10.0, "center_of_mass": [0.0, 0.0, 1.0], "center": [0, 0, 0.8]}
    command = {"type": "twist", "v_xyw_B": [2.0, 0.0, 0.0], "ramp": 0.1}
    with (
        pytest.warns(rb.RollerbenchWarning, match="fine: up to"),
        pytest.raises(rb.SimulationError, match=r"tipped over|left the ground") as caught,
    ):
        rb.run({**SHORT, "robot": data, "duration": 3.0, "command": command}, save=False)
    assert 0.05 < caught.value.result.recording.time[-1] < 2.9


def test_an_interrupt_keeps_what_was_computed() -> None:
    def stop(now: float) -> None:
        if now > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(rb.SimulationError, match=r"interrupted at t = 0\.45") as caught:
        rb.run(SHORT, save=False, progress=stop)
    assert caught.value.result.recording.time[-1] == pytest.approx(0.45, abs=0.01)
