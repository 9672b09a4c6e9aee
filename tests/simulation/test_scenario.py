"""Scenarios: defaults, overrides, refusals."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

import robots
import rollerbench as rb
from rollerbench.resources import scenario_files
from rollerbench.simulation.drake_config import plant_config, simulator_config

BASE = {
    "name": "base",
    "robot": "youbot_base",
    "duration": 1.0,
    "command": {"type": "twist", "v_xyw_B": [0.1, 0.0, 0.0]},
}


@pytest.mark.parametrize("name", scenario_files())
def test_shipped_scenarios_are_named_by_their_files(name: str) -> None:
    scenario = rb.load_scenario(name)
    assert scenario.name == name
    assert scenario.summary


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"duration": 0}, ["duration = 0", "greater than 0"]),
        ({"duration": "long"}, ["duration = 'long'"]),
        ({"durration": 1}, ["durration = 1", "did you mean duration?"]),
        ({"command": {"type": "teleport"}}, ["command.type = 'teleport'", "'twist'"]),
        ({"command": {"type": "twist", "v_xyw_B": [1, 0]}}, ["command.v_xyw_B[2]", "required"]),
        ({"command": {"type": "twist", "v_xyw_B": [float("nan"), 0, 0]}}, ["command.v_xyw_B[0] = nan", "finite"]),
        ({"command": {"type": "twist", "v_xyw_B": [1, 0, 0], "ramp": 0.6}}, ["command.ramp = 0.6", "up to 0.5"]),
        ({"command": {"type": "wheel_speeds", "wheel_speeds": {"left": 1.0}}}, ["wheel_speeds.left", "front_left"]),
        ({"plant": {"roller_model": "half"}}, ["plant.roller_model = 'half'", "'full'"]),
        ({"plant": {"contact_approximation": "tamsi"}}, ["plant.contact_approximation = 'tamsi'", "lagged, similar"]),
        ({"plant": {"roller_window": 1}}, ["plant.roller_window = 1", "greater than or equal to 2"]),
        ({"plant": {"time_step": -0.001}}, ["plant.time_step = -0.001", "greater than or equal to"]),
        ({"plant": {"time_step": 0.05}, "duration": 0.04, "command": {**BASE["command"], "ramp": 0.0}}, ["time_step"]),  # type: ignore[dict-item]
        ({"ground": {"roll_resistance": 1.5}}, ["ground.roll_resistance = 1.5", "less than 1"]),
        ({"ground": {"slope_deg": 90}}, ["ground.slope_deg = 90", "less than 90"]),
        ({"errors": {"radius_scale": 1.1}}, ["errors.radius_scale"]),
        ({"seed": -1}, ["seed = -1"]),
        ({"controller": {"type": "magic"}}, ["controller.type = 'magic'", "'open_loop'"]),
    ],
)
def test_a_fault_is_named(change: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_scenario({**BASE, **change})
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    ("section", "fields", "words"),
    [
        ("plant", {"timestep": 0.1}, "plant.timestep = 0.1: not a field of Drake's; accepted: .*penetration_allowance"),
        ("plant", {"penetration_allowance": "deep"}, "plant.penetration_allowance = 'deep': accepted: float"),
        ("plant", {"discrete_contact_approximation": "sap"}, "use plant.contact_approximation"),
        ("plant", {"contact_model": "magic"}, "plant: Drake refuses these settings"),
        ("simulator", {"speed": 1.0}, "simulator.speed = 1.0: not a field of Drake's"),
    ],
)
def test_drakes_own_settings_are_checked(section: str, fields: dict[str, Any], words: str) -> None:
    with pytest.raises(rb.DescriptionError, match=words):
        rb.run({**BASE, section: fields}, save=False)


def test_drakes_own_settings_arrive() -> None:
    scenario = rb.load_scenario(
        {**BASE, "plant": {"stiction_tolerance": 1e-3}, "simulator": {"target_realtime_rate": 2.0}}
    )
    assert plant_config(scenario).stiction_tolerance == 1e-3
    assert simulator_config(scenario).target_realtime_rate == 2.0


def test_overrides_replace_fields() -> None:
    scenario = rb.load_scenario(
        "youbot_plus_x", overrides=["plant.time_step=0.002", "command.v_xyw_B=[0.1, 0, 0]", "seed=7"]
    )
    assert scenario.plant.time_step == 0.002
    assert scenario.command.v_xyw_B == (0.1, 0.0, 0.0)  # type: ignore[union-attr]
    assert scenario.seed == 7
    assert rb.load_scenario(scenario, overrides={"duration": 5.0}).duration == 5.0
    assert rb.load_scenario(scenario, robot="mecanum_platform").robot.name == "mecanum_platform"


@pytest.mark.parametrize("text", ["plant.time_step", "=3", "plant.time_step=[", "name.first=x"])
def test_malformed_overrides_are_refused(text: str) -> None:
    with pytest.raises(rb.DescriptionError, match="--set"):
        rb.load_scenario("youbot_plus_x", overrides=[text])


def test_a_fault_in_a_file_has_its_line(tmp_path: Path) -> None:
    file = tmp_path / "scenario.yaml"
    file.write_text("name: mine\nrobot: youbot_base\nduration: 1.0\ncommand:\n  type: twist\n  v_xyw_B: [1, 0, x]\n")
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_scenario(file)
    assert str(caught.value).startswith(f"{file}:6: command.v_xyw_B[2] = 'x': ")


def test_a_robot_lies_beside_its_scenario(tmp_path: Path) -> None:
    with (tmp_path / "own.yaml").open("w") as stream:
        YAML().dump(robots.kiwi(), stream)
    with (tmp_path / "scenario.yaml").open("w") as stream:
        YAML().dump({**BASE, "robot": "own.yaml"}, stream)
    assert rb.load_scenario(tmp_path).robot.name == "test_kiwi"


def test_the_step_rule() -> None:
    """A wheel may turn by a sixth of its roller pitch in a step: 5 deg with twelve rollers."""
    scenario = rb.load_scenario(BASE)
    largest, wheel = scenario.step_rule()
    assert largest == pytest.approx(np.radians(5) * 0.0475 / 0.1)
    assert wheel in scenario.robot.wheel_names
    assert rb.load_scenario({**BASE, "robot": robots.cart()}).step_rule() == (np.inf, None)
    fast = copy.deepcopy(BASE) | {"plant": {"time_step": 0.01}, "recording": {"html": False}}
    fast["command"] = {"type": "twist", "v_xyw_B": [0.8, 0.0, 0.0]}
    with pytest.warns(rb.RollerbenchWarning, match=r"sixth of its roller pitch.*fine: up to 0.0052 s"):
        rb.run(fast, save=False)


def test_an_infeasible_command_is_refused_with_the_tyre() -> None:
    scenario = {**BASE, "robot": robots.cart(), "command": {"type": "twist", "v_xyw_B": [0.1, 0.1, 0.0]}}
    with pytest.raises(rb.InfeasibleTwist, match=r"left at .* right at"):
        rb.run(scenario, save=False)
