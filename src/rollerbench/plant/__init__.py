"""Robots as parts of a Drake MultibodyPlant."""

from rollerbench.plant.ground import add_ground
from rollerbench.plant.robot import add_robot
from rollerbench.plant.robot_model import RobotModel
from rollerbench.plant.window import RollerWindow, follow_rollers
from rollerbench.sdf.servo import LegGains, ServoGains, servo_gains

__all__ = [
    "LegGains",
    "RobotModel",
    "RollerWindow",
    "ServoGains",
    "add_ground",
    "add_robot",
    "follow_rollers",
    "servo_gains",
]
