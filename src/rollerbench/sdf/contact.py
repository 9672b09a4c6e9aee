"""Contact parameters that follow from a robot's weight and wheels, or the wheels at its feet."""

import math

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY

PENETRATION_RATIO = 5e-4
"""Static penetration of a wheel into rigid ground, as a share of its radius: by so much the wheel rolls short [-]."""


def static_penetration(robot: Robot) -> float:
    """Depth by which the wheels sink into rigid ground under the robot's weight [m]."""
    return PENETRATION_RATIO * min(_radii(robot))


def contact_stiffness(robot: Robot) -> float:
    """Stiffness of a wheel's contact with rigid ground [N/m], by which a wheel with an even share sinks as above."""
    load = robot.mass * GRAVITY / len(_radii(robot))
    return load / static_penetration(robot)


def contact_dissipation(robot: Robot) -> float:
    """Hunt-Crossley dissipation d [s/m] of force k x (1 + d x') that damps bouncing at half of critical.

    Under the load m g = k x0 the contact is a spring k with the damper k x0 d; it is critical at d = 2 / sqrt(g x0).
    """
    return 1.0 / math.sqrt(GRAVITY * static_penetration(robot))


def _radii(robot: Robot) -> list[float]:
    return [wheel.radius for wheel in robot.wheels] + [leg.wheel.radius for leg in robot.legs]
