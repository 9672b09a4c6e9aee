"""Input that a careless or hostile user gives: one clear error, no traceback, nothing of theirs lost."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.simulation import build_station

BASE: dict[str, Any] = {
    **{"name": "base", "robot": "differential_cart", "duration": 2.0, "recording": {"html": False}},
    "command": {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.3]},
}


def _offset_cart() -> robots.Data:
    data = robots.cart()
    for wheel in data["wheels"]:
        wheel["position"][0] -= 0.1
    data["body"]["center_of_mass"][0] -= 0.1
    return data


@pytest.mark.parametrize("infeasible", ["refuse", "project"])
def test_rounding_is_no_skid(infeasible: str) -> None:
    """With the axle at x = -0.1 the twist (0.3, 0.03, 0.3) is feasible, also at the ends of its ramps."""
    command = {"type": "twist", "v_xyw_B": [0.3, 0.03, 0.3], "infeasible": infeasible}
    scenario = rb.load_scenario({**BASE, "robot": _offset_cart(), "command": command})
    assert scenario.motion.twist(1.0) == pytest.approx([0.3, 0.03, 0.3], abs=1e-12)


def test_projection_leaves_steered_wheels_free() -> None:
    car = robots.cart()
    car["wheels"][2] = {**robots.TYRE, "type": "steered", "name": "front", "position": [-0.3, 0.0]}
    command = {"type": "twist", "v_xyw_B": [0.5, 0.2, 0.3], "infeasible": "project"}
    motion = rb.load_scenario({**BASE, "robot": car, "command": command}).motion
    assert motion.twist(1.0) == pytest.approx([0.5, 0.0, 0.3], abs=1e-12)
    assert motion.steering_angles(1.0) == pytest.approx([math.atan2(-0.3 * 0.3, 0.5)], abs=1e-9)


@pytest.mark.usefixtures("undrawn")
def test_a_file_of_the_user_is_never_deleted(tmp_path: Path) -> None:
    rb.run({**BASE, "duration": 1.2}, output=tmp_path / "run")
    (tmp_path / "run" / "notes.txt").write_text("precious")
    with pytest.raises(rb.ResourceError, match=r"notes\.txt"):
        rb.run({**BASE, "duration": 1.2}, output=tmp_path / "run")
    assert (tmp_path / "run" / "notes.txt").read_text() == "precious"


def test_the_current_folder_is_refused_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rb.ResourceError, match="current folder"):
        rb.run(BASE, output=".")


def test_steering_is_not_asked_beyond_its_limit() -> None:
    def turning(rest: float) -> rb.Scenario:
        pieces = [([0.3, 0, 0], 1.0), ([0, 0, 0], rest), ([0, 0.3, 0], 1.0)]
        command = {"type": "twist", "ramp": 0.3, "pieces": [{"duration": d, "v_xyw_B": v} for v, d in pieces]}
        return rb.load_scenario({**BASE, "robot": "swerve_base", "duration": 4.0, "command": command})

    with pytest.raises(rb.DescriptionError, match=r"turns wheel front_left .* max_steering_speed = 15"):
        _ = turning(0.35).motion
    steering = turning(1.0).motion.steering_angles
    assert steering.peak_rate.max() < 15
    # The quarter turn lies in the rest between 1.3 and 2.0 s.
    assert np.ptp(steering(np.array([1.29, 2.01])), axis=0) == pytest.approx(np.full(4, math.pi / 2), abs=1e-6)


def test_a_swerve_base_drives_round_a_square() -> None:
    command = {"type": "path", "name": "square", "length": 0.4, "heading": "fixed"}
    scenario = rb.load_scenario({**BASE, "robot": "swerve_base", "duration": 8.0, "command": command})
    error = rb.run(scenario, save=False).summary["pose_error"]
    assert error["percent_of_path"] < 0.5
    assert error["max_yaw"] < math.radians(0.3)


def test_nearly_equal_breaks_are_one() -> None:
    pieces = [{"duration": 0.3, "v_xyw_B": [1, 0, 0]}, {"duration": 0.6, "v_xyw_B": [0.5, 0, 0]}]
    scenario = rb.load_scenario({**BASE, "command": {"type": "twist", "pieces": pieces, "ramp": 0.3}})
    assert np.diff(scenario.motion.wheel_speeds.breaks).min() > 1e-6
    build_station(scenario)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"command": {"type": "path", "name": "arc", "radius": 1.0, "angle_deg": 0}}, "no length"),
        ({"command": {"type": "path", "name": "spline", "points": [[0, 0]]}}, "command.points.*two points in a row"),
        (
            {"command": {"type": "path", "name": "line", "length": 1.0, "direction_deg": 90}},
            "direction_deg = 90.*tangent",
        ),
        ({"robot": "nope.yaml"}, "robot: no robot 'nope.yaml'"),
        ({"robot": {**robots.cart(), "name": "world"}}, "robot: name = 'world'.*reserve"),
        ({"plant": {"time_step": 1e-9}}, "plant.time_step = 1e-09"),
        ({"simulator": {"start_time": 5.0}}, "simulator.start_time = 5.0: a run starts at 0"),
        ({"simulator": {"max_step_size": True}}, "simulator.max_step_size = True: accepted: float"),
        ({"simulator": {"integration_scheme": "foo"}}, "simulator: Drake refuses"),
    ],
)
def test_a_fault_is_named(change: dict[str, Any], words: str) -> None:
    with pytest.raises(rb.DescriptionError, match=words):
        rb.run({**BASE, **change}, save=False)


def test_nothing_driven_and_driven_castors_are_refused() -> None:
    data = robots.cart()
    for wheel in data["wheels"]:
        wheel["driven"] = False
    with pytest.raises(rb.DescriptionError, match="no wheel is driven"):
        rb.load_scenario({**BASE, "robot": data})
    data["wheels"][2]["driven"] = True
    with pytest.raises(rb.DescriptionError, match="drive row changes as it swivels"):
        rb.load_robot(data)


def test_a_steered_wheel_at_the_centre_of_rotation_restricts_nothing() -> None:
    data = robots.cart()
    data["wheels"][2] = {**robots.TYRE, "name": "front", "position": [0.3, 0.0], "heading_deg": 90.0}
    data["wheels"].append({**robots.TYRE, "type": "steered", "name": "middle", "position": [0.0, 0.0]})
    data["body"]["center_of_mass"] = [0.05, 0.0, 0.03]
    mobility = rb.WheelKinematics(data).mobility()
    assert (mobility.degree_of_mobility, mobility.degree_of_steerability) == (1, 0)


def test_the_callers_mapping_is_left_alone() -> None:
    data = {**BASE, "plant": {"time_step": 0.01}}
    rb.load_scenario(data, overrides={"plant.time_step": 0.002})
    assert data["plant"] == {"time_step": 0.01}


def test_an_anchored_boolean_is_a_boolean(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        "name: x\nbody: {size: [0.2, 0.2, 0.05], mass: 1.0, center_of_mass: [-0.05, 0, 0]}\nwheels:\n"
        "  - {name: l, type: fixed, position: [0, 0.2], radius: 0.1, width: 0.02, mass: 1.0, driven: &d true}\n"
        "  - {name: r, type: fixed, position: [0, -0.2], radius: 0.1, width: 0.02, mass: 1.0, driven: *d}\n"
        "  - {name: c, type: castor, position: [-0.3, 0], radius: 0.1, width: 0.02, mass: 0.1, trail: 0.02}\n"
    )
    assert [wheel.driven for wheel in rb.load_robot(tmp_path).wheels] == [True, True, False]
