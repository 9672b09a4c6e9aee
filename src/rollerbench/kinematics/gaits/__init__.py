"""How robots on legs move: gaits, driving on the feet's wheels, changes of posture. Plans are values."""

from rollerbench.kinematics.gaits.gait import GAITS, Gait
from rollerbench.kinematics.gaits.plan import LegCommand, LegFeedback, LegMode, LegPlan
from rollerbench.kinematics.gaits.planner import LegPlanner
from rollerbench.kinematics.gaits.tracker import Tracked, track

__all__ = ["GAITS", "Gait", "LegCommand", "LegFeedback", "LegMode", "LegPlan", "LegPlanner", "Tracked", "track"]
