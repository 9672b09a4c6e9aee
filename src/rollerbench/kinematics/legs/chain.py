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
    return geometric_jacobian(chain_frames(rows, q))


def geometric_jacobian(frames: Array) -> Array:
    """Geometric Jacobians (..., 6, n) at the ends of chains, rows [angular; linear], from frames (..., n + 1, 4, 4)."""
    axes, joints = frames[..., :-1, :3, 2], frames[..., :-1, :3, 3]
    moving = cross(axes, frames[..., -1:, :3, 3] - joints)
    return np.concatenate([axes, moving], axis=-1).swapaxes(-1, -2)


def cross(a: Array, b: Array) -> Array:
    """Cross product over the last axis; numpy's own is slower on small arrays."""
    ax, ay, az, bx, by, bz = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    x = ay * bz - az * by
    product = np.empty((*x.shape, 3))
    product[..., 0], product[..., 1], product[..., 2] = x, az * bx - ax * bz, ax * by - ay * bx
    return product
