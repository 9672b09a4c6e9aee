"""The limits of wheels as cones over the unknowns of the equations of motion."""

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.kinematics.limits.cone_program import Cones
from rollerbench.kinematics.limits.contact_forces import ContactForces
from rollerbench.kinematics.limits.result import finite_number

Array = NDArray[np.float64]


def limit_cones(
    model: ContactForces, friction: Array, adhesion: str, share: float = 1.0
) -> tuple[Cones, NDArray[np.intp], NDArray[np.str_]]:
    """Cones over the model's unknowns x that hold where wheels stay within their limits, scaled to about 1.

    Args:
        model: The equations of motion.
        friction: Coefficients of friction (n_wheels,) [-].
        adhesion: "circle" or "independent", as in `max_acceleration`.
        share: Share of the limits that may be used [-].

    Returns:
        The cones; which wheel (m,) each is of; its kind (m,), "adhesion" or "effort".
    """
    robot, count = model.robot, len(model.u)
    even = robot.mass * GRAVITY / len(robot.wheels)
    constant, slope, owners, kinds = [], [], [], []
    for wheel in np.flatnonzero(model.carrying).tolist():
        bound = share * friction[wheel] * model.loads.constant[:, wheel] / even
        bound_slope = share * friction[wheel] * model.loads.slope[:, wheel] / even
        for axes in ((0, 1),) if adhesion == "circle" else ((0,), (1,)):
            w, w_slope = np.zeros((count, 3)), np.zeros((count, 3, model.size))
            w[:, 0], w_slope[:, 0] = bound, bound_slope
            for axis in axes:
                w[:, 1 + axis] = model.forces.constant[:, wheel, axis] / even
                w_slope[:, 1 + axis] = model.forces.slope[:, wheel, axis] / even
            constant.append(w)
            slope.append(w_slope)
            owners.append(wheel)
            kinds.append("adhesion")
    driven = [i for i, wheel in enumerate(robot.wheels) if wheel.driven]
    for row, driver in enumerate(driven):
        largest = robot.wheels[driver].max_effort
        if largest is not None:
            w, w_slope = np.zeros((count, 3)), np.zeros((count, 3, model.size))
            w[:, 0] = share
            w[:, 1] = model.efforts.constant[:, row] / largest
            w_slope[:, 1] = model.efforts.slope[:, row] / largest
            constant.append(w)
            slope.append(w_slope)
            owners.append(driver)
            kinds.append("effort")
    cones = Cones(constant=np.stack(constant, axis=1), slope=np.stack(slope, axis=1))
    return cones, np.array(owners, dtype=np.intp), np.array(kinds, dtype="<U9")


def with_rates(
    model: ContactForces, largest: float, cones: Cones, kinds: NDArray[np.str_]
) -> tuple[Cones, NDArray[np.str_]]:
    """The cones, and those of the rates of the driven wheels' speeds."""
    driven = [i for i, wheel in enumerate(model.robot.wheels) if wheel.driven]
    radius = np.array([model.robot.wheels[i].radius for i in driven])
    constant = np.zeros((len(model.u), len(driven), 3))
    constant[..., 0] = 1.0
    slope = np.zeros((*constant.shape, model.size))
    slope[..., 1, : model.accelerations] = model.surface_rates[:, driven] / (radius * largest)[:, np.newaxis]
    rates = Cones(constant=constant, slope=slope)
    return joined(cones, rates), np.array([*kinds, *["wheel_acceleration"] * len(driven)])


def joined(one: Cones, other: Cones) -> Cones:
    """The cones of both."""
    return Cones(
        constant=np.concatenate([one.constant, other.constant], axis=1),
        slope=np.concatenate([one.slope, other.slope], axis=1),
    )


def friction_coefficients(robot: Robot, ground: float | None) -> Array:
    """Coefficients of friction (n_wheels,) [-] of the wheels on a ground of another; None for each wheel's own.

    Raises:
        KinematicsError: the ground's is no number of 0 or more.
    """
    own = np.array([wheel.friction for wheel in robot.wheels])
    if ground is None:
        return own
    ground = finite_number("ground_friction", ground, smallest=0.0)
    return 2.0 * own * ground / (own + ground)
