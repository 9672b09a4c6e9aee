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
    assert model.nu == len(robot.driven_wheels) + len(robot.steered_wheels)


@pytest.mark.parametrize("make", robots.ALL.values(), ids=robots.ALL.keys())
def test_any_robot_runs_in_mujoco(make: Any) -> None:
    command = {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.0]}
    result = rb.run({**SHORT, "robot": make(), "command": command, "duration": 2.0}, save=False)
    assert result.summary["engine"] == "mujoco"
    assert result.summary["pose_error"]["percent_of_path"] < 0.6
    budget = rb.error_budget(result.recording)
    assert np.abs(budget.parts["rest"][:, :2]).max() < 5e-4


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
