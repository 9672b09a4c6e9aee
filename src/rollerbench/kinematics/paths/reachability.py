"""The fastest motion along a path under convex limits of acceleration and speed, by reachability.

The way is cut into intervals of constant acceleration u = s'', over which the squared speed x = s'^2 grows by 2 u ds.
Each interval holds the limits of both its ends, which leaves a convex set of pairs (x, y) of squared speeds at its
start and end. A pass from the end finds the largest x from which the rest of the path can be followed; a pass from the
start then always takes the largest y among these.

Source: Pham and Pham (2018), A new approach to time-optimal path parameterization based on reachability analysis,
sections III and IV; with the limits of both ends of an interval after section V.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ranges = tuple[Array, Array, Array]

ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Intervals:
    """For each interval the pairs (x, y), as ranges of x at levels of y; empty where left > right.

    Attributes:
        y: Levels (n, m), increasing.
        left: Smallest x (n, m) there.
        right: Largest x (n, m) there.
    """

    y: Array
    left: Array
    right: Array


def intervals(steps: Array, starts: Ranges, ends: Ranges) -> Intervals:
    """The pairs (x, y) of all intervals.

    Args:
        steps: Ways ds (n,).
        starts: What the limits at the starts of the intervals allow: squared speeds (n, k) from 0 up, the smallest u
            (n, k) at these, convex over them, and the largest, concave.
        ends: As much at their ends.
    """
    gain = 2.0 * steps[:, np.newaxis]
    (x, by_start), (y, by_end) = _outline(starts), _outline(ends)
    at_start, at_end = (x, x + gain * by_start), (y - gain * by_end, y)
    y = np.concatenate([at_start[1], at_end[1]], axis=1)
    lowest = np.maximum(at_start[1].min(axis=1), 0.0)
    highest = np.maximum(np.minimum(at_start[1].max(axis=1), at_end[1].max(axis=1)), lowest)
    y = np.sort(np.clip(y, lowest[:, np.newaxis], highest[:, np.newaxis]), axis=1)
    bounds = [_crossed(polygons, y) for polygons in (at_start, at_end)]
    (left, right), (other_left, other_right) = bounds
    return Intervals(y=y, left=np.maximum(left, other_left), right=np.minimum(right, other_right))


def fastest(pairs: Intervals) -> Array | None:
    """Squared speeds (n + 1,) from rest to rest; None if no motion comes through."""
    count = len(pairs.y)
    most = np.zeros(count + 1)
    for i in range(count - 1, -1, -1):
        rows = _feasible(pairs, i, most[i + 1])
        if rows is None:
            return None
        most[i] = rows[2].max()
    x = np.zeros(count + 1)
    for i in range(count):
        rows = _feasible(pairs, i, most[i + 1])
        reached = None if rows is None else _highest(*rows, x[i])
        if reached is None:
            return None
        x[i + 1] = reached
    return x


def _outline(ranges: Ranges) -> tuple[Array, Array]:
    """Corners (n, 2k + 2) of the polygons of squared speeds and u.

    They are continued below rest, so that the ranges of x at small y do not end in a corner.
    """
    levels, low, high = (np.column_stack([2 * rows[:, 0] - rows[:, 1], rows]) for rows in ranges)
    return np.concatenate([levels, levels[:, ::-1]], axis=1), np.concatenate([low, high[:, ::-1]], axis=1)


def _crossed(polygons: tuple[Array, Array], at: Array) -> tuple[Array, Array]:
    """Where polygons with corners x, y (n, k) begin and end (n, m) at levels of y (n, m)."""
    x, y = polygons
    dx, dy = np.roll(x, -1, axis=1) - x, np.roll(y, -1, axis=1) - y
    flat = dy == 0
    share = (at[..., np.newaxis] - y[:, np.newaxis]) / np.where(flat, 1.0, dy)[:, np.newaxis]
    meets = (share >= -ROUNDING) & (share <= 1.0 + ROUNDING) & ~flat[:, np.newaxis]
    found = x[:, np.newaxis] + share * dx[:, np.newaxis]
    return np.where(meets, found, np.inf).min(axis=-1), np.where(meets, found, -np.inf).max(axis=-1)


def _feasible(pairs: Intervals, i: int, most: float) -> tuple[Array, Array, Array] | None:
    """Levels of y up to the most that is allowed, with the ranges of x there; None if there are none."""
    y, left, right = pairs.y[i], pairs.left[i], pairs.right[i]
    inside = left <= right + ROUNDING * (1.0 + right)
    y, left, right = y[inside], left[inside], right[inside]
    if not len(y) or y[0] > most + ROUNDING:
        return None
    if y[-1] <= most:
        return y, left, right
    below = y < most
    ends = np.array([most, np.interp(most, y, left), np.interp(most, y, right)])
    y, left, right = (np.append(values[below], end) for values, end in zip((y, left, right), ends, strict=True))
    return y, left, right


def _highest(y: Array, left: Array, right: Array, x: float) -> float | None:
    """The largest y at which x lies in its range, linear between the levels; None if there is none."""
    if len(y) == 1:
        return float(y[0])
    # Between two levels both x - left and right - x are linear: each is positive on one side of its root.
    tolerance = ROUNDING * (1.0 + x)
    upper, lower = np.ones(len(y) - 1), np.zeros(len(y) - 1)
    for room in (x - left + tolerance, right - x + tolerance):
        a, b = room[:-1], room[1:]
        root = a / np.where(a == b, 1.0, a - b)
        upper = np.where((b < 0) & (a >= 0), np.minimum(upper, root), upper)
        lower = np.where((a < 0) & (b >= 0), np.maximum(lower, root), lower)
        upper = np.where((a < 0) & (b < 0), -1.0, upper)
    possible = upper >= lower
    if not possible.any():
        return None
    last = int(np.flatnonzero(possible)[-1])
    return float(y[last] + upper[last] * (y[last + 1] - y[last]))
