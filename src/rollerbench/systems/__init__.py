"""Drake Systems of rollerbench: thin shells over kinematics, with named ports."""

from rollerbench.systems.drivetrain import Drivetrain
from rollerbench.systems.kinematics import ForwardKinematics, InverseKinematics, Odometry, PlanarState

__all__ = ["Drivetrain", "ForwardKinematics", "InverseKinematics", "Odometry", "PlanarState"]
