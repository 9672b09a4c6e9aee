"""Lets robots settle, and notices when a simulation has left reality."""

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context

from rollerbench.description import Robot
from rollerbench.plant import RobotModel
from rollerbench.sdf.contact import static_penetration
from rollerbench.sdf.window import reach

Array = NDArray[np.float64]

SETTLE_TIME = 0.25
"""Time that a robot stands still before a run, to find how it rests on its wheels [s]."""

CHUNK = 0.05
"""Simulated time between two looks at a robot [s]."""

NOT_FINITE = "the state is not finite (NaN or infinite): accepted: a smaller plant.time_step"

TIP_ANGLE = math.radians(45)
"""A robot inclined by more has tipped over [rad]."""

HEIGHT_SHARE = 0.5
"""By which share of the smallest wheel radius the body may rise or sink on level ground [-]."""


def fault(model: RobotModel, context: Context) -> str | None:
    """What is wrong with the robot's state in a context of its plant, or None."""
    state = model.plant.GetPositionsAndVelocities(context, model.model_instance)
    if not np.isfinite(state).all():
        return NOT_FINITE
    pose = model.plant.EvalBodyPoseInWorld(context, model.body)
    what = wrong_pose(model.robot, pose.translation(), pose.rotation().matrix())
    return what or _beyond_window(model, pose.rotation().matrix())


def _beyond_window(model: RobotModel, R_WB: Array) -> str | None:
    """Whether a wheel leans on rollers that are not simulated."""
    window = model.roller_window
    angle = tilt(R_WB)
    if window is None or angle <= min(map(reach, window.windows.values())):
        return None
    return (
        f"the robot is inclined by {math.degrees(angle):.0f} deg, and the simulated rollers around the bottoms of its "
        "wheels do not reach as far; accepted: a larger plant.roller_window, or plant.roller_model: full"
    )


def wrong_pose(robot: Robot, p_WB: Array, R_WB: Array) -> str | None:
    """What is wrong with the pose of a robot's body, position (3,) and rotation (3, 3), on level ground, or None."""
    angle = tilt(R_WB)
    if angle > TIP_ANGLE:
        return f"the robot tipped over: its body is inclined by {math.degrees(angle):.0f} deg"
    rise = float(p_WB[2]) + robot.ground_height + static_penetration(robot)
    allowed = HEIGHT_SHARE * min(wheel.radius for wheel in robot.wheels)
    if rise > allowed:
        return f"the robot left the ground: its body rose by {rise:.3g} m"
    if rise < -allowed:
        return f"the robot fell through the ground: its body sank by {-rise:.3g} m"
    return None


def tilt(R_WB: Array) -> float:
    """Angle from B's z axis to the vertical [rad]."""
    return math.acos(min(1.0, max(-1.0, float(R_WB[2, 2]))))
