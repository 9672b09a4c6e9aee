"""What a base can do in each direction: speed, acceleration before a wheel slips, wheel efforts.

Directions are angles of travel of Bo [rad] from body x, counter-clockwise; functions over them broadcast. Steered
wheels are taken as steered to the direction, castors as trailing behind it. Wheels are textbook wheels, which touch the
ground under their centre.
"""

from rollerbench.kinematics.limits.acceleration import max_acceleration
from rollerbench.kinematics.limits.efforts import wheel_efforts, wheel_loads
from rollerbench.kinematics.limits.isotropy import Isotropy, isotropy
from rollerbench.kinematics.limits.polygon import SpeedPolygon, speed_polygon
from rollerbench.kinematics.limits.result import CAUSES, Limit
from rollerbench.kinematics.limits.speed import max_speed, max_yaw_rate

__all__ = [
    "CAUSES",
    "Isotropy",
    "Limit",
    "SpeedPolygon",
    "isotropy",
    "max_acceleration",
    "max_speed",
    "max_yaw_rate",
    "speed_polygon",
    "wheel_efforts",
    "wheel_loads",
]
