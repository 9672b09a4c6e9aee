"""Pieces of a path that a robot follows from rest to rest: lines, arcs, squares, figures of eight, waypoints."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import finite, finite_number
from rollerbench.kinematics.odometry import rotate

Array = NDArray[np.float64]

NODES = 481
"""Samples of a leg's path, and of its twist over time."""

FINE = 8
"""Samples for every one of these by which a path's length is measured."""


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


def leg(
    pose: Callable[[Array], tuple[ArrayLike, ArrayLike, ArrayLike]],
    *,
    tangent: bool = False,
    nodes: int = NODES,
    by_length: bool = False,
) -> Leg:
    """A leg from a function of u (k,) in 0..1 to x, y [m] and yaw [rad], by its values at a number of nodes.

    These are at equal steps of u, or by_length, at equal ways of Bo, so that it can be driven at an even speed.
    """
    u = np.linspace(0, 1, nodes)
    if by_length:
        fine = np.linspace(0, 1, FINE * (nodes - 1) + 1)
        x, y, _ = pose(fine)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        u = CubicSpline(way, fine)(u * way[-1]).clip(0.0, 1.0)
    return Leg(
        q_xyt=np.column_stack([np.broadcast_to(np.asarray(part, float), u.shape) for part in pose(u)]), tangent=tangent
    )


def line(start: ArrayLike, end: ArrayLike) -> Leg:
    """Straight from one pose (3,) to another, turning evenly on the way."""
    a, b = finite("start", start), finite("end", end)
    if a.shape != (3,) or b.shape != (3,):
        raise KinematicsError(f"start = {start!r}, end = {end!r}: accepted: [x, y, yaw] each")
    return leg(lambda u: tuple((a + np.outer(u, b - a)).T))


def arc(radius: float, angle: float, *, tangent: bool) -> Leg:
    """Along a circle from the origin, first to +x; to the left, or right if the angle is negative [m, rad]."""
    if not finite_number("radius", radius) > 0:
        raise KinematicsError(f"radius = {radius!r}: accepted: more than 0 [m]; a negative angle leads to the right")
    side = math.copysign(1.0, finite_number("angle", angle))

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

    return leg(pose, tangent=tangent, by_length=True)


def laps(legs: Sequence[Leg], count: int) -> list[Leg]:
    """A closed path several times: one leg without a rest in between, or several legs one after the other."""
    turn = legs[-1].q_xyt[-1, 2] - legs[0].q_xyt[0, 2]
    rounds = [[each.q_xyt + np.array([0.0, 0.0, lap * turn]) for each in legs] for lap in range(count)]
    if len(legs) > 1:
        return [replace(each, q_xyt=q) for poses in rounds for each, q in zip(legs, poses, strict=True)]
    joined = [rounds[0][0], *(each[0][1:] for each in rounds[1:])]
    return [replace(legs[0], q_xyt=np.concatenate(joined))]


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


def _wrap(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)
