"""All legs of a robot as arrays, so that a step of control costs the same for four legs and for eight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Posture, Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.description.legs import chain_links, turned_frames
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.legs.chain import cross, geometric_jacobian

Array = NDArray[np.float64]

DAMPING = 1e-5
"""Damping of the inverse, relative to the leg's length [-]: it moves singular legs slowly instead of wildly."""

FASTEST = 40.0
"""Joints of which no max_speed is described turn no faster [rad/s]: where they would, a leg is near a singular pose."""

LARGEST_STEP = 0.3
"""Largest change of a joint in one iteration of the inverse [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hold:
    """What settles the joints that the feet's positions leave free, for each of k legs of up to n joints.

    Attributes:
        rows: Coefficients (k, n); a row of zeros asks for the least motion.
        values: What rows @ q shall be (k,) [rad]; where heading is set, the direction in which the wheel rolls ahead,
            from B's x axis about its z axis [rad].
        heading: Whether the wheel's direction is held instead (k,).
        near: Joint angles (k, n) near which a solution is sought [rad].
    """

    rows: Array
    values: Array
    heading: NDArray[np.bool_]
    near: Array


class LegGroup:
    """Kinematics and statics of all legs at once. Arrays have a row for each leg, in the order of robot.legs.

    Legs with fewer joints than the longest are padded with joints that do nothing.

    Attributes:
        robot: The robot.
        shape: Number of legs, and of joints of the longest.
        wheel_radius: Radii (k,) of the feet's wheels [m].
        present: Which joints (k, n) there are.
        max_speeds: Largest speeds of the joints (k, n), `FASTEST` where none is described, and of the wheels (k,)
            [rad/s].
    """

    def __init__(self, robot: Robot) -> None:
        if not robot.legs:
            raise KinematicsError(f"{robot.name} has no legs; accepted: a robot with legs")
        self.robot = robot
        count, joints = len(robot.legs), max(len(leg.links) for leg in robot.legs)
        self.shape = (count, joints)
        self.wheel_radius = np.array([leg.wheel.radius for leg in robot.legs])
        self._driven = np.array([leg.wheel.driven for leg in robot.legs])
        self.present = np.zeros((count, joints), dtype=bool)
        rows, self._limits = np.zeros((count, joints, 4)), np.zeros((count, 2, joints))
        self._mass, self._com = np.zeros((count, joints + 1)), np.zeros((count, joints + 1, 3))
        self._X_BL = np.array([leg.X_BL for leg in robot.legs])
        self._length = float(np.mean([leg.length for leg in robot.legs]))
        for index, leg in enumerate(robot.legs):
            own = len(leg.links)
            self.present[index, :own] = True
            rows[index, :own], self._limits[index, :, :own] = leg.rows, leg.limits
            parts = [link.inertia for link in leg.links]
            self._mass[index, :own], self._com[index, :own] = [p.mass for p in parts], [p.com for p in parts]
            self._mass[index, -1] = leg.wheel.mass
        self._in_vector = np.hstack([self.present, np.ones((count, 1), dtype=bool)])
        fastest = [[link.max_speed or FASTEST for link in leg.links] for leg in robot.legs]
        fastest = [own + [FASTEST] * (joints - len(own)) for own in fastest]
        self.max_speeds = np.array(fastest), np.array([leg.wheel.max_speed or np.inf for leg in robot.legs])
        self._links, self._offsets = chain_links(rows), rows[..., 3]
        self._total = float(self._mass.sum()) + robot.body.mass
        self._body = (robot.body.mass, np.array(robot.body.center_of_mass))

    @property
    def limits(self) -> tuple[Array, Array]:
        """Least and largest joint angles (k, n) [rad]."""
        return self._limits[:, 0], self._limits[:, 1]

    def posture(self, name: str) -> Array:
        """Joint angles (k, n) of a posture [rad]."""
        q = np.zeros(self.shape)
        for index, leg in enumerate(self.robot.legs):
            q[index, : len(leg.links)] = leg.posture(name)
        return q

    def hold(self, posture: Posture, q: Array) -> Hold:
        """What a posture holds, at the values that it has at joint angles q (k, n)."""
        rows = np.zeros(self.shape)
        if posture.hold == "tibia":
            rows[:, 1:3] = 1.0
        elif posture.held_joint is not None:
            rows[:, posture.held_joint] = 1.0
        return Hold(rows=rows, values=np.sum(rows * q, axis=1), heading=np.zeros(len(q), dtype=bool), near=q)

    def to_vector(self, joints: Array, wheels: Array) -> Array:
        """Values of joints (k, n) and of wheels (k,) in one vector, leg by leg, each leg's wheel after its joints."""
        every = np.concatenate([joints, wheels[:, np.newaxis]], axis=1)
        return every[self._in_vector]

    def from_vector(self, vector: Array) -> tuple[Array, Array]:
        """Values of joints (k, n) and of wheels (k,) from such a vector."""
        every = np.zeros((self.shape[0], self.shape[1] + 1))
        every[self._in_vector] = vector
        return every[:, :-1], every[:, -1]

    def frames(self, q: Array) -> Array:
        """Poses (k, n + 1, 4, 4) in B of the joints' frames and of the feet at joint angles (k, n)."""
        frames: Array = self._X_BL[:, np.newaxis] @ turned_frames(self._links, q + self._offsets)
        return frames

    def leg_frames(self, leg: int, q: Array) -> Array:
        """Poses (..., n + 1, 4, 4) in B of one leg's joints and foot at many joint angles (..., n)."""
        own = q.shape[-1]
        frames: Array = self._X_BL[leg] @ turned_frames(self._links[leg, :own], q + self._offsets[leg, :own])
        return frames

    def jacobian(self, frames: Array) -> Array:
        """Geometric Jacobians (k, 6, n), rows [w_BF_B; v_BF_B], at the feet's centres."""
        return geometric_jacobian(frames) * self.present[:, np.newaxis]

    def headings(self, frames: Array) -> Array:
        """Directions (k,) in which the wheels roll ahead, from B's x axis about its z axis [rad]."""
        axle = frames[:, -1, :3, 2]
        return np.arctan2(-axle[:, 0], axle[:, 1])

    def inverse(
        self, p_BF: Array, hold: Hold, *, iterations: int = 2, tolerance: float = 1e-9
    ) -> tuple[Array, Array, Array]:
        """Joint angles that put the feet's centres at p_BF (k, 3).

        Damped Gauss-Newton steps. From one period of a controller to the next two of them suffice; for far targets
        allow more. The joints' limits are not considered.

        Returns:
            Joint angles (k, n), their `frames`, and the distances (k,) by which the feet miss [m].
        """
        scale, q, frames = self._length, hold.near, self.frames(hold.near)
        for _ in range(iterations):
            error = p_BF - frames[:, -1, :3, 3]
            matrix = np.concatenate([self.jacobian(frames)[:, 3:], np.zeros((len(q), 1, q.shape[1]))], axis=1)
            rows, missing = self._hold_rows(frames, hold, q)
            matrix[:, 3] = scale * rows
            residual = np.concatenate([error, scale * missing[:, np.newaxis]], axis=1)
            if np.abs(residual).max() < tolerance:
                break
            square = matrix @ matrix.swapaxes(1, 2)
            square[:, range(4), range(4)] += (DAMPING * scale) ** 2
            step = (matrix.swapaxes(1, 2) @ np.linalg.solve(square, residual[..., np.newaxis]))[..., 0]
            largest = np.abs(step).max(axis=1, keepdims=True)
            q = q + step * np.minimum(1.0, LARGEST_STEP / np.maximum(largest, 1e-12))
            frames = self.frames(q)
        return q, frames, np.linalg.norm(p_BF - frames[:, -1, :3, 3], axis=1)

    def _hold_rows(self, frames: Array, hold: Hold, q: Array) -> tuple[Array, Array]:
        missing = hold.values - np.sum(hold.rows * q, axis=1)
        if not hold.heading.any():
            return hold.rows, np.where(np.any(hold.rows, axis=1), missing, 0.0)
        axle = frames[:, -1, :3, 2]
        turning = cross(frames[:, :-1, :3, 2] * self.present[..., np.newaxis], axle[:, np.newaxis])
        flat = np.maximum(axle[:, 0] ** 2 + axle[:, 1] ** 2, 1e-6)
        rows = (axle[:, :1] * turning[..., 1] - axle[:, 1:2] * turning[..., 0]) / flat[:, np.newaxis]
        off = hold.values - self.headings(frames)
        off = np.arctan2(np.sin(off), np.cos(off))
        which = hold.heading[:, np.newaxis]
        free = ~np.any(hold.rows, axis=1) & ~hold.heading
        return np.where(which, rows, hold.rows), np.where(hold.heading, off, np.where(free, 0.0, missing))

    def beyond_limits(self, q: Array) -> Array:
        """By how much joint angles (k, n) are beyond the joints' limits [rad], 0 within them."""
        low, high = self.limits
        return np.maximum(0.0, np.maximum(low - q, q - high)) * self.present

    def center_of_mass(self, frames: Array) -> Array:
        """Centre of mass (3,) of the whole robot in B [m]."""
        places = frames[..., :3, 3] + (frames[..., :3, :3] @ self._com[..., np.newaxis])[..., 0]
        moment = np.einsum("km,kmx->x", self._mass, places) + self._body[0] * self._body[1]
        return moment / self._total

    def gravity_efforts(self, frames: Array, up_B: Array) -> Array:
        """Torques (k, n) with which the joints carry the legs' own weight [N m].

        Args:
            frames: Poses from `frames`.
            up_B: Unit vector (3,) against gravity, in B.
        """
        places = frames[..., :3, 3] + (frames[..., :3, :3] @ self._com[..., np.newaxis])[..., 0]
        mass = np.cumsum(self._mass[:, ::-1], axis=1)[:, ::-1]
        moment = np.cumsum((self._mass[..., np.newaxis] * places)[:, ::-1], axis=1)[:, ::-1]
        arms = moment[:, :-1] - mass[:, :-1, np.newaxis] * frames[:, :-1, :3, 3]
        # A torque about z_i holds what gravity -g up turns: tau = g z . (arm x up).
        return GRAVITY * np.einsum("knx,knx->kn", frames[:, :-1, :3, 2], cross(arms, up_B)) * self.present

    def contact_efforts(self, frames: Array, forces: Array, up_B: Array) -> tuple[Array, Array]:
        """Torques of joints (k, n) and wheels (k,) by which feet press against the ground [N m].

        Args:
            frames: Poses from `frames`.
            forces: Forces (k, 3) of the ground on the feet's lowest points, in B [N].
            up_B: Unit vector (3,) out of the ground, in B.
        """
        contact = frames[:, -1, :3, 3] - self.wheel_radius[:, np.newaxis] * up_B
        moments = cross(contact[:, np.newaxis] - frames[..., :3, 3], forces[:, np.newaxis])
        efforts = -np.sum(frames[..., :3, 2] * moments, axis=-1)
        return efforts[:, :-1] * self.present, efforts[:, -1]

    def shared_load(self, frames: Array, load: Array, pull_B: Array) -> Array:
        """Forces (k, 3) of the ground on the feet in B [N] that carry the robot, of least norm.

        Args:
            frames: Poses from `frames`.
            load: Shares (k,) of its load that each foot bears, from 0 in the air to 1.
            pull_B: Acceleration (3,) that the robot feels, g times up plus its own, in B [m/s2].
        """
        arms = frames[:, -1, :3, 3] - self.center_of_mass(frames)
        count = len(arms)
        grasp = np.zeros((6, count, 3))
        grasp[0, :, 2], grasp[0, :, 1] = arms[:, 1], -arms[:, 2]
        grasp[1, :, 0], grasp[1, :, 2] = arms[:, 2], -arms[:, 0]
        grasp[2, :, 1], grasp[2, :, 0] = arms[:, 0], -arms[:, 1]
        grasp[3:] = np.eye(3)[:, np.newaxis]
        flat = grasp.reshape(6, 3 * count)
        weighted = flat * np.repeat(load, 3)
        wrench = np.concatenate([np.zeros(3), self._total * pull_B])
        square = weighted @ flat.T
        square[range(6), range(6)] += 1e-6 * max(1.0, load.sum())
        forces: Array = (weighted.T @ np.linalg.solve(square, wrench)).reshape(-1, 3)
        return forces

    def rolling(self, frames: Array, w_F_B: Array, v_F_B: Array, up_B: Array) -> tuple[Array, Array]:
        """How ball-shaped wheels roll on level ground as their legs move and lean.

        With the arm's angular velocity w, the axle a and the wheel's speed s the ball's lowest point rests if
        v = (w + s a) x R up. Along t = a x up the wheel settles that; across it the ball rolls with the arm, and so it
        does altogether where no motor turns the wheel.

        Args:
            frames: Poses from `frames`.
            w_F_B: Angular velocities (k, 3) of the arms that hold the wheels over the ground [rad/s].
            v_F_B: Velocities (k, 3) of the wheels' centres over the ground, in B [m/s].
            up_B: Unit vector (3,) out of the ground, in B.

        Returns:
            Wheel speeds (k,) [rad/s], and velocities (k, 3) with which leaning makes the centres roll, across driven
            wheels, in B [m/s].
        """
        axle = frames[:, -1, :3, 2]
        ahead = cross(axle, up_B)
        flat = np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-6)
        ahead = ahead / flat
        leaning = cross(w_F_B, up_B) * self.wheel_radius[:, np.newaxis]
        speed = np.sum((v_F_B - leaning) * ahead, axis=1) / (self.wheel_radius * flat[:, 0])
        across = cross(np.broadcast_to(up_B, ahead.shape), ahead)
        roll = np.where(self._driven[:, np.newaxis], across * np.sum(leaning * across, axis=1, keepdims=True), leaning)
        return np.where(self._driven, speed, 0.0), roll
