"""Elements of SDF text: links' masses and shapes, joints, poses, numbers."""

from collections.abc import Iterable

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description import Robot
from rollerbench.description.inertia import RigidInertia
from rollerbench.sdf.contact import contact_dissipation, contact_stiffness

DRAKE = "drake.mit.edu"


def add_joint(
    model: etree._Element,
    name: str,
    parent: str | None,
    child: str | None,
    axis: str,
    effort: float,
    *,
    damping: float = 0.0,
    speed: float | None = None,
    limits: tuple[float, float] | None = None,
    rotor_inertia: float = 0.0,
) -> None:
    """A revolute joint at the child's origin; effort 0 means that no motor drives it, -1 that it has no limit."""
    joint = add(model, "joint", name=name, type="revolute")
    add(joint, "parent", text=parent)
    add(joint, "child", text=child)
    element = add(joint, "axis")
    add(element, "xyz", text=axis)
    limit = add(element, "limit")
    if limits is not None:
        add(limit, "lower", text=number(limits[0]))
        add(limit, "upper", text=number(limits[1]))
    add(limit, "effort", text=number(effort))
    if speed is not None:
        add(limit, "velocity", text=number(speed))
    if damping:
        add(add(element, "dynamics"), "damping", text=number(damping))
    if rotor_inertia:
        add_drake(joint, "rotor_inertia", text=number(rotor_inertia))


def add_fixed_joint(model: etree._Element, name: str, parent: str | None, child: str | None) -> None:
    """A joint that holds the child where its pose puts it."""
    joint = add(model, "joint", name=name, type="fixed")
    add(joint, "parent", text=parent)
    add(joint, "child", text=child)


def add_inertial(link: etree._Element, inertia: RigidInertia) -> None:
    """Gives a link its mass distribution, in the link's frame."""
    element = add(link, "inertial")
    add(element, "pose", text=numbers([*inertia.com, 0, 0, 0]))
    add(element, "mass", text=number(inertia.mass))
    moments = add(element, "inertia")
    for row, column, name in ((0, 0, "ixx"), (0, 1, "ixy"), (0, 2, "ixz"), (1, 1, "iyy"), (1, 2, "iyz"), (2, 2, "izz")):
        add(moments, name, text=number(inertia.moment[row, column]))


def add_shape(
    link: etree._Element,
    kind: str,
    name: str,
    shape: etree._Element,
    *,
    position: NDArray[np.float64] | None = None,
    rotation: Rotation | None = None,
    color: tuple[float, float, float] | None = None,
) -> etree._Element:
    """A shape of a link, of the kind "visual" or "collision", at a pose in the link's frame."""
    element = add(link, kind, name=name)
    if position is not None or rotation is not None:
        add_pose(element, np.zeros(3) if position is None else position, rotation or Rotation.identity())
    add(element, "geometry").append(etree.fromstring(etree.tostring(shape)))
    if color is not None:
        add(add(element, "material"), "diffuse", text=numbers([*color, 1]))
    return element


def add_contact(collision: etree._Element, robot: Robot, *, friction: float) -> None:
    """Gives a collision shape its friction, and the stiffness and dissipation of a wheel on the ground."""
    properties = add_drake(collision, "proximity_properties")
    add_drake(properties, "mu_dynamic", text=number(friction))
    add_drake(properties, "mu_static", text=number(friction))
    add_drake(properties, "point_contact_stiffness", text=number(contact_stiffness(robot), digits=6))
    add_drake(properties, "hunt_crossley_dissipation", text=number(contact_dissipation(robot), digits=6))
    # Of Drake's SAP only, which otherwise lets contacts creep.
    add_drake(properties, "relaxation_time", text="0")


def add_pose(
    parent: etree._Element, position: NDArray[np.float64], rotation: Rotation, relative_to: str | None = None
) -> None:
    """Places an element in the frame of another, by default of its parent."""
    pose = add(parent, "pose", text=numbers([*position, *rotation.as_quat(canonical=True)]))
    pose.set("rotation_format", "quat_xyzw")
    if relative_to is not None:
        pose.set("relative_to", relative_to)


def ellipsoid(radii: tuple[float, float, float]) -> etree._Element:
    """The shape with semi-axes along x, y and z [m]."""
    shape = etree.Element("ellipsoid")
    add(shape, "radii", text=numbers(radii))
    return shape


def box(size: Iterable[float]) -> etree._Element:
    """The shape of extent size along x, y and z [m]."""
    shape = etree.Element("box")
    add(shape, "size", text=numbers(size))
    return shape


def sphere(radius: float) -> etree._Element:
    """The shape of a radius [m]."""
    shape = etree.Element("sphere")
    add(shape, "radius", text=number(radius))
    return shape


def cylinder(radius: float, length: float) -> etree._Element:
    """The shape about the z axis [m]."""
    shape = etree.Element("cylinder")
    add(shape, "radius", text=number(radius))
    add(shape, "length", text=number(length))
    return shape


def add(parent: etree._Element, tag: str, *, text: str | None = None, **attributes: str) -> etree._Element:
    """An element inside another."""
    element = etree.SubElement(parent, tag, attrib=attributes)
    element.text = text
    return element


def add_drake(parent: etree._Element, tag: str, *, text: str | None = None, **attributes: str) -> etree._Element:
    """An element of Drake's inside another."""
    return add(parent, f"{{{DRAKE}}}{tag}", text=text, **attributes)


def number(value: float, digits: int = 12) -> str:
    """A number as text, the same on all platforms."""
    # Rounding hides the last bits, in which platforms differ; adding 0.0 turns -0 into 0.
    rounded = float(f"{value:.{digits}g}")
    return f"{0.0 if abs(rounded) < 1e-15 else rounded:.{digits}g}"


def numbers(values: Iterable[float]) -> str:
    """Numbers as text."""
    return " ".join(number(value) for value in values)
