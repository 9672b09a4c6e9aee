"""Gains of the servos, from the robot's mass, wheels and legs."""

from dataclasses import dataclass, field

from rollerbench.description import Leg, Robot
from rollerbench.description.inertia import GRAVITY

DRIVE_TIME_CONSTANT = 5e-4
"""Time in which a drive servo makes up a speed difference of the whole robot [s]."""

STEERING_TIME_CONSTANT = 0.02
"""Time constant of the critically damped steering servos [s]."""

LEG_DEFLECTION = 0.03
"""Angle by which a leg's servo gives way to twice the leg's share of the weight, at the length of the leg [rad]."""

LEG_TIME_CONSTANT = 0.01
"""Half the damping over the stiffness of the servos of legs [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegGains:
    """Gains of the servos of a leg.

    Attributes:
        stiffness: Torque over the error of a joint's angle [N m].
        damping: Torque over the error of a joint's rate [N m s].
        wheel_stiffness: Torque over the error of the wheel's angle [N m]; 0 for a wheel that only follows a speed.
        wheel_damping: Torque over the error of the wheel's speed [N m s].
    """

    stiffness: float
    damping: float
    wheel_stiffness: float
    wheel_damping: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoGains:
    """Gains of Drake's implicit PD servos, by the name of the wheel or leg.

    Attributes:
        drive_damping: Torque over the error of the wheel speed [N m s]; wheels without one have no servo.
        steering_stiffness: Torque over the error of the steering angle [N m].
        steering_damping: Torque over the error of the steering speed [N m s].
        legs: Gains of the legs; legs without have no servo.
    """

    drive_damping: dict[str, float] = field(default_factory=dict)
    steering_stiffness: dict[str, float] = field(default_factory=dict)
    steering_damping: dict[str, float] = field(default_factory=dict)
    legs: dict[str, LegGains] = field(default_factory=dict)


def servo_gains(robot: Robot, *, time_constant: float = DRIVE_TIME_CONSTANT) -> ServoGains:
    """Gains that follow commands equally well on a light and on a heavy robot.

    A driven wheel moves its share of the robot, m R^2 / n as seen at the axle, so d = m R^2 / (n tau) gives every robot
    the same time constant tau. The steering servos turn the wheel's mass m_w scrubbing under its share of the weight;
    their stiffness answers the largest scrubbing torque, mu N width/2, with a hundredth of a radian. Those of legs:
    see `leg_gains`.

    Args:
        robot: The robot.
        time_constant: tau of the drive servos [s].
    """
    share = robot.mass / max(1, len(robot.driven_wheels))
    load = robot.mass * GRAVITY / max(1, len(robot.wheels))
    stiffness = {w.name: 100 * w.friction * load * 0.5 * w.width for w in robot.steered_wheels}
    return ServoGains(
        drive_damping={w.name: share * w.radius**2 / time_constant for w in robot.driven_wheels},
        steering_stiffness=stiffness,
        steering_damping={name: 2 * STEERING_TIME_CONSTANT * value for name, value in stiffness.items()},
        legs={leg.name: leg_gains(robot, leg) for leg in robot.legs},
    )


def leg_gains(robot: Robot, leg: Leg) -> LegGains:
    """Gains with which a leg carries its load, on a light and on a heavy robot.

    A robot that walks lifts half of its n legs, so one carries up to F = 2 m g / n, at most at the length l of the leg
    from a joint: kp = F l / deflection. The foot's wheel holds the same force at its radius.
    """
    torque_per_length = 2 * robot.mass * GRAVITY / len(robot.legs) / LEG_DEFLECTION
    stiffness, wheel_stiffness = torque_per_length * leg.length, torque_per_length * leg.wheel.radius
    return LegGains(
        stiffness=stiffness,
        damping=2 * LEG_TIME_CONSTANT * stiffness,
        wheel_stiffness=wheel_stiffness,
        wheel_damping=2 * LEG_TIME_CONSTANT * wheel_stiffness,
    )
