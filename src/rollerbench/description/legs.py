"""Wheel-legs: chains of revolute joints in standard Denavit-Hartenberg rows, with a wheel at the foot."""

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from rollerbench.description.inertia import RigidInertia, combined, solid_ball, solid_cylinder, solid_rod
from rollerbench.description.part import Flag, Name, NonNegative, Number, Part, Positive, Vector3
from rollerbench.description.problems import Problem, refuse

Array = NDArray[np.float64]


class Link(Part):
    """One row of a standard Denavit-Hartenberg table: a revolute joint, and the link that it turns.

    The row's transform is Rz(theta + offset) Tz(d) Tx(a) Rx(alpha), theta the joint's angle about the z axis before it.

    Attributes:
        a: Distance along the new x axis [m].
        alpha_deg: Twist about the new x axis.
        d: Distance along the old z axis [m].
        theta_offset_deg: Angle about the old z axis at joint angle 0.
        min_deg: Least angle of the joint.
        max_deg: Largest angle of the joint.
        mass: Mass of the link [kg], along d and then along a; where both are 0, of a ball at the joint.
        radius: Radius of the link's rods, or ball [m].
        max_effort: Largest torque of the joint's motor [N m]; None for no limit.
        max_speed: Largest speed of the joint [rad/s]; None for no limit.
        rotor_inertia: Inertia of the motor's rotor, seen at the joint [kg m2].
    """

    a: Number = 0.0
    alpha_deg: Number = 0.0
    d: Number = 0.0
    theta_offset_deg: Number = 0.0
    min_deg: Annotated[Number, Field(ge=-360, le=360)] = -180.0
    max_deg: Annotated[Number, Field(ge=-360, le=360)] = 180.0
    mass: Positive
    radius: Positive = 0.02
    max_effort: Positive | None = None
    max_speed: Positive | None = None
    rotor_inertia: NonNegative = 0.01

    @property
    def inertia(self) -> RigidInertia:
        """Mass distribution in the joint's frame, which turns with the link: z the joint's axis, x along a."""
        lengths = np.abs([self.d, self.a])
        if not lengths.any():
            return solid_ball(self.mass, self.radius)
        along_d, along_a = (
            solid_rod(self.mass * length / lengths.sum(), self.radius, length) for length in lengths.tolist()
        )
        to_x = Rotation.from_euler("y", 90, degrees=True).as_matrix()
        rods = [
            (along_d, np.eye(3), np.array([0.0, 0.0, 0.5 * self.d])),
            (along_a, to_x, np.array([0.5 * self.a, 0.0, self.d])),
        ]
        return combined([rod.moved(rotation, center) for rod, rotation, center in rods if rod.mass])

    @model_validator(mode="after")
    def _range_is_one(self) -> Self:
        if self.min_deg >= self.max_deg:
            raise ValueError(f"min_deg = {self.min_deg:g}: accepted: less than max_deg = {self.max_deg:g}")
        return self


class FootWheel(Part):
    """The wheel at a leg's foot: a ball-shaped tyre cut to its width, so that it may lean.

    Its centre is the origin of the last Denavit-Hartenberg frame, its axle that frame's z axis; positive speeds turn it
    about that axis, so with the axle to the left it rolls ahead.

    Attributes:
        radius: Radius of the ball [m].
        width: Width along the axle [m].
        mass: Mass [kg].
        friction: Coefficient of friction of the tyre [-].
        driven: Whether a motor drives it; if not, it is locked to the leg.
        max_speed: Largest wheel speed [rad/s]; None for no limit.
        max_effort: Largest torque at the wheel [N m]; None for no limit.
        rotor_inertia: Inertia of the motor's rotor, seen at the wheel [kg m2].
    """

    radius: Positive
    width: Positive
    mass: Positive
    friction: Positive = 0.8
    driven: Flag = True
    max_speed: Positive | None = None
    max_effort: Positive | None = None
    rotor_inertia: NonNegative = 0.001

    @property
    def inertia(self) -> RigidInertia:
        """Mass distribution in the foot's frame, z the axle: a cylinder."""
        to_z = Rotation.from_euler("x", 90, degrees=True).as_matrix()
        return solid_cylinder(self.mass, self.radius, self.width).moved(to_z, np.zeros(3))

    @model_validator(mode="after")
    def _is_a_slice(self) -> Self:
        if self.width > 2 * self.radius:
            raise ValueError(f"width = {self.width:g}: accepted: up to the diameter, {2 * self.radius:g}")
        return self


