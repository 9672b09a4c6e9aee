"""Where a robot is, by its wheels, a gyroscope and late absolute fixes: an extended Kalman filter with a memory.

The state is the pose q = (x, y, yaw) in W and the bias b of the gyroscope. The error of the pose is the step that leads
from the estimate to the truth, turned into W: to first order the errors of x, y and yaw, and yet Gaussian where these
are not, because an uncertain heading scatters places along an arc. With that of the bias its covariance is P (4, 4).

In a time dt the wheels tell the step s of the body with the covariance Q (`uncertainty.step_covariance`), and the
gyroscope reads its last component once more:

    yaw_rate dt = s_yaw + b dt + noise,      of variance N dt.

So step and bias are first corrected by the difference of the two, one scalar Kalman update of (q, b, s), then the pose
moves by the corrected step: q+ = q * exp(s), with the exact Jacobians of `uncertainty.step_terms`. Wheels that stand
without noise thereby calibrate the gyroscope. A fix tells the error of the pose, with noise (`belief.corrected`).

A fix tells of the past: it is taken at the state of its stamp, and the stored inputs from there on are used again, with
all fixes in between. The estimate is therefore, to the bit, the one of fixes that had come at once and in order.

Source: Bar-Shalom, Li and Kirubarajan (2001), Estimation with applications to tracking and navigation, section 10.3
(extended Kalman filter) and 5.4 (its consistency); Barrau and Bonnabel (2017), The invariant extended Kalman filter as
a stable observer, and Long, Wolfe, Mashner and Chirikjian (2012), The banana distribution is Gaussian, for the error of
a pose; Chong and Kleeman (1997) for the wheels; Larsen, Andersen, Ravn and Poulsen (1998), Incorporation of time
delayed measurements in a discrete-time Kalman filter, for late fixes.
"""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.belief import Belief, Fix, Interval, Rates, Three, Variances, crossed, with_fix
from rollerbench.kinematics.given import AnyRobot, held_kinematics, positive_time
from rollerbench.kinematics.uncertainty import UPPER, GyroNoise, OdometryNoise, checked_covariance

Array = NDArray[np.float64]

SNAP = 1e-6
"""A stamp closer to a step's start than this share of a step is taken to lie there [-]."""


class FixCounts(NamedTuple):
    """What became of the fixes so far; gated (...) counts those beyond the gate, each for its own run."""

    used: int = 0
    too_old: int = 0
    future: int = 0
    gated: Any = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseEstimate:
    """What a `PoseFilter` knows at a time; never changed once it is made.

    Attributes:
        step: Number of the time step whose start it tells of.
        belief: State and covariance there.
        twist: Corrected body twist of the step before, of three numbers (...).
        history: The last steps, the oldest first.
        stamp: Stamp of the last fix that came [s]; NaN if none has.
        fixes: What became of the fixes.
    """

    step: int
    belief: Belief
    twist: Three
    history: tuple[Interval, ...] = ()
    stamp: float = math.nan
    fixes: FixCounts = field(default_factory=FixCounts)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Itself: nothing in it ever changes, so Drake's contexts may share it."""
        return self

    @property
    def q_xyt(self) -> Array:
        """Pose (..., 3) of B in W; the yaw counts full turns [m, m, rad]."""
        return np.stack(self.belief[:3], axis=-1)

    @property
    def covariance(self) -> Array:
        """Covariance (..., 4, 4) of the errors of x, y, yaw and the gyroscope's bias."""
        return self.belief.covariance()

    @property
    def gyro_bias(self) -> Array:
        """Bias (...) of the gyroscope [rad/s]."""
        return np.asarray(self.belief.bias, dtype=np.float64)

    @property
    def v_xyw_B(self) -> Array:
        """Twist (..., 3) of the last time step, wheels and gyroscope weighed [m/s, m/s, rad/s]."""
        return np.stack(self.twist, axis=-1)


