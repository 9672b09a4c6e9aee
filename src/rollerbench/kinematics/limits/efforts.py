"""The wheel efforts of an acceleration along a direction, and the loads of the wheels in it."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description import Robot
from rollerbench.errors import InfeasibleTwist, KinematicsError
from rollerbench.kinematics.limits.contact_forces import Affine, ContactForces
from rollerbench.kinematics.limits.result import CAUSES, finite, finite_number, unit_vectors
from rollerbench.kinematics.rows import wheeled

Array = NDArray[np.float64]

OPEN = 1e-9
"""Singular values and residuals below this count as zero, of equations scaled to 1."""


def wheel_efforts(
    robot: Robot | str | Path,
    direction: ArrayLike,
    acceleration: ArrayLike,
    *,
    roll_resistance: float = 0.0,
    loads: ArrayLike | None = None,
    strict: bool = True,
) -> Array:
    """Efforts of the driven wheels that accelerate the base along a direction, without turning it, if no wheel slips.

    Inverse dynamics of the equations in `contact_forces`. Where more wheels drive than motions are free, the efforts
    are those of least norm: T = (B^T J^T)^+ Q, with B the motions that the tyres allow and Q the generalised force.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        direction: Directions of travel (...) [rad] from body x, counter-clockwise; the base rolls or starts this way.
        acceleration: Accelerations (...) [m/s2] along them, 0 or more; both broadcast.
        roll_resistance: Resisting force of a rolling wheel or roller over its load [-].
        loads: Loads (n_wheels,) [N] that stay constant, instead of those of equilibrium under the acceleration.
        strict: Whether to raise where the base cannot accelerate that way; otherwise the efforts are NaN there.

    Returns:
        Efforts (..., n_driven) [N m], positive where they drive towards +x of the wheel's heading. They may be more
        than friction or max_effort allow: see `max_acceleration`.

    Raises:
        InfeasibleTwist: tyres forbid a direction (only if strict).
        KinematicsError: an argument is malformed, or (if strict) the driven wheels cannot push in a direction.
    """
    robot = wheeled(robot)
    shape, u = unit_vectors(direction)
    a = _accelerations(acceleration)
    resistance = finite_number("roll_resistance", roll_resistance, smallest=0.0)
    model = ContactForces(robot, u, resistance, constant_loads(robot, loads))
    x, able = least_norm(model)
    if strict:
        _require(model, able)
    constant = model.efforts.at(x.constant)
    slope = np.einsum("dnx,dx->dn", model.efforts.slope, x.slope[..., 0])
    bad = model.skids.any(axis=1) | ~able
    constant = np.where(bad[:, np.newaxis], np.nan, constant).reshape(*shape, -1)
    return constant + a[..., np.newaxis] * slope.reshape(*shape, -1)


def wheel_loads(robot: Robot | str | Path, direction: ArrayLike, acceleration: ArrayLike) -> Array:
    """Loads of the wheels (..., n_wheels) [N] in an acceleration (...) [m/s2] along directions (...) [rad].

    Wheels are equally stiff springs (see `loads`); a negative load means that the wheel has lifted off before.

    Raises:
        KinematicsError: an argument is malformed.
    """
    robot = wheeled(robot)
    shape, u = unit_vectors(direction)
    a = _accelerations(acceleration)
    loads = ContactForces(robot, u, 0.0, None).loads
    constant, slope = loads.constant.reshape(*shape, -1), loads.slope[..., 0].reshape(*shape, -1)
    return constant + a[..., np.newaxis] * slope


def least_norm(model: ContactForces) -> tuple[Affine, NDArray[np.bool_]]:
    """Unknowns x (d, n_x) by accelerations, with the efforts of least norm and then the side forces of least norm.

    Returns:
        x: Affine in the accelerations of the model.
        able: Whether (d,) the wheels can push that way.
    """
    mass = model.robot.mass
    arm = float(np.max(np.abs(model.places))) or 1.0
    # Forces in units of the weight, and moments by the farthest wheel: everything is about 1.
    scale = 1.0 / np.array([mass, mass, mass * arm])
    balance = Affine(constant=model.balance.constant * scale, slope=model.balance.slope * scale[:, np.newaxis])
    given = model.accelerations
    drive = [given + k for k, (_, axis) in enumerate(model.unknowns) if axis == 0]
    side = [given + k for k, (_, axis) in enumerate(model.unknowns) if axis == 1]
    names = [wheel.name for wheel in model.robot.driven_wheels]
    rows = [names.index(model.robot.wheels[i].name) for i, axis in model.unknowns if axis == 0]
    # Right-hand sides by 1 and the accelerations.
    wanted = -np.concatenate([balance.constant[..., np.newaxis], balance.slope[..., :given]], axis=-1)
    own = np.concatenate([model.efforts.constant[..., np.newaxis], model.efforts.slope[..., :given]], axis=-1)[:, rows]
    lever = model.efforts.slope[:, rows, drive] if drive else np.ones((len(model.u), 0))
    by_effort = balance.slope[..., drive] * mass / lever[:, np.newaxis]
    by_side = balance.slope[..., side] * mass
    side_inverse = np.linalg.pinv(by_side, rcond=OPEN)
    through = np.eye(3) - by_side @ side_inverse
    typical = float(np.max(np.abs(lever), initial=0.0)) or 1.0
    needed = through @ (wanted + by_effort @ own / mass)
    efforts = mass * typical * np.linalg.pinv(through @ by_effort * typical, rcond=OPEN) @ needed
    pushes = (efforts - own) / lever[..., np.newaxis]
    rest = wanted - by_effort @ ((efforts - own) / mass)
    sides = mass * side_inverse @ rest
    left = rest - by_side @ sides / mass
    x = np.zeros((len(model.u), model.size, 1 + given))
    x[:, range(given), range(1, 1 + given)] = 1.0
    x[:, drive], x[:, side] = pushes, sides
    able = np.max(np.abs(left), axis=(1, 2)) < OPEN * 10.0
    return Affine(constant=x[..., 0], slope=x[..., 1:]), able


def constant_loads(robot: Robot, loads: ArrayLike | None) -> Array | None:
    """The loads (n_wheels,) given instead of those of equilibrium.

    Raises:
        KinematicsError: they are no loads of this robot.
    """
    if loads is None:
        return None
    array = finite("loads", loads)
    if array.shape != (len(robot.wheels),) or (array < 0).any() or not (array > 0).any():
        raise KinematicsError(f"loads = {loads!r}: accepted: {len(robot.wheels)} loads [N], 0 or more, not all 0")
    return array


def _accelerations(acceleration: ArrayLike) -> Array:
    a = finite("acceleration", acceleration)
    if (a < 0).any():
        raise KinematicsError(f"acceleration = {np.min(a):g}: accepted: 0 or more, along the direction of travel")
    return a


def _require(model: ContactForces, able: NDArray[np.bool_]) -> None:
    skids = model.skids.any(axis=1)
    if skids.any():
        first = int(np.argmax(skids))
        names = [w.name for w, skid in zip(model.robot.wheels, model.skids[first], strict=True) if skid]
        angle = np.degrees(np.arctan2(*model.u[first, ::-1]))
        raise InfeasibleTwist(
            f"{model.robot.name} cannot travel at {angle:.6g} deg: {CAUSES['tyres']} ({', '.join(names)}); accepted: "
            "directions that its tyres allow, or strict=False for NaN there",
            tuple(names),
            tuple(float(speed) for speed in model.side_speeds[first, model.skids[first]]),
        )
    if not able.all():
        angle = np.degrees(np.arctan2(*model.u[int(np.argmin(able)), ::-1]))
        raise KinematicsError(f"{model.robot.name} cannot accelerate at {angle:.6g} deg: {CAUSES['drive']}")
