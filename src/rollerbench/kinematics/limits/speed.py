"""The largest speed before a driven wheel turns faster than it may."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import Limit, finite, unit_vectors
from rollerbench.kinematics.rows import wheel_rows, wheeled

Array = NDArray[np.float64]

NOTHING = 1e-9
"""A wheel's or tyre's speed that counts as none, over that of the body [-]."""

AT_LIMIT = 1e-9
"""How close to its limit a wheel counts as being at it [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedRows:
    """What twists mean for wheels: |rows @ v| <= speeds, |v at a steered wheel| <= its speed, tyre_rows @ v = 0.

    Attributes:
        driven: Indices (k,) of the driven wheels with a max_speed that do not steer.
        rows: Surface speeds (k, 3) [m/s] of these per twist.
        speeds: Their largest surface speeds (k,) [m/s].
        steered: Indices (s,) of the driven wheels with a max_speed that steer.
        places: Positions (s, 2) of these [m].
        steered_speeds: Their largest surface speeds (s,) [m/s].
        tyres: Indices (m,) of the fixed tyres.
        tyre_rows: Sideways speeds (m, 3) of these per twist.
    """

    driven: NDArray[np.intp]
    rows: Array
    speeds: Array
    steered: NDArray[np.intp]
    places: Array
    steered_speeds: Array
    tyres: NDArray[np.intp]
    tyre_rows: Array

    @property
    def length(self) -> float:
        """Largest distance of a wheel from Bo [m], by which yaw rates compare with speeds; 1 at least."""
        arms = [np.abs(self.rows[:, 2]), np.abs(self.tyre_rows[:, 2]), np.linalg.norm(self.places, axis=1), [1.0]]
        return float(np.max(np.concatenate(arms)))


def speed_rows(robot: Robot) -> SpeedRows:
    """The rows of a robot's wheels that limit its twists."""
    wheels = robot.wheels
    positions = np.array([wheel.p_BoHo_B[:2] for wheel in wheels])
    along, left = wheel_rows(robot, positions, np.zeros(len(wheels)))
    limited = [i for i, wheel in enumerate(wheels) if wheel.driven and wheel.max_speed is not None]
    driven = np.array([i for i in limited if not wheels[i].steered], dtype=np.intp)
    steered = np.array([i for i in limited if wheels[i].steered], dtype=np.intp)
    tyres = np.array([i for i, w in enumerate(wheels) if w.ring is None and not w.swivels], dtype=np.intp)
    slope = np.array([wheel.roller_slope for wheel in wheels])[:, np.newaxis]
    surface = np.array([wheel.radius * (wheel.max_speed or 0.0) for wheel in wheels])
    return SpeedRows(
        driven=driven,
        rows=(along + slope * left)[driven],
        speeds=surface[driven],
        steered=steered,
        places=positions[steered],
        steered_speeds=surface[steered],
        tyres=tyres,
        tyre_rows=left[tyres],
    )


def max_speed(
    robot: Robot | str | Path, direction: ArrayLike, *, yaw_rate: ArrayLike = 0.0, curvature: ArrayLike = 0.0
) -> Limit:
    """Largest speed of Bo in each direction, such that no driven wheel exceeds its max_speed and no tyre skids.

    With u the unit vector of the direction, the twist is [s u_x, s u_y, yaw_rate + curvature s]; the answer is the
    largest s >= 0 with |J v| <= max_speed and C v = 0. At curvature 0 and yaw rate 0: s = min over the wheels of
    max_speed / |J u|.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        direction: Directions of travel (...) [rad] from body x, counter-clockwise.
        yaw_rate: Yaw rates (...) that the robot has besides [rad/s].
        curvature: Yaw rates per speed (...) [1/m]: the centre of rotation lies 1/curvature to the left of the travel.
            All three broadcast.

    Returns:
        Speeds (...) [m/s]; causes "speed" or, with a yaw rate, "tyres" where they allow one speed alone. Where there is
        none, NaN: "tyres" (forbidden), "speed" (the yaw rate alone is too much), "unlimited".

    Raises:
        KinematicsError: an argument is not finite, or they do not broadcast, or both yaw_rate and curvature are given.
    """
    robot = wheeled(robot)
    turns = finite("yaw_rate", yaw_rate), finite("curvature", curvature)
    if turns[0].any() and turns[1].any():
        raise KinematicsError(f"yaw_rate = {yaw_rate!r}, curvature = {curvature!r}: accepted: one of them")
    try:
        angle, yaw_rates, curvatures = np.broadcast_arrays(finite("direction", direction), *turns)
    except ValueError as error:
        raise KinematicsError(f"direction, yaw_rate and curvature: {error}") from error
    shape, u = unit_vectors(angle)
    return _largest(robot, shape, np.column_stack([u, curvatures.ravel()]), yaw_rates.ravel())


def max_yaw_rate(robot: Robot | str | Path, p_BoICR_B: ArrayLike = (0.0, 0.0)) -> Limit:
    """Largest yaw rate about each centre of rotation; the same in both senses.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        p_BoICR_B: Centres of rotation (..., 2) from Bo, in B [m].

    Returns:
        Yaw rates (...) [rad/s], with cause "speed"; where there is none, NaN: "tyres", "unlimited".

    Raises:
        KinematicsError: p_BoICR_B is not finite or not of shape (..., 2).
    """
    robot = wheeled(robot)
    centers = finite("p_BoICR_B", p_BoICR_B)
    if centers.ndim == 0 or centers.shape[-1] != 2:
        raise KinematicsError(f"p_BoICR_B has shape {centers.shape}: accepted: (..., 2)")
    x, y = centers.reshape(-1, 2).T
    return _largest(robot, centers.shape[:-1], np.column_stack([y, -x, np.ones_like(x)]), np.zeros_like(x))


def _largest(robot: Robot, shape: tuple[int, ...], per_s: Array, yaw_rate: Array) -> Limit:
    """Largest s >= 0 at which the twists s per_s (n, 3) + [0, 0, yaw_rate (n,)] are allowed."""
    rows = speed_rows(robot)
    size = np.linalg.norm(per_s * [1.0, 1.0, rows.length], axis=1)[:, np.newaxis]
    parts = [_driven(rows, per_s, yaw_rate, size), _steered(rows, per_s, yaw_rate, size)]
    parts.append(_tyres(rows, per_s, yaw_rate, size))
    low, high = (np.concatenate(bounds, axis=1) for bounds in zip(*parts, strict=True))
    is_tyre = np.arange(low.shape[1]) >= len(rows.driven) + len(rows.steered)

    need, value = np.max(low, axis=1, initial=0.0), np.min(high, axis=1, initial=np.inf)
    allowed = need <= value * (1 + AT_LIMIT)
    tight = (high <= value[:, np.newaxis] * (1 + AT_LIMIT)) & np.isfinite(high)
    clash = low >= need[:, np.newaxis] * (1 - AT_LIMIT)
    at = np.where(np.isinf(need)[:, np.newaxis], np.isinf(low) & (low > 0), tight | (clash & ~allowed[:, np.newaxis]))
    tyres_alone = (at & is_tyre).any(axis=1) & (np.isinf(need) | ~(at & ~is_tyre).any(axis=1))
    cause = np.where(tyres_alone, "tyres", np.where(np.isinf(value) & allowed, "unlimited", "speed"))
    at_limit = np.zeros((len(per_s), len(robot.wheels)), dtype=bool)
    columns = np.concatenate([rows.driven, rows.steered, rows.tyres])
    for wheel in range(len(robot.wheels)):
        at_limit[:, wheel] = at[:, columns == wheel].any(axis=1)
    return Limit(
        value=np.where(allowed & np.isfinite(value), value, np.nan).reshape(shape),
        cause=cause.reshape(shape),
        at_limit=at_limit.reshape(*shape, len(robot.wheels)),
        wheel_names=robot.wheel_names,
    )


# Smallest and largest s (n, columns) that each wheel allows; an empty interval is (inf, inf).


def _driven(rows: SpeedRows, per_s: Array, yaw_rate: Array, size: Array) -> tuple[Array, Array]:
    per, fixed = per_s @ rows.rows.T, np.outer(yaw_rate, rows.rows[:, 2])
    still, over = np.abs(per) <= NOTHING * size, np.abs(fixed) > rows.speeds
    pace, shift = np.where(still, 1.0, np.abs(per)), np.sign(per) * fixed
    low = np.where(still, np.where(over, np.inf, -np.inf), (-rows.speeds - shift) / pace)
    return low, np.where(still, np.inf, (rows.speeds - shift) / pace)


def _steered(rows: SpeedRows, per_s: Array, yaw_rate: Array, size: Array) -> tuple[Array, Array]:
    """|s p + r| <= c, with p the velocity per s at the wheel's place and r that by the yaw rate."""
    turn = np.column_stack([-rows.places[:, 1], rows.places[:, 0]])
    p, r = per_s[:, np.newaxis, :2] + per_s[:, np.newaxis, 2:] * turn, yaw_rate[:, np.newaxis, np.newaxis] * turn
    a, b = np.sum(p**2, axis=-1), np.sum(p * r, axis=-1)
    c = np.sum(r**2, axis=-1) - rows.steered_speeds**2
    still = np.sqrt(a) <= NOTHING * size
    a = np.where(still, 1.0, a)
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    empty = np.where(still, c > 0, b**2 < a * c)
    low = np.where(empty, np.inf, np.where(still, -np.inf, (-b - root) / a))
    return low, np.where(empty | still, np.inf, (-b + root) / a)


def _tyres(rows: SpeedRows, per_s: Array, yaw_rate: Array, size: Array) -> tuple[Array, Array]:
    """A tyre allows every s, or the only one at which it does not skid, or none."""
    per, fixed = per_s @ rows.tyre_rows.T, np.outer(yaw_rate, rows.tyre_rows[:, 2])
    free = np.abs(per) <= NOTHING * size
    skids = np.abs(fixed) > NOTHING * np.abs(yaw_rate)[:, np.newaxis] * rows.length
    only = -fixed / np.where(free, 1.0, per)
    only = np.where(only < 0, np.inf, only)
    # By rounding, two tyres may allow one and the same speed.
    low = np.where(free, np.where(skids, np.inf, -np.inf), np.where(only > 0, only * (1 - AT_LIMIT), np.inf))
    return low, np.where(free, np.inf, np.where(only > 0, only, np.inf))
