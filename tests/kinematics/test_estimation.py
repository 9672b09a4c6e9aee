"""The pose filter: steps of the textbook, and exact about late fixes."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robots
import rollerbench as rb
from rollerbench.kinematics import WheelKinematics, odometry, uncertainty
from rollerbench.kinematics.belief import ENTRIES, Belief
from rollerbench.kinematics.estimation import PoseEstimate, PoseFilter
from rollerbench.kinematics.uncertainty import GyroNoise, OdometryNoise

WHEELS = OdometryNoise(travel=2e-4)
GYRO = GyroNoise(density=2e-3, bias_walk=1e-4, bias_deviation=0.01)
FIX = np.array([0.05, 0.05, 0.03])
BASE = WheelKinematics("youbot_base")


def make(time_step: float = 0.1, **changes) -> PoseFilter:
    arguments = {"wheels": WHEELS, "gyro": GYRO, "fix_deviation": FIX, **changes}
    return PoseFilter(BASE, time_step, **arguments)


def beliefs(seed: int) -> tuple[np.ndarray, np.ndarray, Belief]:
    """A state, a covariance, and the two as a belief."""
    random = np.random.default_rng(seed)
    state, factor = random.standard_normal(4), 0.1 * random.standard_normal((4, 4))
    covariance = factor @ factor.T
    entries = {entry: covariance[i, j] for i, row in enumerate(ENTRIES) for j, entry in enumerate(row)}
    return state, covariance, Belief(*state.tolist(), *(float(entries[entry]) for entry in range(10)))


def turned(angle, steps):
    """Steps (..., 3) turned by angles (...)."""
    moved = odometry.rotate(angle, steps[..., :2])
    return np.concatenate([moved, np.broadcast_to(steps[..., 2:], (*moved.shape[:-1], 1))], axis=-1)


def textbook_update(state, covariance, matrix, innovation, noise):
    gain = covariance @ matrix.T @ np.linalg.inv(matrix @ covariance @ matrix.T + noise)
    return state + gain @ innovation, covariance - gain @ matrix @ covariance


@given(st.integers(0, 10**6), st.booleans())
@settings(max_examples=40, deadline=None)
def test_a_step_is_that_of_the_textbook(seed: int, with_fix: bool) -> None:
    """A fix, then gyroscope and wheels as measurement and prior of the step, then the motion: all with matrices."""
    random = np.random.default_rng(seed)
    state, covariance, belief = beliefs(seed)
    dt, wheel_speeds, yaw_rate = 0.1, 5 * random.standard_normal(4), random.standard_normal()
    pose = state[:3] + 0.1 * random.standard_normal(3) + [0, 0, 2 * np.pi * random.integers(-2, 3)]
    estimate = PoseEstimate(step=7, belief=belief, twist=(0.0, 0.0, 0.0))
    ours = make(dt).advance(estimate, wheel_speeds, yaw_rate, [0.7, *pose] if with_fix else None)

    if with_fix:
        turn = pose[2] - state[2]
        pose[2] = state[2] + np.arctan2(np.sin(turn), np.cos(turn))
        innovation = turned(state[2], odometry.displacement(state[:3], pose))
        error, covariance = textbook_update(np.zeros(4), covariance, np.eye(3, 4), innovation, np.diag(FIX**2))
        rotation = np.eye(4)
        rotation[:3, :3] = np.transpose([turned(error[2], axis) for axis in np.eye(3)])
        covariance = rotation @ covariance @ rotation.T
        pose = odometry.integrate(state[:3], turned(-state[2], error[:3]), 1.0)
        state = np.array([*pose, state[3] + error[3]])
    step = BASE.forward(wheel_speeds) * dt
    joint = np.zeros((7, 7))
    joint[:4, :4], joint[4:, 4:] = covariance, uncertainty.step_covariance(BASE, WHEELS, wheel_speeds, dt)
    matrix = np.array([[0, 0, 0, dt, 0, 0, 1.0]])
    innovation = np.array([yaw_rate * dt - step[2] - state[3] * dt])
    noise = np.array([[GYRO.density**2 * dt]])
    both, joint = textbook_update(np.concatenate([state, step]), joint, matrix, innovation, noise)
    by_pose, by_step = uncertainty.jacobians(both[:3], both[4:], 1.0)
    transition = np.zeros((4, 7))
    transition[:3, :3], transition[:3, 4:], transition[3, 3] = by_pose, by_step, 1.0
    expected = transition @ joint @ transition.T
    expected[3, 3] += GYRO.bias_walk**2 * dt

    assert ours.q_xyt == pytest.approx(odometry.integrate(both[:3], both[4:], 1.0), abs=1e-11)
    assert ours.gyro_bias == pytest.approx(both[3], abs=1e-11)
    assert ours.v_xyw_B == pytest.approx(both[4:] / dt, abs=1e-11)
    assert ours.covariance == pytest.approx(expected, abs=1e-12)


@given(st.integers(0, 10**6))
@settings(max_examples=12, deadline=None)
def test_late_fixes_count_as_if_they_had_come_at_once(seed: int) -> None:
    """Stamps anywhere in the steps, latencies that put fixes out of order: to the bit the estimate of prompt ones."""
    random = np.random.default_rng(seed)
    filter_, steps = make(largest_latency=2.0), 60
    wheel_speeds, yaw_rates = 5 * random.standard_normal((steps, 4)), random.standard_normal(steps)
    stamps = random.uniform(0.0, 4.5, 12)
    # Two in the same step, and two at the start of one.
    stamps[:4] = [2.31, 2.35, 3.6, 4.0]
    fixes = np.column_stack([stamps, 0.3 * random.standard_normal((12, 3))])
    estimates = []
    for latencies in (np.zeros(12), random.uniform(0.0, 1.0, 12)):
        # One fix a step: those that would come together wait for the next.
        arrivals, step = {}, -1
        for index in np.argsort(stamps + latencies):
            step = max(math.ceil((stamps[index] + latencies[index]) / filter_.time_step - 1e-6), step + 1)
            arrivals[step] = index
        estimate = filter_.start()
        for step in range(steps):
            fix = fixes[arrivals[step]] if step in arrivals else None
            estimate = filter_.advance(estimate, wheel_speeds[step], yaw_rates[step], fix)
        assert estimate.fixes == (12, 0, 0, 0.0)
        estimates.append(estimate)
    prompt, late = estimates
    assert late.belief == prompt.belief
    assert late.twist == prompt.twist


def test_a_fix_within_a_step_is_taken_there() -> None:
    """At a tenth of the step's length the fix meets the belief that ten times shorter steps have there."""
    coarse, fine = make(0.1), make(0.01)
    wheel_speeds, yaw_rate, fix = [3.0, -1.0, 2.0, 5.0], 0.1, [0.27, 0.1, -0.05, 0.2]

    def end(filter_, steps, fix):
        estimate = filter_.start(covariance=np.diag([0.01, 0.01, 0.01]))
        for step in range(steps):
            estimate = filter_.advance(estimate, wheel_speeds, yaw_rate, fix if step == 0.6 * steps else None)
        return estimate

    short, long = end(fine, 50, fix), end(coarse, 5, fix)
    # What remains is that linearisations, and the bias's walk, change from step to step.
    assert long.q_xyt == pytest.approx(short.q_xyt, abs=2e-4)
    assert long.covariance == pytest.approx(short.covariance, rel=0.01, abs=1e-7)
    for stamp in (0.2, 0.3):
        assert np.abs(end(coarse, 5, [stamp, *fix[1:]]).q_xyt - short.q_xyt).max() > 2e-3


