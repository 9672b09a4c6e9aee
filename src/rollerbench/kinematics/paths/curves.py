"""Smooth curves through points, and along points with their corners rounded by clothoids."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import finite, finite_number
from rollerbench.kinematics.odometry import rotate
from rollerbench.kinematics.paths.legs import NODES, Leg, leg

Array = NDArray[np.float64]

CLOTHOID_SHARE = 0.5
"""Share of a corner's turn that its two clothoids take together; the arc between them takes the rest [-]."""

SHARPEST_TURN = math.radians(170.0)
"""Largest turn of a corner that is rounded [rad]: beyond, the rounding would begin far from it."""

NODES_PER_CORNER = 960
"""Samples per corner: where clothoids begin and end the change of the curvature jumps, which splines smear."""

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


def spline(points: ArrayLike, *, tangent: bool = False, yaw: ArrayLike | None = None) -> Leg:
    """Smooth curve from the origin through points (k, 2) [m], turned so that a tangent heading starts at +x.

    A natural cubic spline over the chord lengths; without tangent heading it is not turned.

    Args:
        points: The points (k, 2), each apart from the one before [m].
        tangent: Whether the body looks along the curve.
        yaw: Without tangent heading, yaws (k,) at the points [rad], NaN where it is free; they count full turns. A
            natural cubic spline leads from one to the next, and after the last one the yaw stays.
    """
    through = _from_origin(points)
    chords = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(through, axis=0).T))])
    curve = CubicSpline(chords, through, bc_type="natural")
    turning = _free_yaw(chords, yaw, tangent)

    def pose(u: Array) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
        s = u * curve.x[-1]
        place, slope = curve(s), curve(s, 1)
        if not tangent:
            return place[:, 0], place[:, 1], turning(s)
        back = np.sum(slope[1:] * slope[:-1], axis=1) < 0
        if back.any():
            at = place[int(np.argmax(back))].round(4).tolist()
            raise KinematicsError(f"the path turns back on itself at {at}; accepted: points that lead around")
        heading = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))
        x, y = rotate(-heading[0], place).T
        return x, y, heading - heading[0]

    return leg(pose, tangent=tangent, by_length=True)


def clothoid(
    points: ArrayLike, *, deviation: float | None = None, tangent: bool = False, yaw: ArrayLike | None = None
) -> Leg:
    """Straight lines from the origin along points (k, 2) [m], each corner rounded by clothoid, arc and clothoid.

    The curvature is continuous and linear in the way s: it rises from 0 to 1/R along a clothoid, on which the path
    turns by d = s/(2R) in all, stays along the arc, and falls again. For a corner that turns by a, with the end of its
    first clothoid at (X, Y) from its start, the rounding begins before the corner by

        X - R sin d + (Y + R cos d) tan(a/2)    and passes it at    (Y + R cos d) / cos(a/2) - R,

    both in proportion to R. R is the largest with which roundings meet in the middle of a line at the most (at its end,
    of the first and last line), and which passes no corner farther than the deviation.

    Args:
        points: The corners and the end (k, 2), each apart from the one before [m].
        deviation: How far the path may pass a corner [m]; None for as far as there is room.
        tangent: Whether the body looks along the path, which is then turned so that it starts at +x.
        yaw: As for `spline`; it holds where the path is closest to a corner.

    Raises:
        KinematicsError: a corner turns back, or an argument is malformed.

    Source: Walton and Meek (2005), A controlled clothoid spline; with the arc of Fraichard and Scheuer (2004).
    """
    if deviation is not None and not finite_number("deviation", deviation) > 0:
        raise KinematicsError(f"deviation = {deviation!r}: accepted: more than 0 [m], or None")
    through = _from_origin(points)
    sides = np.diff(through, axis=0)
    length, heading = np.hypot(*sides.T), np.unwrap(np.arctan2(sides[:, 1], sides[:, 0]))
    turns = np.diff(heading)
    if (np.abs(turns) > SHARPEST_TURN).any():
        corner = int(np.argmax(np.abs(turns))) + 1
        raise KinematicsError(
            f"point {corner}, {through[corner].tolist()}: the path turns by {math.degrees(turns[corner - 1]):.4g} deg "
            f"there; accepted: corners of up to {math.degrees(SHARPEST_TURN):g} deg"
        )
    radius, before = _roundings(turns, length, deviation)
    knots, curvature, corners = _curvatures(turns, length, radius, before)
    start = heading[0]

    turning = _free_yaw(corners, yaw, tangent)
    count = NODES + NODES_PER_CORNER * len(turns)

    def pose(u: Array) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
        s = u * knots[-1]
        place, angle = _integrated(knots, curvature, s)
        if tangent:
            return place[:, 0], place[:, 1], angle
        x, y = rotate(start, place).T
        return x, y, turning(s)

    return leg(pose, tangent=tangent, nodes=count)


