"""A robot as an SDF model: body, forks, hubs, rollers and legs as links, revolute joints between them."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench import palette
from rollerbench.description import AnyWheel, Robot, RollerWheel
from rollerbench.description.mass import (
    body_inertia,
    fork_inertia,
    hub_inertia,
    hub_radius,
    roller_inertia,
    roller_poses_H,
)
from rollerbench.description.rollers import RollerRing
from rollerbench.sdf import names
from rollerbench.sdf.elements import (
    DRAKE,
    add,
    add_contact,
    add_drake,
    add_inertial,
    add_joint,
    add_pose,
    add_shape,
    box,
    cylinder,
    ellipsoid,
)
from rollerbench.sdf.legs import add_legs
from rollerbench.sdf.window import Window

Z_TO_AXLE = Rotation.from_euler("x", 90, degrees=True)
"""Turns SDF's cylinders, which lie along z, onto the axle."""
Z_TO_ROLLER_AXIS = Rotation.from_euler("y", 90, degrees=True)
"""Turns SDF's cylinders onto a roller's axis."""
NO_TURN = Rotation.identity()
BARREL_STEPS = (0.4, 0.7, 0.87, 1.0)
"""Half lengths of the cylinders that show a roller, over that of its barrel [-]."""


def robot_to_sdf(robot: Robot, windows: Mapping[str, Window] = MappingProxyType({}), *, visuals: bool = True) -> str:
    """The robot as SDF text, complete in itself.

    Link and joint names are those of `rollerbench.sdf.names`. Positive joint angles drive forward (hubs), turn left
    (swivels), and follow the right-hand rule about the roller's axis. Collision shapes are one ellipsoid a roller
    (`RollerRing.semi_axis`), one ellipsoid (R, width/2, R) a tyre, and the body's box; none collide with each other.

    Args:
        robot: The robot.
        windows: Wheels by name of whose rollers only some are links, those near the ground at wheel angle 0; their hubs
            carry the mass of the others, and the visuals of all.
        visuals: Whether it shall be seen.
    """
    root = etree.Element("sdf", version="1.9", nsmap={"drake": DRAKE})
    model = add(root, "model", name=robot.name)
    _add_body(model, robot)
    for wheel in robot.wheels:
        _add_wheel(model, robot, wheel, windows.get(wheel.name))
    add_legs(model, robot)
    if not visuals:
        etree.strip_elements(model, "visual")
    group = add_drake(model, "collision_filter_group", name="robot")
    for link in model.findall("link"):
        add_drake(group, "member", text=link.get("name"))
    add_drake(group, "ignored_collision_filter_group", text="robot")
    text: bytes = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="utf-8")
    return text.decode("utf-8")


def _add_body(model: etree._Element, robot: Robot) -> None:
    link = add(model, "link", name=names.BODY)
    add_inertial(link, body_inertia(robot.body))
    shape, center = box(robot.body.size), np.array(robot.body.box_center)
    add_shape(link, "visual", "box", shape, position=center, color=palette.BODY)
    collision = add_shape(link, "collision", "box", shape, position=center)
    tyres = (*robot.wheels, *(leg.wheel for leg in robot.legs))
    add_contact(collision, robot, friction=min(tyre.friction for tyre in tyres))
    # A mark at the front tells which way the robot looks.
    length, width, height = robot.body.size
    mark = box((0.06 * length, 0.5 * width, 0.1 * height))
    ahead = center + np.array([0.45 * length, 0.0, 0.5 * height])
    add_shape(link, "visual", "front", mark, position=ahead, color=palette.MARK)