def test_standing_still_calibrates_the_gyroscope() -> None:
    """Wheels without noise at rest: the variance of the bias is that of the mean of the readings, with its prior."""
    noise = GyroNoise(density=2e-3, bias_deviation=0.01)
    filter_ = make(gyro=noise)
    estimate = filter_.start([1.0, 2.0, 3.0])
    readings = 0.02 + 0.006 * np.random.default_rng(0).standard_normal(200)
    for reading in readings:
        estimate = filter_.advance(estimate, np.zeros(4), reading)
    prior, data = 1 / noise.bias_deviation**2, 20.0 / noise.density**2
    assert estimate.covariance[3, 3] == pytest.approx(1 / (prior + data), rel=1e-11)
    assert estimate.gyro_bias == pytest.approx(readings.mean() * data / (prior + data), rel=1e-11)
    assert estimate.q_xyt == pytest.approx([1.0, 2.0, 3.0], abs=1e-15)
    assert np.abs(estimate.covariance[:3, :3]).max() < 1e-17


def test_many_runs_at_once_are_single_runs() -> None:
    random = np.random.default_rng(2)
    filter_ = make()
    wheel_speeds, yaw_rates = 5 * random.standard_normal((8, 3, 4)), random.standard_normal((8, 3))
    fixes = np.concatenate([np.full((3, 1), 0.25), 0.1 * random.standard_normal((3, 3))], axis=-1)
    together, singles = filter_.start(np.zeros((3, 3))), [filter_.start() for _ in range(3)]
    for step in range(8):
        taken = fixes if step == 5 else np.full((3, 4), np.nan)
        together = filter_.advance(together, wheel_speeds[step], yaw_rates[step], taken)
        singles = [
            filter_.advance(single, wheel_speeds[step, run], yaw_rates[step, run], taken[run])
            for run, single in enumerate(singles)
        ]
    assert together.q_xyt == pytest.approx(np.array([single.q_xyt for single in singles]), abs=1e-13)
    assert together.covariance == pytest.approx(np.array([single.covariance for single in singles]), abs=1e-15)
    assert together.gyro_bias == pytest.approx(np.array([single.gyro_bias for single in singles]), abs=1e-14)


