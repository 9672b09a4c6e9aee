"""What pictures are made of: coloured shapes on frames that move. Viewers and renderers translate them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.palette import Color

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box of extent size about the origin [m]."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder:
    """A cylinder about the z axis [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Ellipsoid:
    """An ellipsoid with semi-axes along x, y and z [m]."""

    radii: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        vertices: Points (n, 3) [m].
        faces: Indices (m, 3) of their corners, counter-clockwise from outside.
    """

    vertices: Array
    faces: NDArray[np.int64]


Shape = Box | Cylinder | Ellipsoid | Mesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Item:
    """A shape that is fixed to a frame.

    Attributes:
        frame: Path of the frame, such as "robot/body"; those of no track are the world's.
        name: Its name on that frame.
        shape: Its shape.
        color: Its colour.
        opacity: From 0 to 1.
        X_FG: Its pose (4, 4) in the frame.
        lit: Whether light falls on it; marks on the ground keep their colour from every side.
    """

    frame: str
    name: str
    shape: Shape
    color: Color
    opacity: float = 1.0
    X_FG: Array = field(default_factory=lambda: np.eye(4))
    lit: bool = True


Tracks = Mapping[str, Array]
"""Poses (n, 4, 4) of frames in the world over the times of a scene, by path."""


def merged(meshes: list[Mesh]) -> Mesh | None:
    """Meshes as one; None if there are none."""
    meshes = [mesh for mesh in meshes if len(mesh.faces)]
    if not meshes:
        return None
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(vertices=np.concatenate([mesh.vertices for mesh in meshes]), faces=np.concatenate(faces))


def ribbon(points: Array, width: float, heights: ArrayLike) -> Mesh | None:
    """A flat band along points (n, 2) at heights (n,), or one, over the ground [m]; None if they stay in place."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-3 * width
    kept = np.concatenate([[True], apart])
    points, z = points[kept], np.broadcast_to(np.asarray(heights, dtype=np.float64), len(points))[kept]
    if len(points) < 2:
        return None
    ahead = np.gradient(points, axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-12)
    left = 0.5 * width * np.column_stack([-ahead[:, 1], ahead[:, 0]])
    flat = np.stack([points + left, points - left], axis=1).reshape(-1, 2)
    first = 2 * np.arange(len(points) - 1)[:, np.newaxis]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([1, 3, 2])])
    return Mesh(vertices=np.column_stack([flat, np.repeat(z, 2)]), faces=faces)


def polygon(corners: Array) -> Mesh:
    """A convex polygon with corners (n, 3), counter-clockwise from above."""
    index = np.arange(1, len(corners) - 1)
    return Mesh(vertices=corners, faces=np.column_stack([np.zeros_like(index), index, index + 1]))


def disc(center: Array, radius: float, corners: int = 20) -> Mesh:
    """A level disc about a point (3,)."""
    angle = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
    return polygon(center + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(corners)]))
