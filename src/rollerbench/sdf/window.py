"""Which of a wheel's rollers are simulated where only those near the ground are."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rollerbench.description import Robot, RollerWheel
from rollerbench.description.inertia import RigidInertia
from rollerbench.description.mass import hub_with_rollers, roller_inertia
from rollerbench.description.rollers import RollerRing

DEFAULT_SIZE = 2
"""Simulated rollers of a wheel: on level ground it stands on one, or is handed over from one to the next."""

HYSTERESIS = 0.02
"""How much farther than half way to the next roller a wheel turns before the window follows it [pitches]."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """The rollers of one wheel that are simulated: `size` neighbours around the bottom.

    Rollers are counted on and on over the turns of the wheel, so that roller m is roller m mod count of the ring. The
    window from roller `first` holds first .. first + size - 1, roller m in slot m mod size; when the wheel turns on by
    a pitch, one slot changes its roller and the others stay.

    Attributes:
        wheel: The wheel.
        size: Number of simulated rollers, fewer than the wheel has.
    """

    wheel: RollerWheel
    size: int

    @cached_property
    def ring(self) -> RollerRing:
        """All rollers of the wheel."""
        return self.wheel.ring

    @cached_property
    def pitch(self) -> float:
        """Wheel angle from one roller to the next [rad]."""
        return self.ring.pitch

    @cached_property
    def cos_sin(self) -> tuple[float, float]:
        """Of the angle g from the axle to the rollers' axes."""
        return math.cos(self.ring.roller_angle), math.sin(self.ring.roller_angle)

    def first_at(self, wheel_angle: float) -> int:
        """First roller of the window whose middle is nearest to the bottom, at a wheel angle [rad]."""
        return round(-wheel_angle / self.pitch - 0.5 * (self.size - 1))

    def rollers(self, first: int) -> list[int]:
        """Rollers (size,) of the ring in the slots."""
        ring = [(slot, m % self.ring.count) for m in range(first, first + self.size) for slot in [m % self.size]]
        return [roller for _, roller in sorted(ring)]

    def hub_spin(self, roller: int, wheel_angle: Any, wheel_speed: Any, yaw_rate: Any) -> Any:
        """Angular velocity w_H . u of the hub along the axis u of a roller [rad/s].

        For a robot that is upright: cos(g) wheel_speed + sin(g) sin(phi + wheel_angle) yaw_rate, with the roller's
        angle phi on the ring and its axis at g from the axle.

        Args:
            roller: The roller, counted over the turns or not.
            wheel_angle: Angle about the axle [rad], a float or an array.
            wheel_speed: Its rate, likewise [rad/s].
            yaw_rate: Yaw rate of the body, likewise [rad/s].
        """
        cos_g, sin_g = self.cos_sin
        sin = np.sin if isinstance(wheel_angle, np.ndarray) else math.sin  # The scalar one is ten times as fast.
        return cos_g * wheel_speed + sin_g * sin(self.pitch * roller + wheel_angle) * yaw_rate

    def remembered(self, spin: Any, elapsed: Any, wheel_speed: Any) -> Any:
        """Angular velocity w_R . u of a roller along its axis, some time after it left the window [rad/s].

        Its joint's damping brings it to that of the hub, whose mean over a turn is cos(g) wheel_speed.

        Args:
            spin: Angular velocity with which it left, a float or an array [rad/s].
            elapsed: The time since, likewise [s]; negative if time was set back meanwhile, which counts as none.
            wheel_speed: Speed of the wheel about its axle, likewise [rad/s].
        """
        mean = self.cos_sin[0] * wheel_speed
        if isinstance(elapsed, np.ndarray):
            return mean + (spin - mean) * np.exp(-self.decay_rate * np.maximum(elapsed, 0.0))
        return mean + (spin - mean) * math.exp(-self.decay_rate * max(elapsed, 0.0))

    @cached_property
    def decay_rate(self) -> float:
        """Damping of a roller's joint over its inertia about its axis [1/s]."""
        return self.wheel.rollers.damping / self.roller_inertia

    @cached_property
    def roller_inertia(self) -> float:
        """Rotational inertia of a roller about its axis [kg m2]."""
        return float(roller_inertia(self.wheel).moment[0, 0])

    def hub_inertia(self, first: int) -> RigidInertia:
        """Mass distribution in H of the hub with the rollers that are not simulated."""
        held = set(range(self.ring.count)) - set(self.rollers(first))
        return hub_with_rollers(self.wheel, sorted(held))


def windows(robot: Robot, size: int = DEFAULT_SIZE) -> dict[str, Window]:
    """Windows of a robot's wheels by name; of those that have more rollers than a window."""
    return {
        wheel.name: Window(wheel=wheel, size=size)
        for wheel in robot.wheels
        if isinstance(wheel, RollerWheel) and wheel.ring.count > size
    }


def size_on_bumps(robot: Robot, height: float) -> int:
    """Size of windows for ground with bumps of a height [m].

    A wheel that stands beside a bump touches it at most at acos(1 - height / R) from the bottom, and a robot that
    stands on it with one side is inclined by height over its size.
    """
    needed = 0.0
    for wheel in robot.wheels:
        if wheel.ring is not None:
            angle = math.acos(1 - min(1.0, height / wheel.radius)) + math.atan2(height, robot.reach)
            needed = max(needed, 2 * (angle / wheel.ring.pitch + 0.5 + HYSTERESIS))
    return math.ceil(needed)


def reach(window: Window) -> float:
    """Angle from the bottom up to which a window's rollers always cover their wheel [rad].

    The window follows the bottom within half a pitch, and half a pitch of the last roller's own does not count.
    """
    return (0.5 * window.size - 0.5 - HYSTERESIS) * window.pitch
