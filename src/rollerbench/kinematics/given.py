"""What callers give: a robot in one of several forms, times, poses; checked in one place."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.wheels import WheelKinematics

AnyRobot: TypeAlias = Robot | WheelKinematics | str | Path | Mapping[str, Any]
"""A robot by itself, its kinematics, name, path or content."""


def kinematics_of(robot: AnyRobot) -> WheelKinematics:
    """Kinematics of a robot, or those given."""
    return robot if isinstance(robot, WheelKinematics) else WheelKinematics(robot)


def held_kinematics(robot: AnyRobot) -> WheelKinematics:
    """Kinematics in which wheel speeds alone tell the twist: those given, or those of a robot that does not steer.

    Raises:
        KinematicsError: the robot steers wheels, whose speeds mean nothing without their angles.
    """
    if isinstance(robot, WheelKinematics):
        return robot
    kinematics = WheelKinematics(robot)
    if kinematics.robot.steered_wheels:
        raise KinematicsError(
            f"{kinematics.robot.name} steers wheels, and its wheel speeds mean nothing without their angles; accepted: "
            "robots that do not steer, or its WheelKinematics at the swivel_angles at which they are held (on the "
            "way see rollerbench.systems.SteeredOdometry, WheelKinematics.forward_at)"
        )
    return kinematics


def positive_time(name: str, value: float) -> float:
    """The argument, a time.

    Raises:
        KinematicsError: it is not positive and finite.
    """
    if not (math.isfinite(value) and value > 0):
        raise KinematicsError(f"{name} = {value}: accepted: a positive number of seconds")
    return value


def planar_pose(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """The argument, a pose (3,).

    Raises:
        KinematicsError: it is not finite or not of that shape.
    """
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise KinematicsError(f"{name} = {value!r}: accepted: three finite numbers [x, y, yaw]")
    return array
