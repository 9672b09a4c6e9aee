"""Robots in simulation that a hand drives from a page in a browser."""

from rollerbench.simulation.teleop.teleop import Teleop

__all__ = ["Teleop"]
