"""What a base can do in each direction, tabulated: the numbers behind the figures and the page of an analysis."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import limits
from rollerbench.kinematics.limits import Isotropy, Limit, SpeedPolygon
from rollerbench.kinematics.mobility import null_space
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]

STEP_DEG = 1.0
"""Step of the directions [deg]."""

YAW_SHARES = (0.0, 1 / 3, 2 / 3)
"""Yaw rates of the speed figure, over the largest on the spot [-]."""

VARIANTS: dict[str, tuple[Literal["best", "least_norm"], Literal["circle", "independent"]]] = {
    "best": ("best", "circle"),
    "least_norm": ("least_norm", "circle"),
    "independent": ("best", "independent"),
}
"""Sharing and adhesion of `limits.max_acceleration` by name of the curve."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Capability:
    """What theory says of a robot, over directions of travel.

    Attributes:
        robot: The robot.
        roll_resistance: Coefficient of rolling resistance [-].
        ground_friction: That of the ground; None for each wheel's own.
        directions: Directions (n,) [rad], 0 to 360 deg; those that tyres allow are among them.
        isotropy: Condition number, manipulability, speed ratio.
        polygon: Speeds without yaw; None if something is unlimited.
        max_yaw_rate: Largest yaw rate on the spot [rad/s]; NaN if there is none.
        yaw_rates: Yaw rates (k,) of speeds [rad/s]; the first is 0.
        speeds: Largest speeds (k, n) [m/s].
        accelerations: Largest accelerations (n,) [m/s2], by name of the variant.
        map_accelerations: Accelerations (m,) of the efforts [m/s2].
        efforts: Efforts (n, m, n_driven) [N m]; NaN where the base cannot go.
        reference: Index of the acceleration of map_accelerations at which efforts are told by direction.
    """

    robot: Robot
    roll_resistance: float
    ground_friction: float | None
    directions: Array
    isotropy: Isotropy
    polygon: SpeedPolygon | None
    max_yaw_rate: float
    yaw_rates: Array
    speeds: Limit
    accelerations: dict[str, Limit]
    map_accelerations: Array
    efforts: Array
    reference: int

    @property
    def few(self) -> bool:
        """Whether the base can go in single directions alone."""
        return not self.all_round and bool(self.goes.any())

    @property
    def all_round(self) -> bool:
        """Whether the base can go in every direction."""
        return bool(self.goes.all())

    @property
    def goes(self) -> NDArray[np.bool_]:
        """Whether (n,) tyres allow the direction."""
        return self.accelerations["best"].cause != "tyres"

    @property
    def speed(self) -> Limit:
        """Largest speeds (n,) without yaw."""
        return part(self.speeds, 0)


def part(limit: Limit, index: Any) -> Limit:
    """The limits at an index into value."""
    return Limit(
        value=np.asarray(limit.value[index]),
        cause=np.asarray(limit.cause[index]),
        at_limit=limit.at_limit[index],
        wheel_names=limit.wheel_names,
    )


STEPS = 2.0 + len(VARIANTS)
"""Steps of `capability`, for progress bars."""


