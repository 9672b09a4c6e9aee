"""The pose filter is as good as it says: errors of many runs, whose noise is what the filter is told."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from rollerbench.kinematics import WheelKinematics, odometry
from rollerbench.kinematics.estimation import PoseFilter
from rollerbench.kinematics.uncertainty import GyroNoise, OdometryNoise

WHEELS = OdometryNoise(travel=2e-4)
GYRO = GyroNoise(density=2e-3, bias_walk=1e-4, bias_deviation=0.01)
FIX = np.array([0.05, 0.05, 0.03])
BASE = WheelKinematics("youbot_base")
RUNS, STEP, LATE_STEPS, STEPS_PER_FIX, STEPS_PER_LOOK = 40, 0.2, 1, 5, 25


def turned(angle, steps):
    """Steps (..., 3) turned by angles (...)."""
    moved = odometry.rotate(angle, steps[..., :2])
    return np.concatenate([moved, np.broadcast_to(steps[..., 2:], (*moved.shape[:-1], 1))], axis=-1)


def errors(
    duration: float, *, first_fix: float = 0.0, yaw_deviation: float = 0.0, compensated: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Errors (looks, RUNS, 4) of pose and bias every 5 s, and their covariances as the filter tells.

    The filters take the heading at the start to be 0, with this deviation.
    """
    random = np.random.default_rng(0)
    count = round(duration / STEP)
    time = STEP * np.arange(count)
    twists = np.stack([0.4 + 0.1 * np.sin(0.3 * time), 0.1 * np.cos(0.2 * time), 0.1 + 0.3 * np.sin(0.05 * time)], -1)
    truth = odometry.accumulate(np.zeros(3), STEP * twists)
    wheel_speeds = BASE.inverse(twists)
    deviation = np.sqrt(WHEELS.angle_variances(BASE, wheel_speeds) / STEP)
    measured = wheel_speeds + deviation * random.standard_normal((RUNS, count, 4))
    walk = GYRO.bias_walk * math.sqrt(STEP) * random.standard_normal((RUNS, count + 1)).cumsum(axis=1)
    bias = GYRO.bias_deviation * random.standard_normal((RUNS, 1)) + walk - walk[:, :1]
    white = GYRO.density / math.sqrt(STEP) * random.standard_normal((RUNS, count))
    yaw_rates = twists[:, 2] + bias[:, :-1] + white
    start = yaw_deviation * random.standard_normal((RUNS, 1))
    truth = turned(start, truth) + start[..., np.newaxis] * [0, 0, 1]
    poses = truth + FIX * random.standard_normal((RUNS, count + 1, 3))

    filter_ = PoseFilter(BASE, STEP, wheels=WHEELS, gyro=GYRO, fix_deviation=FIX)
    estimate, looks = filter_.start(np.zeros((RUNS, 3)), np.diag([0, 0, yaw_deviation**2])), []
    for step in range(count):
        fix, at = None, step - LATE_STEPS
        if at >= first_fix / STEP and at % STEPS_PER_FIX == 0:
            stamp = STEP * (at if compensated else step)
            fix = np.concatenate([np.full((RUNS, 1), stamp), poses[:, at]], axis=-1)
        estimate = filter_.advance(estimate, measured[:, step], yaw_rates[:, step], fix)
        if (step + 1) % STEPS_PER_LOOK == 0:
            off = estimate.gyro_bias - bias[:, step + 1]
            error = np.concatenate([estimate.q_xyt - truth[:, step + 1], off[:, np.newaxis]], axis=-1)
            looks.append((error, estimate.covariance))
    return np.array([error for error, _ in looks]), np.array([covariance for _, covariance in looks])


def mean_nees(error: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Normalised error squared (looks,), the mean over the runs."""
    solved = np.linalg.solve(covariance, error[..., np.newaxis])[..., 0]
    return (error * solved).sum(axis=-1).mean(axis=-1)


def test_for_ten_minutes_the_error_is_bounded_and_as_large_as_told() -> None:
    """The sum of RUNS independent NEES is chi-square of 4 RUNS degrees: at a look it lies in the 95 % band of that.

    Errors of a run are correlated over about ten seconds, those of two runs never: so the band is for the runs, at
    each of 120 looks. The share of looks in it scatters by sqrt(0.95 0.05 / 60) = 2.8 % if two looks count as one: two
    of that below 95 % are accepted.

    Source: Bar-Shalom, Li and Kirubarajan (2001), section 5.4.2.
    """
    error, covariance = errors(600.0)
    nees = mean_nees(error, covariance)
    lower, upper = chi2.ppf([0.025, 0.975], 4 * RUNS) / RUNS
    assert np.mean((lower < nees) & (nees < upper)) >= 0.90
    assert nees.mean() == pytest.approx(4.0, rel=0.05)
    deviation = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    assert (deviation[12:, :, :3] < 0.6 * FIX).all()
    assert np.abs(error[12:] / deviation[12:]).max() < 5.0  # the largest of 17 000

    half = len(error) // 2
    first, second = (np.sqrt((part**2).mean(axis=(0, 1))) for part in (error[12:half], error[half:]))
    assert second == pytest.approx(first, rel=0.2)


def test_latency_that_is_not_compensated_is_noticed() -> None:
    """At 0.4 m/s 0.2 s make 8 cm, four standard deviations."""
    with_stamps, covariance = errors(60.0)
    as_now, told = errors(60.0, compensated=False)
    diagonals = [np.diagonal(each, axis1=-2, axis2=-1) for each in (covariance, told)]
    assert diagonals[1] == pytest.approx(diagonals[0], rel=0.3)  # it does not notice itself
    assert mean_nees(as_now, told)[1:].min() > 10.0
    sizes = [np.hypot(*np.moveaxis(each[..., :2], -1, 0)).mean() for each in (with_stamps, as_now)]
    assert sizes[1] > 3 * sizes[0]


def test_without_fixes_it_drifts() -> None:
    error, covariance = errors(120.0, first_fix=math.inf)
    sizes = np.hypot(error[..., 0], error[..., 1]).mean(axis=-1)
    assert sizes[-1] > 10 * sizes[0]
    deviation = np.sqrt(covariance[:, 0, 2, 2])
    assert (np.diff(deviation) > 0).all()
    # Within 3 standard errors of a deviation that RUNS runs give, 1 / sqrt(2 RUNS) of it each.
    assert np.sqrt((error[-1, :, 2] ** 2).mean()) == pytest.approx(deviation[-1], rel=3 / math.sqrt(2 * RUNS))


def test_fixes_after_a_long_time_are_used_well() -> None:
    """A heading uncertain by 0.3 rad, 30 s without a fix: places scatter along an arc, by a metre, and then by 3 cm.

    What is left of its first fixes' overconfidence fades (NEES of 400 runs: 4.8 after 5 s, 4.1 after 15 s); a filter
    that adds corrections to x, y and yaw has tens.
    """
    error, covariance = errors(60.0, first_fix=30.0, yaw_deviation=0.3)
    sizes = np.hypot(error[..., 0], error[..., 1]).mean(axis=-1)
    assert sizes[4] > 0.5
    assert (sizes[6:] < 0.05).all()
    nees = mean_nees(error, covariance)
    lower, upper = chi2.ppf([0.0005, 0.9995], 4 * RUNS) / RUNS
    assert nees[6] < 1.5 * upper
    assert ((lower < nees[8:]) & (nees[8:] < upper)).all()
