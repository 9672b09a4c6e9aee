"""Equations of motion of wheeled bases: wheels, legs, odometry, contacts, limits. Pure numpy and scipy."""

from rollerbench.kinematics import estimation, gaits, legs, limits, odometry, paths, uncertainty
from rollerbench.kinematics.mobility import Mobility
from rollerbench.kinematics.rows import finite_roller_factor
from rollerbench.kinematics.wheels import WheelKinematics

__all__ = [
    "Mobility",
    "WheelKinematics",
    "estimation",
    "finite_roller_factor",
    "gaits",
    "legs",
    "limits",
    "odometry",
    "paths",
    "uncertainty",
]
