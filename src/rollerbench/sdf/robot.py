"""A robot as an SDF model: body, forks, hubs and rollers as links, revolute joints between them."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description import AnyWheel, Robot, RollerWheel
from rollerbench.description.inertia import RigidInertia
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
from rollerbench.sdf.contact import contact_dissipation, contact_stiffness
from rollerbench.sdf.window import Window

DRAKE = "drake.mit.edu"
BODY_COLOR = (0.20, 0.35, 0.55)
HUB_COLOR = (0.35, 0.35, 0.38)
SPOKE_COLOR = (0.95, 0.60, 0.10)
TYRE_COLOR = (0.12, 0.12, 0.13)
ROLLER_COLORS = ((0.12, 0.12, 0.13), (0.55, 0.55, 0.58))
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
    model = _add(root, "model", name=robot.name)
    _add_body(model, robot)
    for wheel in robot.wheels:
        _add_wheel(model, robot, wheel, windows.get(wheel.name))
    if not visuals:
        etree.strip_elements(model, "visual")
    group = _drake(model, "collision_filter_group", name="robot")
    for link in model.findall("link"):
        _drake(group, "member", text=link.get("name"))
    _drake(group, "ignored_collision_filter_group", text="robot")
    text: bytes = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="utf-8")
    return text.decode("utf-8")


def _add_body(model: etree._Element, robot: Robot) -> None:
    link = _add(model, "link", name=names.BODY)
    _add_inertial(link, body_inertia(robot.body))
    box = _add(etree.Element("geometry"), "box")
    _add(box, "size", text=_numbers(robot.body.size))
    center = np.array(robot.body.box_center)
    _add_shape(link, "visual", "box", box, position=center, color=BODY_COLOR)
    collision = _add_shape(link, "collision", "box", box, position=center)
    _add_contact(collision, robot, friction=min(wheel.friction for wheel in robot.wheels))
    # A mark at the front tells which way the robot looks.
    mark = _add(etree.Element("geometry"), "box")
    length, width, height = robot.body.size
    _add(mark, "size", text=_numbers((0.06 * length, 0.5 * width, 0.1 * height)))
    ahead = center + np.array([0.45 * length, 0.0, 0.5 * height])
    _add_shape(link, "visual", "front", mark, position=ahead, color=SPOKE_COLOR)


def _add_wheel(model: etree._Element, robot: Robot, wheel: AnyWheel, window: Window | None) -> None:
    heading = Rotation.from_euler("z", wheel.heading_degrees, degrees=True)
    carrier, position, rotation = names.BODY, wheel.center_B, heading
    if wheel.swivels:
        carrier = names.fork(wheel.name)
        _add_fork(model, wheel, heading)
        position, rotation = np.array([-wheel.swivel_offset, 0.0, 0.0]), Rotation.identity()
    hub = _add(model, "link", name=names.hub(wheel.name))
    _add_pose(hub, position, rotation, relative_to=carrier)
    _add_inertial(hub, hub_inertia(wheel) if window is None else window.hub_inertia(window.first_at(0.0)))
    _add_hub_visuals(hub, wheel)
    effort = (wheel.max_effort or -1.0) if wheel.driven else 0.0
    _add_joint(model, names.drive_joint(wheel.name), carrier, hub.get("name"), "0 1 0", effort, speed=wheel.max_speed)
    if isinstance(wheel, RollerWheel):
        _add_rollers(model, robot, wheel, hub, window)
    else:
        tyre = _ellipsoid((wheel.radius, 0.5 * wheel.width, wheel.radius))
        _add_contact(_add_shape(hub, "collision", "tyre", tyre), robot, friction=wheel.friction)


def _add_fork(model: etree._Element, wheel: AnyWheel, heading: Rotation) -> None:
    link = _add(model, "link", name=names.fork(wheel.name))
    _add_pose(link, wheel.p_BoHo_B, heading, relative_to=names.BODY)
    _add_inertial(link, fork_inertia(wheel))
    column = _add(etree.Element("geometry"), "cylinder")
    _add(column, "radius", text=_number(0.25 * wheel.width))
    _add(column, "length", text=_number(0.6 * wheel.radius))
    _add_shape(link, "visual", "column", column, position=np.array([0, 0, 1.2 * wheel.radius]), color=HUB_COLOR)
    effort = (getattr(wheel, "max_steering_effort", None) or -1.0) if wheel.steered else 0.0
    speed = getattr(wheel, "max_steering_speed", None)
    _add_joint(model, names.swivel_joint(wheel.name), names.BODY, link.get("name"), "0 0 1", effort, speed=speed)


def _add_hub_visuals(hub: etree._Element, wheel: AnyWheel) -> None:
    radius = hub_radius(wheel)
    cylinder = _add(etree.Element("geometry"), "cylinder")
    _add(cylinder, "radius", text=_number(radius))
    _add(cylinder, "length", text=_number(wheel.width))
    color = HUB_COLOR if isinstance(wheel, RollerWheel) else TYRE_COLOR
    _add_shape(hub, "visual", "hub", cylinder, rotation=Z_TO_AXLE, color=color)
    spoke = _add(etree.Element("geometry"), "box")
    _add(spoke, "size", text=_numbers((0.2 * radius, 1.04 * wheel.width, 0.9 * radius)))
    _add_shape(hub, "visual", "spoke", spoke, position=np.array([0, 0, 0.5 * radius]), color=SPOKE_COLOR)


def _add_rollers(
    model: etree._Element, robot: Robot, wheel: RollerWheel, hub: etree._Element, window: Window | None
) -> None:
    ring, poses = wheel.ring, roller_poses_H(wheel)
    shape = _ellipsoid((ring.semi_axis, ring.roller_radius, ring.roller_radius))
    slots = range(ring.count) if window is None else window.rollers(window.first_at(0.0))
    for slot, index in enumerate(slots):
        rotation, center = poses[index]
        link = _add(model, "link", name=names.roller(wheel.name, slot))
        _add_pose(link, center, Rotation.from_matrix(rotation), relative_to=hub.get("name"))
        _add_inertial(link, roller_inertia(wheel))
        if window is None:
            _add_barrel_visuals(link, ring, index)
        _add_contact(_add_shape(link, "collision", "barrel", shape), robot, friction=wheel.friction)
        joint = names.roller_joint(wheel.name, slot)
        _add_joint(model, joint, hub.get("name"), link.get("name"), "1 0 0", 0.0, damping=wheel.rollers.damping)
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
        cylinder = _add(etree.Element("geometry"), "cylinder")
        radius = ring.roller_radius * np.sqrt(1 - (half_length / ring.semi_axis) ** 2)
        _add(cylinder, "radius", text=_number(radius))
        _add(cylinder, "length", text=_number(2 * half_length))
        _add_shape(
            link,
            "visual",
            f"{prefix}_{step}",
            cylinder,
            position=center,
            rotation=rotation * Z_TO_ROLLER_AXIS,
            color=ROLLER_COLORS[index % 2],
        )


def _add_joint(
    model: etree._Element,
    name: str,
    parent: str | None,
    child: str | None,
    axis: str,
    effort: float,
    *,
    damping: float = 0.0,
    speed: float | None = None,
) -> None:
    """A revolute joint at the child's origin; effort 0 means that no motor drives it, -1 that it has no limit."""
    joint = _add(model, "joint", name=name, type="revolute")
    _add(joint, "parent", text=parent)
    _add(joint, "child", text=child)
    element = _add(joint, "axis")
    _add(element, "xyz", text=axis)
    limit = _add(element, "limit")
    _add(limit, "effort", text=_number(effort))
    if speed is not None:
        _add(limit, "velocity", text=_number(speed))
    if damping:
        _add(_add(element, "dynamics"), "damping", text=_number(damping))


