"""Equations of motion without mass: wheels, odometry, contacts. Pure numpy."""

from rollerbench.kinematics import odometry
from rollerbench.kinematics.mobility import Mobility
from rollerbench.kinematics.wheels import WheelKinematics, finite_roller_factor

__all__ = ["Mobility", "WheelKinematics", "finite_roller_factor", "odometry"]
