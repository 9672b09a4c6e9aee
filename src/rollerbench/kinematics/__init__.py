"""Equations of motion of wheeled bases: wheels, odometry, contacts, limits. Pure numpy and scipy."""

from rollerbench.kinematics import limits, odometry
from rollerbench.kinematics.mobility import Mobility
from rollerbench.kinematics.rows import finite_roller_factor
from rollerbench.kinematics.wheels import WheelKinematics

__all__ = ["Mobility", "WheelKinematics", "finite_roller_factor", "limits", "odometry"]
