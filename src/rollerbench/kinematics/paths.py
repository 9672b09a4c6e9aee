"""Paths in the plane with a speed law: from a list of legs, each from rest to rest, to a body twist over time."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from rollerbench.kinematics.odometry import rotate
from rollerbench.kinematics.profile import Profile

Array = NDArray[np.float64]
SpeedLaw = Literal["minimum_jerk", "trapezoidal"]

NODES = 481
"""Samples of a leg's path, and of its twist over time."""

RAMP_SHARE = 0.25
"""Share of a leg's time in which the trapezoidal law speeds up, and again in which it slows down [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A smooth piece of a path.

    Attributes:
        q_xyt: Poses (k, 3) along the leg at equal steps of its parameter [m, m, rad]; the yaw counts full turns.
        tangent: Whether the body looks along the path, so that it moves to +x only.
    """

    q_xyt: Array
    tangent: bool = False

    @property
    def length(self) -> float:
        """Length of the path of Bo [m]."""
        return float(np.sum(np.hypot(*np.diff(self.q_xyt[:, :2], axis=0).T)))

    @property
    def turn(self) -> float:
        """Angle that the body turns through [rad]."""
        return float(np.sum(np.abs(np.diff(self.q_xyt[:, 2]))))

    def effort(self, radius: float) -> float:
        """Length plus the arc of the turn at a radius [m]: what a leg's time is shared out by."""
        return self.length + radius * self.turn


def leg(pose: Callable[[Array], tuple[ArrayLike, ArrayLike, ArrayLike]], *, tangent: bool = False) -> Leg:
    """A leg from a function of u (k,) in 0..1 to x, y [m] and yaw [rad]."""
    u = np.linspace(0, 1, NODES)
    return Leg(
        q_xyt=np.column_stack([np.broadcast_to(np.asarray(part, float), u.shape) for part in pose(u)]), tangent=tangent
    )


def line(start: ArrayLike, end: ArrayLike) -> Leg:
    """Straight from one pose (3,) to another, turning evenly on the way."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    return leg(lambda u: tuple((a + np.outer(u, b - a)).T))


def arc(radius: float, angle: float, *, tangent: bool) -> Leg:
    """Along a circle from the origin, first to +x; to the left, or right if the angle is negative [m, rad]."""
    side = math.copysign(1.0, angle)

    def pose(u: Array) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
        turned = abs(angle) * u
        yaw = side * turned if tangent else 0.0
        return radius * np.sin(turned), side * radius * (1 - np.cos(turned)), yaw

    return leg(pose, tangent=tangent)


def square(side: float, *, tangent: bool) -> list[Leg]:
    """Four sides to the left from the origin; with tangent heading the body turns on the spot in between."""
    corners = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)]
    legs = []
    for index, (here, there) in enumerate(itertools.pairwise(corners)):
        yaw = 0.5 * math.pi * index if tangent else 0.0
        legs.append(line((*here, yaw), (*there, yaw)))
        if tangent:
            legs.append(line((*there, yaw), (*there, yaw + 0.5 * math.pi)))
    return legs


def figure_eight(size: float, *, tangent: bool) -> Leg:
    """Lemniscate of Gerono of length size along x, through the origin and back to it, first to +x and +y [m]."""

    def pose(u: Array) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
        t = 2 * np.pi * u
        x, y = 0.5 * size * np.sin(t), 0.5 * size * np.sin(t) * np.cos(t)
        # Turned by -45 deg, so that it starts along +x.
        x, y = rotate(-0.25 * np.pi, np.column_stack([x, y])).T
        yaw = np.unwrap(np.arctan2(np.cos(2 * t), np.cos(t))) - 0.25 * np.pi
        return x, y, yaw if tangent else 0.0

    return leg(pose, tangent=tangent)


def spline(points: ArrayLike, *, tangent: bool) -> Leg:
    """Smooth curve from the origin through points (k, 2) [m], turned so that a tangent heading starts at +x.

    A natural cubic spline over the chord lengths; with fixed heading it is not turned.
    """
    through = np.vstack([np.zeros((1, 2)), np.asarray(points, dtype=np.float64)])
    chords = np.hypot(*np.diff(through, axis=0).T)
    curve = CubicSpline(np.concatenate([[0.0], np.cumsum(chords)]), through, bc_type="natural")

    def pose(u: Array) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
        s = u * curve.x[-1]
        place, slope = curve(s), curve(s, 1)
        yaw = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))
        if not tangent:
            return place[:, 0], place[:, 1], 0.0
        x, y = rotate(-yaw[0], place).T
        return x, y, yaw - yaw[0]

    return leg(pose, tangent=tangent)


def through_waypoints(waypoints: Sequence[Sequence[float]], *, tangent: bool) -> list[Leg]:
    """Straight from waypoint to waypoint, each [x, y] or [x, y, yaw] [m, rad], from the origin.

    With tangent heading the body turns on the spot to face the next waypoint, and to a yaw that a waypoint asks for;
    otherwise it turns evenly on the way.
    """
    pose, legs = np.zeros(3), []
    for waypoint in waypoints:
        target = np.array([*waypoint, pose[2]][:3])
        way = target[:2] - pose[:2]
        if tangent and np.hypot(*way) > 1e-9:
            facing = pose[2] + _wrap(math.atan2(way[1], way[0]) - pose[2])
            legs += [line(pose, (*pose[:2], facing)), line((*pose[:2], facing), (*target[:2], facing))]
            pose = np.array([*target[:2], facing])
            target[2] = waypoint[2] if len(waypoint) == 3 else facing
        turned = np.array([*target[:2], pose[2] + _wrap(target[2] - pose[2])])
        legs.append(line(pose, turned))
        pose = turned
    return [each for each in legs if each.effort(1.0) > 1e-9]


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
    tau = np.linspace(0, 1, NODES)
    u, rate = _speed_law(law, tau)
    breaks: list[Array] = []
    values: list[Array] = []
    slopes: list[Array] = []
    for each, start, end in zip(legs, starts, starts + moving, strict=True):
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


def _wrap(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)
