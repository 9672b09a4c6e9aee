"""The largest acceleration before a wheel slips, lifts off or runs out of effort."""

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.cone_program import Cones, maximize, slack
from rollerbench.kinematics.limits.contact_forces import Affine, ContactForces
from rollerbench.kinematics.limits.efforts import constant_loads, least_norm
from rollerbench.kinematics.limits.force_limits import friction_coefficients, limit_cones
from rollerbench.kinematics.limits.result import Limit, finite_number, unit_vectors
from rollerbench.kinematics.rows import wheeled

Array = NDArray[np.float64]

LIFTED = 0.025
"""A wheel at its limit with less load than this part of an even share of the weight has lost it [-]."""

AT_LIMIT = 1e-6
"""How close to its limit a wheel counts as being at it, over its share of the weight or over its max_effort [-]."""

OPEN = 1e-9
"""Singular values and residuals below this count as zero, of equations scaled to 1."""


def max_acceleration(
    robot: Robot | str | Path,
    direction: ArrayLike,
    *,
    roll_resistance: float = 0.0,
    adhesion: Literal["circle", "independent"] = "circle",
    sharing: Literal["best", "least_norm"] = "best",
    ground_friction: float | None = None,
    loads: ArrayLike | None = None,
) -> Limit:
    """Largest acceleration along each direction, from rest or while travelling that way, before any wheel slips.

    The largest a for which contact forces exist that move the base without turning it (the equations are in
    `contact_forces`), with |f_i| <= mu_i N_i at each wheel and |T_i| <= max_effort at each driven one: a second-order
    cone program, as loads and efforts are affine in accelerations and forces.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        direction: Directions of travel (...) [rad] from body x, counter-clockwise.
        roll_resistance: Resisting force of a rolling wheel or roller over its load [-].
        adhesion: "circle" bounds the size of a wheel's force, "independent" its parts along and across the roller's
            axis (for a tyre the heading), each by mu N.
        sharing: How wheels share a push that several ways make: "best" for the largest acceleration, or "least_norm"
            as `wheel_efforts`.
        ground_friction: Coefficient of friction of the ground, which combines with a wheel's to 2ab/(a + b); None for
            each wheel's own.
        loads: Loads (n_wheels,) [N] that stay constant, instead of those of equilibrium under the acceleration.

    Returns:
        Accelerations (...) [m/s2]; causes "adhesion", "effort", "lift-off". Where there is none, NaN: "tyres" and
        "drive" forbid the direction, the others keep the base from rolling at all.

    Raises:
        KinematicsError: an argument is malformed.
    """
    robot = wheeled(robot)
    shape, u = unit_vectors(direction)
    _accept("adhesion", adhesion, ("circle", "independent"))
    _accept("sharing", sharing, ("best", "least_norm"))
    friction = friction_coefficients(robot, ground_friction)
    resistance = finite_number("roll_resistance", roll_resistance, smallest=0.0)
    model = ContactForces(robot, u, resistance, constant_loads(robot, loads))
    x, able = _in_balance(model) if sharing == "best" else _least_norm(model)
    # The acceleration must be free: a base without drive may be in balance with what slows it down.
    chosen = able & ~model.skids.any(axis=1) & (np.linalg.norm(x.slope[:, 0], axis=1) > OPEN * GRAVITY)
    cones, owners, kinds = limit_cones(model, friction, adhesion)
    value, cause, at_limit = _solve(
        Affine(constant=x.constant[chosen], slope=x.slope[chosen]),
        Cones(constant=cones.constant[chosen], slope=cones.slope[chosen]),
        # Given loads are not lost.
        np.where((kinds == "adhesion") & (loads is None), friction[owners], 0.0),
    )
    values, causes = np.full(len(u), np.nan), np.full(len(u), "drive", dtype="<U9")
    at_limits = model.skids.copy()
    values[chosen] = value
    causes[chosen] = np.where(cause < 0, "lift-off", kinds[cause])
    causes[at_limits.any(axis=1)] = "tyres"
    for wheel in range(len(robot.wheels)):
        at_limits[chosen, wheel] = at_limit[:, owners == wheel].any(axis=1)
    return Limit(
        value=values.reshape(shape),
        cause=causes.reshape(shape),
        at_limit=at_limits.reshape(*shape, len(robot.wheels)),
        wheel_names=robot.wheel_names,
    )


def _solve(x: Affine, cones: Cones, friction: Array) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_]]:
    """Largest x_0 (p,) of the x(z) in the cones; which (p,) of these sets it, -1 for lost load; which (p, m) are tight.

    Where there is none: NaN, and the cones that are violated most. The cones (m,) of loads that may be lost carry these
    times their friction, the others 0.
    """
    reduced = Cones(constant=cones.at(x.constant), slope=np.einsum("pmix,pxk->pmik", cones.slope, x.slope))
    z, feasible = maximize(x.slope[:, 0] / GRAVITY, reduced)
    w = reduced.at(z)
    rest = slack(w)
    least = rest.min(axis=1, initial=1.0, keepdims=True)
    tight = rest <= np.maximum(least, np.where(feasible, 0.0, -np.inf)[:, np.newaxis]) + AT_LIMIT
    best = x.constant[:, 0] + np.einsum("pk,pk->p", x.slope[:, 0], z)
    lost = (tight & (w[..., 0] < LIFTED * friction)).any(axis=1)
    return np.where(feasible & (best >= 0.0), best, np.nan), np.where(lost, -1, np.argmin(rest, axis=1)), tight


def _in_balance(model: ContactForces) -> tuple[Affine, NDArray[np.bool_]]:
    """All unknowns x = constant + slope @ z (d, n_x) in balance, z without unit and of about 1; and whether any are."""
    weight = model.robot.mass * GRAVITY
    arm = float(np.max(np.abs(model.places)))
    rows = 1.0 / (weight * np.array([1.0, 1.0, arm]))
    units = np.array([GRAVITY, *[weight] * (model.size - 1)])
    matrix = model.balance.slope * rows[:, np.newaxis] * units
    wanted = -model.balance.constant * rows
    u, values, vt = np.linalg.svd(matrix)
    values = np.pad(values, ((0, 0), (0, model.size - values.shape[1])))
    inside = values > OPEN
    inverse = np.where(inside, 1.0 / np.where(inside, values, 1.0), 0.0)[:, : u.shape[1]]
    y = np.einsum("drx,dr,dkr,dk->dx", vt[:, : u.shape[1]], inverse, u[:, :, : inverse.shape[1]], wanted)
    able = np.max(np.abs(np.einsum("dkx,dx->dk", matrix, y) - wanted), axis=1) < OPEN
    # The free directions; those of other ranks are filled up with none.
    free = np.swapaxes(np.where(inside[..., np.newaxis], 0.0, vt), 1, 2)
    return Affine(constant=units * y, slope=units[:, np.newaxis] * free[..., inside.sum(axis=1).min(initial=3) :]), able


def _least_norm(model: ContactForces) -> tuple[Affine, NDArray[np.bool_]]:
    """As `_in_balance`, with the efforts of least norm at each acceleration."""
    x, able = least_norm(model)
    return Affine(constant=x.constant, slope=x.slope * GRAVITY), able


def _accept(name: str, value: str, accepted: tuple[str, ...]) -> None:
    if value not in accepted:
        raise KinematicsError(f"{name} = {value!r}: accepted: {', '.join(accepted)}")
