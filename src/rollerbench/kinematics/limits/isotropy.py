"""How evenly a base moves in all directions."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.polygon import speed_polygon
from rollerbench.kinematics.mobility import null_space
from rollerbench.kinematics.rows import wheeled
from rollerbench.kinematics.wheels import WheelKinematics


@dataclass(frozen=True, slots=True, kw_only=True)
class Isotropy:
    """Measures of isotropy; twists count as (vx, vy, L w), restricted to those at which no tyre skids.

    Attributes:
        characteristic_length: The length L [m]: root mean square distance of the wheels from Bo.
        condition_number: Largest over smallest singular value of J [-]; 1 is isotropic, inf is a motion that the driven
            wheels do not feel.
        manipulability: Volume of the twists that wheel speeds with |q'| <= 1 rad/s make, over that of the unit ball:
            the product of the inverse singular values of J [(m/s per rad/s)^k] over k feasible dimensions; inf where
            the driven wheels leave a motion open.
        speed_ratio: Largest over smallest top speed of all directions [-]; inf if the base cannot move in all of them,
            None if a direction has no limit.
    """

    characteristic_length: float
    condition_number: float
    manipulability: float
    speed_ratio: float | None


def isotropy(robot: Robot | str | Path) -> Isotropy:
    """Condition number, manipulability and speed ratio of a base; its steered wheels at swivel angle 0 for the former.

    Source: Salisbury and Craig (1982) for the condition number, Yoshikawa (1985) for the manipulability.
    """
    robot = wheeled(robot)
    kinematics = WheelKinematics(robot)
    places = np.array([wheel.p_BoHo_B[:2] for wheel in robot.wheels])
    length = math.sqrt(float(np.mean(np.sum(places**2, axis=1))))
    scale = np.array([1.0, 1.0, length])
    basis = null_space(kinematics.constraint_matrix / scale)
    values = np.linalg.svd(kinematics.drive_matrix / scale @ basis, compute_uv=False)
    condition = kinematics.condition_number(length)
    return Isotropy(
        characteristic_length=length,
        condition_number=condition,
        manipulability=math.inf if math.isinf(condition) else float(np.prod(1.0 / values)),
        speed_ratio=_speed_ratio(robot),
    )


def _speed_ratio(robot: Robot) -> float | None:
    """Farthest corner of the speed polygon over its nearest edge."""
    try:
        polygon = speed_polygon(robot)
    except KinematicsError:
        return None
    if polygon.dimension < 2:
        return math.inf
    first, second = polygon.vertices, np.roll(polygon.vertices, -1, axis=0)
    across = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    nearest = np.min(across / np.linalg.norm(second - first, axis=1))
    return float(np.max(np.linalg.norm(first, axis=1)) / nearest)
