"""Where the wheels of a moving robot touch level ground or bumps on it, and how fast they slip there.

Tyres and rollers are ellipsoids of revolution: semi-axis a along a unit vector u, r across. The depth of their lowest
point below the centre is h = sqrt(r^2 + (a^2 - r^2) u_z^2), and it lies at -(r^2 z + (a^2 - r^2) u_z u) / h. A sphere
presses in by its radius less the distance of its centre from the ellipsoid.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from rollerbench.description import AnyWheel, Robot
from rollerbench.description.rollers import rotate_about_axle
from rollerbench.kinematics.bumps import Bumps, nearest_on_ellipsoid

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
        p_WC: Contact points (n, 3) on the ground or bump [m].
        normal_W: Unit normals (n, 3) of the ground or bump there.
        depth: Penetrations (n,) [m], negative where the wheel is in the air.
        slip_W: Velocities (n, 3) of the wheel's or roller's surface over the ground, along it [m/s].
        roller: Index (n,) of the roller that touches; 0 for a tyre.
        drive_W: Directions (n, 3) d in which the wheel holds the ground, scaled to a part of 1 along its heading: that
            of the roller's axis, for a tyre the heading.
        rolling_radius: Lengths (n,) r of the equation that the wheel really obeys [m]: with the velocity v_C of the
            body's material over the contact, d . v_C = r q' + d . slip.
    """

    p_WC: Array
    normal_W: Array
    depth: Array
    slip_W: Array
    roller: NDArray[np.intp]
    drive_W: Array
    rolling_radius: Array


def wheel_contact(robot: Robot, wheel: AnyWheel, motion: RobotMotion, bumps: Bumps | None = None) -> WheelContact:
    """The deepest contact of a wheel with level ground at z = 0, and with bumps on it."""
    p_WH, v_WH, w_WH = _hub_motion(robot, wheel, motion)
    shapes = _moving_ellipsoids(robot, wheel, motion, p_WH)
    places = _on_level_ground(shapes)
    if bumps is not None and len(bumps.radii):
        _deepen(places, shapes, bumps, p_WH, reach=float(np.hypot(wheel.radius, wheel.width)))

    p_WC, normal_W = places.p_WC, places.normal_W
    velocity = v_WH + np.cross(w_WH, p_WC - p_WH)
    if wheel.name in motion.roller_speeds:
        touching = (np.arange(len(p_WC)), places.shape)
        spin = motion.roller_speeds[wheel.name][touching][:, np.newaxis]
        velocity += spin * np.cross(shapes.axes_W[touching], p_WC - shapes.centers_W[touching])
    slip = velocity - np.sum(velocity * normal_W, axis=1, keepdims=True) * normal_W
    # A wheel in the air would roll on its lowest point, not on that point's shadow.
    lowest = p_WC - p_WH + np.maximum(0.0, -places.depth)[:, np.newaxis] * normal_W
    drive_W, rolling_radius = _drive_equation(robot, wheel, motion, shapes, places, lowest)
    return WheelContact(
        p_WC=p_WC,
        normal_W=normal_W,
        depth=places.depth,
        slip_W=slip,
        roller=places.shape,
        drive_W=drive_W,
        rolling_radius=rolling_radius,
    )


@dataclass(frozen=True, slots=True)
class _Ellipsoids:
    """k ellipsoids of revolution over n samples: semi-axes, centres (n, k, 3) and axes (n, k, 3) in W."""

    a: float
    r: float
    centers_W: Array
    axes_W: Array

    @property
    def drops(self) -> Array:
        """Heights (n, k) of the centres above their lowest points [m]."""
        drops: Array = np.sqrt(self.r**2 + (self.a**2 - self.r**2) * self.axes_W[..., 2] ** 2)
        return drops


@dataclass(frozen=True, slots=True)
class _Places:
    """Where the deepest of a wheel's ellipsoids touches, over n samples; see `WheelContact`."""

    p_WC: Array
    normal_W: Array
    depth: Array
    shape: NDArray[np.intp]


def _drive_equation(
    robot: Robot, wheel: AnyWheel, motion: RobotMotion, shapes: _Ellipsoids, places: _Places, p_HC_W: Array
) -> tuple[Array, Array]:
    """`WheelContact.drive_W` and `WheelContact.rolling_radius`.

    A roller turns about its axis u, so its surface moves across u, and the hub's turn alone moves it along u.
    """
    R_WF = _heading_frames(robot, wheel, motion)
    forward_W, axle_W, normal_W = R_WF[:, :, 0], R_WF[:, :, 1], places.normal_W
    if wheel.ring is None:
        along = np.cross(axle_W, normal_W)
    else:
        u = shapes.axes_W[np.arange(len(normal_W)), places.shape]
        along = u - np.sum(u * normal_W, axis=1, keepdims=True) * normal_W
    drive = along / np.sum(along * forward_W, axis=1, keepdims=True)
    return drive, -np.sum(np.cross(axle_W, p_HC_W) * drive, axis=1)


def _heading_frames(robot: Robot, wheel: AnyWheel, motion: RobotMotion) -> Array:
    """Rotations (n, 3, 3) in W of a wheel's frame: x ahead, y along the axle."""
    heading = wheel.heading + motion.swivel_angles[:, robot.wheel_names.index(wheel.name)]
    frames: Array = motion.R_WB @ Rotation.from_euler("z", heading[:, np.newaxis]).as_matrix()
    return frames


