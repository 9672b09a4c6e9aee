"""Legs: kinematics of one leg; and of the body on its feet: pose, support, forces."""

from rollerbench.kinematics.legs.body_pose import StancePose, body_pose_from_circumcenter, body_pose_from_stance
from rollerbench.kinematics.legs.forces import foot_forces
from rollerbench.kinematics.legs.kinematics import LegKinematics
from rollerbench.kinematics.legs.singularity import Singularity
from rollerbench.kinematics.legs.support import static_margin, support_polygon

__all__ = [
    "LegKinematics",
    "Singularity",
    "StancePose",
    "body_pose_from_circumcenter",
    "body_pose_from_stance",
    "foot_forces",
    "static_margin",
    "support_polygon",
]
