"""Equations of motion without mass: wheels, odometry, contacts. Pure numpy."""

from rollerbench.kinematics import odometry
from rollerbench.kinematics.mobility import Mobility
from rollerbench.kinematics.rows import finite_roller_factor
from rollerbench.kinematics.wheels import WheelKinematics

__all__ = ["Mobility", "WheelKinematics", "finite_roller_factor", "odometry"]