def _hub_motion(robot: Robot, wheel: AnyWheel, motion: RobotMotion) -> tuple[Array, Array, Array]:
    """Positions, velocities and angular velocities (n, 3) of a wheel's hub in W."""
    index = robot.wheel_names.index(wheel.name)
    R_WF = _heading_frames(robot, wheel, motion)
    arm_W = -wheel.swivel_offset * R_WF[:, :, 0]
    r_W = motion.R_WB @ wheel.p_BoHo_B + arm_W
    swivel_W = motion.swivel_rates[:, index, np.newaxis] * motion.R_WB[:, :, 2]
    v_WH = motion.v_WB + np.cross(motion.w_WB, r_W) + np.cross(swivel_W, arm_W)
    turning_W = motion.wheel_speeds[:, index, np.newaxis] * R_WF[:, :, 1]
    return motion.p_WB + r_W, v_WH, motion.w_WB + swivel_W + turning_W


def _moving_ellipsoids(robot: Robot, wheel: AnyWheel, motion: RobotMotion, p_WH: Array) -> _Ellipsoids:
    """The ellipsoids of a wheel whose hub is at p_WH (n, 3)."""
    index = robot.wheel_names.index(wheel.name)
    R_WF = _heading_frames(robot, wheel, motion)
    a, r, centers_H, axes_H = _ellipsoids(wheel)
    angle = np.broadcast_to(motion.wheel_angles[:, index, np.newaxis], (len(p_WH), len(centers_H)))
    centers_W = p_WH[:, np.newaxis] + rotate_about_axle(angle, centers_H) @ R_WF.transpose(0, 2, 1)
    axes_W = rotate_about_axle(angle, axes_H) @ R_WF.transpose(0, 2, 1)
    return _Ellipsoids(a, r, centers_W, axes_W)


def _on_level_ground(shapes: _Ellipsoids) -> _Places:
    """Contacts of the lowest ellipsoids with the plane z = 0."""
    low = shapes.centers_W[..., 2] - shapes.drops
    lowest = np.argmin(low, axis=1)
    rows = np.arange(len(lowest))
    u, drop = shapes.axes_W[rows, lowest], shapes.drops[rows, lowest, np.newaxis]
    # Above the ground point C lies the lowest point of the ellipsoid.
    p_WC = shapes.centers_W[rows, lowest] - (shapes.a**2 - shapes.r**2) * u[:, 2:] * u / drop
    p_WC[:, 2] = 0.0
    return _Places(p_WC, np.tile([0.0, 0.0, 1.0], (len(rows), 1)), -low[rows, lowest], lowest)


def _deepen(places: _Places, shapes: _Ellipsoids, bumps: Bumps, p_WH: Array, reach: float) -> None:
    """Replaces contacts with level ground by those with bumps, where these are deeper.

    Args:
        places: The contacts, to be changed.
        shapes: Ellipsoids of the wheel.
        bumps: Bumps.
        p_WH: Positions (n, 3) of the hub [m].
        reach: How far the wheel extends from its hub [m].
    """
    near = KDTree(bumps.centers_W[:, :2]).query_ball_point(p_WH[:, :2], reach + bumps.half_widths.max())
    sample = np.repeat(np.arange(len(p_WH)), [len(found) for found in near])
    bump = np.concatenate([np.asarray(found, np.intp) for found in near])
    # A bump lies below its top, so an ellipsoid may press it deeper than the ground only if it is as low as this.
    low = shapes.centers_W[..., 2] - shapes.drops
    pair, shape = np.nonzero(low[sample] < bumps.heights[bump, np.newaxis] - places.depth[sample, np.newaxis])
    sample, bump = sample[pair], bump[pair]
    depth, p_WC, normal_W = _on_spheres(shapes, sample, shape, bumps.centers_W[bump], bumps.radii[bump])

    order = np.lexsort((depth, sample))
    deepest = order[np.flatnonzero(np.diff(sample[order], append=-1))]
    deepest = deepest[depth[deepest] > places.depth[sample[deepest]]]
    at = sample[deepest]
    places.depth[at], places.shape[at] = depth[deepest], shape[deepest]
    places.p_WC[at], places.normal_W[at] = p_WC[deepest], normal_W[deepest]


def _on_spheres(
    shapes: _Ellipsoids, sample: NDArray[np.intp], shape: NDArray[np.intp], sphere_centers_W: Array, radii: Array
) -> tuple[Array, Array, Array]:
    """Depths (m,), contact points (m, 3) on the spheres and their normals (m, 3) there, of m pairs."""
    center, u = shapes.centers_W[sample, shape], shapes.axes_W[sample, shape]
    to_sphere = sphere_centers_W - center
    along = np.sum(to_sphere * u, axis=1)
    side = to_sphere - along[:, np.newaxis] * u
    across = np.linalg.norm(side, axis=1)
    near_along, near_across = nearest_on_ellipsoid(shapes.a, shapes.r, along, across)
    share = near_across / np.maximum(across, np.finfo(float).tiny)
    outward = near_along[:, np.newaxis] * u + share[:, np.newaxis] * side - to_sphere
    distance = np.linalg.norm(outward, axis=1)
    normal = outward / distance[:, np.newaxis]
    return radii - distance, sphere_centers_W + radii[:, np.newaxis] * normal, normal


def _ellipsoids(wheel: AnyWheel) -> tuple[float, float, Array, Array]:
    """Semi-axes along and across, centres (k, 3) and axes (k, 3) in H of a wheel's tyre or rollers."""
    ring = wheel.ring
    if ring is None:
        return 0.5 * wheel.width, wheel.radius, np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])
    return ring.semi_axis, ring.roller_radius, ring.centers_H, ring.axes_H
