"""How the ground carries a base: the loads of its wheels at rest and under acceleration.

All wheels that touch the ground are equally stiff springs under a rigid body, as in the simulation. Their loads are
then N_i = n0 + n1 x_i + n2 y_i, the solution of smallest norm of the equilibrium

    sum N_i = m g,    sum N_i (p_i - c) = -m h a + (-H'_y, H'_x),

with the mass centre c at height h over the ground, the acceleration a, and the rate H' of the angular momentum that
the wheels and rollers take up as they spin up.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY

Array = NDArray[np.float64]

TOUCHING = 1e-6
"""A wheel that hangs less than this above the ground touches it [m]."""


def supporting_wheels(robot: Robot) -> NDArray[np.bool_]:
    """Which wheels (n_wheels,) carry the robot at rest; castors count where their swivel axis is.

    The ground is the plane under all contact points that holds the mass centre lowest. Of the wheels that touch it,
    springs would pull at some if the base overhangs: these carry nothing.
    """
    com, points = robot.inertia.com, robot.contact_points_B.copy()
    points[:, :2] = [wheel.p_BoHo_B[:2] for wheel in robot.wheels]
    plane = np.column_stack([np.ones(len(points)), points[:, :2] - com[:2]])
    found = linprog([-1.0, 0.0, 0.0], A_ub=plane, b_ub=points[:, 2], bounds=[(None, None)] * 3)
    # Without a plane (castors whose axes hold nothing) all wheels count.
    touching = points[:, 2] - plane @ found.x < TOUCHING if found.success else np.ones(len(points), dtype=bool)
    for _ in points:
        loads = np.zeros(len(points))
        loads[touching] = np.linalg.pinv(plane[touching].T) @ [robot.mass * GRAVITY, 0.0, 0.0]
        pulled = touching & (loads < -1e-9 * robot.mass * GRAVITY)
        if not pulled.any():
            break
        touching = touching & ~pulled
    return touching


def spring_loads(places: Array, touching: NDArray[np.bool_], total: Array, moments: Array) -> Array:
    """Loads (..., n_wheels) of equally stiff wheels.

    Args:
        places: Contact points (..., n_wheels, 2) from the mass centre [m].
        touching: Which wheels (n_wheels,) carry.
        total: Their sum (...) [N].
        moments: sum N_i places_i (..., 2) [N m].
    """
    shape = np.broadcast_shapes(places.shape[:-2], total.shape, moments.shape[:-1])
    ones = np.ones((*places.shape[:-1], 1))
    equations = np.swapaxes(np.concatenate([ones, places], axis=-1)[..., touching, :], -1, -2)
    wanted = np.concatenate([np.broadcast_to(total, shape)[..., np.newaxis], np.broadcast_to(moments, (*shape, 2))], -1)
    loads = np.zeros((*shape, len(touching)))
    loads[..., touching] = np.einsum("...ij,...j->...i", np.linalg.pinv(equations), wanted)
    return loads
