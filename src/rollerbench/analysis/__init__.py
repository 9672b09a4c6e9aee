"""Numbers from recordings. Pure numpy: works on stored runs, without Drake."""

from rollerbench.analysis.budget import ErrorBudget, error_budget
from rollerbench.analysis.legs import LegMetrics, leg_metrics
from rollerbench.analysis.pose_error import PoseError, pose_error
from rollerbench.analysis.wheels import height_ripple, wheel_slip

__all__ = [
    "ErrorBudget",
    "LegMetrics",
    "PoseError",
    "error_budget",
    "height_ripple",
    "leg_metrics",
    "pose_error",
    "wheel_slip",
]
