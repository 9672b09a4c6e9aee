"""Driving on the feet's wheels: castors do not slip, other wheels are steered before they start."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import robots
import rollerbench as rb
from rollerbench.kinematics.gaits import LegMode, LegPlanner
from rollerbench.kinematics.gaits.wheeling import ALIGNED, advanced, aligned, trailing_turn, wheeling_from
from walking import Walk, asked, standing

HEXAPOD = LegPlanner(rb.load_robot("wheel_leg_hexapod"))
INSECT, MAMMAL = (LegMode(posture=name, motion="drive") for name in ("insect", "mammal"))


def one_castor(bearing: float, trail: float = 0.09, pivot=(0.3, 0.4)):
    """A castor whose foot is in a direction from its axis; its wheel rolls along that line."""
    contact = np.array([pivot]) + trail * np.array([[np.cos(bearing), np.sin(bearing)]])
    return wheeling_from(contact, np.array([bearing + np.pi]), np.array([pivot]), np.array([1.0]))


def pose_of(twist, time):
    return rb.odometry.integrate(np.zeros(3), twist, time)


def placed(pose, point):
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return pose[:2] + np.array([[cos, -sin], [sin, cos]]) @ point


@given(st.floats(-3.1, 3.1), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-1.0, 1.0))
def test_a_castor_moves_only_where_its_wheel_rolls(bearing, vx, vy, w) -> None:
    twist, dt = np.array([vx, vy, w]), 1e-4
    before = one_castor(bearing)
    after = advanced(before, twist, twist, dt)
    contacts = [placed(pose_of(twist, time), each.contact[0]) for time, each in ((0.0, before), (dt, after))]
    velocity = (contacts[1] - contacts[0]) / dt
    middle = 0.5 * (before.heading[0] + after.heading[0] + w * dt)
    # 1e-4 m/s: the curvature of the way within 0.1 ms.
    assert velocity @ [-np.sin(middle), np.cos(middle)] == pytest.approx(0.0, abs=1e-4)
    assert np.linalg.norm(after.contact[0] - after.pivot[0]) == pytest.approx(0.09, abs=1e-12)


@pytest.mark.parametrize("bearing", [0.3, -1.5, 2.0, -3.0])
def test_castors_come_to_trail(bearing: float) -> None:
    twist, castor = np.array([0.4, 0.1, 0.0]), one_castor(bearing)
    for _ in range(1000):
        castor = advanced(castor, twist, twist, 0.005)
    behind = np.arctan2(-0.1, -0.4)
    assert np.cos(castor.bearing[0] - behind) == pytest.approx(1.0, abs=1e-9)
    assert trailing_turn(castor, twist) == pytest.approx([0.0], abs=1e-6)


def test_a_castor_trails_by_the_law_of_a_dragged_point() -> None:
    """tan(theta / 2) decays with exp(-v t / trail)."""
    castor, speed, dt = one_castor(np.pi - 1.2), 0.3, 0.001
    for _ in range(300):
        castor = advanced(castor, np.array([speed, 0, 0]), np.array([speed, 0, 0]), dt)
    expected = 2 * np.arctan(np.tan(0.6) * np.exp(-speed * 0.3 / 0.09))
    # 1e-5: steps of the midpoint rule of 1 ms.
    assert np.pi - castor.bearing[0] == pytest.approx(expected, abs=1e-5)


def swerve(headings):
    places = np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]])
    return wheeling_from(places, np.array(headings), places + np.array([0, 0.001]), np.zeros(4))


@given(st.lists(st.floats(-3.1, 3.1), min_size=4, max_size=4), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_swerving_wheels_steer_by_the_shorter_turn_before_they_start(headings, vx, w) -> None:
    twist, wheels = np.array([vx, 0.2, w]), swerve(headings)
    # A quarter of a turn at 2 rad/s.
    for _ in range(int(0.5 * np.pi / 2.0 / 0.01) + 2):
        wheels = advanced(wheels, np.zeros(3), twist, 0.01)
    assert aligned(wheels, twist)
    assert np.abs(wheels.heading - headings).max() <= 0.5 * np.pi + 1e-9
    x, y = wheels.contact.T
    velocity = np.column_stack([vx - w * y, 0.2 + w * x])
    across = velocity[:, 1] * np.cos(wheels.heading) - velocity[:, 0] * np.sin(wheels.heading)
    assert np.abs(across).max() <= np.sin(ALIGNED) * np.hypot(*velocity.T).max()
    assert (wheels.contact == swerve(headings).contact).all()


def drive(mode: LegMode, v_xyw_B, duration: float = 4.0) -> Walk:
    walk = standing(HEXAPOD, mode).go(duration, asked(v_xyw_B, mode)).go(1.5, asked([0, 0, 0], mode))
    assert not walk.faults
    return walk


def test_mammals_steer_their_hips_and_only_then_drive() -> None:
    walk = drive(MAMMAL, [0.0, 0.3, 0.0])
    headings = np.array([HEXAPOD.group.headings(HEXAPOD.group.frames(q)) for q in walk.q])
    moving = np.abs(walk.twist[:, 1]) > 0
    assert np.abs(np.cos(headings[moving])).max() <= np.sin(ALIGNED) + 1e-6
    assert walk.time[moving][0] == pytest.approx(0.5 * np.pi / 2.0, abs=0.1)
    assert walk.plans[-1].q_xyt[1] > 0.5


@pytest.mark.parametrize(
    ("mode", "v_xyw_B"),
    [(INSECT, [0.4, 0, 0]), (INSECT, [0.1, 0.1, 0.2]), (INSECT, [0, 0, 0.5]), (MAMMAL, [0.3, 0, 0.2])],
    ids=["ahead", "curve", "spin", "mammal"],
)
def test_wheels_do_not_slide_across_their_way(mode: LegMode, v_xyw_B: list[float]) -> None:
    walk = drive(mode, v_xyw_B)
    velocity = np.diff(walk.feet, axis=0)[..., :2] / np.diff(walk.time)[:, np.newaxis, np.newaxis]
    headings = np.array([HEXAPOD.group.headings(HEXAPOD.group.frames(q)) for q in walk.q])
    headings += np.array([plan.q_xyt[2] for plan in walk.plans])[:, np.newaxis]
    middle = headings[:-1] + 0.5 * np.arctan2(np.sin(np.diff(headings, axis=0)), np.cos(np.diff(headings, axis=0)))
    across = velocity[..., 1] * np.cos(middle) - velocity[..., 0] * np.sin(middle)
    size = np.hypot(*np.moveaxis(velocity, -1, 0)).max()
    # 2 %: wheels may be steered 1 deg off, and turn within a period of 20 ms.
    assert np.abs(across).max() < 0.02 * size
    assert walk.feet[..., 2].tolist() == np.zeros_like(walk.feet[..., 2]).tolist()
    assert (walk.swing < 0).all()


def test_wheels_turn_as_far_as_their_feet_go() -> None:
    walk = drive(INSECT, [0.4, 0, 0])
    way = np.linalg.norm(np.diff(walk.feet, axis=0), axis=2).sum(axis=0)
    # 1 %: castors also pivot, where the leg turns under the wheel.
    assert_allclose(np.abs(np.diff(walk.wheel, axis=0)).sum(axis=0) * 0.06, way, rtol=0.01)


def test_legs_that_wound_up_step_back_and_drive_on() -> None:
    """A long drive in circles turns the joints that steer to their limits."""
    walk = standing(HEXAPOD, MAMMAL)
    low, high = HEXAPOD.group.limits
    for turn in range(4):
        direction = 0.5 * np.pi * turn
        walk.go(3.0, asked([0.15 * np.cos(direction), 0.15 * np.sin(direction), 0.3], MAMMAL))
    assert not walk.faults
    q = np.array(walk.q)
    assert (q >= low - 1e-3).all()
    assert (q <= high + 1e-3).all()


def test_feet_without_motors_do_not_drive() -> None:
    planner = LegPlanner(rb.load_robot(robots.quadruped()))
    with pytest.raises(rb.KinematicsError, match="test_quadruped cannot drive"):
        planner.start(LegMode(posture="stand", motion="drive"))
