"""Campion's degrees of mobility, steerability and manoeuvrability."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RANK_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Mobility:
    """What a wheeled base can do.

    Attributes:
        degree_of_mobility: Twist directions free at once, at fixed steering angles [-], 0..3.
        degree_of_steerability: Twist directions gained by turning the steered wheels [-], 0..2.
    """

    degree_of_mobility: int
    degree_of_steerability: int

    @property
    def degree_of_manoeuvrability(self) -> int:
        """Sum of the two [-]: what driver and steering together control."""
        return self.degree_of_mobility + self.degree_of_steerability


def null_space(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis (3, k) of the twists that a constraint matrix (m, 3) leaves free."""
    if not len(matrix):
        return np.eye(3)
    _, values, vt = np.linalg.svd(matrix)
    rank = int(np.sum(values > RANK_TOLERANCE * max(1.0, values.max(initial=0.0))))
    return vt[rank:].T


def degree_of_mobility(fixed_rows: NDArray[np.float64], steered_positions: NDArray[np.float64]) -> Mobility:
    """Degrees of a base from its tyres.

    The steered wheels must agree on a common centre of rotation, so they are turned to a generic twist that the fixed
    tyres allow, and the rank is taken there.

    Args:
        fixed_rows: Sideways rows (m, 3) of the fixed tyres, yaw scaled by a length.
        steered_positions: Positions (k, 2) of the steered tyres, over the same length [-].

    Source: Campion, Bastin, d'Andrea-Novel (1996), equations 16 to 20.
    """
    free = null_space(fixed_rows)
    fixed_rank = 3 - free.shape[1]
    if not len(steered_positions) or not free.shape[1]:
        return Mobility(degree_of_mobility=free.shape[1], degree_of_steerability=0)
    # Irrational weights: a twist with no accidental symmetry with the wheels' places.
    twist = free @ np.sqrt([2.0, 3.0, 5.0])[: free.shape[1]]
    x, y = steered_positions.T
    along, left = twist[0] - twist[2] * y, twist[1] + twist[2] * x
    rows = np.stack([-left, along, x * along + y * left], axis=-1)
    # A wheel at the only possible centre of rotation stands still and restricts nothing.
    speed = np.hypot(along, left)
    rows = rows[speed > RANK_TOLERANCE] / speed[speed > RANK_TOLERANCE, np.newaxis]
    both = np.vstack([fixed_rows, rows])
    rank = 3 - null_space(both).shape[1]
    return Mobility(degree_of_mobility=3 - rank, degree_of_steerability=rank - fixed_rank)
