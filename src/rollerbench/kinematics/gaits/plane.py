"""Points in the plane, seen from a pose and placed by it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def placed(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of B in P, at poses (3,) or (k, 3)."""
    x, y, yaw = q_xyt[..., 0], q_xyt[..., 1], q_xyt[..., 2]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack([x + cos * points[:, 0] - sin * points[:, 1], y + sin * points[:, 0] + cos * points[:, 1]], axis=-1)


def seen_from(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of P in B, at a pose (3,)."""
    x, y, yaw = q_xyt
    away = points - [x, y]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]])
