"""A robot as URDF for Bullet, which knows no ellipsoids: rollers are convex hulls of them, or rows of spheres."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import rollerbench as rb
from rollerbench.description.inertia import RigidInertia
from rollerbench.description.mass import body_inertia, hub_inertia, roller_inertia, roller_poses_H
from rollerbench.description.rollers import RollerRing
from rollerbench.description.wheels import RollerWheel
from rollerbench.sdf import names

MARGIN = 1e-3
"""By which Bullet rounds a convex hull from a URDF, outwards [m]."""


def write_urdf(robot: rb.Robot, folder: Path, *, rollers: str) -> Path:
    """Writes URDF and meshes of a Mecanum base; returns the URDF's path.

    Args:
        robot: A robot whose wheels all have rollers.
        folder: Where to write.
        rollers: "hull 15x32" for hulls of 15 rings of 32 vertices, "spheres 9" for rows of 9 spheres.
    """
    kind, _, size = rollers.partition(" ")
    root = etree.Element("robot", name=robot.name)
    body = _link(root, names.BODY, body_inertia(robot.body))
    box = etree.SubElement(body, "collision")
    etree.SubElement(box, "origin", xyz=_text(robot.body.box_center))
    etree.SubElement(etree.SubElement(box, "geometry"), "box", size=_text(robot.body.size))
    for wheel in robot.wheels:
        if not isinstance(wheel, RollerWheel):
            raise rb.DescriptionError(f"{robot.name}: the benchmark knows wheels with rollers only")
        mesh = folder / f"roller_{wheel.name}.obj"
        if kind == "hull":
            mesh.write_text(_hull_text(wheel.ring, *map(int, size.split("x"))))
        heading = Rotation.from_euler("z", wheel.heading)
        _link(root, names.hub(wheel.name), hub_inertia(wheel))
        _joint(
            root, names.drive_joint(wheel.name), (names.BODY, names.hub(wheel.name)), "0 1 0", wheel.center_B, heading
        )
        for index, (matrix, center) in enumerate(roller_poses_H(wheel)):
            link = _link(root, names.roller(wheel.name, index), roller_inertia(wheel))
            if kind == "hull":
                geometry = etree.SubElement(etree.SubElement(link, "collision"), "geometry")
                etree.SubElement(geometry, "mesh", filename=mesh.name)
            else:
                _add_spheres(link, wheel.ring, int(size))
            ends = (names.hub(wheel.name), names.roller(wheel.name, index))
            joint = names.roller_joint(wheel.name, index)
            _joint(root, joint, ends, "1 0 0", center, Rotation.from_matrix(matrix))
    path = folder / "robot.urdf"
    path.write_bytes(etree.tostring(root, pretty_print=True))
    return path


def barrel_points(ring: RollerRing, rings: int, sides: int) -> NDArray[np.float64]:
    """Vertices (rings sides, 3) on the part of a roller's ellipsoid that touches the ground, x along its axis.

    Bullet rounds hulls by a margin that URDF cannot change, so these are points of the inner parallel surface at that
    distance. Neighbouring rings are turned by half a side.
    """
    half = min(1.1 * ring.half_length, 0.999 * ring.semi_axis)
    along = half * np.linspace(-1, 1, rings)
    radius = ring.roller_radius * np.sqrt(1 - (along / ring.semi_axis) ** 2)
    normal = np.stack([along / ring.semi_axis**2, radius / ring.roller_radius**2])
    normal /= np.linalg.norm(normal, axis=0)
    along, radius = along - MARGIN * normal[0], radius - MARGIN * normal[1]
    # Sides lie as far inside of the circle as corners outside.
    radius = radius * (2 / (1 + np.cos(np.pi / sides)))
    angle = 2 * np.pi * (np.arange(sides) + 0.5 * (np.arange(rings)[:, np.newaxis] % 2)) / sides
    across = radius[:, np.newaxis, np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = np.concatenate([np.broadcast_to(along[:, np.newaxis, np.newaxis], (rings, sides, 1)), across], axis=-1)
    return points.reshape(-1, 3)


def _add_spheres(link: etree._Element, ring: RollerRing, count: int) -> None:
    """Spheres inscribed in the ellipsoid, evenly along the part that touches the ground."""
    flattening = 1 - (ring.roller_radius / ring.semi_axis) ** 2
    for center in flattening * ring.half_length * np.linspace(-1, 1, count):
        collision = etree.SubElement(link, "collision")
        etree.SubElement(collision, "origin", xyz=_text((center, 0.0, 0.0)))
        radius = ring.roller_radius * np.sqrt(1 - center**2 / (ring.semi_axis**2 * flattening))
        etree.SubElement(etree.SubElement(collision, "geometry"), "sphere", radius=_text([radius]))


def _hull_text(ring: RollerRing, rings: int, sides: int) -> str:
    points = barrel_points(ring, rings, sides)
    lines = ["v " + _text(point) for point in points]
    lines += ["f " + " ".join(str(i + 1) for i in corners) for corners in ConvexHull(points).simplices]
    return "\n".join(lines) + "\n"


def _link(root: etree._Element, name: str, inertia: RigidInertia) -> etree._Element:
    link = etree.SubElement(root, "link", name=name)
    inertial = etree.SubElement(link, "inertial")
    etree.SubElement(inertial, "origin", xyz=_text(inertia.com))
    etree.SubElement(inertial, "mass", value=_text([inertia.mass]))
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    etree.SubElement(inertial, "inertia", attrib={key: _text([inertia.moment[at]]) for key, at in entries.items()})
    return link


def _joint(
    root: etree._Element,
    name: str,
    ends: tuple[str, str],
    axis: str,
    position: NDArray[np.float64],
    rotation: Rotation,
) -> None:
    joint = etree.SubElement(root, "joint", name=name, type="continuous")
    etree.SubElement(joint, "parent", link=ends[0])
    etree.SubElement(joint, "child", link=ends[1])
    etree.SubElement(joint, "axis", xyz=axis)
    etree.SubElement(joint, "origin", xyz=_text(position), rpy=_text(rotation.as_euler("xyz")))


def _text(values: Iterable[float]) -> str:
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)