def _add_wheel(model: etree._Element, robot: Robot, wheel: AnyWheel, window: Window | None) -> None:
    heading = Rotation.from_euler("z", wheel.heading_degrees, degrees=True)
    carrier, position, rotation = names.BODY, wheel.center_B, heading
    if wheel.swivels:
        carrier = names.fork(wheel.name)
        _add_fork(model, wheel, heading)
        position, rotation = np.array([-wheel.swivel_offset, 0.0, 0.0]), Rotation.identity()
    hub = add(model, "link", name=names.hub(wheel.name))
    add_pose(hub, position, rotation, relative_to=carrier)
    add_inertial(hub, hub_inertia(wheel) if window is None else window.hub_inertia(window.first_at(0.0)))
    _add_hub_visuals(hub, wheel)
    effort = (wheel.max_effort or -1.0) if wheel.driven else 0.0
    add_joint(model, names.drive_joint(wheel.name), carrier, hub.get("name"), "0 1 0", effort, speed=wheel.max_speed)
    if isinstance(wheel, RollerWheel):
        _add_rollers(model, robot, wheel, hub, window)
    else:
        tyre = ellipsoid((wheel.radius, 0.5 * wheel.width, wheel.radius))
        add_contact(add_shape(hub, "collision", "tyre", tyre), robot, friction=wheel.friction)


def _add_fork(model: etree._Element, wheel: AnyWheel, heading: Rotation) -> None:
    link = add(model, "link", name=names.fork(wheel.name))
    add_pose(link, wheel.p_BoHo_B, heading, relative_to=names.BODY)
    add_inertial(link, fork_inertia(wheel))
    column = cylinder(0.25 * wheel.width, 0.6 * wheel.radius)
    add_shape(link, "visual", "column", column, position=np.array([0, 0, 1.2 * wheel.radius]), color=palette.HUB)
    effort = (getattr(wheel, "max_steering_effort", None) or -1.0) if wheel.steered else 0.0
    speed = getattr(wheel, "max_steering_speed", None)
    add_joint(model, names.swivel_joint(wheel.name), names.BODY, link.get("name"), "0 0 1", effort, speed=speed)


def _add_hub_visuals(hub: etree._Element, wheel: AnyWheel) -> None:
    radius = hub_radius(wheel)
    color = palette.HUB if isinstance(wheel, RollerWheel) else palette.TYRE
    add_shape(hub, "visual", "hub", cylinder(radius, wheel.width), rotation=Z_TO_AXLE, color=color)
    spoke = box((0.2 * radius, 1.04 * wheel.width, 0.9 * radius))
    add_shape(hub, "visual", "spoke", spoke, position=np.array([0, 0, 0.5 * radius]), color=palette.MARK)


def _add_rollers(
    model: etree._Element, robot: Robot, wheel: RollerWheel, hub: etree._Element, window: Window | None
) -> None:
    ring, poses = wheel.ring, roller_poses_H(wheel)
    shape = ellipsoid((ring.semi_axis, ring.roller_radius, ring.roller_radius))
    slots = range(ring.count) if window is None else window.rollers(window.first_at(0.0))
    for slot, index in enumerate(slots):
        rotation, center = poses[index]
        link = add(model, "link", name=names.roller(wheel.name, slot))
        add_pose(link, center, Rotation.from_matrix(rotation), relative_to=hub.get("name"))
        add_inertial(link, roller_inertia(wheel))
        if window is None:
            _add_barrel_visuals(link, ring, index)
        add_contact(add_shape(link, "collision", "barrel", shape), robot, friction=wheel.friction)
        joint = names.roller_joint(wheel.name, slot)
        add_joint(model, joint, hub.get("name"), link.get("name"), "1 0 0", 0.0, damping=wheel.rollers.damping)
    for index, (rotation, center) in enumerate(poses if window is not None else ()):
        # Rollers are solids of revolution: those that the hub shows look as if they turned.
        _add_barrel_visuals(hub, ring, index, Rotation.from_matrix(rotation), center)


def _add_barrel_visuals(
    link: etree._Element,
    ring: RollerRing,
    index: int,
    rotation: Rotation = NO_TURN,
    center: NDArray[np.float64] | None = None,
) -> None:
    """Draws the part of the ellipsoid that ever touches the ground: cylinders of growing length inscribed in it."""
    prefix = "barrel" if center is None else f"roller_{index:02d}_barrel"
    for step, share in enumerate(BARREL_STEPS):
        half_length = share * ring.half_length
        radius = ring.roller_radius * np.sqrt(1 - (half_length / ring.semi_axis) ** 2)
        add_shape(
            link,
            "visual",
            f"{prefix}_{step}",
            cylinder(radius, 2 * half_length),
            position=center,
            rotation=rotation * Z_TO_ROLLER_AXIS,
            color=palette.ROLLERS[index % 2],
        )
