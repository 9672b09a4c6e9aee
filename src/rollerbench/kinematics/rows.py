"""The rows of the wheel equations, for all wheels of a robot at once."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import cosdg, sindg

from rollerbench.description import AnyWheel, Robot, load_robot
from rollerbench.description.wheels import RollerWheel
from rollerbench.errors import KinematicsError

Array = NDArray[np.float64]


def wheeled(robot: Robot | str | Path | Mapping[str, Any]) -> Robot:
    """The robot, by itself, name, path or content, if it stands on wheels.

    Raises:
        KinematicsError: it stands on legs.
    """
    loaded = load_robot(robot)
    if loaded.legs:
        raise KinematicsError(
            f"robot {loaded.name} stands on legs; accepted: robots with wheels (for legs see rollerbench.legs)"
        )
    return loaded


def wheel_rows(robot: Robot, positions: Array, swivel_angles: Array) -> tuple[Array, Array]:
    """row(t) and row(n) of every wheel, (..., n_wheels, 3) each: velocities along and to the left of its heading.

    Args:
        robot: The robot.
        positions: Reference points (n_wheels, 2) of the wheels from that of the twist, in B [m].
        swivel_angles: Angles (..., n_wheels) of the wheels from heading_deg [rad].
    """
    # In degrees, for the cosine of 90 deg is then exactly 0.
    degrees = np.array([wheel.heading_degrees for wheel in robot.wheels]) + np.degrees(swivel_angles)
    ux, uy = cosdg(degrees), sindg(degrees)
    x, y = positions.T
    along = np.stack([ux, uy, x * uy - y * ux], axis=-1)
    left = np.stack([-uy, ux, x * ux + y * uy], axis=-1)
    return along, left


def finite_roller_slope(wheel: AnyWheel) -> float:
    """tan(g) that makes the textbook row equal to the mean over one roller pitch [-].

    With the touching roller turned by theta from the bottom, |theta| <= pi/N, its contact lies
    (R - r) tan(theta) cot(gamma) along the axle and its axis makes tan(gamma') = tan(gamma) cos(theta) with the axle on
    the ground. Rolling without slip along it gives, in the wheel's frame,

        R q' = vx - vy cot(gamma) sec(theta) - w (R - r) cot(gamma) tan(theta).

    At constant q' and w = 0, vy is proportional to cos(theta), whose mean over the pitch is sin(pi/N)/(pi/N): the wheel
    acts like one with tan(gamma_eff) = tan(gamma) sin(pi/N)/(pi/N). Omni wheels (gamma = 90 deg) and tyres stay.

    In a turn the same mean takes the term in w away, as tan(theta) is odd, and leaves longer lever arms: K + L becomes
    K + L / (sin(pi/N)/(pi/N)). That is a law only where the terms in w of all wheels are small or agree: those of left
    and right wheels contradict each other by (R - r)/(K + L), wheels must slip, and friction and servos decide by how
    much (models/mecanum_platform/README.md has numbers).
    """
    if not isinstance(wheel, RollerWheel):
        return 0.0
    return wheel.roller_slope / finite_roller_factor(wheel.rollers.count)


def finite_roller_factor(count: int) -> float:
    """sin(pi/N)/(pi/N): how far a Mecanum base with N rollers a wheel moves sideways, over the textbook way [-]."""
    return float(np.sinc(1 / count))
