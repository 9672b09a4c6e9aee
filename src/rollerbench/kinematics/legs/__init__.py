"""Legs: kinematics of one leg; and of the body on its feet: pose, support, forces."""

from rollerbench.kinematics.legs.kinematics import LegKinematics, Singularity

__all__ = ["LegKinematics", "Singularity"]
