"""Numbers from recordings. Pure numpy: works on stored runs, without Drake."""

from rollerbench.analysis.pose_error import PoseError, pose_error
from rollerbench.analysis.wheels import height_ripple, wheel_slip

__all__ = ["PoseError", "height_ripple", "pose_error", "wheel_slip"]