def _add_inertial(link: etree._Element, inertia: RigidInertia) -> None:
    element = _add(link, "inertial")
    _add(element, "pose", text=_numbers([*inertia.com, 0, 0, 0]))
    _add(element, "mass", text=_number(inertia.mass))
    moments = _add(element, "inertia")
    for row, column, name in ((0, 0, "ixx"), (0, 1, "ixy"), (0, 2, "ixz"), (1, 1, "iyy"), (1, 2, "iyz"), (2, 2, "izz")):
        _add(moments, name, text=_number(inertia.moment[row, column]))


def _add_shape(
    link: etree._Element,
    kind: str,
    name: str,
    shape: etree._Element,
    *,
    position: NDArray[np.float64] | None = None,
    rotation: Rotation | None = None,
    color: tuple[float, float, float] | None = None,
) -> etree._Element:
    element = _add(link, kind, name=name)
    if position is not None or rotation is not None:
        _add_pose(element, np.zeros(3) if position is None else position, rotation or Rotation.identity())
    _add(element, "geometry").append(etree.fromstring(etree.tostring(shape)))
    if color is not None:
        _add(_add(element, "material"), "diffuse", text=_numbers([*color, 1]))
    return element


def _add_contact(collision: etree._Element, robot: Robot, *, friction: float) -> None:
    properties = _drake(collision, "proximity_properties")
    _drake(properties, "mu_dynamic", text=_number(friction))
    _drake(properties, "mu_static", text=_number(friction))
    _drake(properties, "point_contact_stiffness", text=_number(contact_stiffness(robot), digits=6))
    _drake(properties, "hunt_crossley_dissipation", text=_number(contact_dissipation(robot), digits=6))
    # Of Drake's SAP only, which otherwise lets contacts creep.
    _drake(properties, "relaxation_time", text="0")


def _add_pose(
    parent: etree._Element, position: NDArray[np.float64], rotation: Rotation, relative_to: str | None = None
) -> None:
    pose = _add(parent, "pose", text=_numbers([*position, *rotation.as_quat(canonical=True)]))
    pose.set("rotation_format", "quat_xyzw")
    if relative_to is not None:
        pose.set("relative_to", relative_to)


def _ellipsoid(radii: tuple[float, float, float]) -> etree._Element:
    shape = etree.Element("ellipsoid")
    _add(shape, "radii", text=_numbers(radii))
    return shape


def _add(parent: etree._Element, tag: str, *, text: str | None = None, **attributes: str) -> etree._Element:
    element = etree.SubElement(parent, tag, attrib=attributes)
    element.text = text
    return element


def _drake(parent: etree._Element, tag: str, *, text: str | None = None, **attributes: str) -> etree._Element:
    return _add(parent, f"{{{DRAKE}}}{tag}", text=text, **attributes)


def _number(value: float, digits: int = 12) -> str:
    # Rounding hides the last bits, in which platforms differ; adding 0.0 turns -0 into 0.
    rounded = float(f"{value:.{digits}g}")
    return f"{0.0 if abs(rounded) < 1e-15 else rounded:.{digits}g}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)
