"""Forces of feet that stand: the smallest that carry a load, within the cones of friction."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import finite, finite_number

Array = NDArray[np.float64]

EDGES = 16
"""Edges of the pyramid inside a cone of friction: at the most 1 - cos(pi/16), 2 %, of the friction is left unused."""

BALANCE = 1e5
"""Weight of the balance against the size of the forces; what it misses is then given back."""

MISSED = 1e-8
"""Share of the load that may be missing before the feet count as unable to carry it."""


def foot_forces(p_BF: ArrayLike, wrench: ArrayLike, friction: float, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """Forces on the feet with sum p_i x f_i = moment and sum f_i = force, and the least sum |f_i|^2.

    Where the least forces leave the cones of friction or pull, those nearest to them do not that lie within pyramids
    of 16 edges inside the cones: as the balance is kept, they are again the least.

    Args:
        p_BF: Feet (k, 3) from the centre of mass, in B [m].
        wrench: What the ground must give (6,) about the centre of mass in B, moment [N m] then force [N].
        friction: Coefficient of friction of the feet [-].
        up: Normal of the ground (3,), or of the ground under each foot (k, 3), in B.

    Returns:
        Forces (k, 3) of the ground on the feet in B [N].

    Raises:
        KinematicsError: the feet cannot give this wrench.
    """
    feet, load = finite("p_BF", p_BF), finite("wrench", wrench)
    if feet.ndim != 2 or feet.shape[1] != 3 or not len(feet):
        raise KinematicsError(f"p_BF of shape {feet.shape}: accepted: (k, 3), one foot or more")
    if load.shape != (6,):
        raise KinematicsError(f"wrench of shape {load.shape}: accepted: (6,)")
    friction = finite_number("friction", friction, smallest=0.0)
    normals = _normals(up, len(feet))
    balance = _balance(feet)
    # Moments weigh as forces do at the feet.
    arm = max(float(np.max(np.abs(feet))), 1e-6)
    balance[:3] /= arm
    scaled = load / [arm, arm, arm, 1.0, 1.0, 1.0]
    size = float(np.linalg.norm(scaled))
    inverse = np.asarray(np.linalg.pinv(balance, rcond=1e-10), dtype=np.float64)
    forces = (inverse @ scaled).reshape(-1, 3)
    missing = float(np.linalg.norm(balance @ forces.ravel() - scaled))
    if missing <= MISSED * size and _within(forces, normals, friction, 1e-12 * size):
        return forces
    return _within_pyramids(balance, scaled, inverse, normals, friction, size)


def _balance(feet: Array) -> Array:
    """The map (6, 3 k) from forces to their moment and sum."""
    matrix = np.zeros((6, len(feet), 3))
    x, y, z = feet.T
    matrix[0, :, 1], matrix[0, :, 2] = -z, y
    matrix[1, :, 0], matrix[1, :, 2] = z, -x
    matrix[2, :, 0], matrix[2, :, 1] = -y, x
    matrix[[3, 4, 5], :, [0, 1, 2]] = 1.0
    return matrix.reshape(6, -1)


def _normals(up: ArrayLike, count: int) -> Array:
    """Unit normals (k, 3) of the ground."""
    normals = finite("up", up)
    sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
    if normals.shape not in ((3,), (count, 3)) or np.min(sizes) == 0:
        raise KinematicsError(f"up = {up!r}: accepted: one vector (3,) or one for each foot, none 0")
    return np.broadcast_to(normals / sizes, (count, 3))


def _within(forces: Array, normals: Array, friction: float, tolerance: float) -> bool:
    """Whether all forces (k, 3) are in their cones of friction."""
    pushes = np.sum(forces * normals, axis=1)
    slides = np.linalg.norm(forces - pushes[:, np.newaxis] * normals, axis=1)
    return bool(np.all(slides <= friction * pushes + tolerance))


def _within_pyramids(
    balance: Array, load: Array, inverse: Array, normals: Array, friction: float, size: float
) -> Array:
    """The least forces (k, 3) that are sums of the pyramids' edges with shares of 0 or more."""
    count = len(normals)
    helpers = np.where(np.abs(normals[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(normals, helpers)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(normals, first)
    angles = 2 * np.pi / EDGES * np.arange(EDGES)
    edges = normals[:, np.newaxis] + friction * (
        np.cos(angles)[:, np.newaxis] * first[:, np.newaxis] + np.sin(angles)[:, np.newaxis] * second[:, np.newaxis]
    )
    generators = np.zeros((count, 3, count, EDGES))
    generators[np.arange(count), :, np.arange(count)] = np.swapaxes(edges, 1, 2)
    matrix = generators.reshape(3 * count, -1)
    system = np.vstack([BALANCE * balance @ matrix, matrix])
    shares, _ = nnls(system, np.concatenate([BALANCE * load / size, np.zeros(3 * count)]))
    forces = matrix @ shares * size
    missing = load - balance @ forces
    if np.linalg.norm(missing) > 1e3 / BALANCE**2 * size:
        raise KinematicsError(
            f"the {count} feet cannot give the wrench: within their friction of {friction:g} and without pulling they "
            f"miss {np.linalg.norm(missing[3:]):.3g} N and, over the feet's arm, {np.linalg.norm(missing[:3]):.3g} N; "
            "accepted: wrenches of feet around the centre of pressure, and of less sideways force"
        )
    return np.asarray((forces.ravel() + inverse @ missing).reshape(-1, 3))