class Leg(Part):
    """A leg.

    Attributes:
        name: Unique name of the leg.
        hip: p_BoLo_B [m], the origin of the leg's base frame L.
        mounting_deg: Direction of L's x axis about +z from body x; L's z axis is the body's.
        links: Rows of the Denavit-Hartenberg table, from the hip on.
        wheel: The wheel at the foot.
        postures: Angles of the joints [deg] by the name of the posture (see `Robot.postures`).
    """

    name: Name
    hip: Vector3
    mounting_deg: Number = 0.0
    links: Annotated[tuple[Link, ...], Field(min_length=2, max_length=12)]
    wheel: FootWheel
    postures: dict[Name, tuple[Number, ...]]

    @property
    def mass(self) -> float:
        """Mass of the leg [kg], its wheel included."""
        return self.wheel.mass + sum(link.mass for link in self.links)

    @property
    def length(self) -> float:
        """Length of the outstretched leg from the hip to the wheel's centre [m], an upper bound."""
        return float(sum(math.hypot(link.a, link.d) for link in self.links))

    @property
    def rows(self) -> Array:
        """Denavit-Hartenberg rows (n_joints, 4): a [m], alpha [rad], d [m], offset of theta [rad]."""
        table = [(row.a, math.radians(row.alpha_deg), row.d, math.radians(row.theta_offset_deg)) for row in self.links]
        return np.array(table)

    @property
    def limits(self) -> Array:
        """Least and largest joint angles (2, n_joints) [rad]."""
        return np.radians([[link.min_deg for link in self.links], [link.max_deg for link in self.links]])

    @property
    def X_BL(self) -> Array:
        """Pose (4, 4) of the leg's base in the body."""
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_euler("z", self.mounting_deg, degrees=True).as_matrix()
        pose[:3, 3] = self.hip
        return pose

    def posture(self, name: str) -> Array:
        """Joint angles (n_joints) of a posture [rad]."""
        return np.radians(self.postures[name])

    def frames_B(self, q: ArrayLike) -> Array:
        """Poses (n_joints + 1, 4, 4) in B of the joints' frames, which turn with their links, and of the foot's."""
        return self.X_BL @ chain_frames(self.rows, np.asarray(q, dtype=np.float64))

    @model_validator(mode="after")
    def _postures_fit(self) -> Self:
        problems = []
        for name, angles in self.postures.items():
            if len(angles) != len(self.links):
                message = f"{len(angles)} angles; accepted: one for each of the {len(self.links)} links"
                problems.append(Problem(("postures", name), message, angles))
                continue
            for index, (angle, link) in enumerate(zip(angles, self.links, strict=True)):
                if not link.min_deg <= angle <= link.max_deg:
                    message = f"beyond the limits of the joint; accepted: {link.min_deg:g} to {link.max_deg:g}"
                    problems.append(Problem(("postures", name, index), message, angle))
        refuse(problems)
        return self


class Posture(Part):
    """A way to stand on legs, and what the legs keep as they walk in it.

    Attributes:
        name: Name of the posture; each leg has its joint angles under it.
        hold: What settles the joint that a foot's position leaves free. "tibia": the tibia (the link that turns with
            the joints 2 and 3) keeps its inclination; "joint_1" to "joint_4": this joint keeps its angle; "least": all
            joints move as little as they can.
    """

    name: Name
    hold: Literal["tibia", "joint_1", "joint_2", "joint_3", "joint_4", "least"] = "least"

    @property
    def held_joint(self) -> int | None:
        """Index of the joint that keeps its angle, or None."""
        return int(self.hold[-1]) - 1 if self.hold.startswith("joint") else None


def chain_frames(rows: Array, q: Array) -> Array:
    """Poses of the frames of chains of revolute joints, in their bases.

    Args:
        rows: Denavit-Hartenberg rows (..., n, 4): a [m], alpha [rad], d [m], offset of theta [rad].
        q: Joint angles (..., n) [rad].

    Returns:
        (..., n + 1, 4, 4): of each joint's frame, which turns with its link, then of the last link's end.
    """
    return turned_frames(chain_links(rows), q + rows[..., 3])


def chain_links(rows: Array) -> Array:
    """Transforms (..., n, 4, 4) along the links of chains, without the turns of their joints."""
    a, alpha, d = rows[..., 0], rows[..., 1], rows[..., 2]
    links = np.zeros((*alpha.shape, 4, 4))
    links[..., 0, 0] = links[..., 3, 3] = 1.0
    links[..., 1, 1] = links[..., 2, 2] = np.cos(alpha)
    links[..., 2, 1] = np.sin(alpha)
    links[..., 1, 2] = -links[..., 2, 1]
    links[..., 0, 3], links[..., 2, 3] = a, d
    return links


def turned_frames(links: Array, theta: Array) -> Array:
    """Poses (..., n + 1, 4, 4) along chains of links (..., n, 4, 4) whose joints are turned by theta (..., n) [rad]."""
    cos, sin = np.cos(theta), np.sin(theta)
    turns = np.zeros((*theta.shape, 4, 4))
    turns[..., 0, 0] = turns[..., 1, 1] = cos
    turns[..., 1, 0] = sin
    turns[..., 0, 1] = -sin
    turns[..., 2, 2] = turns[..., 3, 3] = 1.0
    count = theta.shape[-1]
    frames = np.empty((*theta.shape[:-1], count + 1, 4, 4))
    frames[..., 0, :, :] = turns[..., 0, :, :]
    steps = links[..., :-1, :, :] @ turns[..., 1:, :, :]
    for joint in range(1, count):
        frames[..., joint, :, :] = frames[..., joint - 1, :, :] @ steps[..., joint - 1, :, :]
    frames[..., count, :, :] = frames[..., count - 1, :, :] @ links[..., -1, :, :]
    return frames
