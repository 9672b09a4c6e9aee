"""Where a camera has to stand so that all that matters is seen, as large as can be."""

import math

import numpy as np
from numpy.typing import NDArray

from rollerbench.visualization.scenes import FIELD_OF_VIEW, Scene
from rollerbench.visualization.shapes import Box, Cylinder, Ellipsoid, Item, Shape

Array = NDArray[np.float64]

TIMES = 60
"""How many poses of a robot count for its way."""

NEIGHBOURHOOD = 2.2
"""How much of its trails is seen about a robot, over its radius."""


def axes(direction: Array) -> Array:
    """Rotation (3, 3) in W of a camera that looks against a direction (3,): x to the right, y down, z ahead."""
    right = np.cross([0.0, 0.0, 1.0], direction)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(right, direction), -direction])


def closest_eye(points: Array, direction: Array, aspect: float, margin: float) -> tuple[Array, float]:
    """Where the eye is nearest to points and still sees them all.

    A point p in the camera's axes is seen if |x - x_eye| <= (z - z_eye) tan(angle / 2), and as much for y: four planes
    through the eye, each of which touches the points.

    Args:
        points: Points (n, 3) in W.
        direction: Unit vector (3,) from there to the eye.
        aspect: Width over height of the picture.
        margin: Share of the picture that stays free along each edge.

    Returns:
        The eye (3,), and its distance [m] to the middle of the points along the view.
    """
    R_WC = axes(direction)
    p_C = points @ R_WC
    half = (1.0 - 2 * margin) * math.tan(0.5 * FIELD_OF_VIEW)
    eye, ahead = np.zeros(3), np.inf
    for axis, slope in ((0, half * aspect), (1, half)):
        most = np.max(p_C[:, axis] - slope * p_C[:, 2])
        least = np.min(p_C[:, axis] + slope * p_C[:, 2])
        eye[axis] = 0.5 * (most + least)
        ahead = min(ahead, (least - most) / (2 * slope))
    eye[2] = ahead
    return R_WC @ eye, float(0.5 * (p_C[:, 2].min() + p_C[:, 2].max()) - ahead)


def whole(scene: Scene) -> Array:
    """Points (n, 3) round all that robots and ghosts do in a scene, and their trails."""
    return np.concatenate([_trails(scene), *(_corners(scene, index) for index in np.linspace(0.0, 1.0, TIMES))])


def near(scene: Scene, time: float) -> Array:
    """Points (n, 3) round robots and ghosts at a time [s], and of the trails about them."""
    bodies = _corners(scene, (time / scene.duration if scene.duration else 0.0))
    middle = 0.5 * (bodies.min(axis=0) + bodies.max(axis=0))
    radius = np.linalg.norm(bodies - middle, axis=1).max()
    trails = _trails(scene)
    return np.concatenate([bodies, trails[np.linalg.norm(trails - middle, axis=1) < NEIGHBOURHOOD * radius]])


def _trails(scene: Scene) -> Array:
    found = [np.zeros((0, 3))]
    return np.concatenate(found + [_outline(item.shape) for item in scene.items if item.frame == "trails"])


def _corners(scene: Scene, share: float) -> Array:
    """Corners (n, 3) of robots and ghosts after a share of the scene's time."""
    found = []
    for item in scene.items:
        track = scene.tracks.get(item.frame)
        if track is not None and _matters(scene, item):
            X_WG = track[round(share * (len(track) - 1))] @ item.X_FG
            found.append(_outline(item.shape) @ X_WG[:3, :3].T + X_WG[:3, 3])
    return np.concatenate(found)


def _matters(scene: Scene, item: Item) -> bool:
    return any(item.frame.startswith((f"{run.prefix}robot/", f"{run.prefix}ghost")) for run in scene.runs)


def _outline(shape: Shape) -> Array:
    """Corners (n, 3) of the box about a shape, or of its triangles."""
    if isinstance(shape, Box):
        half = 0.5 * np.array(shape.size)
    elif isinstance(shape, Cylinder):
        half = np.array([shape.radius, shape.radius, 0.5 * shape.length])
    elif isinstance(shape, Ellipsoid):
        half = np.array(shape.radii)
    else:
        return shape.vertices
    signs = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij"), axis=-1).reshape(-1, 3)
    return signs * half
