"""The two steps of the pose filter, motion and fix, and what it remembers; see `estimation`.

The entries of states and covariances are written out: numbers of a single run, for which numpy would be slow, or arrays
(...) of many runs.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.uncertainty import Six, spread, step_terms

Array = NDArray[np.float64]
Three = tuple[Any, Any, Any]

ENTRIES = ((0, 1, 2, 6), (1, 3, 4, 7), (2, 4, 5, 8), (6, 7, 8, 9))
"""Where the entries of the covariance (4, 4) are among those of a `Belief`."""


class Belief(NamedTuple):
    """State, then covariance: pose (x, y, yaw = t) in W with gyroscope bias b, each a number or an array (...)."""

    x: Any
    y: Any
    yaw: Any
    bias: Any
    xx: Any
    xy: Any
    xt: Any
    yy: Any
    yt: Any
    tt: Any
    xb: Any
    yb: Any
    tb: Any
    bb: Any

    def covariance(self) -> Array:
        """P (..., 4, 4) of x, y, yaw, bias."""
        return np.stack([np.stack([self[4 + entry] for entry in row], axis=-1) for row in ENTRIES], axis=-2)


class Rates(NamedTuple):
    """What wheels and gyroscope tell of a time step.

    Attributes:
        twist: Body twist of the wheel speeds [m/s, m/s, rad/s].
        noise: Covariance of the step that it makes, over time [m, m, rad]^2/s.
        yaw_rate: Reading of the gyroscope [rad/s].
    """

    twist: Three
    noise: Six
    yaw_rate: Any


class Variances(NamedTuple):
    """Noise of the sensors.

    Attributes:
        gyro: Spectral density of the gyroscope's white noise [rad^2/s].
        walk: Variance of its bias over time [rad^2/s^3].
        fix: Variances of a fix of x, y, yaw [m^2, m^2, rad^2].
    """

    gyro: float
    walk: float
    fix: tuple[float, ...]


class Fix(NamedTuple):
    """A fix in a time step.

    Attributes:
        offset: When, from the start of the step, over its length [-].
        pose: x, y, yaw [m, m, rad].
        weight: 1, or 0 where it is not to be used.
    """

    offset: float
    pose: Three
    weight: Any = 1.0


class Interval(NamedTuple):
    """A time step: the belief at its start, the rates in it, and its fixes in their order."""

    belief: Belief
    rates: Rates
    fixes: tuple[Fix, ...] = ()


def moved(belief: Belief, rates: Rates, dt: float, variances: Variances) -> tuple[Belief, Three]:
    """Belief after a time dt, and the twist (3) that the body is found to have had.

    With H (q, b, s) = s_yaw + b dt, P H' = [P_.b dt; Q_.yaw] and S = P_bb dt^2 + Q_yaw,yaw + N dt, the difference r of
    gyroscope and wheels corrects bias and step, and with the corrected step

        P <- [A P A' + B Q B'] - c c' / S,      c = [A P_.b dt + B Q_.yaw]     (A and B extended by the bias).
    """
    x, y, yaw, bias = belief[:4]
    qxx, qxy, qxt, qyy, qyt, qtt = (rate * dt for rate in rates.noise)
    bb = belief.bb
    variance = bb * (dt * dt) + qtt + variances.gyro * dt
    gain = (rates.yaw_rate - rates.twist[2] - bias) * dt / variance
    # The pose is correlated with the bias, so the reading tells of it too.
    x, y = x + belief.xb * (dt * gain), y + belief.yb * (dt * gain)
    yaw, bias = yaw + belief.tb * (dt * gain), bias + bb * (dt * gain)
    sx, sy, turn = (rate * dt + q * gain for rate, q in zip(rates.twist, (qxt, qyt, qtt), strict=True))
    terms = step_terms(yaw, (sx, sy, turn), _functions(yaw))
    pose = spread(belief[4:10], terms, (qxx, qxy, qxt, qyy, qyt, qtt))
    xb, yb, tb = belief.xb - terms.dy * belief.tb, belief.yb + terms.dx * belief.tb, belief.tb
    cx = xb * dt + terms.cos * qxt - terms.sin * qyt + terms.slope_x * qtt
    cy = yb * dt + terms.sin * qxt + terms.cos * qyt + terms.slope_y * qtt
    ct, cb = tb * dt + qtt, bb * dt
    nx, ny, nt = cx / variance, cy / variance, ct / variance
    xx, xy, xt, yy, yt, tt = pose
    after = Belief(
        *(x + terms.dx, y + terms.dy, yaw + turn, bias),
        *(xx - nx * cx, xy - nx * cy, xt - nx * ct, yy - ny * cy, yt - ny * ct, tt - nt * ct),
        *(xb - nx * cb, yb - ny * cb, tb - nt * cb, bb - cb * cb / variance + variances.walk * dt),
    )
    return after, (sx / dt, sy / dt, turn / dt)


def corrected(belief: Belief, fix: Fix, variances: Variances) -> tuple[Belief, Any]:
    """Belief after a fix, and the fix's normalised innovation squared (chi-square of 3 degrees of freedom).

    The error of a pose is the step, turned into W, whose exponential leads from the estimate to the truth: places that
    an uncertain heading has scattered along an arc are Gaussian in it. The step to the fix is the innovation; the
    corrected step is then made, and the error's covariance turns with it. The noises of x, y and yaw are independent,
    so the three are taken one after the other, each a scalar update.
    """
    functions = _functions(belief.yaw)
    turn = fix.pose[2] - belief.yaw
    turn = turn - 2 * math.pi * functions.floor(turn / (2 * math.pi) + 0.5)
    dx, dy = _chord(fix.pose[0] - belief.x, fix.pose[1] - belief.y, -0.5 * turn, functions)
    stretch = _sinc(0.5 * turn, functions)
    innovations = (dx / stretch, dy / stretch, turn)
    step, covariance = [0.0, 0.0, 0.0, 0.0], list(belief[4:])
    distance = 0.0
    for index in range(3):
        column = [covariance[entry] for entry in ENTRIES[index]]
        total = column[index] + variances.fix[index]
        innovation = innovations[index] - step[index]
        distance = distance + innovation * innovation / total
        for row in range(4):
            gain = fix.weight * column[row] / total
            step[row] = step[row] + gain * innovation
            for other in range(row, 4):
                entry = ENTRIES[row][other]
                covariance[entry] = covariance[entry] - gain * column[other]
    return _stepped(belief, step, covariance), distance


def _stepped(belief: Belief, step: list[Any], covariance: list[Any]) -> Belief:
    """Belief after a correction (4), a step in W and one of the bias; the covariance turns with the pose."""
    functions = _functions(belief.yaw)
    stretch = _sinc(0.5 * step[2], functions)
    dx, dy = _chord(stretch * step[0], stretch * step[1], 0.5 * step[2], functions)
    xx, xy, xt, yy, yt, tt, xb, yb, tb, bb = covariance
    c, s = functions.cos(step[2]), functions.sin(step[2])
    turned = (
        *(c * (c * xx - 2 * s * xy) + s * s * yy, c * s * (xx - yy) + (c * c - s * s) * xy, c * xt - s * yt),
        *(s * (s * xx + 2 * c * xy) + c * c * yy, s * xt + c * yt, tt),
        *(c * xb - s * yb, s * xb + c * yb, tb, bb),
    )
    return Belief(belief.x + dx, belief.y + dy, belief.yaw + step[2], belief.bias + step[3], *turned)


def _chord(x: Any, y: Any, angle: Any, functions: Any) -> tuple[Any, Any]:
    """A vector turned counter-clockwise."""
    cos, sin = functions.cos(angle), functions.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def _sinc(angle: Any, functions: Any) -> Any:
    away = functions.sqrt(angle * angle + 1e-24)
    return functions.sin(away) / away


def crossed(interval: Interval, time_step: float, variances: Variances) -> tuple[Belief, Three]:
    """Belief at the end of a time step, and the twist at its end; the rates are constant in it."""
    belief, done = _up_to(interval, 1.0, time_step, variances)
    return moved(belief, interval.rates, (1.0 - done) * time_step, variances)


def with_fix(
    interval: Interval, fix: Fix, time_step: float, variances: Variances, gate: float | None
) -> tuple[Interval, Any]:
    """The time step with one fix more, and that fix's weight (...): 0 where the gate keeps it out."""
    if gate is not None:
        belief, done = _up_to(interval, fix.offset, time_step, variances)
        if fix.offset > done:
            belief, _ = moved(belief, interval.rates, (fix.offset - done) * time_step, variances)
        distance = corrected(belief, fix, variances)[1]
        fix = fix._replace(weight=1.0 * (distance <= gate))
    fixes = tuple(sorted((*interval.fixes, fix), key=lambda each: each.offset))
    return interval._replace(fixes=fixes), fix.weight


def _up_to(interval: Interval, end: float, time_step: float, variances: Variances) -> tuple[Belief, float]:
    """Belief after the last fix up to an offset, and that fix's offset."""
    belief, done = interval.belief, 0.0
    for fix in interval.fixes:
        if fix.offset <= end:
            if fix.offset > done:
                belief, _ = moved(belief, interval.rates, (fix.offset - done) * time_step, variances)
            belief, done = corrected(belief, fix, variances)[0], fix.offset
    return belief, done


def _functions(value: Any) -> Any:
    return math if isinstance(value, float) else np
