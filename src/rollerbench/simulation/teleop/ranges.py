"""How far the sliders of a robot go, and how fast what they say is approached."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.description.wheels import SteeredWheel
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import WheelKinematics, limits

Array = NDArray[np.float64]

AXES = ("vx", "vy", "wz")

TIME_TO_TOP_SPEED = 0.5
"""Time in which a robot may reach its top speed, if its wheels hold that [s]."""

GRIP_SHARE = 0.5
"""Share of the largest acceleration before a wheel slips that is used [-]."""

STEERING_SPEED = 2 * math.pi
"""Speed at which steered wheels turn that have no max_steering_speed [rad/s]."""

USEFUL = 0.25
"""A component of a twist is of use if as much of it is left where no tyre skids [-]."""

TURNING_PER_STEP = 1 / 6
"""By which part of its roller pitch a wheel may turn in a step of the plant [-]."""

STEPS = (5e-3, 4e-3, 2.5e-3, 2e-3, 1e-3)
"""Steps of the plant to choose from, parts of a period of control [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """A slider.

    Attributes:
        name: What it sets.
        largest: Largest value; the smallest one is its negative [SI].
        reason: Why it cannot be moved; empty if it can.
    """

    name: str
    largest: float
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ranges:
    """What a robot on wheels can be told.

    Attributes:
        axes: vx, vy [m/s] and wz [rad/s].
        wheel_speeds: Largest speeds (n_driven,) of the driven wheels [rad/s].
        wheel_accelerations: Largest accelerations (n_driven,) of these [rad/s2].
        steering_speeds: Largest speeds (n_steered,) about the swivel axes [rad/s].
    """

    axes: tuple[Axis, ...]
    wheel_speeds: Array
    wheel_accelerations: Array
    steering_speeds: Array


def with_steering_speeds(robot: Robot) -> Robot:
    """The robot with a limit of the steering speed for each steered wheel."""
    wheels = tuple(
        wheel.model_copy(update={"max_steering_speed": STEERING_SPEED})
        if isinstance(wheel, SteeredWheel) and wheel.max_steering_speed is None
        else wheel
        for wheel in robot.wheels
    )
    return robot.model_copy(update={"wheels": wheels})


def wheel_ranges(kinematics: WheelKinematics) -> Ranges:
    """Ranges of a robot on wheels, from its limits; where it has none, of a body length per second."""
    robot = kinematics.robot
    pace = max(robot.body.size[:2])
    along, across, about = (
        _limit(limits.max_speed(robot, 0.0)),
        _limit(limits.max_speed(robot, 0.5 * math.pi)),
        _limit(limits.max_yaw_rate(robot)),
    )
    largest = np.array([along or across or pace, across or along or pace, about or pace / robot.reach])
    axes = tuple(
        Axis(name=name, largest=float(top), reason=reason)
        for name, top, reason in zip(AXES, largest, _reasons(kinematics), strict=True)
    )
    radii = np.array([wheel.radius for wheel in robot.driven_wheels])
    fastest = np.array([wheel.max_speed or 0.0 for wheel in robot.driven_wheels])
    return Ranges(
        axes=axes,
        wheel_speeds=np.where(fastest > 0, fastest, 2 * max(largest[:2]) / radii),
        wheel_accelerations=_acceleration(robot, max(largest[:2])) / radii,
        steering_speeds=np.array(
            [getattr(wheel, "max_steering_speed", None) or STEERING_SPEED for wheel in robot.steered_wheels]
        ),
    )


def leg_axes(robot: Robot) -> tuple[Axis, ...]:
    """Ranges of the twist of a robot on legs: half a body length per second, and as fast for the feet as it turns."""
    pace = 0.5 * max(robot.body.size[:2])
    return tuple(
        Axis(name=name, largest=value)
        for name, value in zip(AXES, (pace, 0.75 * pace, pace / robot.reach), strict=True)
    )


def fixed_tyres(robot: Robot) -> list[int]:
    """Indices of the tyres that can neither swivel nor roll sideways."""
    return [index for index, wheel in enumerate(robot.wheels) if wheel.ring is None and not wheel.swivels]


def plant_step(kinematics: WheelKinematics, ranges: Ranges) -> float:
    """Longest step of the plant [s] that follows the rollers at the largest wheel speeds."""
    wheels = zip(kinematics.robot.driven_wheels, ranges.wheel_speeds, strict=True)
    needed = [TURNING_PER_STEP * wheel.ring.pitch / speed for wheel, speed in wheels if wheel.ring is not None]
    longest = min(needed, default=math.inf)
    return next((step for step in STEPS if step <= longest), STEPS[-1])


def _limit(limit: Any) -> float:
    """A limit, 0 if there is none."""
    return float(np.nan_to_num(limit.value))


def _reasons(kinematics: WheelKinematics) -> list[str]:
    """Why each component of a twist is useless: nothing of it is left where no fixed tyre skids."""
    tyres = fixed_tyres(kinematics.robot)
    kept = np.diag(kinematics.project(np.eye(3), tyres)) if tyres else np.ones(3)
    names = ", ".join(kinematics.robot.wheels[index].name for index in tyres)
    return ["" if share > USEFUL else f"tyres would skid: {names}" for share in kept]


def _acceleration(robot: Robot, top_speed: float) -> float:
    """How fast the body may speed up, in whatever direction [m/s2]."""
    quick = top_speed / TIME_TO_TOP_SPEED
    try:
        grip = limits.max_acceleration(robot, np.linspace(0.0, 2 * math.pi, 8, endpoint=False)).value
    except KinematicsError:
        return quick
    grip = grip[np.isfinite(grip) & (grip > 0)]
    return min(quick, GRIP_SHARE * float(grip.min())) if grip.size else quick
