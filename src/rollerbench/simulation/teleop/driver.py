"""From what a hand asks for to what the wheels are told, period by period: pure equations."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics import WheelKinematics, odometry
from rollerbench.kinematics.steering import steering_step
from rollerbench.kinematics.twist_limits import TwistLimits, twist_limits
from rollerbench.simulation.teleop.ranges import Ranges, fixed_tyres, wheel_ranges, with_steering_speeds

Array = NDArray[np.float64]

NOTICEABLE = 1e-6
"""Share by which a twist must change before that is worth a word [-]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wish:
    """What a hand asks for.

    Attributes:
        mode: Which of the two counts: the "twist", or the "wheels", each by itself.
        v_xyw_B: Body twist (3,) [m/s, m/s, rad/s].
        wheel_speeds: Speeds (n_driven,) of the driven wheels [rad/s].
        steering_angles: Angles (n_steered,) of the steered wheels from heading_deg [rad].
    """

    mode: Literal["twist", "wheels"]
    v_xyw_B: Array
    wheel_speeds: Array
    steering_angles: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Told:
    """What the wheels are told for a period, and where that leads.

    Attributes:
        v_xyw_B: Twist (3,) on the way to the one that is asked for [m/s, m/s, rad/s].
        wheel_speeds: Speeds (n_driven,) of the driven wheels [rad/s].
        steering_angles: Angles (n_steered,) of the steered wheels from heading_deg at the end of the period [rad].
        steering_rates: How fast (n_steered,) these turn [rad/s].
        ghost: Pose (3,) at the end of the period that the equations alone predict [m, m, rad].
    """

    v_xyw_B: Array
    wheel_speeds: Array
    steering_angles: Array
    steering_rates: Array
    ghost: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Preview:
    """What a wish comes to, once limits of acceleration no longer count.

    Attributes:
        v_xyw_B: Twist (3,) [m/s, m/s, rad/s].
        wheel_speeds: Speeds (n_driven,) [rad/s].
        steering_angles: Angles (n_steered,) [rad].
        contradiction: By how much the wheels contradict each other [m/s]: the fastest that a driven wheel must slide
            along, or a tyre across.
        notes: What of it is impossible, in words.
    """

    v_xyw_B: Array
    wheel_speeds: Array
    steering_angles: Array
    contradiction: float
    notes: tuple[str, ...] = ()


