"""Position and Jacobian of a foot at the end of a chain of revolute joints."""

import numpy as np
from numpy.typing import NDArray

from rollerbench.description.legs import chain_frames

Array = NDArray[np.float64]


def position(rows: Array, q: Array) -> Array:
    """Foot p_LF (..., 3) [m] at joint angles (..., n), of Denavit-Hartenberg rows (n, 4)."""
    return np.asarray(chain_frames(rows, q)[..., -1, :3, 3])


def jacobian(rows: Array, q: Array) -> Array:
    """Geometric Jacobian (..., 6, n) of the foot in the leg's base: columns [z_i; z_i x (p_LF - o_i)].

    Args:
        rows: Denavit-Hartenberg rows (n, 4).
        q: Joint angles (..., n) [rad].
    """
    frames = chain_frames(rows, q)
    axes = frames[..., :-1, :3, 2]
    arms = frames[..., -1:, :3, 3] - frames[..., :-1, :3, 3]
    out = np.empty((*axes.shape[:-2], 6, axes.shape[-2]))
    out[..., :3, :] = np.swapaxes(axes, -1, -2)
    x, y, z = np.moveaxis(axes, -1, 0)
    u, v, w = np.moveaxis(arms, -1, 0)
    out[..., 3, :], out[..., 4, :], out[..., 5, :] = y * w - z * v, z * u - x * w, x * v - y * u
    return out
