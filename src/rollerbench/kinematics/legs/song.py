"""Closed forms for the wheel-leg of Song et al.: a hip that turns, a thigh, a knee, and a tibia that turns on itself.

With phi = th2 + th3 the inclination of the tibia, and c, s cosines and sines:

    r = l2 c2 + d4 c_phi - l4 c4 s_phi,    w = l4 s4,    h = l2 s2 + d4 s_phi + l4 c4 c_phi,    p = Rz(th1) (r, w, h).

Four joints for three coordinates leave one to be settled; each way of it is a family of solutions.

Source: Song et al. (2012), Table 1.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHAPE = np.array(
    [[0, np.pi / 2, 0, 0], [np.nan, 0, 0, 0], [0, -np.pi / 2, 0, np.pi / 2], [np.nan, -np.pi / 2, np.nan, 0]]
)
"""Denavit-Hartenberg rows of such a leg; NaN where its lengths stand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SongLeg:
    """The three lengths of the leg, and its inverse kinematics.

    Attributes:
        thigh: l2 [m].
        tibia: d4 [m].
        foot: l4 [m], from the tibia's axis to the wheel's centre.
    """

    thigh: float
    tibia: float
    foot: float

    @classmethod
    def of(cls, rows: Array) -> Self | None:
        """The lengths in Denavit-Hartenberg rows (n, 4); None of another kind of leg."""
        if rows.shape != SHAPE.shape or not np.allclose(rows[~np.isnan(SHAPE)], SHAPE[~np.isnan(SHAPE)], atol=1e-9):
            return None
        thigh, foot, tibia = float(rows[1, 0]), float(rows[3, 0]), float(-rows[3, 2])
        return cls(thigh=thigh, tibia=tibia, foot=foot) if min(thigh, foot) > 0 and tibia >= 0 else None

    @property
    def length(self) -> float:
        """l2 + d4 + l4 [m]."""
        return self.thigh + self.tibia + self.foot

    def coordinates(self, q: Array) -> tuple[Array, Array, Array]:
        """The coordinates r, w, h (...) [m] of the foot in the frame that turns with joint 1, at angles (..., 4)."""
        inclination = q[..., 1] + q[..., 2]
        c, s, foot = np.cos(inclination), np.sin(inclination), self.foot * np.cos(q[..., 3])
        r = self.thigh * np.cos(q[..., 1]) + self.tibia * c - foot * s
        h = self.thigh * np.sin(q[..., 1]) + self.tibia * s + foot * c
        return r, self.foot * np.sin(q[..., 3]), h

    def shank(self, joint_4: Array) -> tuple[Array, Array]:
        """D = hypot(d4, l4 c4) [m] and beta = atan2(l4 c4, d4) [rad] of the triangle from the knee to the foot."""
        side = self.foot * np.cos(joint_4)
        return np.hypot(self.tibia, side), np.arctan2(side, self.tibia)

    def bend(self, r: Array, h: Array, joint_4: Array) -> tuple[Array, Array]:
        """Angles th2, th3 (..., 2) that put the foot at (r, h) (...), the knee bent to either side."""
        reach, lead = (value[..., np.newaxis] for value in self.shank(joint_4))
        r, h = r[..., np.newaxis], h[..., np.newaxis]
        product = 2 * self.thigh * reach
        cosine = (r**2 + h**2 - self.thigh**2 - reach**2) / np.where(product == 0, np.inf, product)
        knee = np.arccos(np.clip(cosine, -1.0, 1.0)) * np.array([1.0, -1.0])
        thigh = np.arctan2(h, r) - np.arctan2(reach * np.sin(knee), self.thigh + reach * np.cos(knee))
        return thigh, knee - lead


def turn(p: Array, r: Array, w: Array, near: Array) -> Array:
    """Joint 1 (..., k) that leads (r, w) (..., k) to p (..., 3); that of near where the foot is on the hip's axis."""
    angle = np.arctan2(p[..., 1], p[..., 0])[..., np.newaxis] - np.arctan2(w, r)
    on_axis = np.hypot(p[..., 0], p[..., 1]) == 0
    return np.where(on_axis[..., np.newaxis], near[..., :1], angle)


def stacked(*joints: Array) -> Array:
    """Angles (..., k, 4) from four arrays (..., k)."""
    return np.stack(np.broadcast_arrays(*joints), axis=-1)
