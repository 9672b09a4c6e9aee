"""Everything that cannot be accepted is refused with file, line, field, value and what is accepted."""

import copy
from collections.abc import Callable
from typing import Any

import pytest
from pydantic import ValidationError
from ruamel.yaml import YAML

import robots
import rollerbench as rb

Data = dict[str, Any]


def _set(data: Data, path: list[Any], value: Any) -> None:
    for step in path[:-1]:
        data = data[step]
    data[path[-1]] = value


REFUSALS = [
    (["wheels", 0, "radius"], -0.1, ["wheels[0].radius = -0.1", "greater than 0"]),
    (["wheels", 0, "radius"], 0, ["wheels[0].radius = 0", "greater than 0"]),
    (["wheels", 0, "mass"], float("nan"), ["wheels[0].mass = nan", "finite"]),
    (["body", "mass"], float("inf"), ["body.mass = inf", "finite"]),
    (["body", "mass"], "12", ["body.mass = '12'", "valid number"]),
    (["body", "mass"], True, ["body.mass = True", "valid number"]),
    (["body", "size"], [0.4, 0.2], ["body.size[2]", "required"]),
    (["body", "colour"], "red", ["body.colour = 'red'", "unknown key", "center_of_mass"]),
    (["wheels", 0, "radus"], 0.1, ["wheels[0].radus = 0.1", "did you mean radius?"]),
    (["wheels", 0, "type"], "mecanumm", ["wheels[0].type = 'mecanumm'", "'mecanum'", "'castor'"]),
    (["wheels", 1, "name"], "fl", ["wheels[1].name = 'fl'", "another wheel has this name"]),
    (["wheels", 0, "name"], "front left", ["wheels[0].name = 'front left'", "pattern"]),
    (["wheels", 0, "roller_angle_deg"], 0, ["roller_angle_deg = 0", "parallel to the axle", "accepted"]),
    (["wheels", 0, "roller_angle_deg"], 100, ["roller_angle_deg = 100", "less than or equal to 90"]),
    (["wheels", 0, "rollers", "count"], 40, ["rollers.count = 40", "overlap by", "accepted: at most 14"]),
    (["wheels", 0, "rollers", "radius"], 0.02, ["rollers.radius = 0.02", "overlap by", "a radius up to"]),
    (["wheels", 0, "rollers", "radius"], 0.025, ["no room is left for a hub", "0.025"]),
    (["wheels", 0, "rollers", "mass"], 0.1, ["rollers.mass = 0.1", "outweigh", "less than"]),
    (["wheels", 0, "rollers", "rows"], 3, ["rollers.rows = 3", "less than or equal to 2"]),
    (["wheels", 1, "position"], [0.2, 0.19], ["wheels[1].position", "overlaps wheel fl"]),
    (["wheels", 1, "position"], [0.2, -0.2, 0.1], ["wheels[1].position", "hangs 0.1 m above the ground"]),
    (["wheels", 1, "position"], [0.2], ["wheels[1].position = [0.2]", "at least 2"]),
    (["body", "center_of_mass"], [0.5, 0, 0], ["body.center_of_mass = (0.5, 0.0, 0.0)", "tips over", "outside"]),
    (["body", "center"], [0, 0, -0.05], ["body.size", "into the ground"]),
    (["body", "inertia"], [1, 2, 4], ["inertia", "largest moment"]),
    (["wheels"], [], ["wheels", "required", "legs instead of it"]),
    (["legs"], [{}], ["legs"]),
]


LEG_REFUSALS = [
    (["wheels"], [{**robots.TYRE, "name": "w", "position": [0, 0]}], ["legs", "legs and wheels on one body"]),
    (["legs", 1, "name"], "fl", ["legs[1].name = 'fl'", "another leg has this name"]),
    (["legs", 0, "postures", "stand"], [0, 30], ["legs[0].postures.stand", "2 angles", "each of the 3 links"]),
    (
        ["legs", 0, "postures", "stand"],
        [0, 95, 0],
        ["legs[0].postures.stand[1] = 95", "beyond the limits", "-90 to 90"],
    ),
    (["legs", 3, "postures"], {"stand": [0, 30, 0]}, ["legs[3].postures", "no angles for the posture low"]),
    (["legs", 3, "postures", "stand"], [0, 45, 0], ["the foot of leg rr hangs", "above the ground"]),
    (["legs", 0, "links", 0, "min_deg"], 80, ["legs[0].links[0]", "min_deg = 80", "less than max_deg = 60"]),
    (["legs", 0, "links", 1, "mass"], 0, ["legs[0].links[1].mass = 0", "greater than 0"]),
    (["legs", 0, "wheel", "width"], 0.1, ["legs[0].wheel", "width = 0.1", "diameter, 0.06"]),
    (["postures"], [{"name": "stand", "hold": "tibia"}], ["postures[0].hold = 'tibia'", "3 joints", "least"]),
    (["postures"], [{"name": "fly"}], ["no angles for the posture fly"]),
    (["body", "center_of_mass"], [2.0, 0, 0], ["body.center_of_mass", "tips over"]),
]


