"""The error budget: parts that add up to the pose error, and name the cause that was put in."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from budgets import assert_parts_add_up
from rollerbench.resources import scenario_files

LATERAL: dict[str, Any] = {
    **{"name": "lateral", "robot": "youbot_base", "duration": 2.0, "recording": {"html": False}},
    "command": {"type": "twist", "v_xyw_B": [0.0, 0.3, 0.0]},
}


def shares(recording: rb.Recording) -> dict[str, Any]:
    return {name: part["position_share"] for name, part in rb.error_budget(recording).to_dict().items()}


ELSEWHERE = (
    "youbot_",
    "mecanum_",
    "six_wheel_",
    "cart_gear_",
    "cart_straight",
    "cart_radius",
    "cart_slip",
    "cart_back",
    "hexapod_",
)
"""Scenarios that the tests of the ten motions and of the reproductions run, and check in the same way; and legs."""


@pytest.mark.parametrize("name", [name for name in scenario_files() if not name.startswith(ELSEWHERE)])
def test_the_parts_add_up(name: str) -> None:
    """On every shipped scenario, at every moment."""
    assert_parts_add_up(rb.run(rb.load_scenario(name, overrides={"recording.html": False}), save=False).recording)


def test_sideways_it_is_the_geometry() -> None:
    assert shares(rb.run(LATERAL, save=False).recording)["geometry"] > 0.9


def test_on_slippery_ground_it_is_slip() -> None:
    command = {"type": "twist", "v_xyw_B": [1.0, 0, 0], "ramp": 0.2}
    changes = {"ground": {"friction": 0.1}, "command": command, "plant": {"time_step": 0.002}}
    recording = rb.run({**LATERAL, **changes}, save=False).recording
    assert np.abs(recording.wheels("slip_x")).max() > 0.1
    assert shares(recording)["slip"] > 0.9


@pytest.mark.parametrize(
    ("errors", "part"),
    [
        ({"radius_scale": {"all": 0.98}}, "radius_scale"),
        ({"radius_scale": {"right": 1.01}}, "radius_scale"),
        ({"heading_offset_deg": {"all": 1.0}}, "heading_offset_deg"),
        ({"gear_error": {"left": {"constant": 0.02}}}, "drivetrain"),
        ({"backlash_deg": {"left": 5.0}}, "drivetrain"),
    ],
)
def test_what_was_injected_is_named(errors: dict[str, Any], part: str) -> None:
    scenario = {**LATERAL, "robot": "differential_cart", "command": {"type": "path", "name": "line", "length": 0.5}}
    recording = rb.run({**scenario, "duration": 4.0, "errors": errors}, save=False).recording
    assert shares(recording)[part] == pytest.approx(1.0, abs=0.1)


def test_several_errors_are_told_apart() -> None:
    """Alone, the radius error makes -2 % of the path; together with a place error that turns the cart it still does."""
    scenario = {**LATERAL, "robot": "differential_cart", "command": {"type": "path", "name": "line", "length": 0.5}}
    errors = {"radius_scale": {"all": 0.98}, "heading_offset_deg": {"left": 0.5}}
    recording = rb.run({**scenario, "duration": 4.0, "errors": errors}, save=False).recording
    parts = rb.error_budget(recording).to_dict()
    assert parts["radius_scale"]["along_track"] == pytest.approx(-0.02 * 0.5, rel=0.01)
    assert parts["radius_scale"]["cross_track"] == pytest.approx(0.0, abs=1e-5)
    assert {"radius_scale", "heading_offset_deg"} < parts.keys()


def test_the_equation_of_the_contacts_is_exact() -> None:
    """Drive rows with the recorded contact, direction, radius and slip give the body's twist: that is their meaning."""
    recording = rb.run({**LATERAL, "command": {"type": "twist", "v_xyw_B": [0.2, 0.2, 0.4]}}, save=False).recording
    for name in recording.wheel_names:
        c = {key: recording.columns[f"{name}.{key}"][:-1] for key in ("drive_x", "drive_y", "contact_x", "contact_y")}
        slip, speed = recording.columns[f"{name}.slip_x"][:-1], recording.columns[f"{name}.speed"][1:]
        slip_y, radius = recording.columns[f"{name}.slip_y"][:-1], recording.columns[f"{name}.rolling_radius"][:-1]
        # The body's velocity of the step, along the axes at its start.
        yaw, dt = recording.q_xyt[:-1, 2], 0.005
        vx, vy = rb.odometry.rotate(-yaw, np.diff(recording.q_xyt[:, :2], axis=0) / dt).T
        roll, pitch, w = (np.diff(recording.columns[angle]) / dt for angle in ("roll", "pitch", "yaw"))
        height = recording.columns["z"][:-1]
        ahead = vx - w * c["contact_y"] - pitch * height
        aside = vy + w * c["contact_x"] + roll * height
        along = c["drive_x"] * ahead + c["drive_y"] * aside
        # 0.2 mm/s: products of the body's small roll and pitch.
        assert along == pytest.approx(radius * speed + c["drive_x"] * slip + c["drive_y"] * slip_y, abs=2e-4)
        assert radius == pytest.approx(0.0475, rel=5e-3)


