"""How far odometry can be trusted: covariances of poses that come from noisy wheels.

A body moves by step = v_xyw_B dt, with the covariance Q that the noise of its wheels gives it; its pose q then has

    P <- A P A^T + B Q B^T,      A = dq+/dq,   B = dq+/dstep      of q+ = q * exp(step), the exponential of SE(2).

`step_terms` and `spread` hold these equations once, for numbers, numpy arrays and symbols alike.

Source: Chong and Kleeman (1997), Accurate odometry and error modelling for a mobile robot, section 4, for noise whose
variance grows with the travel of each wheel; Kelly (2004), Linearized error propagation in odometry; Thrun, Burgard and
Fox (2005), Probabilistic robotics, section 5.4.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]
PerWheel = float | Sequence[float] | Mapping[str, float]
Six = tuple[Any, Any, Any, Any, Any, Any]
"""A symmetric matrix of (x, y, yaw): its entries xx, xy, xt, yy, yt, tt."""

UPPER = np.triu_indices(3)
"""Places of these entries in the matrix."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryNoise:
    """White noise of the measured wheel motion, independent from wheel to wheel.

    While a wheel of radius R turns at q' for a time dt, the error of its angle gets the variance

        (travel / R |q'| + speed) dt      [rad^2].

    Each is a number for all driven wheels, a sequence in the order of robot.yaml, or a mapping by wheel name. As
    only the measured q' is known, the noise of a sample should be small against it.

    A wrong wheel radius or track is no white noise: its error grows with the travel, not with the square root of it.
    Calibrate it away; what remains, a relative error e, is covered by inflating the noise so that it is as large after
    the distance D between two pose fixes (or, without fixes, after the distance that matters): add e^2 D to travel.

    Attributes:
        travel: Variance of a wheel's travel over the length of it [m^2/m].
        speed: Spectral density of the noise of wheel speeds [rad^2/s]: for samples of standard deviation s that are
            independent every dt, s^2 dt.
    """

    travel: PerWheel = 0.0
    speed: PerWheel = 0.0

    def angle_variances(self, kinematics: WheelKinematics, wheel_speeds: ArrayLike) -> Array:
        """Variance of the wheels' angles over time (..., n_driven) [rad^2/s] at wheel speeds (..., n_driven)."""
        slope, constant = self.coefficients(kinematics)
        rates: Array = slope * np.abs(np.asarray(wheel_speeds, dtype=np.float64)) + constant
        return rates

    def coefficients(self, kinematics: WheelKinematics) -> tuple[Array, Array]:
        """Values of travel / R [rad] and speed [rad^2/s] of the driven wheels, (n_driven,) each.

        Raises:
            KinematicsError: a value is negative or not finite, or they do not fit the driven wheels.
        """
        wheels = kinematics.robot.driven_wheels
        names, radii = [wheel.name for wheel in wheels], np.array([wheel.radius for wheel in wheels])
        return _per_wheel("travel", self.travel, names) / radii, _per_wheel("speed", self.speed, names)


