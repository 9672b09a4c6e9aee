"""Wheel-legs in an SDF model: a link for each joint, and the wheel at the foot."""

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench import palette
from rollerbench.description import Leg, Link, Robot
from rollerbench.sdf import names
from rollerbench.sdf.elements import (
    add,
    add_contact,
    add_fixed_joint,
    add_inertial,
    add_joint,
    add_pose,
    add_shape,
    box,
    cylinder,
    sphere,
)

Z_TO_X = Rotation.from_euler("y", 90, degrees=True)


def add_legs(model: etree._Element, robot: Robot) -> None:
    """Adds a robot's legs to its model.

    The frame of a link is that of its joint (`Leg.frames_B`): it turns with the link, z along the joint's axis. Feet
    are balls of the wheel's radius; links collide with nothing, so legs reach through each other and through steps.
    """
    for leg in robot.legs:
        parent, steps = names.BODY, link_steps(leg)
        for number, (link, step) in enumerate(zip(leg.links, steps, strict=False), start=1):
            element = add(model, "link", name=names.leg_link(leg.name, number))
            add_pose(element, step[:3, 3], Rotation.from_matrix(step[:3, :3]), relative_to=parent)
            add_inertial(element, link.inertia)
            _add_link_visuals(element, link, palette.LEG_LINKS[(number - 1) % len(palette.LEG_LINKS)])
            add_joint(
                model,
                names.leg_joint(leg.name, number),
                parent,
                element.get("name"),
                "0 0 1",
                link.max_effort or -1.0,
                speed=link.max_speed,
                limits=(np.radians(link.min_deg), np.radians(link.max_deg)),
                rotor_inertia=link.rotor_inertia,
            )
            parent = names.leg_link(leg.name, number)
        foot = add(model, "link", name=names.foot(leg.name))
        add_pose(foot, steps[-1][:3, 3], Rotation.from_matrix(steps[-1][:3, :3]), relative_to=parent)
        _add_foot(model, robot, leg, foot, parent)


def link_steps(leg: Leg) -> NDArray[np.float64]:
    """Poses (n_joints + 1, 4, 4) of the links' frames and the foot's at joint angles 0, each in the one before it."""
    frames = leg.frames_B(np.zeros(len(leg.links)))
    return np.concatenate([frames[:1], np.linalg.solve(frames[:-1], frames[1:])])


def _add_foot(model: etree._Element, robot: Robot, leg: Leg, foot: etree._Element, shank: str) -> None:
    wheel, joint = leg.wheel, names.drive_joint(leg.name)
    add_inertial(foot, wheel.inertia)
    add_contact(add_shape(foot, "collision", "tyre", sphere(wheel.radius)), robot, friction=wheel.friction)
    add_shape(foot, "visual", "tyre", cylinder(wheel.radius, wheel.width), color=palette.TYRE)
    spoke = box((0.9 * wheel.radius, 0.2 * wheel.radius, 1.04 * wheel.width))
    ahead = np.array([0.5 * wheel.radius, 0.0, 0.0])
    add_shape(foot, "visual", "spoke", spoke, position=ahead, color=palette.MARK)
    if wheel.driven:
        effort, inertia = wheel.max_effort or -1.0, wheel.rotor_inertia
        name = foot.get("name")
        add_joint(model, joint, shank, name, "0 0 1", effort, speed=wheel.max_speed, rotor_inertia=inertia)
    else:
        add_fixed_joint(model, joint, shank, foot.get("name"))


def _add_link_visuals(element: etree._Element, link: Link, color: tuple[float, float, float]) -> None:
    """A ball at the joint, and a rod along d and then one along a."""
    add_shape(element, "visual", "joint", sphere(1.2 * link.radius), color=palette.HUB)
    if link.d:
        rod = cylinder(link.radius, abs(link.d))
        add_shape(element, "visual", "along_d", rod, position=np.array([0.0, 0.0, 0.5 * link.d]), color=color)
    if link.a:
        rod, middle = cylinder(link.radius, abs(link.a)), np.array([0.5 * link.a, 0.0, link.d])
        add_shape(element, "visual", "along_a", rod, position=middle, rotation=Z_TO_X, color=color)
