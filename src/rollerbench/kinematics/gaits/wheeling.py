"""Driving on the feet's wheels: powered castors where the last joint steers, swerve steering where the leg does."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UPRIGHT = 0.98
"""A last joint whose axis is this upright (cosine) makes a castor of its foot [-]."""

LEAST_TRAIL = 0.005
"""Feet closer to the last joint's axis are no castors [m]."""

STEERING_SPEED = 2.0
"""Speed at which swerving wheels steer [rad/s]."""

ALIGNED = np.radians(1.0)
"""Wheels this well aligned with the command may start [rad]."""

STANDSTILL = 1e-3
"""Feet that shall be slower steer nowhere [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wheeling:
    """Places and directions of the feet's wheels while the robot drives on them, in B without its offset.

    Attributes:
        castor: Which legs (k,) are castors: their foot trails behind the upright axis of the last joint.
        pivot: Where these axes meet the ground (k, 2) [m].
        trail: Distances (k,) of the feet from them [m].
        bearing: Directions (k,) from the axes to the feet [rad].
        contact: Where the feet are (k, 2) [m].
        heading: Directions (k,) in which the wheels roll ahead [rad].
        rate: How fast these turn (k,) [rad/s].
        wound_up: Whether a leg has turned so far that the drive has to be interrupted.
    """

    castor: NDArray[np.bool_]
    pivot: Array
    trail: Array
    bearing: Array
    contact: Array
    heading: Array
    rate: Array
    wound_up: bool = False


def wheeling_from(contact: Array, heading: Array, pivot: Array, upright: Array) -> Wheeling:
    """The start of a drive.

    Args:
        contact: Where the feet are (k, 2), in B [m].
        heading: Directions (k,) in which their wheels roll ahead [rad].
        pivot: Where the axes of the last joints are (k, 2) [m].
        upright: Cosines (k,) of these axes' inclinations [-].
    """
    arm = contact - pivot
    trail = np.hypot(*arm.T)
    bearing = np.arctan2(arm[:, 1], arm[:, 0])
    castor = (np.abs(upright) > UPRIGHT) & (trail > LEAST_TRAIL)
    return Wheeling(
        castor=castor, pivot=pivot, trail=trail, bearing=bearing, contact=contact, heading=heading, rate=0 * heading
    )


def aligned(wheeling: Wheeling, v_xyw_B: Array) -> bool:
    """Whether the wheels may start with a twist (3,): castors always, others if they are steered to it."""
    velocity = _velocity(wheeling.contact, v_xyw_B)
    off = _to_line(np.arctan2(velocity[:, 1], velocity[:, 0]) - wheeling.heading)
    waits = ~wheeling.castor & (np.hypot(*velocity.T) > STANDSTILL) & (np.abs(off) > ALIGNED)
    return not waits.any()


def advanced(wheeling: Wheeling, v_xyw_B: Array, steer_to: Array, dt: float) -> Wheeling:
    """A moment dt later [s].

    A castor's foot must not slip sideways: with the velocity v of its axis and the normal n left of the bearing,
    trail (bearing' + w) = -v . n. Other wheels steer to the velocity of their contact, by the shorter turn.

    Args:
        wheeling: The present.
        v_xyw_B: Mean body twist (3,) [m/s, m/s, rad/s].
        steer_to: The twist (3,) for which swerving wheels steer.
        dt: How much later [s].
    """
    v_pivot, w = _velocity(wheeling.pivot, v_xyw_B), v_xyw_B[2]
    trail = np.maximum(wheeling.trail, LEAST_TRAIL)

    def rate(bearing: Array) -> Array:
        return (np.sin(bearing) * v_pivot[:, 0] - np.cos(bearing) * v_pivot[:, 1]) / trail - w

    middle = wheeling.bearing + 0.5 * dt * rate(wheeling.bearing)
    turned = np.where(wheeling.castor, dt * rate(middle), 0.0)
    bearing = wheeling.bearing + turned
    arm = wheeling.trail[:, np.newaxis] * np.column_stack([np.cos(bearing), np.sin(bearing)])
    contact = np.where(wheeling.castor[:, np.newaxis], wheeling.pivot + arm, wheeling.contact)
    velocity = _velocity(wheeling.contact, steer_to)
    off = _to_line(np.arctan2(velocity[:, 1], velocity[:, 0]) - wheeling.heading)
    steering = np.clip(off, -STEERING_SPEED * dt, STEERING_SPEED * dt)
    steering = np.where(wheeling.castor | wheeling.wound_up | (np.hypot(*velocity.T) <= STANDSTILL), 0.0, steering)
    turned = turned + steering
    return replace(wheeling, bearing=bearing, contact=contact, heading=wheeling.heading + turned, rate=turned / dt)


def trailing_turn(wheeling: Wheeling, v_xyw_B: Array) -> Array:
    """By how much castors (k,) have to turn to trail behind their axes at a twist (3,); 0 for others [rad]."""
    velocity = _velocity(wheeling.pivot, v_xyw_B)
    off = np.arctan2(-velocity[:, 1], -velocity[:, 0]) - wheeling.bearing
    turns = wheeling.castor & (np.hypot(*velocity.T) > STANDSTILL)
    return np.where(turns, np.arctan2(np.sin(off), np.cos(off)), 0.0)


def _velocity(points: Array, v_xyw_B: Array) -> Array:
    """Velocities (k, 2) of points (k, 2) fixed in B [m/s]."""
    vx, vy, w = v_xyw_B
    return np.column_stack([vx - w * points[:, 1], vy + w * points[:, 0]])


def _to_line(angle: Array) -> Array:
    """Angles between directions as angles between lines, from -90 to 90 deg [rad]."""
    return 0.5 * np.arctan2(np.sin(2 * angle), np.cos(2 * angle))
