"""Smooth speed laws: from legs, each from rest to rest, to a body twist over time."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rollerbench.kinematics.odometry import rotate
from rollerbench.kinematics.paths.legs import NODES, Leg
from rollerbench.kinematics.profile import Profile

Array = NDArray[np.float64]
SpeedLaw = Literal["minimum_jerk", "trapezoidal"]

RAMP_SHARE = 0.25
"""Share of a leg's time in which the trapezoidal law speeds up, and again in which it slows down [-]."""


def twist_along(legs: Sequence[Leg], duration: float, law: SpeedLaw, radius: float, pause: float = 0.0) -> Profile:
    """Body twist (3) over time that follows legs one after another, resting in between.

    Args:
        legs: The legs, each starting where the last one ends.
        duration: Time of all legs together [s], shared out by `Leg.effort`.
        law: How the parameter of a leg runs in time.
        radius: Radius at which turns count [m].
        pause: Part of the duration that is spent at rest between the legs, evenly [s].
    """
    efforts = np.array([each.effort(radius) for each in legs])
    moving = efforts * (duration - pause) / efforts.sum()
    starts = np.concatenate([[0.0], np.cumsum(moving[:-1] + pause / max(1, len(legs) - 1))])
    breaks: list[Array] = []
    values: list[Array] = []
    slopes: list[Array] = []
    for each, start, end in zip(legs, starts, starts + moving, strict=True):
        tau = np.linspace(0, 1, max(NODES, len(each.q_xyt)))
        u, rate = _speed_law(law, tau)
        path = CubicSpline(np.linspace(0, 1, len(each.q_xyt)), each.q_xyt)
        pose, derivative = path(u), path(u, 1) * (rate / (end - start))[:, np.newaxis]
        twist = np.column_stack([rotate(-pose[:, 2], derivative[:, :2]), derivative[:, 2]])
        if each.tangent:
            # Exactly, not but for the spline's error: tyres allow nothing else.
            twist[:, 0], twist[:, 1] = np.hypot(derivative[:, 0], derivative[:, 1]), 0.0
        time = start + tau * (end - start)
        slope = CubicSpline(time, twist, bc_type="clamped")(time, 1)
        first = 1 if breaks and pause == 0 else 0
        breaks.append(time[first:])
        values.append(twist[first:])
        slopes.append(slope[first:])
    return Profile(breaks=np.concatenate(breaks), values=np.vstack(values), slopes=np.vstack(slopes))


def fastest_duration(legs: Sequence[Leg], speed: float, law: SpeedLaw, radius: float) -> float:
    """Time in which legs can be followed without exceeding a speed of Bo, or of a point at the radius [s]."""
    _, rate = _speed_law(law, np.linspace(0, 1, NODES))
    total = 0.0
    for each in legs:
        path = CubicSpline(np.linspace(0, 1, len(each.q_xyt)), each.q_xyt)
        slope = path(np.linspace(0, 1, NODES), 1)
        peak = np.max(np.hypot(slope[:, 0], slope[:, 1]) + radius * np.abs(slope[:, 2]))
        total = max(total, rate.max() * peak / speed / each.effort(radius))
    return total * sum(each.effort(radius) for each in legs)


def _speed_law(law: SpeedLaw, tau: Array) -> tuple[Array, Array]:
    """Parameter u(tau) and its derivative, both over tau in 0..1, u from 0 to 1."""
    if law == "minimum_jerk":
        # Flash and Hogan (1985).
        return tau**3 * (10 - 15 * tau + 6 * tau**2), 30 * tau**2 * (1 - tau) ** 2
    # Ramps of constant jerk sign, the cubic step, around a plateau.
    ramp = RAMP_SHARE
    top = 1 / (1 - ramp)
    s = np.clip(np.minimum(tau, 1 - tau) / ramp, 0, 1)
    rate = top * s**2 * (3 - 2 * s)
    rising = top * ramp * (s**3 - 0.5 * s**4)
    early = np.where(tau < ramp, rising, top * (tau - 0.5 * ramp))
    return np.where(tau > 1 - ramp, 1 - rising, early), rate
