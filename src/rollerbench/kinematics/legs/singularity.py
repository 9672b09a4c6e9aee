"""Poses of a leg in which its foot loses a direction of motion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs.song import SongLeg

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Singularity:
    """How near leg poses are to singular ones, in which the foot loses a direction of motion.

    The last three are None of legs that are not built like that of Song et al.

    Attributes:
        smallest_singular_value: Of the foot's velocity Jacobian of all joints (...) [m].
        determinant: |det| of that of the first three joints (...) [m3], |r| l2 D |sin(th3 + beta)|.
        hip_distance: |r| (...) [m]: how far the foot is ahead of the hip's axis in the plane of the thigh; at 0 joint 1
            moves it only along that plane.
        knee_distance: How far (...) [m] the foot is, seen from the hip, from where the knee is outstretched or folded.
    """

    smallest_singular_value: Array
    determinant: Array | None
    hip_distance: Array | None
    knee_distance: Array | None

    @property
    def cause(self) -> NDArray[np.str_] | None:
        """The nearer of the two singular poses (...), "hip" or "knee"; None of legs of another kind."""
        if self.hip_distance is None or self.knee_distance is None:
            return None
        return np.where(self.hip_distance < self.knee_distance, "hip", "knee")


def singularity(song: SongLeg | None, jacobian: Array, q: Array) -> Singularity:
    """How near a leg with a Jacobian (..., 6, n) at joint angles (..., n) is to a singular pose."""
    values = np.linalg.svd(jacobian[..., 3:, :], compute_uv=False)
    smallest = np.asarray(values[..., -1], dtype=np.float64)
    if song is None:
        return Singularity(smallest_singular_value=smallest, determinant=None, hip_distance=None, knee_distance=None)
    r, _, h = song.coordinates(q)
    shank, lead = song.shank(q[..., 3])
    span = np.hypot(r, h)
    return Singularity(
        smallest_singular_value=smallest,
        determinant=np.abs(r * song.thigh * shank * np.sin(q[..., 2] + lead)),
        hip_distance=np.abs(r),
        knee_distance=np.minimum(np.abs(song.thigh + shank - span), np.abs(span - np.abs(song.thigh - shank))),
    )