def capability(
    robot: Robot,
    *,
    roll_resistance: float = 0.0,
    ground_friction: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Capability:
    """All limits of a robot over all directions.

    Args:
        robot: The robot.
        roll_resistance: Resisting force of a rolling wheel or roller over its load [-].
        ground_friction: Coefficient of friction of the ground, None for each wheel's own.
        progress: Called with the steps done and the steps there are.

    Raises:
        KinematicsError: an argument is malformed.
    """
    show = progress or (lambda done, total: None)
    directions = travel_directions(robot)
    isotropy, polygon = limits.isotropy(robot), _polygon(robot)
    fastest = limits.max_yaw_rate(robot)
    turning = float(fastest.value) if fastest.feasible else math.nan
    yaw_rates = np.array(YAW_SHARES) * turning if fastest.feasible else np.zeros(1)
    speeds = limits.max_speed(robot, directions, yaw_rate=yaw_rates[:, np.newaxis])
    show(1.0, STEPS)
    accelerations = {}
    for done, (name, (sharing, adhesion)) in enumerate(VARIANTS.items(), start=2):
        accelerations[name] = limits.max_acceleration(
            robot,
            directions,
            roll_resistance=roll_resistance,
            ground_friction=ground_friction,
            sharing=sharing,
            adhesion=adhesion,
        )
        show(float(done), STEPS)
    largest = np.nanmax(accelerations["best"].value, initial=0.0)
    steps = _steps(float(largest))
    efforts = limits.wheel_efforts(
        robot, directions[:, np.newaxis], steps, roll_resistance=roll_resistance, strict=False
    )
    show(STEPS, STEPS)
    smallest = np.nanmin(accelerations["least_norm"].value, initial=np.inf)
    return Capability(
        robot=robot,
        roll_resistance=roll_resistance,
        ground_friction=ground_friction,
        directions=directions,
        isotropy=isotropy,
        polygon=polygon,
        max_yaw_rate=turning,
        yaw_rates=yaw_rates,
        speeds=speeds,
        accelerations=accelerations,
        map_accelerations=steps,
        efforts=efforts,
        reference=int(np.searchsorted(steps, 0.5 * smallest, side="right")) - 1 if np.isfinite(smallest) else 0,
    )


def travel_directions(robot: Robot) -> Array:
    """Directions (n,) [rad] in equal steps over a full turn, with those that fixed tyres allow in their places."""
    directions = np.radians(np.arange(0.0, 360.0 + 0.5 * STEP_DEG, STEP_DEG))
    # Steered wheels follow, so fixed tyres alone decide.
    fixed = [w for w in robot.wheels if w.ring is None and not w.swivels]
    if fixed:
        rows = WheelKinematics(robot).constraint_matrix
        names = [w.name for w in robot.wheels if w.ring is None and w.swivel_offset == 0]
        keep = [names.index(w.name) for w in fixed]
        free = null_space(rows[keep][:, :2]) if keep else np.eye(2)
        for column in free.T if free.shape[1] == 1 else ():
            ahead = math.atan2(column[1], column[0])
            for angle in (ahead % (2 * math.pi), (ahead + math.pi) % (2 * math.pi)):
                if np.abs(directions - angle).min() > 1e-9:
                    directions = np.append(directions, angle)
    sorted_directions: Array = np.sort(directions)
    return sorted_directions


def sectors(directions: Array, limit: Limit) -> Iterator[tuple[float, float, str, tuple[str, ...]]]:
    """Ranges of directions with the same cause and wheels: start and end [rad], cause, names of the wheels.

    A single direction at the border of ranges that have limits too ends these, and is no range of its own.
    """
    keys = [(str(cause), limit.wheels(i)) for i, cause in enumerate(limit.cause)]
    runs: list[list[int]] = []
    for i, key in enumerate(keys):
        if runs and keys[runs[-1][0]] == key:
            runs[-1][1] = i
        else:
            runs.append([i, i])
    borders = {run[0] for run in runs if run[0] == run[1] and _between(limit, run[0])}
    for first, last in runs:
        if first not in borders:
            start, end = max(first - 1, 0), min(last + 1, len(keys) - 1)
            ends = start if start in borders else first, end if end in borders else last
            yield float(directions[ends[0]]), float(directions[ends[1]]), *keys[first]


def _between(limit: Limit, index: int) -> bool:
    """Whether the directions next to one have limits as it has."""
    around = [i for i in (index - 1, index, index + 1) if 0 <= i < len(limit.value)]
    return bool(limit.feasible[around].all()) and len(around) > 1


def _polygon(robot: Robot) -> SpeedPolygon | None:
    try:
        return limits.speed_polygon(robot)
    except KinematicsError:
        return None


def _steps(largest: float) -> Array:
    """Accelerations from 0 up to the largest, in about 40 round steps [m/s2]."""
    if largest <= 0:
        return np.array([0.0])
    rough = largest / 40
    unit = 10.0 ** math.floor(math.log10(rough))
    step = unit * next(factor for factor in (1, 2, 5, 10) if factor * unit >= rough)
    return step * np.arange(math.floor(largest / step * (1 + 1e-9)) + 1, dtype=np.float64)
