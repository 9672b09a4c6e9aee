"""Gains of the servos, from the robot's mass and wheels."""

from dataclasses import dataclass

from rollerbench.description import Robot

DRIVE_TIME_CONSTANT = 5e-4
"""Time in which a drive servo makes up a speed difference of the whole robot [s]."""

STEERING_TIME_CONSTANT = 0.02
"""Time constant of the critically damped steering servos [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoGains:
    """Gains of Drake's implicit PD servos, by wheel name.

    Attributes:
        drive_damping: Torque over the error of the wheel speed [N m s]; wheels without one have no servo.
        steering_stiffness: Torque over the error of the steering angle [N m].
        steering_damping: Torque over the error of the steering speed [N m s].
    """

    drive_damping: dict[str, float]
    steering_stiffness: dict[str, float]
    steering_damping: dict[str, float]


def servo_gains(robot: Robot, *, time_constant: float = DRIVE_TIME_CONSTANT) -> ServoGains:
    """Gains that follow commands equally well on a light and on a heavy robot.

    A driven wheel moves its share of the robot, m R^2 / n as seen at the axle, so d = m R^2 / (n tau) gives every robot
    the same time constant tau. The steering servos turn the wheel's mass m_w scrubbing under its share of the weight;
    their stiffness answers the largest scrubbing torque, mu N width/2, with a hundredth of a radian.

    Args:
        robot: The robot.
        time_constant: tau [s].
    """
    share = robot.mass / max(1, len(robot.driven_wheels))
    load = robot.mass * 9.81 / len(robot.wheels)
    stiffness = {w.name: 100 * w.friction * load * 0.5 * w.width for w in robot.steered_wheels}
    return ServoGains(
        drive_damping={w.name: share * w.radius**2 / time_constant for w in robot.driven_wheels},
        steering_stiffness=stiffness,
        steering_damping={name: 2 * STEERING_TIME_CONSTANT * value for name, value in stiffness.items()},
    )
