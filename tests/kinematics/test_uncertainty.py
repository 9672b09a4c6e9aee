"""Covariances of odometry: exact derivatives, agreement with noisy runs, and the laws that theory states."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.systems.analysis import Simulator

import robots
import rollerbench as rb
from rollerbench.kinematics import WheelKinematics, odometry, uncertainty
from rollerbench.kinematics.uncertainty import OdometryNoise

numbers = st.floats(-2.0, 2.0)
vectors = st.tuples(numbers, numbers, numbers)
turns = st.one_of(st.floats(-6.0, 6.0), st.floats(-1e-3, 1e-3), st.just(0.0))
H = 1e-5


@given(vectors, st.tuples(numbers, numbers, turns))
@settings(max_examples=60, deadline=None)
def test_jacobians_are_finite_differences(pose, step) -> None:
    by_pose, by_step = uncertainty.jacobians(pose, step, 1.0)
    ends = np.concatenate([H * np.eye(3), -H * np.eye(3)])
    for ours, q, v in ((by_pose, pose + ends, step), (by_step, pose, step + ends)):
        moved = odometry.integrate(q, v, 1.0)
        # Of the second order: H^2 times third derivatives, of some units, and rounding over H.
        assert ours == pytest.approx((moved[:3] - moved[3:]).T / (2 * H), abs=2e-9)


@given(vectors, vectors, st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_propagate_is_the_sandwich(pose, twist, seed) -> None:
    factors = np.random.default_rng(seed).standard_normal((2, 5, 3, 3))
    before, added = factors @ np.swapaxes(factors, -1, -2)
    by_pose, by_step = uncertainty.jacobians(pose, twist, 0.1)
    expected = by_pose @ before @ by_pose.T + by_step @ added @ by_step.T
    assert uncertainty.propagate(before, pose, twist, 0.1, added) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_covariance_is_that_of_noisy_runs() -> None:
    """4000 runs of a Mecanum base with one bad wheel, along a curve: every entry within its sampling error.

    An entry of a sample covariance of n runs has the standard error sqrt((P_ii P_jj + P_ij^2) / n): 4.5 of them.
    """
    kinematics = WheelKinematics("youbot_base")
    name = kinematics.robot.driven_wheels[0].name
    dt, steps, runs = 0.1, 60, 4000
    bad, good = OdometryNoise(travel={name: 4e-5}), OdometryNoise(travel=1e-5, speed=2e-5)
    twist = np.array([0.3, 0.2, 0.4])
    wheel_speeds = kinematics.inverse(twist)
    variances = bad.angle_variances(kinematics, wheel_speeds) + good.angle_variances(kinematics, wheel_speeds)
    noise = OdometryNoise(speed=variances.tolist())
    step = uncertainty.step_covariance(kinematics, noise, wheel_speeds, dt)
    pose, covariance = np.array([1.0, -1.0, 0.3]), np.zeros((3, 3))
    samples = np.tile(pose, (runs, 1))
    random = np.random.default_rng(1)
    for _ in range(steps):
        covariance = uncertainty.propagate(covariance, pose, twist, dt, step)
        pose = odometry.integrate(pose, twist, dt)
        measured = wheel_speeds + np.sqrt(variances / dt) * random.standard_normal((runs, 4))
        samples = odometry.integrate(samples, kinematics.forward(measured), dt)
    diagonal = np.diag(covariance)
    error = np.sqrt((np.outer(diagonal, diagonal) + covariance**2) / runs)
    assert (np.abs(np.cov(samples.T) - covariance) < 4.5 * error).all()
    # The effect tested is larger than the tolerance: x and yaw, and y and yaw, are correlated.
    assert (np.abs(covariance) > 10 * error).all()


@pytest.mark.parametrize("steps", [10, 100])
def test_on_a_straight_line_the_lateral_variance_grows_with_the_cube(steps: int) -> None:
    """With travel noise k and track b the yaw variance is 2 k s / b^2, the lateral one 2 k / b^2 s^3 / 3 (1 - 1/4n^2).

    The last factor is that of n steps. Along, the mean of two wheels is left: k s / 2.
    """
    kinematics = WheelKinematics(robots.cart())
    k, track, distance = 1e-5, 0.4, 5.0
    twist, dt = np.array([0.5, 0.0, 0.0]), 10.0 / steps
    step = uncertainty.step_covariance(kinematics, OdometryNoise(travel=k), kinematics.inverse(twist), dt)
    pose, covariance = np.zeros(3), np.zeros((3, 3))
    for _ in range(steps):
        covariance = uncertainty.propagate(covariance, pose, twist, dt, step)
        pose = odometry.integrate(pose, twist, dt)
    rate = 2 * k / track**2
    lateral = rate * distance**3 / 3 * (1 - 1 / (4 * steps**2))
    expected = [k * distance / 2, lateral, rate * distance]
    assert np.diag(covariance) == pytest.approx(expected, rel=1e-11)
    assert covariance[1, 2] == pytest.approx(rate * distance**2 / 2, rel=1e-11)


def test_the_system_is_the_function() -> None:
    kinematics = WheelKinematics(robots.mecanum())
    noise = OdometryNoise(travel=[1e-4, 2e-4, 0.0, 1e-4], speed=1e-3)
    dt, wheel_speeds = 0.02, np.array([3.0, -1.0, 2.0, 5.0])
    system = rb.systems.Odometry(kinematics, dt, noise=noise)
    pose, covariance = np.array([1.0, 2.0, 0.5]), np.diag([1e-4, 2e-4, 3e-4])
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.set_pose(context, pose, covariance)
    system.GetInputPort("wheel_speeds").FixValue(context, wheel_speeds)
    simulator.AdvanceTo(1.0)
    twist = kinematics.forward(wheel_speeds)
    for _ in range(50):
        step = uncertainty.step_covariance(kinematics, noise, wheel_speeds, dt)
        covariance = uncertainty.propagate(covariance, pose, twist, dt, step)
        pose = odometry.integrate(pose, twist, dt)
    assert system.GetOutputPort("q_xyt").Eval(context) == pytest.approx(pose, abs=1e-13)
    assert system.GetOutputPort("covariance").Eval(context) == pytest.approx(covariance.ravel(), rel=1e-11)
    without = rb.systems.Odometry(kinematics, dt)
    assert [without.GetOutputPort("q_xyt").get_index(), without.num_output_ports()] == [0, 1]


@pytest.mark.parametrize("wheel_speeds", [[3.0, -1.0, 2.0, 5.0], [0.0, 0.0, 0.0, 0.0]])
def test_the_system_has_derivatives(wheel_speeds) -> None:
    """Derivatives of the next covariance by the wheel speeds, standstill included."""
    system = rb.systems.Odometry(robots.mecanum(), 0.1, noise=OdometryNoise(travel=1e-2, speed=1e-3))

    def following(speeds, of=system):
        context = of.CreateDefaultContext()
        of.GetInputPort("wheel_speeds").FixValue(context, speeds)
        groups = of.EvalUniquePeriodicDiscreteUpdate(context)
        sizes = [groups.value(group).size for group in range(groups.num_groups())]
        return groups.value(sizes.index(6))

    derived = following(InitializeAutoDiff(np.array(wheel_speeds)).ravel(), system.ToAutoDiffXd())
    assert ExtractValue(derived).ravel() == pytest.approx(following(wheel_speeds), rel=1e-14)
    shifts = [(following(wheel_speeds + h) - following(wheel_speeds - h)) / (2 * H) for h in H * np.eye(4)]
    assert ExtractGradient(derived) == pytest.approx(np.transpose(shifts), abs=1e-8)
    assert system.ToSymbolic().GetOutputPort("covariance").size() == 9


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"travel": {"nose": 1e-4}}, r"travel\['nose'\]: no such driven wheel; accepted: \['left', 'right'\]"),
        ({"speed": [1e-4]}, r"speed has shape \(1,\): accepted: a number, or 2"),
        ({"travel": -1e-4}, r"travel = -0.0001: accepted: finite numbers of 0 or more"),
        ({"speed": {"left": float("nan")}}, r"speed = \[nan, 0.0\]"),
    ],
)
def test_a_noise_that_does_not_fit_is_refused(values, message: str) -> None:
    with pytest.raises(rb.KinematicsError, match=message):
        rb.systems.Odometry(robots.cart(), 0.01, noise=OdometryNoise(**values))


def test_a_covariance_needs_a_noise() -> None:
    system = rb.systems.Odometry(robots.cart(), 0.01)
    with pytest.raises(rb.KinematicsError, match="made without a noise"):
        system.set_pose(system.CreateDefaultContext(), [0, 0, 0], np.eye(3))
    system = rb.systems.Odometry(robots.cart(), 0.01, noise=OdometryNoise(travel=1e-4))
    for bad in (np.eye(2), np.diag([1.0, -1.0, 1.0]), np.triu(np.ones((3, 3))), np.full((3, 3), np.nan)):
        with pytest.raises(rb.KinematicsError, match=r"accepted: finite, symmetric, \(3, 3\)"):
            system.set_pose(system.CreateDefaultContext(), [0, 0, 0], bad)