@dataclass(frozen=True, slots=True, kw_only=True)
class GyroNoise:
    """Noise of a gyroscope about the vertical, as data sheets and Allan deviations give it.

    Attributes:
        density: Angle random walk: root of the white noise's spectral density [rad/s/sqrt(Hz)]. Samples every dt have
            the standard deviation density / sqrt(dt).
        bias_walk: Rate random walk: the bias wanders by bias_walk sqrt(t) [rad/s/sqrt(s)].
        bias_deviation: Standard deviation of the bias at the start [rad/s].
    """

    density: float
    bias_walk: float = 0.0
    bias_deviation: float = 0.0

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            KinematicsError: one is negative or not finite.
        """
        for field in ("density", "bias_walk", "bias_deviation"):
            value = getattr(self, field)
            if not (math.isfinite(value) and value >= 0):
                raise KinematicsError(f"{field} = {value}: accepted: a finite number of 0 or more")


class StepTerms(NamedTuple):
    """What a step does to a pose, and its derivatives; see `step_terms`."""

    dx: Any
    dy: Any
    cos: Any
    sin: Any
    slope_x: Any
    slope_y: Any


def step_terms(yaw: Any, step_xyt_B: Sequence[Any], functions: Any) -> StepTerms:
    """Displacement in W by a step, and what its Jacobians consist of.

        A = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]      B = [[cos, -sin, slope_x], [sin, cos, slope_y], [0, 0, 1]]

    with the step's half turn h, (cos, sin) = sinc(h) (cos, sin)(yaw + h), and as slopes the derivatives of (dx, dy) by
    the turn: half of sinc'(h) R(yaw + h) (sx, sy) + (-dy, dx).

    Args:
        yaw: Yaw before the step [rad].
        step_xyt_B: Step (3) in B, twist times duration [m, m, rad].
        functions: Where sin, cos and sqrt are found: math, numpy or pydrake.symbolic, as the arguments are.
    """
    sx, sy, turn = step_xyt_B
    half = 0.5 * turn
    # Free of branches, so that symbols can follow. The tiny summands keep sinc exact to the last bit, and its slope, in
    # which a difference of nearly equal numbers is divided by the square of h, to 1e-11 of the step.
    near, far = functions.sqrt(half * half + 1e-24), functions.sqrt(half * half + 1e-10)
    sinc = functions.sin(near) / near
    sinc_slope = half * (functions.cos(far) - functions.sin(far) / far) / (far * far)
    cos, sin = functions.cos(yaw + half), functions.sin(yaw + half)
    along, left = cos * sx - sin * sy, sin * sx + cos * sy
    dx, dy = sinc * along, sinc * left
    slope_x, slope_y = 0.5 * (sinc_slope * along - dy), 0.5 * (sinc_slope * left + dx)
    return StepTerms(dx, dy, sinc * cos, sinc * sin, slope_x, slope_y)


def spread(covariance: Six, terms: StepTerms, step_covariance: Six) -> Six:
    """A P A^T + B Q B^T, entry by entry."""
    xx, xy, xt, yy, yt, tt = covariance
    qxx, qxy, qxt, qyy, qyt, qtt = step_covariance
    dx, dy, c, s, ex, ey = terms
    ux, uy, ut = c * qxx - s * qxy + ex * qxt, c * qxy - s * qyy + ex * qyt, c * qxt - s * qyt + ex * qtt
    vx, vy, vt = s * qxx + c * qxy + ey * qxt, s * qxy + c * qyy + ey * qyt, s * qxt + c * qyt + ey * qtt
    return (
        xx - dy * (2 * xt - dy * tt) + c * ux - s * uy + ex * ut,
        xy + dx * xt - dy * yt - dx * dy * tt + s * ux + c * uy + ey * ut,
        xt - dy * tt + ut,
        yy + dx * (2 * yt + dx * tt) + s * vx + c * vy + ey * vt,
        yt + dx * tt + vt,
        tt + qtt,
    )


def jacobians(q_xyt: ArrayLike, v_xyw_B: ArrayLike, dt: ArrayLike) -> tuple[Array, Array]:
    """Derivatives A and B (..., 3, 3) of `odometry.integrate` by the pose, and by the step v_xyw_B dt.

    Args:
        q_xyt: Poses (..., 3) [m, m, rad].
        v_xyw_B: Twists (..., 3) in B [m/s, m/s, rad/s].
        dt: Times (...) [s].
    """
    terms = _terms(q_xyt, v_xyw_B, dt)
    dx, dy, cos, sin, slope_x, slope_y = terms
    zero, one = np.zeros_like(dx), np.ones_like(dx)
    by_pose = _matrix([[one, zero, -dy], [zero, one, dx], [zero, zero, one]])
    by_step = _matrix([[cos, -sin, slope_x], [sin, cos, slope_y], [zero, zero, one]])
    return by_pose, by_step


def step_covariance(kinematics: WheelKinematics, noise: OdometryNoise, wheel_speeds: ArrayLike, dt: ArrayLike) -> Array:
    """Covariance Q (..., 3, 3) of the step of a body: F diag(variances of the wheels' angles) F^T.

    F is `WheelKinematics.forward_matrix`, so wheels that disagree are weighed as `WheelKinematics.forward` does.

    Args:
        kinematics: The robot's.
        noise: Its wheels' noise.
        wheel_speeds: Speeds (..., n_driven) [rad/s].
        dt: Durations (...) [s].
    """
    forward = kinematics.forward_matrix
    variances = noise.angle_variances(kinematics, wheel_speeds) * np.asarray(dt, dtype=np.float64)[..., np.newaxis]
    return np.einsum("in,...n,jn->...ij", forward, variances, forward)


def propagate(
    covariance: ArrayLike, q_xyt: ArrayLike, v_xyw_B: ArrayLike, dt: ArrayLike, step_covariance: ArrayLike
) -> Array:
    """Covariance (..., 3, 3) of the pose after a step: A P A^T + B Q B^T.

    Args:
        covariance: P (..., 3, 3) of the pose before, of x, y, yaw in W.
        q_xyt: Pose (..., 3) before [m, m, rad].
        v_xyw_B: Twist (..., 3) in B [m/s, m/s, rad/s].
        dt: Duration (...) [s].
        step_covariance: Q (..., 3, 3) of the step in B (see the function of this name).
    """
    before, added = (np.asarray(matrix, dtype=np.float64) for matrix in (covariance, step_covariance))
    return symmetric(spread(upper(before), _terms(q_xyt, v_xyw_B, dt), upper(added)))


def checked_covariance(covariance: ArrayLike) -> Array:
    """A covariance (3, 3) of a pose.

    Raises:
        KinematicsError: it is none.
    """
    matrix = np.asarray(covariance, dtype=np.float64)
    shaped = matrix.shape == (3, 3) and np.isfinite(matrix).all() and np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0)
    if not (shaped and np.linalg.eigvalsh(matrix).min() >= -1e-12 * np.trace(matrix)):
        raise KinematicsError(
            f"covariance = {covariance!r}: accepted: finite, symmetric, (3, 3), without negative eigenvalues"
        )
    return matrix


def upper(matrix: Array) -> Six:
    """Entries (6) of symmetric matrices (..., 3, 3)."""
    xx, xy, xt, yy, yt, tt = np.moveaxis(matrix[..., UPPER[0], UPPER[1]], -1, 0)
    return xx, xy, xt, yy, yt, tt


def symmetric(entries: Six) -> Array:
    """Matrices (..., 3, 3) of these entries."""
    xx, xy, xt, yy, yt, tt = np.broadcast_arrays(*entries)
    return _matrix([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])


def _terms(q_xyt: ArrayLike, v_xyw_B: ArrayLike, dt: ArrayLike) -> StepTerms:
    q, v = np.asarray(q_xyt, dtype=np.float64), np.asarray(v_xyw_B, dtype=np.float64)
    step = v * np.asarray(dt, dtype=np.float64)[..., np.newaxis]
    return step_terms(q[..., 2], np.moveaxis(step, -1, 0), np)  # type: ignore[arg-type]


def _matrix(rows: list[list[Array]]) -> Array:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _per_wheel(field: str, values: PerWheel, names: list[str]) -> Array:
    if isinstance(values, Mapping):
        for name in values:
            if name not in names:
                raise KinematicsError(f"{field}[{name!r}]: no such driven wheel; accepted: {names}")
        values = [values.get(name, 0.0) for name in names]
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.shape not in ((), (len(names),)):
        raise KinematicsError(f"{field} has shape {numbers.shape}: accepted: a number, or {len(names)}, one a wheel")
    if not (np.isfinite(numbers) & (numbers >= 0)).all():
        raise KinematicsError(f"{field} = {values}: accepted: finite numbers of 0 or more")
    return np.broadcast_to(numbers, (len(names),)).copy()
