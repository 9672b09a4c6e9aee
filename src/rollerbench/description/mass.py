"""How the mass of a robot's parts is spread."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description.body import Body
from rollerbench.description.inertia import (
    RigidInertia,
    at_origin,
    barrel_volume,
    combined,
    solid_barrel,
    solid_box,
    solid_cylinder,
)
from rollerbench.description.wheels import FORK_MASS_FRACTION, RollerWheel, Wheel


def body_inertia(body: Body) -> RigidInertia:
    """Mass distribution of the chassis in B."""
    box = solid_box(body.mass, body.size) if body.inertia is None else at_origin(body.mass, body.inertia)
    return box.moved(np.eye(3), np.array(body.center_of_mass))


def fork_inertia(wheel: Wheel) -> RigidInertia:
    """Mass distribution of the fork of a castor or steered wheel in its frame: a box over the wheel."""
    size = (wheel.swivel_offset + 0.5 * wheel.radius, 1.2 * wheel.width, wheel.radius)
    return solid_box(FORK_MASS_FRACTION * wheel.mass, size)


def roller_mass(wheel: RollerWheel) -> float:
    """Mass of one roller [kg]; if robot.yaml leaves it open, hub and rollers share one density."""
    if wheel.rollers.mass is not None:
        return wheel.rollers.mass
    ring = wheel.ring
    barrel = barrel_volume(ring.semi_axis, ring.roller_radius, ring.half_length)
    hub = np.pi * hub_radius(wheel) ** 2 * wheel.width
    return float(wheel.mass * barrel / (hub + ring.count * barrel))


def roller_inertia(wheel: RollerWheel) -> RigidInertia:
    """Mass distribution of one roller in its frame, x along its axis."""
    ring = wheel.ring
    return solid_barrel(roller_mass(wheel), ring.semi_axis, ring.roller_radius, ring.half_length)


def hub_radius(wheel: Wheel) -> float:
    """Radius of the hub [m]: the whole tyre, or what the rollers leave free."""
    return wheel.radius - 2 * wheel.rollers.radius if isinstance(wheel, RollerWheel) else wheel.radius


def hub_inertia(wheel: Wheel) -> RigidInertia:
    """Mass distribution of the hub in H: the wheel without rollers and fork."""
    mass = wheel.mass
    if isinstance(wheel, RollerWheel):
        mass -= wheel.rollers.count * roller_mass(wheel)
    if wheel.swivels:
        mass -= FORK_MASS_FRACTION * wheel.mass
    return solid_cylinder(mass, hub_radius(wheel), wheel.width)


def hub_with_rollers(wheel: Wheel, rollers: Iterable[int]) -> RigidInertia:
    """Mass distribution in H of the hub with some of its rollers, by index.

    Rollers turn freely about their axes u, so they resist no turn about it: I_roller - I_axial u u^T.
    """
    if not isinstance(wheel, RollerWheel):
        return hub_inertia(wheel)
    roller, poses = roller_inertia(wheel), roller_poses_H(wheel)
    across = roller.moment - np.diag([roller.moment[0, 0], 0.0, 0.0])
    free = RigidInertia(mass=roller.mass, com=roller.com, moment=across)
    return combined([hub_inertia(wheel), *(free.moved(*poses[index]) for index in rollers)])


def axle_inertia(wheel: Wheel) -> float:
    """Rotational inertia of a wheel about its axle, with rollers that turn freely [kg m2]."""
    count = wheel.rollers.count if isinstance(wheel, RollerWheel) else 0
    return float(hub_with_rollers(wheel, range(count)).moment[1, 1])


def roller_poses_H(wheel: RollerWheel) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Rotation (3, 3) and centre (3,) [m] of each roller in H; the roller's x axis is its axis of rotation."""
    ring = wheel.ring
    bottom = Rotation.from_euler("z", ring.roller_angle + 0.5 * np.pi)
    rotations = Rotation.from_rotvec(ring.angles[:, np.newaxis] * [0.0, 1.0, 0.0]) * bottom
    return list(zip(rotations.as_matrix(), ring.centers_H, strict=True))
