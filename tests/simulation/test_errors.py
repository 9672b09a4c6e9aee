"""Imperfections: the simulated robot differs, the controller does not know."""

import math
from typing import Any

import numpy as np
import pytest

import rollerbench as rb


def _run(name: str, errors: dict[str, Any]) -> rb.RunResult:
    return rb.run(rb.load_scenario(name, overrides={"recording.html": False, "errors": errors}), save=False)


def test_larger_wheels_go_farther() -> None:
    exact, larger = _run("youbot_plus_x", {}), _run("youbot_plus_x", {"radius_scale": {"all": 1.02}})
    way = [result.summary["simulated_final_pose"][0] for result in (exact, larger)]
    assert way[1] / way[0] == pytest.approx(1.02, abs=2e-4)
    assert larger.summary["reference_final_pose"] == exact.summary["reference_final_pose"]
    assert larger.summary["odometry_final_pose"][0] == pytest.approx(way[0], rel=1e-3)


def test_unequal_radii_turn_a_cart() -> None:
    """Yaw over way is the difference of the radii over radius and track: 1 % on 0.4 m."""
    summary = _run("cart_straight", {"radius_scale": {"left": 1.01}}).summary
    expected = -0.01 * summary["path_length"] / 0.4
    assert summary["pose_error"]["final_yaw"] == pytest.approx(expected, rel=0.01)


def test_an_offset_mass_changes_only_the_loads() -> None:
    scenario = rb.load_scenario("six_wheel_pivot", overrides={"errors": {"center_of_mass": [0.004, -0.002, 0.01]}})
    described, true = scenario.robot, scenario.simulated_robot
    share = described.body.mass / described.mass
    assert true.inertia.com - described.inertia.com == pytest.approx(share * np.array([0.004, -0.002, 0.01]), abs=1e-12)
    assert true.body.box_center == described.body.box_center
    assert true.wheels[0].p_BoHo_B == pytest.approx(described.wheels[0].p_BoHo_B)


def test_misplaced_wheels_are_misplaced() -> None:
    errors = {"position_offset": {"left": [0.0, 0.01]}, "heading_offset_deg": {"all": 0.5}, "friction": {"right": 0.3}}
    scenario = rb.load_scenario("cart_straight", overrides={"errors": errors})
    left, right, castor = scenario.simulated_robot.wheels
    assert left.p_BoHo_B == pytest.approx([0.0, 0.21, 0.0])
    assert [math.degrees(wheel.heading) for wheel in (left, right, castor)] == pytest.approx([0.5] * 3)
    assert (left.friction, right.friction) == (0.8, 0.3)
    assert scenario.motion.kinematics.robot.wheels[0].p_BoHo_B == pytest.approx([0.0, 0.2, 0.0])


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        ({"radius_scale": {"middle": 1.1}}, ["errors.radius_scale.middle", "accepted: left, right, castor, all"]),
        ({"radius_scale": {"left": 0}}, ["errors.radius_scale.left = 0", "greater than 0"]),
        ({"radius_scale": 1.02}, ["errors.radius_scale = 1.02"]),
        ({"gear": {}}, ["errors.gear", "accepted: backlash_deg, center_of_mass"]),
        ({"center_of_mass": [1.0, 0, 0]}, ["errors: the robot cannot be like that", "tips over"]),
    ],
)
def test_impossible_errors_are_refused(errors: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        _run("cart_straight", errors)
    for word in words:
        assert word in str(caught.value)