@pytest.mark.parametrize(("path", "value", "words"), LEG_REFUSALS)
def test_a_fault_in_legs_is_named(path: list[Any], value: Any, words: list[str]) -> None:
    data = copy.deepcopy(robots.quadruped())
    _set(data, path, value)
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_robot(data)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("ask", [rb.WheelKinematics, rb.limits.speed_polygon, rb.limits.isotropy,
                                 lambda robot: rb.limits.max_speed(robot, 0.0),
                                 lambda robot: rb.limits.max_yaw_rate(robot),
                                 lambda robot: rb.limits.max_acceleration(robot, 0.0),
                                 lambda robot: rb.limits.wheel_loads(robot, 0.0, 0.0),
                                 lambda robot: rb.limits.wheel_efforts(robot, 0.0, 1.0)])  # fmt: skip
def test_questions_about_wheels_are_refused_for_legs(ask: Callable[[Data], object]) -> None:
    with pytest.raises(rb.KinematicsError, match="test_quadruped stands on legs; accepted: robots with wheels"):
        ask(robots.quadruped())


@pytest.mark.parametrize(("path", "value", "words"), REFUSALS)
def test_a_fault_is_named(path: list[Any], value: Any, words: list[str]) -> None:
    data = copy.deepcopy(robots.mecanum())
    _set(data, path, value)
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_robot(data)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize("field", ["radius", "width", "mass", "position", "name", "rollers", "roller_angle_deg"])
def test_a_missing_field_is_named(field: str) -> None:
    data = copy.deepcopy(robots.mecanum())
    del data["wheels"][2][field]
    with pytest.raises(rb.DescriptionError, match=rf"wheels\[2\].{field}: this field is required"):
        rb.load_robot(data)


def _two_tyres(data: Data) -> None:
    data["wheels"] = [{**robots.TYRE, "name": name, "position": [0, y]} for name, y in (("l", 0.2), ("r", -0.2))]


def _tandem(data: Data) -> None:
    data["wheels"] = [{**robots.TYRE, "name": f"w{x}", "position": [0.3 * x, 0]} for x in range(3)]


@pytest.mark.parametrize("change", [_two_tyres, _tandem])
def test_a_base_needs_three_supports(change: Callable[[Data], None]) -> None:
    data = copy.deepcopy(robots.mecanum())
    change(data)
    with pytest.raises(rb.DescriptionError, match=r"wheels = .*three or more wheels"):
        rb.load_robot(data)


def test_a_single_row_of_omni_rollers_is_told_to_use_two() -> None:
    data = robots.kiwi()
    data["wheels"][0]["rollers"] = {"count": 16, "radius": 0.008, "rows": 1}
    with pytest.raises(rb.DescriptionError, match="rows: 2"):
        rb.load_robot(data)


def test_a_castor_needs_room_to_swivel() -> None:
    data = robots.cart()
    data["wheels"][2]["position"] = [-0.06, 0.16, -0.06]
    with pytest.raises(rb.DescriptionError, match="needs room to swivel"):
        rb.load_robot(data)


def test_a_file_is_named_with_the_line(tmp_path: Any) -> None:
    data = robots.mecanum()
    data["wheels"][1]["mass"] = -1
    file = tmp_path / "robot.yaml"
    with file.open("w") as stream:
        YAML().dump(data, stream)
    lines = file.read_text().splitlines()
    line = next(i for i, text in enumerate(lines, start=1) if "mass: -1" in text)
    with pytest.raises(rb.DescriptionError) as caught:
        rb.load_robot(file)
    assert str(caught.value).startswith(f"{file}:{line}: wheels[1].mass = -1: ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: x\nname: y\n", ":2: not valid YAML"),
        ("name: [x\n", "not valid YAML"),
        ("- a\n- b\n", "expected a mapping"),
        ("", "expected a mapping"),
        ("{}", "name: this field is required"),
    ],
)
def test_text_that_is_no_robot(text: str, words: str, tmp_path: Any) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    with pytest.raises(rb.DescriptionError, match=words) as caught:
        rb.load_robot(file)
    assert str(file) in str(caught.value)


def test_an_unknown_robot_is_guessed(tmp_path: Any) -> None:
    with pytest.raises(rb.ResourceError, match="did you mean youbot_base"):
        rb.load_robot("youbot_bse")
    with pytest.raises(rb.ResourceError, match="no robot"):
        rb.load_robot(tmp_path / "robot.yaml")


def test_a_robot_is_frozen_data() -> None:
    robot = rb.load_robot("youbot_base")
    with pytest.raises(ValidationError):
        robot.name = "other"