def test_fixes_that_cannot_be_used_are_counted() -> None:
    filter_ = make(largest_latency=0.3, gate=16.3)
    fixes = {2: [0.25, 0, 0, 0], 8: [0.45, 0, 0, 0], 9: [0.6, 0, 0, 0], 10: [0.9, 5.0, 0, 0], 11: [0.9, 0, 0, 0]}
    estimate, bare = filter_.start(), filter_.start()
    for step in range(12):
        bare = filter_.advance(bare, np.ones(4), 0.0)
        estimate = filter_.advance(estimate, np.ones(4), 0.0, fixes.get(step))
        if step == 8:
            assert estimate.fixes == (0, 1, 1, 0.0)
            assert estimate.belief == bare.belief
    # The second of stamp 0.9 is not seen as a new one.
    assert estimate.fixes == (2, 1, 1, 1.0)
    assert estimate.belief != bare.belief


def test_an_unknown_pose_is_set_by_the_first_fix() -> None:
    filter_ = make()
    estimate = filter_.start(covariance=np.diag([1e8, 1e8, 1e4]))
    estimate = filter_.advance(estimate, np.zeros(4), 0.0, [0.0, 40.0, -30.0, 2.5])
    assert estimate.q_xyt == pytest.approx([40.0, -30.0, 2.5], abs=1e-5)
    assert np.diag(estimate.covariance)[:3] == pytest.approx(FIX**2, rel=1e-6)


def test_a_copy_is_the_estimate_itself() -> None:
    estimate = make().start()
    assert copy.deepcopy(estimate) is estimate


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_step": 0.0}, "time_step = 0.0: accepted: a positive number"),
        ({"largest_latency": -0.1}, "largest_latency = -0.1: accepted: 0 s or more"),
        ({"fix_deviation": [0.1, 0.1]}, r"fix_deviation = \[0.1, 0.1\]: accepted: three positive numbers"),
        ({"fix_deviation": [0.1, 0.1, 0.0]}, "fix_deviation = .*: accepted: three positive numbers"),
        ({"gyro": GyroNoise(density=0.0)}, "density = 0.0 of the gyroscope: accepted: a positive number"),
        ({"gate": -1.0}, "gate = -1.0: accepted: a positive number, or None"),
        ({"wheels": OdometryNoise(travel={"nose": 1.0})}, "no such driven wheel"),
    ],
)
def test_bad_parameters_are_refused(changes, message: str) -> None:
    with pytest.raises(rb.KinematicsError, match=message):
        make(**changes)


def test_bad_values_are_refused() -> None:
    filter_ = make()
    estimate = filter_.start(np.zeros((2, 3)))
    for arguments, message in (
        ((np.ones(3), 0.0), r"wheel_speeds has shape \(3,\): accepted: \(..., 4\)"),
        ((np.ones(4), np.nan), "yaw_rate = nan: accepted: finite numbers"),
        ((np.ones(4), 0.0, [0.0, 1.0, np.nan, 0.0]), "pose_fix = .*: accepted: finite numbers"),
        ((np.ones(4), 0.0, [0.0, 1.0]), r"pose_fix has shape \(2,\): accepted: \(..., 4\)"),
        ((np.ones(4), 0.0, [[0.0, 0, 0, 0], [0.1, 0, 0, 0]]), "same stamp for all runs"),
    ):
        with pytest.raises(rb.KinematicsError, match=message):
            filter_.advance(estimate, *arguments)
    with pytest.raises(rb.KinematicsError, match="q_xyt"):
        filter_.start([0.0, np.inf, 0.0])
    with pytest.raises(rb.KinematicsError, match=r"without negative eigenvalues"):
        filter_.start(covariance=np.diag([1.0, -1.0, 1.0]))
    with pytest.raises(rb.KinematicsError, match=r"bias_walk = -1\.0: accepted: a finite number of 0 or more"):
        GyroNoise(density=1e-3, bias_walk=-1.0)
    with pytest.raises(rb.KinematicsError, match="stands on legs"):
        PoseFilter(robots.quadruped(), 0.1, wheels=WHEELS, gyro=GYRO, fix_deviation=FIX)
