"""What the limits of wheels mean for body twists: convex sets, in which straight lines and means stay."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.given import positive_time
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]

PerWheel: TypeAlias = float | Mapping[str, float | None] | None
"""A limit of all driven wheels, or of some by name; None for no limit."""

MAX_SAMPLES = 500
"""Longest mean that limits the jerk."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TwistLimits:
    """Limits of the driven wheels on twists v that are held for one time step dt after the other.

        |A_i v| <= speeds_i,   |A_i (v_next - v)| <= speed_changes_i

    |A_i v| is the size of the wheel's speed. For a steered wheel it is that of its centre's velocity over its radius,
    whatever its angle; its speed changes by |A_i (v_next - v)| at the most.

    Attributes:
        wheel_names: Names of the driven wheels.
        maps: A (n_driven, 2, 3).
        speeds: (n_driven,) [rad/s]; infinite for no limit.
        speed_changes: Largest acceleration times dt (n_driven,) [rad/s]; infinite for no limit.
        samples: Over how many twists a mean must go so that it obeys the limits of jerk: 1 if there are none.
    """

    wheel_names: tuple[str, ...]
    maps: Array
    speeds: Array
    speed_changes: Array
    samples: int

    def wheel_speeds(self, v_xyw_B: ArrayLike) -> Array:
        """Sizes |A_i v| (..., n_driven) of the wheels' speeds at twists (..., 3) [rad/s]."""
        moved = np.einsum("wij,...j->...wi", self.maps, np.asarray(v_xyw_B, dtype=np.float64))
        return np.linalg.norm(moved, axis=-1)

    def scale(self, v_xyw_B: ArrayLike) -> Array:
        """Twists (..., 3) scaled down as far as the wheels' speeds need: v / max(1, max_i |A_i v| / speeds_i)."""
        return _scaled(np.asarray(v_xyw_B, dtype=np.float64), self.wheel_speeds(v_xyw_B) / self.speeds)

    def approach(self, v_xyw_B: ArrayLike, target: ArrayLike) -> Array:
        """Twists (..., 3) after a time step on the straight line to the target (..., 3), as far as they may change."""
        v = np.asarray(v_xyw_B, dtype=np.float64)
        change = np.asarray(target, dtype=np.float64) - v
        return v + _scaled(change, self.wheel_speeds(change) / self.speed_changes)


def twist_limits(
    kinematics: WheelKinematics,
    time_step: float,
    *,
    max_wheel_speed: PerWheel = None,
    max_wheel_acceleration: PerWheel = None,
    max_wheel_jerk: PerWheel = None,
) -> TwistLimits:
    """The limits of a robot's wheels on the twist of the kinematics' reference point.

    The mean of N twists changes by the mean of their N changes, and its change changes by a difference of two of these
    over N: by 2 a dt / N at the most. With N >= 2 a / (j dt) that is j dt^2.

    Args:
        kinematics: The wheels.
        time_step: For how long a twist is held [s].
        max_wheel_speed: Instead of the robot's max_speed [rad/s]; those not named keep it.
        max_wheel_acceleration: [rad/s2].
        max_wheel_jerk: [rad/s3]; only of wheels with a limit of acceleration.

    Raises:
        KinematicsError: an argument is malformed, or names a wheel that is not driven, or the mean would be longer than
            `MAX_SAMPLES`.

    Source: Biagiotti and Melchiorri (2012), FIR filters for online trajectory planning, for the mean as a filter.
    """
    positive_time("time_step", time_step)
    wheels = kinematics.robot.driven_wheels
    own = np.array([wheel.max_speed or math.inf for wheel in wheels])
    unlimited = np.full(len(wheels), math.inf)
    names = tuple(wheel.name for wheel in wheels)
    accelerations = _per_wheel("max_wheel_acceleration", max_wheel_acceleration, names, unlimited)
    jerks = _per_wheel("max_wheel_jerk", max_wheel_jerk, names, unlimited)
    maps = np.stack([kinematics.drive_matrix, np.zeros((len(wheels), 3))], axis=1)
    for index, wheel in enumerate(wheels):
        if wheel.steered:
            x, y = wheel.p_BoHo_B[:2] - kinematics.p_BoCo_B
            maps[index] = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]]) / wheel.radius
    return TwistLimits(
        wheel_names=names,
        maps=maps,
        speeds=_per_wheel("max_wheel_speed", max_wheel_speed, names, own),
        speed_changes=accelerations * time_step,
        samples=_samples(names, accelerations, jerks, time_step),
    )


def _scaled(v: Array, loads: Array) -> Array:
    return v / np.max(loads, axis=-1, initial=1.0)[..., np.newaxis]


def _per_wheel(argument: str, value: PerWheel, names: tuple[str, ...], default: Array) -> Array:
    """Limits (n_driven,), infinite for none; the default for wheels that are not named."""
    if value is None:
        return default
    given: Mapping[str, float | None] = value if isinstance(value, Mapping) else dict.fromkeys(names, value)
    limits = default.copy()
    for name, limit in given.items():
        where = f"{argument}[{name!r}]" if isinstance(value, Mapping) else argument
        if name not in names:
            raise KinematicsError(f"{where}: not a driven wheel; accepted: {', '.join(names) or 'none'}")
        if limit is None:
            limits[names.index(name)] = math.inf
            continue
        if isinstance(limit, bool) or not isinstance(limit, int | float | np.number) or not 0 < limit < math.inf:
            raise KinematicsError(f"{where} = {limit!r}: accepted: a positive number, or None for no limit")
        limits[names.index(name)] = limit
    return limits


def _samples(names: tuple[str, ...], accelerations: Array, jerks: Array, time_step: float) -> int:
    samples = 1
    for name, acceleration, jerk in zip(names, accelerations.tolist(), jerks.tolist(), strict=True):
        if math.isinf(jerk):
            continue
        if math.isinf(acceleration):
            raise KinematicsError(
                f"max_wheel_jerk of {name} = {jerk:g}, but it has no max_wheel_acceleration; accepted: both"
            )
        # A quotient that should be whole may come out a little larger.
        needed = 2 * acceleration / (jerk * time_step) * (1 - 1e-12)
        if needed > MAX_SAMPLES:
            least = 2 * acceleration / (MAX_SAMPLES * time_step)
            raise KinematicsError(
                f"max_wheel_jerk of {name} = {jerk:g}: keeping it would take a mean of {needed:.0f} time steps of "
                f"{time_step:g} s; accepted: {least:.4g} or more, or a longer time_step, or a smaller acceleration"
            )
        samples = max(samples, math.ceil(needed))
    return samples