class WheelDriver:
    """Drives a robot on wheels as it is asked to, within its limits.

    Attributes:
        kinematics: The equations, of a robot whose steering speeds are limited.
        ranges: What it can be told.
        limits: What these mean for twists.
        period: Period of control [s].
    """

    def __init__(self, kinematics: WheelKinematics, period: float) -> None:
        """Prepares the limits.

        Args:
            kinematics: The robot's equations.
            period: Period of control [s].

        Raises:
            KinematicsError: the driven wheels and tyres do not determine the twist.
        """
        self.kinematics = WheelKinematics(with_steering_speeds(kinematics.robot), rollers=kinematics.rollers)
        assert self.kinematics.forward_matrix is not None
        self.ranges: Ranges = wheel_ranges(self.kinematics)
        self.period = period
        names = [wheel.name for wheel in self.kinematics.robot.driven_wheels]
        self.limits: TwistLimits = twist_limits(
            self.kinematics,
            period,
            max_wheel_speed=dict(zip(names, self.ranges.wheel_speeds.tolist(), strict=True)),
            max_wheel_acceleration=dict(zip(names, self.ranges.wheel_accelerations.tolist(), strict=True)),
        )
        wheels = self.kinematics.robot.wheels
        self._steered = [index for index, wheel in enumerate(wheels) if wheel.steered]
        self._tyres = fixed_tyres(self.kinematics.robot)

    def start(self) -> Told:
        """At rest at the origin."""
        still = np.zeros(len(self._steered))
        return Told(
            v_xyw_B=np.zeros(3),
            wheel_speeds=np.zeros(len(self.ranges.wheel_speeds)),
            steering_angles=still,
            steering_rates=still,
            ghost=np.zeros(3),
        )

    def rest(self, told: Told) -> Wish:
        """To stand still, with the wheels steered as they are."""
        return Wish(
            mode="twist",
            v_xyw_B=np.zeros(3),
            wheel_speeds=np.zeros_like(told.wheel_speeds),
            steering_angles=told.steering_angles,
        )

    def step(self, told: Told, wish: Wish) -> Told:
        """What the wheels are told for the next period.

        Twists and wheel speeds approach what is asked for as fast as the wheels may speed up, steering angles the
        shorter way.
        """
        if wish.mode == "twist":
            target, _ = self._allowed(wish.v_xyw_B)
            twist = self.limits.approach(told.v_xyw_B, target)
            speeds, angles = self._follow(twist, told.steering_angles, self.period)
        else:
            speeds, angles = wish.wheel_speeds, self._steer(told.steering_angles, wish.steering_angles)
        change = self.limits.speed_changes
        # On the way from wheels that contradict each other to a twist, and where wheels steer, these are more than it.
        speeds = np.clip(speeds, told.wheel_speeds - change, told.wheel_speeds + change)
        speeds = np.clip(speeds, -self.ranges.wheel_speeds, self.ranges.wheel_speeds)
        moved = self._forward(speeds, 0.5 * (told.steering_angles + angles))
        if wish.mode == "wheels":
            twist = self._resumed(moved, speeds)
        return Told(
            v_xyw_B=twist,
            wheel_speeds=speeds,
            steering_angles=angles,
            steering_rates=(angles - told.steering_angles) / self.period,
            ghost=odometry.integrate(told.ghost, moved, self.period),
        )

    def preview(self, told: Told, wish: Wish) -> Preview:
        """What a wish comes to, from steering angles as they are told."""
        notes: tuple[str, ...] = ()
        if wish.mode == "twist":
            twist, notes = self._allowed(wish.v_xyw_B)
            speeds, angles = self._follow(twist, told.steering_angles, np.inf)
        else:
            largest = self.ranges.wheel_speeds
            speeds, angles = np.clip(wish.wheel_speeds, -largest, largest), wish.steering_angles
            twist = self._forward(speeds, angles)
        now = self._steered_to(angles)
        radii = np.array([wheel.radius for wheel in now.robot.driven_wheels])
        sliding = np.concatenate([radii * (speeds - now.drive_matrix @ twist), now.constraint_matrix @ twist])
        return Preview(
            v_xyw_B=twist,
            wheel_speeds=speeds,
            steering_angles=angles,
            contradiction=float(np.abs(sliding).max(initial=0.0)),
            notes=notes,
        )

    def _allowed(self, v_xyw_B: Array) -> tuple[Array, tuple[str, ...]]:
        """The closest twist (3,) at which no fixed tyre skids, no faster than the wheels may; and what it lost."""
        notes = []
        feasible = self.kinematics.project(v_xyw_B, self._tyres)
        if np.abs(feasible - v_xyw_B).max() > NOTICEABLE * np.abs(v_xyw_B).max():
            names = ", ".join(self.kinematics.robot.wheels[index].name for index in self._tyres)
            notes.append(f"tyres would skid ({names}): the closest twist without that")
        loads = self.limits.wheel_speeds(feasible) / self.limits.speeds
        if loads.max() > 1 + NOTICEABLE:
            slowest = self.limits.wheel_names[int(np.argmax(loads))]
            notes.append(f"{slowest} can turn no faster: {100 / loads.max():.0f} % of the twist")
        return self.limits.scale(feasible), tuple(notes)

    def _resumed(self, moved: Array, speeds: Array) -> Array:
        """The twist (3,) from which to go on after wheel speeds: what they make, braked no later than they are.

        Wheels that contradict each other may make one at which, by itself, they would turn faster than they do.
        """
        twist = self.kinematics.project(moved, self._tyres)
        needed = (self.limits.wheel_speeds(twist) / self.limits.speed_changes).max()
        present = (np.abs(speeds) / self.limits.speed_changes).max()
        return twist * (present / needed) if needed > present else twist

    def _follow(self, twist: Array, angles: Array, period: float) -> tuple[Array, Array]:
        """Wheel speeds and steering angles at a twist, from steering angles a period before."""
        if not self._steered:
            return self.kinematics.inverse(twist, strict=False), angles
        step = steering_step(self.kinematics, twist, angles, period)
        return step.wheel_speeds, step.angles

    def _steer(self, angles: Array, wanted: Array) -> Array:
        """Steering angles a period later, on the shorter way to those wanted."""
        turn = (wanted - angles + np.pi) % (2 * np.pi) - np.pi
        most = self.ranges.steering_speeds * self.period
        return angles + np.clip(turn, -most, most)

    def _forward(self, speeds: Array, angles: Array) -> Array:
        """Twist (3,) of wheel speeds and steering angles."""
        if not self._steered:
            return self.kinematics.forward(speeds)
        swivel = np.zeros(len(self.kinematics.robot.wheels))
        swivel[self._steered] = angles
        return self.kinematics.forward_at(speeds, swivel)

    def _steered_to(self, angles: Array) -> WheelKinematics:
        wheels = self.kinematics.robot.steered_wheels
        if not wheels:
            return self.kinematics
        return self.kinematics.swivelled({wheel.name: float(a) for wheel, a in zip(wheels, angles, strict=True)})
