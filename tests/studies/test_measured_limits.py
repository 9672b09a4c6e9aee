"""Simulated robots reach the limits that theory gives them, and no more."""

import math

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.analysis.limits import capability
from rollerbench.studies.measured_limits import measure_limits


@pytest.fixture(scope="module")
def cart() -> dict[str, np.ndarray]:
    """What a cart does in its two directions: a process for each."""
    data = robots.cart()
    for wheel in data["wheels"][:2]:
        wheel |= {"max_speed": 8.0, "friction": 0.5}
    found = capability(rb.load_robot(data))
    seen: list[tuple[float, float]] = []
    measured = measure_limits(found, lambda done, total: seen.append((done, total)))
    assert seen == [(1.0, 2.0), (2.0, 2.0)]
    theory = {
        "directions": measured["speed"].directions,
        "speed": rb.limits.max_speed(found.robot, measured["speed"].directions).value,
        "acceleration": rb.limits.max_acceleration(
            found.robot, measured["speed"].directions, sharing="least_norm"
        ).value,
        "efforts": rb.limits.wheel_efforts(
            found.robot, measured["speed"].directions, float(found.map_accelerations[found.reference])
        ),
    }
    return {"theory": theory, "measured": {name: points.values for name, points in measured.items()}}  # type: ignore[dict-item]


def test_a_cart_goes_forward_and_back(cart: dict[str, dict[str, np.ndarray]]) -> None:
    assert np.degrees(cart["theory"]["directions"]) == pytest.approx([0.0, 180.0])
    assert cart["measured"]["speed"] == pytest.approx(cart["theory"]["speed"], rel=2e-3)


def test_its_wheels_slide_at_the_acceleration_of_theory(cart: dict[str, dict[str, np.ndarray]]) -> None:
    assert cart["measured"]["acceleration"] == pytest.approx(cart["theory"]["acceleration"], rel=0.04)


def test_its_servos_push_as_inverse_dynamics_says(cart: dict[str, dict[str, np.ndarray]]) -> None:
    assert cart["measured"]["efforts"] == pytest.approx(cart["theory"]["efforts"], rel=0.03)


def test_a_mecanum_wheel_slides_where_theory_says() -> None:
    """At 30 deg, where the four wheels carry and push unevenly."""
    from rollerbench.studies.measured_limits import _slip_onset, _Task

    robot = rb.load_robot("youbot_base")
    task = _Task(robot=robot, direction=math.radians(30), roll_resistance=0.0, ground_friction=None, acceleration=1.0)
    theory = float(rb.limits.max_acceleration(robot, task.direction, sharing="least_norm"))
    assert _slip_onset(task) == pytest.approx(theory, rel=0.04)
