"""The leg of Song et al. (2012): what the paper prints of it, and a robot on three such legs."""

import itertools

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from rollerbench.description import Body, Robot
from rollerbench.description.legs import FootWheel, Leg, Link
from rollerbench.kinematics.legs import LegKinematics
from rollerbench.plant import add_robot

Array = NDArray[np.float64]

ANGLES = np.radians([90.0, 30.0, 45.0, 60.0])
"""The joints' angles in the paper's example [rad]."""

LENGTH = 0.09
"""l2, d4 and l4 of the example [m]."""

POSITION = np.array([77.9423, 57.7693, 143.5802])
"""The foot of the example as printed, in the leg's base [mm]. The text of the paper carries no signs here."""

ROTATION = np.array([[0.866, 0.5, 0.2588], [0.483, 0.8365, 0.2588], [0.1294, 0.2241, 0.9659]])
"""The rotation of the foot as printed, (2.7), without signs too."""

DIGIT = 5.5e-5
"""Half of the last printed digit of the rotation, and its rounding [-]."""

ALPHA_4 = -90.0
"""Twist of the last row of Table 1 [deg]."""

HIP_RADIUS, STANDING = 0.1, (0.0, 20.0, -110.0, 0.0)
"""Chosen, for the paper prints neither: how far the hips of the three legs are from Bo [m]; how they stand [deg]."""


def leg(azimuth_deg: float = 0.0, *, name: str = "leg", alpha_4_deg: float = ALPHA_4) -> Leg:
    """A leg of Table 1 with the lengths of the example; its masses do not matter here.

    Args:
        azimuth_deg: Direction of the leg from Bo, about +z from body x [deg].
        name: Its name.
        alpha_4_deg: Twist of the last row [deg].
    """
    azimuth = np.radians(azimuth_deg)
    return Leg(
        name=name,
        hip=(HIP_RADIUS * float(np.cos(azimuth)), HIP_RADIUS * float(np.sin(azimuth)), 0.0),
        mounting_deg=azimuth_deg,
        links=(
            Link(alpha_deg=90.0, mass=0.1),
            Link(a=LENGTH, mass=0.1),
            Link(alpha_deg=-90.0, theta_offset_deg=90.0, mass=0.1),
            Link(d=-LENGTH, a=LENGTH, alpha_deg=alpha_4_deg, mass=0.1),
        ),
        wheel=FootWheel(radius=0.02, width=0.01, mass=0.05),
        postures={"standing": STANDING},
    )


def three_legs() -> Robot:
    """A body on three legs 120 deg apart: the support mechanism of figure 6."""
    return Robot(
        name="three_legs",
        body=Body(size=(0.1, 0.1, 0.03), mass=1.0),
        legs=tuple(leg(120.0 * index, name=f"leg_{index + 1}") for index in range(3)),
    )


def bones_B(leg: Leg, q: Array) -> Array:
    """Points (..., 4, 3) in B that a leg of the paper is drawn through [m]: hip, knee, corner of the tibia, foot."""
    frames = leg.frames_B(q)
    corner = frames[..., 3, :3, 3] + leg.links[3].d * frames[..., 3, :3, 2]
    return np.stack([frames[..., 0, :3, 3], frames[..., 3, :3, 3], corner, frames[..., 4, :3, 3]], axis=-2)


def rotation_with(alpha_4_deg: float) -> Array:
    """Rotation (3, 3) of the foot at the printed angles with another twist of the last row [deg]."""
    return np.asarray(LegKinematics(leg(alpha_4_deg=alpha_4_deg)).forward(ANGLES)[:3, :3])


def entries_that_fit(alpha_4_deg: float) -> NDArray[np.bool_]:
    """Which entries (3, 3) of that rotation have the printed size, to the fourth digit."""
    return np.asarray(np.abs(np.abs(rotation_with(alpha_4_deg)) - ROTATION) < DIGIT)


def least_defect(sizes: Array) -> float:
    """Largest entry of |R R' - 1|, with the signs of the entries (3, 3) of R that make it least."""
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=9))).reshape(-1, 3, 3)
    matrices = signs * sizes
    return float(np.abs(matrices @ matrices.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2)).min())


def feet_in_drake(robot: Robot, q: Array) -> Array:
    """Centres (n, k, 3) of the feet in B [m] at joint angles (n, k, 4), as Drake's multibody kinematics has them.

    The plant is parsed from the robot's SDF; of the Denavit-Hartenberg rows Drake knows nothing.
    """
    plant = MultibodyPlant(0.0)
    model = add_robot(plant, robot)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetFreeBodyPose(context, model.body, RigidTransform())
    joints = [model.leg_joints(each) for each in robot.legs]
    feet = [model.foot_body(each) for each in robot.legs]
    places = np.empty((*q.shape[:2], 3))
    for sample, angles in enumerate(q):
        for chain, values in zip(joints, angles, strict=True):
            for joint, value in zip(chain, values, strict=True):
                joint.set_angle(context, value)
        places[sample] = [plant.EvalBodyPoseInWorld(context, foot).translation() for foot in feet]
    return places
