"""Wheels that steer while the robot drives: what their motors are told, step by step, and what they tell."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]

STANDSTILL = 1e-3
"""Speed of its centre below which a wheel does not steer [m/s]: what feedback still asks for near rest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringStep:
    """What motors are told for one period of control.

    Attributes:
        angles: Angles (n_steered,) of the steered wheels from heading_deg at the end of the period [rad].
        rates: How fast (n_steered,) they turn there [rad/s].
        wheel_speeds: Speeds (n_driven,) of the driven wheels [rad/s].
    """

    angles: Array
    rates: Array
    wheel_speeds: Array


def steering_step(kinematics: WheelKinematics, v_xyw_B: Array, angles: Array, period: float) -> SteeringStep:
    """The next step of a base with steered wheels towards a twist (3,), from their angles (n_steered,) [rad].

    A wheel turns the shorter way, backwards if that is shorter, no faster than its max_steering_speed; until it looks
    where it has to go it turns only as fast as its way along its own heading, |cos| of the angle that is missing.
    Slower than `STANDSTILL` it keeps its angle: the direction of next to no speed is noise.
    """
    robot = kinematics.robot
    wanted, steered = kinematics.steering(v_xyw_B, previous=angles)
    limits = np.array([getattr(wheel, "max_steering_speed", None) or np.inf for wheel in robot.steered_wheels])
    radii = np.array([wheel.radius for wheel in robot.steered_wheels])
    moves = np.abs(steered) * radii >= STANDSTILL
    turn = np.where(moves, np.clip(wanted - angles, -limits * period, limits * period), 0.0)
    missing = wanted - angles - turn
    speeds = kinematics.drive_matrix @ v_xyw_B
    for column, wheel in enumerate(robot.driven_wheels):
        if wheel.steered:
            index = robot.steered_wheels.index(wheel)
            speeds[column] = steered[index] * np.cos(missing[index])
    return SteeringStep(angles=angles + turn, rates=turn / period, wheel_speeds=speeds)
