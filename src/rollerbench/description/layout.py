"""Where wheels stand: the contact points that support a base, and the room that wheels take."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from rollerbench.description.wheels import Wheel

Points = NDArray[np.float64]


def support_margin(contacts: Points, point: Points) -> float:
    """Distance of a point (2,) from the edge of the convex hull of contacts (n, 2) [m], negative outside.

    Fewer than three contacts, or contacts on one line, support nothing: the margin is -inf.
    """
    if len(contacts) < 3:
        return -math.inf
    try:
        hull = ConvexHull(contacts)
    except QhullError:
        return -math.inf
    return float(-np.max(hull.equations[:, :2] @ point + hull.equations[:, 2]))


def wheels_overlap(first: Wheel, second: Wheel, slices: int = 41) -> bool:
    """Whether two wheels share space, at any swivel angle of those that swivel.

    Both are cut by horizontal planes; a wheel's section is a rectangle, or the disc that it sweeps as it swivels.
    """
    low = max(wheel.center_B[2] - wheel.radius for wheel in (first, second))
    high = min(wheel.center_B[2] + wheel.radius for wheel in (first, second))
    if low >= high:
        return False
    heights = np.linspace(low, high, slices)
    return any(_convex_overlap(_section(first, z), _section(second, z)) for z in heights)


def _section(wheel: Wheel, height: float) -> Points:
    """Corners (n, 2) of a wheel's horizontal section at a height over Bo [m]."""
    above = height - wheel.center_B[2]
    half_length = math.sqrt(max(0.0, wheel.radius**2 - above**2))
    if wheel.swivels:
        reach = math.hypot(half_length + wheel.swivel_offset, 0.5 * wheel.width)
        angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
        return wheel.p_BoHo_B[:2] + reach * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    cos, sin = math.cos(wheel.heading), math.sin(wheel.heading)
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [half_length, 0.5 * wheel.width]
    return wheel.center_B[:2] + corners @ np.array([[cos, sin], [-sin, cos]])


def _convex_overlap(first: Points, second: Points) -> bool:
    """Separating axis test of two convex polygons (n, 2), with a micrometre of tolerance for touching ones."""
    for polygon in (first, second):
        edges = np.roll(polygon, -1, axis=0) - polygon
        lengths = np.linalg.norm(edges, axis=-1)
        edges = edges[lengths > 0] / lengths[lengths > 0, np.newaxis]
        normals = np.stack([edges[:, 1], -edges[:, 0]], axis=-1)
        a, b = first @ normals.T, second @ normals.T
        gap = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
        if np.any(gap > -1e-6):
            return False
    return True
