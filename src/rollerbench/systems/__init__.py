"""Drake Systems of rollerbench: thin shells over kinematics, with named ports."""

from rollerbench.systems.contacts import RollResistance, SlipMonitor
from rollerbench.systems.drivetrain import Drivetrain
from rollerbench.systems.kinematics import ForwardKinematics, InverseKinematics, Odometry, PlanarState
from rollerbench.systems.wheel_speed_controller import PidGains, WheelSpeedController, wheel_speed_gains

__all__ = [
    "Drivetrain",
    "ForwardKinematics",
    "InverseKinematics",
    "Odometry",
    "PidGains",
    "PlanarState",
    "RollResistance",
    "SlipMonitor",
    "WheelSpeedController",
    "wheel_speed_gains",
]
