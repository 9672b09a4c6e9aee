"""What a robot is: validated, frozen data, from and to robot.yaml."""

from rollerbench.description.body import Body
from rollerbench.description.files import load_robot
from rollerbench.description.legs import FootWheel, Leg, Link, Posture
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
    "FootWheel",
    "Leg",
    "Link",
    "MecanumWheel",
    "OmniWheel",
    "Posture",
    "Robot",
    "RollerWheel",
    "Rollers",
    "SteeredWheel",
    "Wheel",
    "load_robot",
]
