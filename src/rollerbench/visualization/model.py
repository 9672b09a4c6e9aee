"""A robot's SDF model as what is seen of it: shapes on frames, and where joint angles put these."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.errors import ResourceError
from rollerbench.palette import BODY, Color
from rollerbench.visualization.shapes import Box, Cylinder, Ellipsoid, Item, Shape

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """A joint of a model.

    Attributes:
        name: Its name.
        parent: Link that carries it.
        child: Link that it moves.
        X_PC: Pose (4, 4) of the child's frame in the parent's at angle 0.
        axis: What it turns about (3,), in the child's frame; None for a joint that does not turn.
    """

    name: str
    parent: str
    child: str
    X_PC: Array
    axis: Array | None


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnModel:
    """What is seen of a robot.

    Attributes:
        root: Name of the link that carries the others.
        joints: Its joints, each after those that carry it.
        visuals: Shapes by the name of their link.
    """

    root: str
    joints: tuple[Joint, ...]
    visuals: Mapping[str, tuple[Item, ...]]

    def items(self, moving: Mapping[str, Array] | set[str], prefix: str) -> list[Item]:
        """The shapes, on frames named prefix/link; links that no moving joint carries are part of the one before them.

        Args:
            moving: Names of joints that have angles.
            prefix: Path of the robot.
        """
        found = list(self._on(self.root, self.root, np.eye(4), prefix))
        carrier = {self.root: (self.root, np.eye(4))}
        for joint in self.joints:
            base, X_BP = carrier[joint.parent]
            fixed = joint.name not in moving
            carrier[joint.child] = (base, X_BP @ joint.X_PC) if fixed else (joint.child, np.eye(4))
            found += self._on(joint.child, *carrier[joint.child], prefix)
        return found

    def tracks(self, X_WB: Array, angles: Mapping[str, Array], prefix: str) -> dict[str, Array]:
        """Poses (n, 4, 4) of the frames of `items` by path.

        Args:
            X_WB: Poses (n, 4, 4) of the root in W.
            angles: Angles (n,) by the name of their joint [rad].
            prefix: Path of the robot.
        """
        poses, seen = {self.root: X_WB}, {f"{prefix}/{self.root}": X_WB}
        for joint in self.joints:
            poses[joint.child] = poses[joint.parent] @ joint.X_PC
            if joint.name in angles and joint.axis is not None:
                turn = np.zeros((len(X_WB), 4, 4))
                turn[:, 3, 3] = 1.0
                turn[:, :3, :3] = Rotation.from_rotvec(np.outer(angles[joint.name], joint.axis)).as_matrix()
                poses[joint.child] = poses[joint.child] @ turn
                seen[f"{prefix}/{joint.child}"] = poses[joint.child]
        return seen

    def _on(self, link: str, frame: str, X_FL: Array, prefix: str) -> list[Item]:
        own = "" if link == frame else f"{link}_"
        return [
            Item(
                frame=f"{prefix}/{frame}",
                name=own + item.name,
                shape=item.shape,
                color=item.color,
                X_FG=X_FL @ item.X_FG,
            )
            for item in self.visuals.get(link, ())
        ]


def read_model(text: str, file: str | Path = "model.sdf") -> DrawnModel:
    """Reads SDF text as `rollerbench.sdf.robot_to_sdf` writes it.

    Args:
        text: The text.
        file: What messages call it.

    Raises:
        ResourceError: it is not such a text.
    """
    try:
        model = etree.fromstring(text.encode("utf-8")).find("model")
        if model is None:
            raise ValueError("it holds no model")
        links = {str(link.get("name")): link for link in model.findall("link")}
        poses = _poses(links)
        joints = tuple(_joint(element, poses) for element in model.findall("joint"))
        visuals = {name: tuple(_visual(visual) for visual in link.findall("visual")) for name, link in links.items()}
        root = _root(links, joints)
        return DrawnModel(root=root, joints=_in_order(root, joints), visuals=visuals)
    except KeyError as error:
        raise ResourceError(f"{file}: not a model of rollerbench: it lacks {error}") from error
    except (etree.XMLSyntaxError, AttributeError, IndexError, RecursionError, ValueError) as error:
        raise ResourceError(f"{file}: not a model of rollerbench: {error}") from error


def transform(rotation: Array, position: Array) -> Array:
    """Poses (..., 4, 4) from rotations (..., 3, 3) and positions (..., 3)."""
    poses = np.zeros((*np.shape(position)[:-1], 4, 4))
    poses[..., :3, :3], poses[..., :3, 3], poses[..., 3, 3] = rotation, position, 1.0
    return poses


def _root(links: Mapping[str, etree._Element], joints: tuple[Joint, ...]) -> str:
    roots = sorted(set(links) - {joint.child for joint in joints})
    if len(roots) != 1:
        raise ValueError(f"links that no joint carries: {', '.join(roots) or 'none'}; accepted: one")
    return roots[0]


def _in_order(root: str, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    known, ordered, left = {root}, [], list(joints)
    while left:
        ready = [joint for joint in left if joint.parent in known]
        if not ready:
            raise ValueError(f"joint {left[0].name}: its links are not connected with {root}")
        ordered += ready
        known |= {joint.child for joint in ready}
        left = [joint for joint in left if joint.child not in known]
    return tuple(ordered)


def _poses(links: Mapping[str, etree._Element]) -> dict[str, Array]:
    """Poses (4, 4) of the links in the model's frame."""
    found: dict[str, Array] = {}

    def pose(name: str) -> Array:
        if name not in links:
            raise ValueError(f"a pose is relative to the unknown link {name!r}")
        if name not in found:
            element = links[name].find("pose")
            base = None if element is None else element.get("relative_to")
            found[name] = (pose(base) if base else np.eye(4)) @ _pose(element)
        return found[name]

    for name in links:
        pose(name)
    return found


