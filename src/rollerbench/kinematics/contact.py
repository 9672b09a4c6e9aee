"""Where the wheels of a moving robot touch level ground, and how fast they slip there.

Tyres and rollers are ellipsoids of revolution: semi-axis a along a unit vector u, r across. The depth of their lowest
point below the centre is h = sqrt(r^2 + (a^2 - r^2) u_z^2), and it lies at -(r^2 z + (a^2 - r^2) u_z u) / h.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description import AnyWheel, Robot
from rollerbench.description.rollers import rotate_about_axle

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotMotion:
    """States of a robot over n samples; W is the world with level ground at z = 0.

    Attributes:
        p_WB: Positions (n, 3) of Bo [m].
        R_WB: Rotations (n, 3, 3) of B.
        v_WB: Velocities (n, 3) of Bo in W [m/s].
        w_WB: Angular velocities (n, 3) of B in W [rad/s].
        wheel_angles: Angles (n, n_wheels) about the axles [rad].
        wheel_speeds: Their rates [rad/s].
        swivel_angles: Angles (n, n_wheels) of castors and steered wheels [rad], 0 for others.
        swivel_rates: Their rates [rad/s].
        roller_speeds: Speeds (n, count) of the rollers about their axes by wheel name [rad/s].
    """

    p_WB: Array
    R_WB: Array
    v_WB: Array
    w_WB: Array
    wheel_angles: Array
    wheel_speeds: Array
    swivel_angles: Array
    swivel_rates: Array
    roller_speeds: dict[str, Array]

    @property
    def q_xyt(self) -> Array:
        """Planar poses (n, 3) of B in W; the yaw counts full turns [m, m, rad]."""
        yaw = np.unwrap(np.arctan2(self.R_WB[:, 1, 0], self.R_WB[:, 0, 0]))
        return np.column_stack([self.p_WB[:, :2], yaw])

    @property
    def v_xyw_B(self) -> Array:
        """Planar twists (n, 3) of Bo in B turned upright [m/s, m/s, rad/s]."""
        cos, sin = np.cos(self.q_xyt[:, 2]), np.sin(self.q_xyt[:, 2])
        vx, vy = self.v_WB[:, 0], self.v_WB[:, 1]
        return np.column_stack([cos * vx + sin * vy, cos * vy - sin * vx, self.w_WB[:, 2]])


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelContact:
    """The deepest contact of one wheel with the ground, over n samples.

    Attributes:
        p_WC: Contact points (n, 3) at the height of the ground [m].
        depth: Penetrations (n,) [m], negative where the wheel is in the air.
        slip_W: Velocities (n, 3) of the wheel's or roller's surface over the ground [m/s].
        roller: Index (n,) of the roller that touches; 0 for a tyre.
    """

    p_WC: Array
    depth: Array
    slip_W: Array
    roller: NDArray[np.intp]


def wheel_contact(robot: Robot, wheel: AnyWheel, motion: RobotMotion) -> WheelContact:
    """The deepest contact of a wheel with level ground at z = 0."""
    index = robot.wheel_names.index(wheel.name)
    n = len(motion.p_WB)
    heading = wheel.heading + motion.swivel_angles[:, index]
    zeros = np.zeros(n)
    forward_B = np.column_stack([np.cos(heading), np.sin(heading), zeros])
    axle_B = np.column_stack([-np.sin(heading), np.cos(heading), zeros])

    # The hub: its centre, rotation and velocities.
    p_BoHo_B = wheel.p_BoHo_B - wheel.swivel_offset * forward_B
    r_W = _apply(motion.R_WB, p_BoHo_B)
    p_WH = motion.p_WB + r_W
    up_W, axle_W = motion.R_WB[:, :, 2], _apply(motion.R_WB, axle_B)
    swivel_W = motion.swivel_rates[:, index, np.newaxis] * up_W
    arm_W = _apply(motion.R_WB, -wheel.swivel_offset * forward_B)
    v_WH = motion.v_WB + np.cross(motion.w_WB, r_W) + np.cross(swivel_W, arm_W)
    w_WH = motion.w_WB + swivel_W + motion.wheel_speeds[:, index, np.newaxis] * axle_W
    R_WF = motion.R_WB @ Rotation.from_euler("z", heading[:, np.newaxis]).as_matrix()

    # The ellipsoids, all of them: heights only.
    a, r, centers_H, axes_H = _ellipsoids(wheel)
    angle = motion.wheel_angles[:, index, np.newaxis]
    centers_F = rotate_about_axle(np.broadcast_to(angle, (n, len(centers_H))), centers_H)
    axes_F = rotate_about_axle(np.broadcast_to(angle, (n, len(axes_H))), axes_H)
    up_F = R_WF[:, 2, np.newaxis, :]
    rise = np.sum(axes_F * up_F, axis=-1)
    drop = np.sqrt(r**2 + (a**2 - r**2) * rise**2)
    low = p_WH[:, 2, np.newaxis] + np.sum(centers_F * up_F, axis=-1) - drop

    # The lowest one.
    k = np.argmin(low, axis=1)
    rows = np.arange(n)
    u = _apply(R_WF, axes_F[rows, k])
    center = p_WH + _apply(R_WF, centers_F[rows, k])
    rise, drop = rise[rows, k, np.newaxis], drop[rows, k, np.newaxis]
    p_WC = center - ((a**2 - r**2) * rise * u + r**2 * np.array([0.0, 0.0, 1.0])) / drop
    p_WC[:, 2] = 0.0
    slip = v_WH + np.cross(w_WH, p_WC - p_WH)
    if wheel.name in motion.roller_speeds:
        spin = motion.roller_speeds[wheel.name][rows, k, np.newaxis]
        slip += spin * np.cross(u, p_WC - center)
    return WheelContact(p_WC=p_WC, depth=-low[rows, k], slip_W=slip, roller=k)


def _ellipsoids(wheel: AnyWheel) -> tuple[float, float, Array, Array]:
    """Semi-axes along and across, centres (k, 3) and axes (k, 3) in H of a wheel's tyre or rollers."""
    ring = wheel.ring
    if ring is None:
        return 0.5 * wheel.width, wheel.radius, np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])
    return ring.semi_axis, ring.roller_radius, ring.centers_H, ring.axes_H


def _apply(rotations: Array, vectors: Array) -> Array:
    product: Array = np.einsum("nij,nj->ni", rotations, vectors)
    return product
