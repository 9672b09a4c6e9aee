"""What a robot is: validated, frozen data, from and to robot.yaml."""

from rollerbench.description.body import Body
from rollerbench.description.files import load_robot
from rollerbench.description.robot import Robot
from rollerbench.description.wheels import (
    AnyWheel,
    CastorWheel,
    FixedWheel,
    MecanumWheel,
    OmniWheel,
    Rollers,
    RollerWheel,
    SteeredWheel,
    Wheel,
)

__all__ = [
    "AnyWheel",
    "Body",
    "CastorWheel",
    "FixedWheel",
    "MecanumWheel",
    "OmniWheel",
    "Robot",
    "RollerWheel",
    "Rollers",
    "SteeredWheel",
    "Wheel",
    "load_robot",
]