def _joint(element: etree._Element, poses: Mapping[str, Array]) -> Joint:
    parent, child = (str(element.findtext(tag)) for tag in ("parent", "child"))
    for link in (parent, child):
        if link not in poses:
            raise ValueError(f"joint {element.get('name')}: unknown link {link!r}")
    axis = element.findtext("axis/xyz")
    return Joint(
        name=str(element.get("name")),
        parent=parent,
        child=child,
        X_PC=np.asarray(np.linalg.solve(poses[parent], poses[child]), dtype=np.float64),
        axis=None if axis is None else np.array(_numbers(axis)),
    )


def _visual(element: etree._Element) -> Item:
    geometry, color = element.find("geometry"), element.findtext("material/diffuse")
    if geometry is None or not len(geometry):
        raise ValueError(f"visual {element.get('name')}: it has no shape")
    return Item(
        frame="",
        name=str(element.get("name")),
        shape=_shape(geometry[0]),
        color=BODY if color is None else _color(color),
        X_FG=_pose(element.find("pose")),
    )


def _shape(element: etree._Element) -> Shape:
    values = {str(child.tag): _numbers(child.text) for child in element}
    if element.tag == "box":
        x, y, z = values["size"]
        return Box(size=(x, y, z))
    if element.tag == "ellipsoid":
        x, y, z = values["radii"]
        return Ellipsoid(radii=(x, y, z))
    if element.tag == "sphere":
        return Ellipsoid(radii=(values["radius"][0],) * 3)
    if element.tag == "cylinder":
        return Cylinder(radius=values["radius"][0], length=values["length"][0])
    raise ValueError(f"shape {element.tag!r}: accepted: box, ellipsoid, sphere, cylinder")


def _color(text: str) -> Color:
    red, green, blue, *_ = _numbers(text)
    return red, green, blue


def _pose(element: etree._Element | None) -> Array:
    """Pose (4, 4) of an SDF element pose; the identity for none."""
    if element is None:
        return np.eye(4)
    x, y, z, *turn = _numbers(element.text)
    quaternion = element.get("rotation_format") == "quat_xyzw"
    rotation = Rotation.from_quat(turn) if quaternion else Rotation.from_euler("xyz", turn)
    return transform(rotation.as_matrix(), np.array([x, y, z]))


def _numbers(text: str | None) -> list[float]:
    return [float(value) for value in (text or "").split()]
