"""Feedback that brings a base to a moving reference pose, by what its fixed tyres allow.

With the reference's twist v_r, the pose error e = [e_x, e_y, e_yaw] of the reference seen from the body, and gains k:

    no fixed tyres (any twist can be had, by steering if need be): each error decays on its own, as exp(-k t),
        [v_x, v_y] = R(e_yaw) [v_rx, v_ry] + k_position [e_x, e_y]
        w          = w_r + k_heading e_yaw

    tyres on one axle (a unicycle, a car steered in front): from its point A nearest to Bo, looking along the tyres,
        v = v_r cos(e_yaw) + k_position e_x
        w = w_r + k_lateral^2 v_r sinc(e_yaw) e_y + (k_heading + sqrt(2) k_lateral |v_r|) e_yaw

    tyres on several axles (one motion is left): the first law, projected on that motion.

The second law lets k_lateral^2 (e_x^2 + e_y^2) + e_yaw^2 fall at every time, and all errors vanish as long as the
reference does not come to rest. At rest no feedback moves such a base sideways.

Source: Canudas de Wit, Khennouf, Samson, Sordalen (1993), Nonlinear control design for mobile robots, for the second
law; De Luca, Oriolo, Vendittelli (2001) for gains that grow with the speed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.speed import speed_rows
from rollerbench.kinematics.mobility import null_space
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]
Vector = NDArray[Any]
"""Numbers, or objects that numpy computes with, such as Drake's Expressions."""

TINY = 1e-24
"""Keeps square roots from 0, where they have no derivative, without an effect on sin(x)/x or |x|."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackingGains:
    """Gains of pose tracking.

    Attributes:
        position: Rate at which errors of position decay [1/s].
        heading: Rate at which errors of heading decay [1/s].
        lateral: Inverse of the distance on which a base with fixed tyres comes back to its path [1/m].
    """

    position: float = 4.0
    heading: float = 4.0
    lateral: float = 5.0

    def __post_init__(self) -> None:
        """Checks the gains.

        Raises:
            KinematicsError: one is negative or not finite.
        """
        for name in ("position", "heading", "lateral"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise KinematicsError(f"gains: {name} = {value}: accepted: 0 or more")


DEFAULT_GAINS = TrackingGains()


def on_an_axle(kinematics: WheelKinematics) -> bool:
    """Whether the law is the one for tyres on one axle.

    Raises:
        KinematicsError: the kinematics' twists are not those of Bo.
    """
    return _free_twists(kinematics).shape[1] == 2


def tracking_law(
    kinematics: WheelKinematics, gains: TrackingGains = DEFAULT_GAINS
) -> Callable[[Vector, Vector, Vector], Vector]:
    """The law for a robot: a function of its pose, the reference's pose and twist, (3,) each, to the twist of Bo (3,).

    Raises:
        KinematicsError: the robot's tyres allow no motion, or the kinematics' twists are not those of Bo.
    """
    free = _free_twists(kinematics)
    if free.shape[1] == 0:
        raise KinematicsError(f"{kinematics.robot.name}: its tyres allow no motion at all, so it cannot track a pose")
    if on_an_axle(kinematics):
        place, heading = axle(kinematics)
        return lambda q, reference, twist: _on_an_axle(gains, place, heading, q, reference, twist)
    scale = np.array([1.0, 1.0, speed_rows(kinematics.robot).length])
    onto = free @ free.T * scale / scale[:, np.newaxis]
    if free.shape[1] == 3:
        return lambda q, reference, twist: _any_way(gains, q, reference, twist)
    return lambda q, reference, twist: onto @ _any_way(gains, q, reference, twist)


def axle(kinematics: WheelKinematics) -> tuple[Array, float]:
    """The point (2,) nearest to Bo of the axle on which all fixed tyres sit [m], and their heading [rad], in B.

    Raises:
        KinematicsError: there is no such axle, or the kinematics' twists are not those of Bo.
    """
    rows = speed_rows(kinematics.robot).tyre_rows
    if not on_an_axle(kinematics):
        raise KinematicsError(f"{kinematics.robot.name} has no single axle with fixed tyres")
    left, offset = rows[0, :2], rows[0, 2]
    along = np.array([left[1], -left[0]])
    if along[0] < 0 or (along[0] == 0 and along[1] < 0):
        along, offset = -along, -offset
    return offset * along, math.atan2(along[1], along[0])


def axle_speed(kinematics: WheelKinematics, v_xyw_B: Array) -> Array:
    """Speeds (...) along the tyres of the point `axle` at twists (..., 3) of Bo [m/s].

    Raises:
        KinematicsError: there is no such axle, or the kinematics' twists are not those of Bo.
    """
    (x, y), heading = axle(kinematics)
    cos, sin = math.cos(heading), math.sin(heading)
    speeds: Array = v_xyw_B @ np.array([cos, sin, sin * x - cos * y])
    return speeds


def pose_error(q_xyt: Vector, reference_q_xyt: Vector) -> Vector:
    """The reference's pose (3,) seen from a pose (3,): ahead, left [m], and the turn in [-pi, pi] [rad]."""
    dx, dy, turn = reference_q_xyt - q_xyt
    cos, sin = np.cos(q_xyt[2]), np.sin(q_xyt[2])
    return np.array([cos * dx + sin * dy, cos * dy - sin * dx, np.arctan2(np.sin(turn), np.cos(turn))])


def _any_way(gains: TrackingGains, q_xyt: Vector, reference_q_xyt: Vector, reference_v_xyw_B: Vector) -> Vector:
    ahead, left, turn = pose_error(q_xyt, reference_q_xyt)
    vx, vy, w = reference_v_xyw_B
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array(
        [
            cos * vx - sin * vy + gains.position * ahead,
            sin * vx + cos * vy + gains.position * left,
            w + gains.heading * turn,
        ]
    )


def _on_an_axle(
    gains: TrackingGains, place: Array, heading: float, q_xyt: Vector, reference_q_xyt: Vector, v_xyw_B: Vector
) -> Vector:
    ahead, left, turn = pose_error(_moved(q_xyt, place, heading), _moved(reference_q_xyt, place, heading))
    x, y = place
    along = np.array([math.cos(heading), math.sin(heading)])
    vx, vy, w = v_xyw_B
    speed = along[0] * (vx - w * y) + along[1] * (vy + w * x)
    some, pace = np.sqrt(turn * turn + TINY), np.sqrt(speed * speed + TINY)
    v = speed * np.cos(turn) + gains.position * ahead
    back = gains.lateral**2 * speed * (np.sin(some) / some) * left
    w = w + back + (gains.heading + math.sqrt(2) * gains.lateral * pace) * turn
    return np.array([v * along[0] + w * y, v * along[1] - w * x, w])


def _moved(q_xyt: Vector, place: Array, heading: float) -> Vector:
    """The pose of a frame of the body at a place (2,) and heading."""
    cos, sin = np.cos(q_xyt[2]), np.sin(q_xyt[2])
    x, y = place
    return np.array([q_xyt[0] + cos * x - sin * y, q_xyt[1] + sin * x + cos * y, q_xyt[2] + heading])


def _free_twists(kinematics: WheelKinematics) -> Array:
    """Basis (3, k) of the twists of Bo at which no fixed tyre skids, yaw rates times a length."""
    if kinematics.p_BoCo_B.any():
        raise KinematicsError(
            f"p_BoCo_B = {kinematics.p_BoCo_B.tolist()}: poses are tracked by twists of Bo; accepted: [0, 0]"
        )
    rows = speed_rows(kinematics.robot)
    return null_space(rows.tyre_rows / [1.0, 1.0, rows.length])
