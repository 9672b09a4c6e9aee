"""A leg by its way: the twist per unit of it, at equal steps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.odometry import rotate
from rollerbench.kinematics.paths.legs import Leg

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """A leg by its way s: dx^2 + dy^2 + r^2 dyaw^2 = ds^2, with the twist b per s'.

    Attributes:
        s: Ways (2n + 1,), at the starts, middles and ends of n intervals [m].
        b: Twists (2n + 1, 3) per unit of the way.
    """

    s: Array
    b: Array

    @property
    def changes(self) -> Array:
        """How b changes with the way at the start, the middle and the end of each interval (3, n, 3).

        Each is taken from its interval alone: where the curvature has a kink, differences across it would swing.
        """
        first, middle, last = self.b[:-2:2], self.b[1::2], self.b[2::2]
        steps = np.diff(self.s[::2])[:, np.newaxis]
        return np.stack([-3 * first + 4 * middle - last, last - first, first - 4 * middle + 3 * last]) / steps


def metric(robot: Robot) -> Array:
    """What a twist (3,) counts in the way: 1, 1 and the radius r of the wheels about Bo, as root mean square [m]."""
    arms = np.array([wheel.p_BoHo_B[:2] for wheel in robot.wheels])
    return np.array([1.0, 1.0, float(np.sqrt(np.mean(np.sum(arms**2, axis=1)))) or 1.0])


def course(each: Leg, robot: Robot, count: int) -> Course:
    """A leg in a number of intervals of equal ways.

    Raises:
        KinematicsError: the leg stands still on its way, or turns back on itself.
    """
    scale = metric(robot)
    path = CubicSpline(np.linspace(0, 1, len(each.q_xyt)), each.q_xyt)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    u = np.linspace(0, 1, 2 * len(each.q_xyt) + 1)
    inner = u[:-1, np.newaxis] + 0.5 * np.diff(u)[:, np.newaxis] * (1 + nodes)
    pace = np.linalg.norm(path(inner, 1) * scale, axis=-1)
    way = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(u) * (pace @ weights))])
    slope = path(u, 1) * scale
    pace = np.linalg.norm(slope, axis=-1)
    back = np.sum(slope[1:] * slope[:-1], axis=-1) < 0
    if back.any():
        at = path(u[int(np.argmax(back))])
        raise KinematicsError(
            f"a leg turns back on itself, or too sharply for its nodes, at x, y, yaw = "
            f"{', '.join(f'{value:.4g}' for value in at)}: accepted: smooth legs (a larger deviation at corners), each "
            "from rest to rest; where a robot turns back one ends and the next begins"
        )
    if not way[-1] > 0 or pace.min() < 1e-6 * way[-1]:
        raise KinematicsError("a leg stands still on its way: accepted: legs whose parameter always moves the robot")
    s = np.linspace(0, way[-1], 2 * count + 1)
    u = CubicHermiteSpline(way, u, 1 / pace)(s)
    yaw, slope = path(u)[:, 2], path(u, 1)
    slope /= np.linalg.norm(slope * scale, axis=-1)[:, np.newaxis]
    along = rotate(-yaw, slope[:, :2])
    if each.tangent:
        # Exactly, not but for the spline's error: tyres allow nothing else.
        along = np.column_stack([np.hypot(along[:, 0], along[:, 1]), np.zeros(len(s))])
    return Course(s=s, b=np.column_stack([along, slope[:, 2]]))
