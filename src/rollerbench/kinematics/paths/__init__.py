"""Paths in the plane and speed laws along them: from legs, each from rest to rest, to a body twist over time."""

from rollerbench.kinematics.paths.curves import clothoid, spline
from rollerbench.kinematics.paths.legs import Leg, arc, figure_eight, laps, leg, line, square, through_waypoints
from rollerbench.kinematics.paths.speed_laws import SpeedLaw, fastest_duration, twist_along
from rollerbench.kinematics.paths.time_optimal import TimeOptimal, time_optimal

__all__ = [
    "Leg",
    "SpeedLaw",
    "TimeOptimal",
    "arc",
    "clothoid",
    "fastest_duration",
    "figure_eight",
    "laps",
    "leg",
    "line",
    "spline",
    "square",
    "through_waypoints",
    "time_optimal",
    "twist_along",
]
