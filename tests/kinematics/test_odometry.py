"""Odometry is the exponential of SE(2)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from rollerbench.kinematics import odometry
from rollerbench.kinematics.profile import held_with_ramps, reference_poses

numbers = st.floats(-3.0, 3.0)
vectors = st.tuples(numbers, numbers, numbers)


@given(vectors, vectors, st.floats(0.0, 2.0))
def test_integrate_is_the_matrix_exponential(pose, twist, dt) -> None:
    vx, vy, w = twist
    x, y, yaw = pose
    start = np.array([[np.cos(yaw), -np.sin(yaw), x], [np.sin(yaw), np.cos(yaw), y], [0, 0, 1]])
    end = start @ expm(dt * np.array([[0, -w, vx], [w, 0, vy], [0, 0, 0]]))
    ours = odometry.integrate(pose, twist, dt)
    assert ours[:2] == pytest.approx(end[:2, 2], abs=1e-12)
    assert ours[2] == yaw + w * dt


@given(vectors, st.tuples(numbers, numbers, st.floats(-6.0, 6.0)))
def test_displacement_undoes_integrate(pose, step) -> None:
    reached = odometry.integrate(pose, step, 1.0)
    assert odometry.displacement(pose, reached) == pytest.approx(step, abs=1e-9)  # divided by a sinc of at least 0.05


@given(vectors, vectors)
def test_many_steps_are_one(pose, twist) -> None:
    steps = np.tile(np.array(twist) / 50, (50, 1))
    assert odometry.accumulate(pose, steps)[-1] == pytest.approx(odometry.integrate(pose, twist, 1.0), abs=1e-12)


def test_integrate_broadcasts() -> None:
    twist = np.ones((4, 3))
    poses = odometry.integrate(np.zeros(3), twist, np.arange(4.0))
    assert poses.shape == (4, 3)
    assert poses[0] == pytest.approx([0, 0, 0], abs=0)


@given(vectors)
def test_reference_of_ramps_is_exact(twist) -> None:
    """The direction of the twist is constant, so the pose is the exponential of its integral."""
    profile = held_with_ramps(twist, duration=3.0, ramp=0.5)
    time = np.linspace(0, 3, 61)
    poses = reference_poses(profile, time)
    assert poses[-1] == pytest.approx(odometry.integrate([0, 0, 0], twist, 2.5), abs=1e-12)
    assert profile(0.25) == pytest.approx(0.5 * np.array(twist))
    assert profile([0.0, 3.0, 9.0]) == pytest.approx(np.zeros((3, 3)), abs=1e-15)


def test_ramps_may_fill_the_whole_time() -> None:
    profile = held_with_ramps([1.0], duration=2.0, ramp=1.0)
    assert profile([0.0, 1.0, 2.0]).ravel() == pytest.approx([0, 1, 0])
    assert profile.integral(np.array([0.0, 2.0])).ravel() == pytest.approx([1.0])