class PoseFilter:
    """Extended Kalman filter of wheel odometry, a gyroscope and late pose fixes; see the module.

    It holds parameters only: `advance` makes a new `PoseEstimate` from the last. All values may have leading axes: many
    runs at once, whose fixes then share their stamps.

    Attributes:
        kinematics: The robot's.
        time_step: Period of the updates [s].
        latency_steps: Time steps that are remembered.
    """

    def __init__(
        self,
        robot: AnyRobot,
        time_step: float,
        *,
        wheels: OdometryNoise,
        gyro: GyroNoise,
        fix_deviation: ArrayLike,
        largest_latency: float = 0.5,
        gate: float | None = None,
    ) -> None:
        """Prepares the filter.

        Args:
            robot: The robot, or its kinematics.
            time_step: Period of the updates [s].
            wheels: Noise of the wheel speeds; see there for wrong radii.
            gyro: Noise of the gyroscope; its density must not be 0.
            fix_deviation: Standard deviations (3,) of a fix in W [m, m, rad].
            largest_latency: Age of the oldest fix that is still used [s].
            gate: Fixes of which the normalised innovation squared (chi-square of 3 degrees) is larger are not used:
                16.3 lets one good fix in a thousand go. By default all are used; a gated filter that has lost its way
                may refuse good fixes for long.

        Raises:
            KinematicsError: an argument is not accepted, or the robot steers wheels.
        """
        deviation = _checked(time_step, gyro, fix_deviation, largest_latency, gate)
        self.kinematics = held_kinematics(robot)
        self.time_step = time_step
        self.latency_steps = math.ceil(largest_latency / time_step - SNAP)
        self._gate, self._bias_variance = gate, gyro.bias_deviation**2
        self._variances = Variances(gyro.density**2, gyro.bias_walk**2, tuple((deviation**2).tolist()))
        forward = self.kinematics.forward_matrix.T
        slope, constant = wheels.coefficients(self.kinematics)
        products = forward[:, UPPER[0]] * forward[:, UPPER[1]]
        # From wheel speeds and their sizes to twist and noise at once.
        self._rates_matrix = block_diag(forward, slope[:, np.newaxis] * products)
        self._rates_at_rest = np.concatenate([np.zeros(3), constant @ products])

    def start(
        self,
        q_xyt: ArrayLike = (0.0, 0.0, 0.0),
        covariance: ArrayLike | None = None,
        *,
        gyro_bias: ArrayLike = 0.0,
        step: int = 0,
    ) -> PoseEstimate:
        """Estimate to begin with.

        Args:
            q_xyt: Poses (..., 3) [m, m, rad].
            covariance: Covariance (3, 3) of the pose; by default it is known exactly. An unknown pose is told by large
                variances: the first fix then sets it.
            gyro_bias: Expected bias (...) [rad/s]; how well it is known is the noise's bias_deviation.
            step: Number of the time step that comes next: time / time_step.

        Raises:
            KinematicsError: a value is not finite, or the covariance is none.
        """
        pose = np.asarray(q_xyt, dtype=np.float64)
        if pose.ndim == 0 or pose.shape[-1] != 3 or not np.isfinite(pose).all():
            raise KinematicsError(f"q_xyt = {q_xyt!r}: accepted: finite numbers (..., 3)")
        bias = np.asarray(gyro_bias, dtype=np.float64)
        if not np.isfinite(bias).all():
            raise KinematicsError(f"gyro_bias = {gyro_bias!r}: accepted: finite numbers")
        matrix = checked_covariance(np.zeros((3, 3)) if covariance is None else covariance)
        bias = np.broadcast_to(bias, pose.shape[:-1])
        variances = (*matrix[UPPER].tolist(), 0.0, 0.0, 0.0, self._bias_variance)
        entries = np.broadcast_to(np.array(variances), (*bias.shape, len(variances)))
        belief = Belief(*_parts(np.concatenate([pose, bias[..., np.newaxis], entries], axis=-1)))
        return PoseEstimate(step=step, belief=belief, twist=_parts(np.zeros_like(pose)))

    def advance(
        self, estimate: PoseEstimate, wheel_speeds: ArrayLike, yaw_rate: ArrayLike, pose_fix: ArrayLike | None = None
    ) -> PoseEstimate:
        """Estimate one time step later.

        Args:
            estimate: That at the start of the step.
            wheel_speeds: Speeds (..., n_driven) during the step [rad/s].
            yaw_rate: Readings (...) of the gyroscope during the step [rad/s].
            pose_fix: Fixes (..., 4) that have come by the start of the step: stamp, x, y, yaw [s, m, m, rad]. A stamp
                that is the last one's, or NaN, means that none has come. A fix whose stamp lies before the history or
                after the start of this step is counted and not used.

        Raises:
            KinematicsError: a value is not finite, or fixes of the same time have unequal stamps.
        """
        current = Interval(estimate.belief, self._rates(wheel_speeds, yaw_rate), ())
        history = (*estimate.history[-self.latency_steps :], current) if self.latency_steps else (current,)
        stamp, counts = estimate.stamp, estimate.fixes
        if pose_fix is not None:
            stamp, counts, history = self._take(estimate, history, pose_fix)
        belief, twist = crossed(history[-1], self.time_step, self._variances)
        step = estimate.step + 1
        return PoseEstimate(step=step, belief=belief, twist=twist, history=history, stamp=stamp, fixes=counts)

    def _rates(self, wheel_speeds: ArrayLike, yaw_rate: ArrayLike) -> Rates:
        # What is kept is copied: the caller may use its arrays again.
        speeds, rate = np.asarray(wheel_speeds, dtype=np.float64), np.array(yaw_rate, dtype=np.float64)
        size = len(self._rates_matrix) // 2
        if speeds.ndim == 0 or speeds.shape[-1] != size:
            raise KinematicsError(f"wheel_speeds has shape {speeds.shape}: accepted: (..., {size})")
        rates = np.concatenate([speeds, np.abs(speeds)], axis=-1) @ self._rates_matrix + self._rates_at_rest
        if not np.isfinite(rates.sum() + rate.sum()):
            raise KinematicsError(f"wheel_speeds = {speeds}, yaw_rate = {rate}: accepted: finite numbers")
        parts = _parts(rates)
        return Rates(parts[:3], parts[3:], float(rate) if rate.ndim == 0 else rate)

    def _take(
        self, estimate: PoseEstimate, history: tuple[Interval, ...], pose_fix: ArrayLike
    ) -> tuple[float, FixCounts, tuple[Interval, ...]]:
        """Puts a fix where it belongs in the history, and brings the history up to date."""
        fix = np.array(pose_fix, dtype=np.float64)
        if fix.ndim == 0 or fix.shape[-1] != 4:
            raise KinematicsError(f"pose_fix has shape {fix.shape}: accepted: (..., 4)")
        stamp = float(fix.flat[0])
        if math.isnan(stamp) or stamp == estimate.stamp:
            return estimate.stamp, estimate.fixes, history
        if not (np.isfinite(fix).all() and (fix[..., 0] == stamp).all()):
            raise KinematicsError(f"pose_fix = {fix}: accepted: finite numbers, and the same stamp for all runs")
        counts = estimate.fixes
        first = estimate.step + 1 - len(history)
        place = stamp / self.time_step - first
        index = math.floor(place + SNAP)
        if index < 0:
            return stamp, counts._replace(too_old=counts.too_old + 1), history
        if place > len(history) - 1 + SNAP:
            return stamp, counts._replace(future=counts.future + 1), history
        taken = Fix(place - index if place - index > SNAP else 0.0, _parts(fix[..., 1:]))
        changed, weight = with_fix(history[index], taken, self.time_step, self._variances, self._gate)
        recent = [*history[:index], changed]
        for interval in history[index + 1 :]:
            belief, _ = crossed(recent[-1], self.time_step, self._variances)
            recent.append(interval._replace(belief=belief))
        gated = counts.gated + (1.0 - weight)
        return stamp, counts._replace(used=counts.used + 1, gated=gated), tuple(recent)


def _parts(vectors: Array) -> Any:
    """Components of vectors (..., n): plain numbers, which are fast, or arrays (...)."""
    return tuple(vectors.tolist()) if vectors.ndim == 1 else tuple(np.moveaxis(vectors, -1, 0))


def _checked(
    time_step: float, gyro: GyroNoise, fix_deviation: ArrayLike, largest_latency: float, gate: float | None
) -> Array:
    """The standard deviations (3,) of a fix, if all parameters are accepted."""
    deviation = np.asarray(fix_deviation, dtype=np.float64)
    positive_time("time_step", time_step)
    if not (math.isfinite(largest_latency) and largest_latency >= 0):
        raise KinematicsError(f"largest_latency = {largest_latency}: accepted: 0 s or more")
    if deviation.shape != (3,) or not (np.isfinite(deviation) & (deviation > 0)).all():
        raise KinematicsError(f"fix_deviation = {fix_deviation!r}: accepted: three positive numbers [m, m, rad]")
    if not gyro.density > 0:
        raise KinematicsError(f"density = {gyro.density} of the gyroscope: accepted: a positive number")
    if gate is not None and not gate > 0:
        raise KinematicsError(f"gate = {gate}: accepted: a positive number, or None")
    return deviation
