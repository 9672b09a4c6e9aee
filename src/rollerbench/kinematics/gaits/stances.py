"""The postures of a robot as numbers: joints, feet, heights; and how far the legs reach from them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.kinematics import odometry
from rollerbench.kinematics.gaits.gait import Schedule
from rollerbench.kinematics.gaits.plan import rotation
from rollerbench.kinematics.gaits.plane import placed
from rollerbench.kinematics.gaits.smooth import bump, quintic
from rollerbench.kinematics.legs.group import Hold, LegGroup

Array = NDArray[np.float64]

REACH_TOLERANCE = 1e-4
"""Feet this close to their targets count as there [m]."""

SWING_CHECKS = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Parts of a swing at which it is checked whether feet reach it [-]."""

RESERVE = 1.2
"""How much faster than asked steady walking must be within reach, as starts and stops leave feet farther behind [-]."""

UNDER_HIP = 0.02
"""Feet this close to the axis of their hip stand under it [m]."""


class Stances:
    """What the legs of a robot do in each of its postures.

    Attributes:
        robot: The robot.
        group: Its legs.
        postures: Its postures by name.
        last: Index of the last joint of each leg.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.group = robot, LegGroup(robot)
        self.postures = {posture.name: posture for posture in robot.standing}
        self.last = [len(leg.links) - 1 for leg in robot.legs]
        self._q = {name: self.group.posture(name) for name in self.postures}
        self._holds = {name: self.group.hold(posture, self._q[name]) for name, posture in self.postures.items()}
        centers = {name: robot.feet_B(name) for name in self.postures}
        self._home = {name: feet[:, :2] for name, feet in centers.items()}
        self._heading = {name: self.group.headings(self.group.frames(q)) for name, q in self._q.items()}
        radius = self.group.wheel_radius
        self._height = {name: float(np.mean(radius - feet[:, 2])) for name, feet in centers.items()}

    def home(self, posture: str) -> Array:
        """Where the feet of a posture stand (k, 2), in B [m]."""
        return self._home[posture]

    def height(self, posture: str) -> float:
        """Height of Bo over the ground in a posture [m]."""
        return self._height[posture]

    def joints(self, posture: str) -> Array:
        """Joint angles (k, n) of a posture [rad]."""
        return self._q[posture]

    def holds(self, posture: str) -> Hold:
        """What a posture holds."""
        return self._holds[posture]

    def heading(self, posture: str) -> Array:
        """Directions (k,) in which the wheels of a posture roll ahead, in B [rad]."""
        return self._heading[posture]

    def under_hips(self, posture: str) -> bool:
        """Whether all feet of a posture stand under their hips."""
        away = self._home[posture] - self.hips
        return bool((np.hypot(*away.T) < UNDER_HIP).all())

    @property
    def hips(self) -> Array:
        """Where the axes of the hips are (k, 2), in B [m]."""
        return np.array([leg.hip[:2] for leg in self.robot.legs])

    def lowered(self, posture: str, height: float) -> Array:
        """Joint angles (k, n) of a posture with the body at another height [m], reached on the way there."""
        q, radius = self._q[posture], self.group.wheel_radius
        for h in np.linspace(self._height[posture], height, 25)[1:]:
            centers = np.column_stack([self._home[posture], radius - h])
            q, _, _ = self.group.inverse(centers, replace(self._holds[posture], near=q), iterations=8)
        return q

    def solve(self, posture: str, centers_B: Array) -> tuple[Array, bool]:
        """Joint angles (k, n) of a posture with the feet's centres elsewhere (k, 3), and whether the legs reach."""
        q, _, missed = self.group.inverse(centers_B, self._holds[posture], iterations=25)
        return q, bool(missed.max() < REACH_TOLERANCE and not self.group.beyond_limits(q).any())

    def reachable_share(self, posture: str, gait: Schedule, v_xyw_B: Array, offset: Array) -> float:
        """The largest share, up to 1, of a twist (3,) at which all feet reach where a gait puts them.

        Args:
            posture: Name of the posture.
            gait: The gait.
            v_xyw_B: The twist [m/s, m/s, rad/s].
            offset: Offset (6,) of the body from where the posture has it: x, y, z [m], roll, pitch, yaw [rad].
        """
        return _largest(lambda share: self._reaches(posture, gait, share * v_xyw_B, offset))

    def offset_share(self, posture: str, offset: Array) -> float:
        """The largest share, up to 1, of an offset (6,) of the body that feet at home reach from."""
        feet = np.column_stack([self._home[posture], self.group.wheel_radius])

        def reaches(share: float) -> bool:
            place = np.array([*share * offset[:2], self._height[posture] + share * offset[2]])
            return self.solve(posture, (feet - place) @ rotation(*share * offset[3:]))[1]

        return _largest(reaches)

    def _reaches(self, posture: str, gait: Schedule, v_xyw_B: Array, offset: Array) -> bool:
        """Whether feet reach all places of a period of steady walking."""
        half, swing = 0.5 * gait.duty * gait.gait.period, (1 - gait.duty) * gait.gait.period
        turned = rotation(*offset[3:])
        place = np.array([offset[0], offset[1], self._height[posture] + offset[2]])

        def after(time: float) -> Array:
            """Where feet (k, 2) on the ground are this long after they were home [s]."""
            return placed(odometry.integrate(np.zeros(3), -RESERVE * v_xyw_B, time), self._home[posture])

        strides = [(after(part * half), 0.0) for part in (-1.0, -0.5, 0.5, 1.0)]
        for u in SWING_CHECKS:
            # Near its ends a swing reaches farther than the stance, for the body goes on.
            s = quintic(u)
            flat = (1 - s) * after(half + u * swing) + s * after(-half - (1 - u) * swing)
            strides.append((flat, gait.gait.lift * float(bump(u))))
        for feet, height in strides:
            centers = np.column_stack([feet, height + self.group.wheel_radius])
            if not self.solve(posture, (centers - place) @ turned)[1]:
                return False
        return True


def _largest(reaches: Callable[[float], bool]) -> float:
    """The largest share, up to 1, that is reached, to the seventh bisection."""
    if reaches(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(7):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reaches(middle) else (low, middle)
    return low
