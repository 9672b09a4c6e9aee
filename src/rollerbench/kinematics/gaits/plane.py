"""Points in the plane, seen from a pose and placed by it."""

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.odometry import rotate

Array = NDArray[np.float64]


def placed(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of B in P, at poses (3,) or (k, 3)."""
    return q_xyt[..., :2] + rotate(q_xyt[..., 2], points)


def seen_from(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of P in B, at a pose (3,)."""
    return rotate(-q_xyt[2], points - q_xyt[:2])