@pytest.mark.parametrize("count", [8, 12, 16])
def test_equations_that_count_the_rollers_end_where_they_say(count: int) -> None:
    """Within 0.2 % of the path, where the textbook is 2.6, 1.1 and 0.6 % off."""
    data = rb.load_robot("youbot_base").model_dump(mode="json", exclude_none=True)
    for wheel in data["wheels"]:
        wheel["rollers"] = {"count": count, "radius": 0.005}
    changes = {"robot": data, "controller": {"rollers": "finite"}, "duration": 3.0}
    error = rb.run({**LATERAL, **changes}, save=False).summary["pose_error"]
    assert error["percent_of_path"] < 0.2


def test_half_the_step_is_tried_on_request() -> None:
    scenario = {**LATERAL, "robot": "differential_cart", "command": {"type": "twist", "v_xyw_B": [0.3, 0, 0.8]}}
    result = rb.run({**scenario, "check_step": True}, save=False)
    half = rb.run({**scenario, "plant": {"time_step": 0.0025}}, save=False)
    change = result.summary["error_budget"]["half_step"]
    expected = half.recording.q_xyt[-1] - result.recording.q_xyt[-1]
    assert [change["x"], change["y"], change["yaw"]] == pytest.approx(expected, abs=1e-12)
    # The plant's step turns the path by w dt / 2: half the step takes away half of the rest.
    rest = rb.error_budget(result.recording).to_dict()["rest"]
    assert [change["x"], change["y"]] == pytest.approx([-0.5 * rest["x"], -0.5 * rest["y"]], rel=0.3)


@pytest.mark.usefixtures("undrawn")
def test_a_stored_recording_gives_the_same_budget_without_drake(tmp_path: Path) -> None:
    errors = {"radius_scale": {"front_left": 1.02}}
    result = rb.run({**LATERAL, "errors": errors}, output=tmp_path / "run")
    code = (
        "import json, sys, rollerbench as rb\n"
        f"recording = rb.Recording.read({str(tmp_path / 'run')!r})\n"
        "print(json.dumps(rb.error_budget(recording).to_dict()))\n"
        "assert not any(name.startswith('pydrake') for name in sys.modules)\n"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert json.loads(out) == result.summary["error_budget"]["parts"]
    assert "radius_scale" in result.summary["error_budget"]["parts"]


def test_a_wheel_in_the_air_has_no_say() -> None:
    """Of four tyres on level ground one may hang in the air: its spin is neither geometry nor slip."""
    errors = {"radius_scale": {"front_left": 1.01}}
    command = {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.0]}
    recording = rb.run({**LATERAL, "robot": "swerve_base", "errors": errors, "command": command}, save=False).recording
    assert (recording.wheels("depth") < 0).any()
    assert_parts_add_up(recording)
    parts = rb.error_budget(recording).parts
    assert np.hypot(*parts["geometry"][:, :2].T).max() < 2e-3
    assert recording.wheels("rolling_radius").max() < 0.05 * 1.011


def test_a_recording_without_its_robot_says_so() -> None:
    recording = rb.run({**LATERAL, "duration": 1.0}, save=False).recording
    columns = {name: column for name, column in recording.columns.items() if "drive_x" not in name}
    with pytest.raises(rb.ResourceError, match=r"lacks front_left.drive_x"):
        rb.error_budget(rb.Recording(columns=columns, wheel_names=recording.wheel_names, metadata=recording.metadata))
    stripped = rb.Recording(columns=recording.columns, wheel_names=recording.wheel_names)
    with pytest.raises(rb.ResourceError, match="does not tell its robot"):
        rb.error_budget(stripped)


@pytest.mark.parametrize("make", robots.ALL.values(), ids=robots.ALL.keys())
def test_any_robot_has_a_budget(make: Any) -> None:
    command = {"type": "twist", "v_xyw_B": [0.2, 0.0, 0.0]}
    recording = rb.run({**LATERAL, "robot": make(), "command": command}, save=False).recording
    assert_parts_add_up(recording)
    budget = rb.error_budget(recording)
    # The contacts explain the motion: what is left over is small.
    assert np.abs(budget.parts["rest"][:, :2]).max() < 2e-4
