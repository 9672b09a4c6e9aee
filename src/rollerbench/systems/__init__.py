"""Drake Systems of rollerbench: thin shells over kinematics, with named ports."""

from rollerbench.systems.kinematics import ForwardKinematics, InverseKinematics, Odometry, PlanarState

__all__ = ["ForwardKinematics", "InverseKinematics", "Odometry", "PlanarState"]
