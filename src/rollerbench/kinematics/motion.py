"""From a commanded twist or commanded wheel speeds to what every motor does, over time."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from rollerbench.kinematics.dynamics import RollingDynamics
from rollerbench.kinematics.profile import Profile
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]

STEERING_SAMPLE_TIME = 0.01
"""Spacing of the samples between which steering angles and speeds are interpolated [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """What the equations make of a command.

    Attributes:
        twist: Body twist (3) over time [m/s, m/s, rad/s].
        wheel_speeds: Speeds of the driven wheels over time [rad/s].
        steering_angles: Angles of the steered wheels over time [rad]; no columns if there are none.
        kinematics: The equations at the steering angles of the start.
        steers: Whether the steering angles change on the way.
        wheel_efforts: Torques of the driven wheels over time [N m], where these are commanded.
    """

    twist: Profile
    wheel_speeds: Profile
    steering_angles: Profile
    kinematics: WheelKinematics
    steers: bool
    wheel_efforts: Profile | None = None


def wheel_motion(kinematics: WheelKinematics, wheel_speeds: Profile) -> Motion:
    """The motion of commanded wheel speeds; steered wheels stay at their heading.

    Raises:
        KinematicsError: the wheel speeds do not determine the twist.
    """
    return Motion(
        twist=wheel_speeds.mapped(kinematics.forward_matrix),
        wheel_speeds=wheel_speeds,
        steering_angles=_constant(np.zeros(len(kinematics.robot.steered_wheels))),
        kinematics=kinematics,
        steers=False,
    )


def effort_motion(dynamics: RollingDynamics, wheel_efforts: Profile, duration: float, time_step: float) -> Motion:
    """The motion that commanded torques lead to from rest; steered wheels stay at their heading."""
    twist = dynamics.twist(wheel_efforts, duration, time_step)
    kinematics = dynamics.kinematics
    return Motion(
        twist=twist,
        wheel_speeds=twist.mapped(kinematics.drive_matrix),
        steering_angles=_constant(np.zeros(len(kinematics.robot.steered_wheels))),
        kinematics=kinematics,
        steers=False,
        wheel_efforts=wheel_efforts,
    )


def twist_motion(kinematics: WheelKinematics, twist: Profile, *, project: bool = False) -> Motion:
    """The motion of a commanded twist; steered wheels follow it, by the shorter turn.

    Args:
        kinematics: The equations.
        twist: The command.
        project: Whether an infeasible twist is projected on what is feasible, instead of refused.

    Raises:
        InfeasibleTwist: a tyre would skid, and project is not set.
    """
    robot = kinematics.robot
    if project:
        # Steered wheels follow; only tyres with a fixed axle restrict the twist.
        fixed = [i for i, wheel in enumerate(robot.wheels) if wheel.type == "fixed"]
        twist = Profile(
            breaks=twist.breaks,
            values=kinematics.project(twist.values, wheels=fixed),
            slopes=kinematics.project(twist.slopes, wheels=fixed),
        )
    times = _samples(twist)
    names = [wheel.name for wheel in robot.steered_wheels]
    angles = _steering(kinematics, times, twist(times))
    start = kinematics.swivelled({name: float(angle) for name, angle in zip(names, angles[0], strict=True)})
    if names and np.ptp(angles, axis=0).max() > 1e-9:
        return _steering_motion(start, twist, times, angles)
    start.require_feasible(twist(times))
    return Motion(
        twist=twist,
        wheel_speeds=twist.mapped(start.drive_matrix),
        steering_angles=_constant(angles[0]),
        kinematics=start,
        steers=False,
    )


def _steering_motion(start: WheelKinematics, twist: Profile, times: Array, angles: Array) -> Motion:
    """The motion of a twist on which steered wheels turn; fixed tyres must agree with all of it."""
    robot = start.robot
    values = twist(times)
    fixed = [i for i, wheel in enumerate(robot.wheels) if wheel.type == "fixed"]
    start.require_feasible(values, wheels=fixed)
    speeds = values @ start.drive_matrix.T
    _, steered = start.steering(values, previous=angles)
    for column, wheel in enumerate(robot.driven_wheels):
        if wheel.steered:
            speeds[:, column] = steered[:, robot.steered_wheels.index(wheel)]
    return Motion(
        twist=twist,
        wheel_speeds=_interpolated(times, speeds),
        steering_angles=_interpolated(times, angles),
        kinematics=start,
        steers=True,
    )


def _steering(kinematics: WheelKinematics, times: Array, twists: Array) -> Array:
    """Steering angles (n, n_steered) at times (n,) along twists (n, 3); at first those that the motion starts with."""
    n_steered = len(kinematics.robot.steered_wheels)
    angles = np.zeros((len(twists), n_steered))
    if not n_steered:
        return angles
    size = np.abs(twists).max(axis=1)
    moving = np.flatnonzero(size > 1e-9 * max(1e-12, size.max()))
    if not moving.size:
        return angles
    angles[: moving[0] + 1] = kinematics.steering(twists[moving[0]])[0]
    # One after the other: each wheel turns from where it was, at rest evenly to where the next motion needs it.
    for last, row in itertools.pairwise(moving):
        angles[row] = kinematics.steering(twists[row], previous=angles[last])[0]
        share = (times[last + 1 : row, np.newaxis] - times[last]) / (times[row] - times[last])
        s = share**2 * (3 - 2 * share)
        angles[last + 1 : row] = angles[last] + s * (angles[row] - angles[last])
    angles[moving[-1] :] = angles[moving[-1]]
    return angles


def _samples(profile: Profile) -> Array:
    """Times at the breaks, and in between as often as steering needs."""
    count = max(2, int(np.ceil(np.ptp(profile.breaks) / STEERING_SAMPLE_TIME)) + 1)
    return np.unique(
        np.round(np.concatenate([profile.breaks, np.linspace(profile.breaks[0], profile.breaks[-1], count)]), 9)
    )


def _interpolated(times: Array, values: Array) -> Profile:
    """Through samples (n, k) without overshoot."""
    return Profile(breaks=times, values=values, slopes=PchipInterpolator(times, values).derivative()(times))


def _constant(values: Array) -> Profile:
    return Profile(breaks=np.array([0.0, 1.0]), values=np.tile(values, (2, 1)), slopes=np.zeros((2, len(values))))
