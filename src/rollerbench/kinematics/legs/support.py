"""Whether a body on its feet stands: its centre of mass over the polygon of the feet."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError

Array = NDArray[np.float64]
Point = tuple[float, float]

GRAVITY = (0.0, 0.0, -9.81)

FLAT = 1e-9
"""Contacts whose polygon is thinner than this share of its size are on one line."""


def support_polygon(p_WC: ArrayLike, gravity: ArrayLike = GRAVITY) -> NDArray[np.intp]:
    """Which contacts are corners of their convex hull as gravity sees them.

    Args:
        p_WC: Contacts (k, 3) in W [m].
        gravity: Gravity (3,) in W; on a slope W may be tilted with it.

    Returns:
        Indices (m,) into the contacts, counter-clockwise from above; none if there are fewer than three corners.
    """
    return np.array(_hull(_projected(p_WC, _level_axes(gravity))), dtype=np.intp)


def static_margin(p_WC: ArrayLike, p_WBcm: ArrayLike, gravity: ArrayLike = GRAVITY) -> float:
    """Level distance [m] of the centre of mass, along gravity, from the edge of the support polygon; negative outside.

    Args:
        p_WC: Contacts (k, 3) in W [m].
        p_WBcm: Centre of mass (3,) in W [m].
        gravity: Gravity (3,) in W; on a slope W may be tilted with it.

    Returns:
        The margin; -inf with fewer than three contacts, or contacts on one line as gravity sees them.

    Source: McGhee and Frank (1968), static stability margin.
    """
    axes = _level_axes(gravity)
    points = _projected(p_WC, axes)
    corners = [points[index] for index in _hull(points)]
    if not corners:
        return -math.inf
    (center,) = _projected(np.reshape(np.asarray(p_WBcm, dtype=np.float64), (1, -1)), axes)
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    inside = all(_cross(start, end, center) >= 0 for start, end in edges)
    return min(_distance(center, start, end) for start, end in edges) * (1.0 if inside else -1.0)


def _level_axes(gravity: ArrayLike) -> Array:
    """Two axes (2, 3) square to gravity and to each other, counter-clockwise from above; x and y if gravity is down."""
    vector = np.asarray(gravity, dtype=np.float64)
    size = math.hypot(*vector.tolist()) if vector.shape == (3,) else 0.0
    if not 0 < size < math.inf:
        raise KinematicsError(f"gravity = {gravity!r}: accepted: three numbers, not all 0")
    x, y, z = (-vector / size).tolist()
    across = math.hypot(x, z)
    if across > 0.1:
        return np.array([[z / across, 0.0, -x / across], [-x * y / across, across, -y * z / across]])
    across = math.hypot(y, z)
    return np.array([[across, -x * y / across, -x * z / across], [0.0, z / across, -y / across]])


def _projected(points: ArrayLike, axes: Array) -> list[Point]:
    """Points (k, 3) as gravity sees them."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise KinematicsError(f"points of shape {array.shape}: accepted: (k, 3)")
    flat = array @ axes.T
    if not np.isfinite(flat).all():
        raise KinematicsError("points hold NaN or infinite values: accepted: finite numbers")
    return [(x, y) for x, y in flat.tolist()]


def _hull(points: list[Point]) -> list[int]:
    """Corners of the convex hull, counter-clockwise; none where it is no polygon.

    Source: Andrew (1979), Another efficient algorithm for convex hulls in two dimensions.
    """
    order = sorted(range(len(points)), key=points.__getitem__)
    if len(order) < 3:
        return []
    size = max(math.dist(point, points[order[0]]) for point in points)
    thin = FLAT * size * size
    chains: list[list[int]] = []
    for direction in (order, order[::-1]):
        chain: list[int] = []
        for index in direction:
            while len(chain) > 1 and _cross(points[chain[-2]], points[chain[-1]], points[index]) <= thin:
                chain.pop()
            chain.append(index)
        chains.append(chain[:-1])
    corners = chains[0] + chains[1]
    return corners if len(corners) >= 3 else []


def _cross(start: Point, end: Point, point: Point) -> float:
    """Positive where the point is to the left of the way from start to end [m2]."""
    return (end[0] - start[0]) * (point[1] - start[1]) - (end[1] - start[1]) * (point[0] - start[0])


def _distance(point: Point, start: Point, end: Point) -> float:
    """Distance of a point from a segment [m]."""
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    share = ((point[0] - start[0]) * along_x + (point[1] - start[1]) * along_y) / (along_x**2 + along_y**2)
    share = min(1.0, max(0.0, share))
    return math.hypot(point[0] - start[0] - share * along_x, point[1] - start[1] - share * along_y)
