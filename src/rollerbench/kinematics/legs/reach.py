"""How far a foot is from what a leg reaches: distances from solids of revolution, in the section through the foot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TOLERANCE = 1e-12
"""A foot that is out of reach by this share of the size of the section is within."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Section:
    """Half of a section through the axis of a solid: the points within one circle, outside another, and between edges.

    With u >= least_u the distance from the axis and v along it: (u - center)^2 + v^2 <= outer^2,
    (u - hole_center)^2 + v^2 >= hole^2 and |v| <= most_v. All arrays broadcast.

    Attributes:
        center: Distance of the circle's centre from the axis [m].
        outer: Its radius [m].
        hole_center: Distance of the hole's centre from the axis [m].
        hole: Its radius [m].
        least_u: Least distance from the axis [m].
        most_v: Largest height [m].
    """

    center: Array | float
    outer: Array | float
    hole_center: Array | float
    hole: Array | float
    least_u: Array | float = 0.0
    most_v: Array | float = np.inf

    def excess(self, u: Array, v: Array) -> Array:
        """Distance (...) [m] of points from the solid, 0 within."""
        u, v = np.broadcast_arrays(u, np.abs(v))
        size = np.max(np.abs(self.center)) + np.max(np.abs(self.outer))
        tolerance = TOLERANCE * float(size)
        out = ~self._holds(u, v, tolerance)
        if not out.any():
            return np.zeros(u.shape)
        # The nearest point is on an edge, straight across from the foot, or in a corner.
        with np.errstate(invalid="ignore"):
            near_u, near_v = (np.stack(np.broadcast_arrays(*axis), axis=-1) for axis in self._candidates(u, v))
            spread = Section(
                **{name: np.asarray(getattr(self, name))[..., np.newaxis] for name in self.__dataclass_fields__}
            )
            holds = spread._holds(near_u, near_v, 1e3 * tolerance)
            apart = np.hypot(near_u - u[..., np.newaxis], near_v - v[..., np.newaxis])
        distance = np.min(np.where(holds, apart, np.inf), axis=-1)
        return np.where(out & (distance > tolerance), distance, 0.0)

    def _holds(self, u: Array, v: Array, tolerance: float) -> NDArray[np.bool_]:
        within = np.hypot(u - self.center, v) <= np.asarray(self.outer) + tolerance
        beyond = np.hypot(u - self.hole_center, v) >= np.asarray(self.hole) - tolerance
        edges = (u >= np.asarray(self.least_u) - tolerance) & (v <= np.asarray(self.most_v) + tolerance)
        return np.asarray(within & beyond & edges)

    def _candidates(self, u: Array, v: Array) -> tuple[list[Array], list[Array]]:
        """Coordinates of what may be the nearest point: of each edge, and of each corner."""
        least, most = np.asarray(self.least_u, dtype=np.float64), np.asarray(self.most_v, dtype=np.float64)
        across, along = np.maximum(u, least), np.minimum(v, most)
        us, vs = [across, across, least], [along, v, along]
        for center, radius in ((self.center, self.outer), (self.hole_center, self.hole)):
            c, r = np.asarray(center, dtype=np.float64), np.asarray(radius, dtype=np.float64)
            away = np.hypot(u - c, v)
            nonzero = np.where(away == 0, 1.0, away)
            direction_u = np.where(away == 0, 1.0, (u - c) / nonzero)
            half_chord, edge_height = np.sqrt(r**2 - most**2), np.sqrt(r**2 - (least - c) ** 2)
            us += [c + r * direction_u, c + half_chord, c - half_chord, least]
            vs += [r * v / nonzero, most, most, edge_height]
        return us, vs
