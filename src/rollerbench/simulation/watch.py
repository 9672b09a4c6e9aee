"""Notices when a simulation has left reality."""

import math

import numpy as np
from pydrake.math import RollPitchYaw
from pydrake.systems.framework import Context

from rollerbench.plant import RobotModel
from rollerbench.sdf.contact import static_penetration

TIP_ANGLE = math.radians(45)
"""A robot inclined by more has tipped over [rad]."""

HEIGHT_SHARE = 0.5
"""By which share of the smallest wheel radius the body may rise or sink on level ground [-]."""


def fault(model: RobotModel, context: Context) -> str | None:
    """What is wrong with the robot's state in a context of its plant, or None."""
    state = model.plant.GetPositionsAndVelocities(context, model.model_instance)
    if not np.isfinite(state).all():
        return "the state is not finite (NaN or infinite): accepted: a smaller plant.time_step"
    pose = model.plant.EvalBodyPoseInWorld(context, model.body)
    roll, pitch, _ = RollPitchYaw(pose.rotation()).vector()
    tilt = math.acos(min(1.0, max(-1.0, math.cos(roll) * math.cos(pitch))))
    if tilt > TIP_ANGLE:
        return f"the robot tipped over: its body is inclined by {math.degrees(tilt):.0f} deg"
    rest = -model.robot.ground_height - static_penetration(model.robot)
    rise = float(pose.translation()[2]) - rest
    allowed = HEIGHT_SHARE * min(wheel.radius for wheel in model.robot.wheels)
    if rise > allowed:
        return f"the robot left the ground: its body rose by {rise:.3g} m"
    if rise < -allowed:
        return f"the robot fell through the ground: its body sank by {-rise:.3g} m"
    return None
