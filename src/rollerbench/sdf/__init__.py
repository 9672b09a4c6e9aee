"""Robot descriptions as models for simulators."""

from rollerbench.sdf.mjcf import robot_to_mjcf
from rollerbench.sdf.robot import robot_to_sdf

__all__ = ["robot_to_mjcf", "robot_to_sdf"]