def _from_origin(points: ArrayLike) -> Array:
    through = finite("points", points)
    if through.ndim != 2 or through.shape[1] != 2 or not len(through):
        raise KinematicsError(f"points = {points!r}: accepted: one or more finite [x, y]")
    through = np.vstack([np.zeros((1, 2)), through])
    if (np.hypot(*np.diff(through, axis=0).T) < 1e-9).any():
        raise KinematicsError("points: two in a row are one (the start is [0, 0]); accepted: points apart")
    return through


def _free_yaw(way: Array, yaw: ArrayLike | None, tangent: bool) -> CubicSpline:
    """Yaw over the way: 0 at the start, and as given (k,) at way[1:], NaN where free."""
    given = np.full(len(way) - 1, np.nan) if yaw is None else np.asarray(yaw, dtype=np.float64)
    if given.shape != (len(way) - 1,) or np.isinf(given).any() or (tangent and yaw is not None):
        raise KinematicsError(f"yaw = {yaw!r}: accepted: a number or NaN for each point, without tangent heading")
    values = np.concatenate([[0.0], given])
    known = np.flatnonzero(~np.isnan(values))
    values[-1] = values[known[-1]]
    known = np.flatnonzero(~np.isnan(values))
    return CubicSpline(way[known], values[known], bc_type="natural")


def _roundings(turns: Array, length: Array, deviation: float | None) -> tuple[Array, Array]:
    """Radii (k,) of the corners' arcs [m], and where the roundings begin before the corners (k,) [m]; 0 if straight."""
    half, share = 0.5 * np.abs(turns), 0.5 * CLOTHOID_SHARE * np.abs(turns)
    # A clothoid of unit end curvature has the length 2 d, and turns by d t^2 up to the share t of its way.
    t, weight = 0.5 * (1 + _GAUSS_NODES), 0.5 * _GAUSS_WEIGHTS
    angle = share[:, np.newaxis] * t**2
    x, y = 2 * share * (np.cos(angle) @ weight), 2 * share * (np.sin(angle) @ weight)
    rise = y + np.cos(share)
    before, passed = x - np.sin(share) + rise * np.tan(half), rise / np.cos(half) - 1.0
    room = np.minimum(np.where(np.arange(len(turns)) == 0, 1.0, 0.5) * length[:-1], 0.5 * length[1:])
    if len(turns):
        room[-1] = min(length[-2] * (1.0 if len(turns) == 1 else 0.5), length[-1])
    bends = np.abs(turns) > 1e-9
    radius = np.where(bends, room / np.where(bends, before, 1.0), 0.0)
    if deviation is not None:
        # Of the slightest corners rounding leaves no distance at all.
        far = passed > 0
        radius = np.minimum(radius, np.where(far, deviation / np.where(far, passed, 1.0), np.inf))
    return radius, radius * before


def _curvatures(turns: Array, length: Array, radius: Array, before: Array) -> tuple[Array, Array, Array]:
    """Ways [m] between which the curvature [1/m] is linear, these curvatures, and the ways (k + 2,) of the points."""
    knots, curvature, corners = [0.0], [0.0], [0.0]
    used = 0.0
    for turn, side, r, cut in zip(turns, length, radius, before, strict=False):
        spiral, arc = CLOTHOID_SHARE * abs(turn) * r, (1 - CLOTHOID_SHARE) * abs(turn) * r
        begin = knots[-1] + side - used - cut
        knots += [begin, begin + spiral, begin + spiral + arc, begin + 2 * spiral + arc]
        corners.append(begin + spiral + 0.5 * arc)
        curvature += [0.0, *[math.copysign(1 / r, turn) if r else 0.0] * 2, 0.0]
        used = cut
    knots.append(knots[-1] + length[-1] - used)
    return np.array(knots), np.array([*curvature, 0.0]), np.array([*corners, knots[-1]])


def _integrated(knots: Array, curvature: Array, s: Array) -> tuple[Array, Array]:
    """Places (k, 2) and directions (k,) after ways s (k,) from the origin, first along +x."""
    steps = np.diff(knots)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * steps)])

    def direction(way: Array) -> Array:
        piece = np.clip(np.searchsorted(knots, way, side="right") - 1, 0, len(steps) - 1)
        rest, size = way - knots[piece], steps[piece]
        slope = np.where(size > 0, (curvature[piece + 1] - curvature[piece]) / np.where(size > 0, size, 1.0), 0.0)
        return turned[piece] + rest * (curvature[piece] + 0.5 * slope * rest)

    # Between knots as well, so that each piece is smooth.
    ends = np.unique(np.concatenate([s, knots]))
    width = np.diff(ends)
    angle = direction(ends[:-1, np.newaxis] + 0.5 * width[:, np.newaxis] * (1 + _GAUSS_NODES))
    weight = 0.5 * width[:, np.newaxis] * _GAUSS_WEIGHTS
    moves = np.column_stack([np.sum(weight * np.cos(angle), axis=1), np.sum(weight * np.sin(angle), axis=1)])
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    return places[np.searchsorted(ends, s)], direction(s)
