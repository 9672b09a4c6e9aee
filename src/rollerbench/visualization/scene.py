"""The robot's surroundings in Meshcat, and the page that keeps a run."""

import logging
import math

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    Ellipsoid,
    Meshcat,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder

from rollerbench.description import Robot
from rollerbench.kinematics.bumps import Bumps

GROUND_SIZE = 40
"""Side of the ground that is shown, over the size of the robot [-]."""

GROUND_COLOR = np.array([0.88, 0.89, 0.90, 1.0])
BUMP_COLOR = np.array([0.72, 0.66, 0.58, 1.0])
GRID_COLOR = Rgba(0.55, 0.60, 0.65, 1.0)
REFERENCE_COLOR = Rgba(0.10, 0.45, 0.85, 1.0)
SIMULATED_COLOR = Rgba(0.90, 0.45, 0.05, 1.0)


def local_meshcat(host: str = "localhost") -> Meshcat:
    """A Meshcat server that only this machine can reach, unless it is bound to another host."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)  # Every run would announce an address that nobody needs.
    try:
        return Meshcat(MeshcatParams(host=host, show_stats_plot=False))
    finally:
        logger.setLevel(level)


def add_ground_visual(plant: MultibodyPlant, robot: Robot) -> None:
    """Draws the ground as a slab in a plant that is not finalized; Meshcat shows no half space.

    Its top is a thousandth of the robot's size below z = 0, so that lines on the ground show.
    """
    size = _size(robot)
    side, thickness = GROUND_SIZE * size, 0.05 * size
    slab = Box(side, side, thickness)
    pose = RigidTransform([0.0, 0.0, -0.5 * thickness - 0.001 * size])
    plant.RegisterVisualGeometry(plant.world_body(), pose, slab, "ground", GROUND_COLOR)


def add_bump_visuals(plant: MultibodyPlant, body: RigidBody, bumps: Bumps) -> None:
    """Draws bumps on the body that carries them, in a plant that is not finalized.

    As flat ellipsoids of their heights and widths: Meshcat's spheres are too coarse to show a small cap of a large one.
    """
    places = zip(bumps.centers_W, bumps.half_widths, bumps.heights, strict=True)
    for index, ((x, y, _), half_width, height) in enumerate(places):
        shape = Ellipsoid(half_width, half_width, height)
        plant.RegisterVisualGeometry(body, RigidTransform([x, y, 0.0]), shape, f"bump_{index}", BUMP_COLOR)


def add_meshcat(
    builder: DiagramBuilder, scene_graph: SceneGraph, meshcat: Meshcat, frames_per_second: float
) -> MeshcatVisualizer:
    """Shows a scene graph's illustration geometry in Meshcat."""
    parameters = MeshcatVisualizerParams(publish_period=1 / frames_per_second)
    return MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, parameters)


def dress_scene(meshcat: Meshcat, robot: Robot, reference_q_xyt: NDArray[np.float64]) -> None:
    """Sets grid, reference path and camera for a run along a reference path (n, 3)."""
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    # Even light: the lamp that comes with Meshcat leaves a bright spot in the middle of dark ground.
    meshcat.SetProperty("/Lights/SpotLight", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 1.1)
    meshcat.SetProperty("/Background", "top_color", [0.93, 0.95, 0.98])
    meshcat.SetProperty("/Background", "bottom_color", [0.80, 0.84, 0.90])
    size = _size(robot)
    _draw_grid(meshcat, size)
    draw_path(meshcat, "reference", reference_q_xyt, REFERENCE_COLOR, lift=0.002 * size)
    low, high = reference_q_xyt[:, :2].min(axis=0) - size, reference_q_xyt[:, :2].max(axis=0) + size
    center, span = 0.5 * (low + high), float(np.max(high - low))
    target = np.array([*center, -0.5 * robot.ground_height])
    meshcat.SetCameraPose(target + span * np.array([-0.3, -0.5, 0.37]), target)


def draw_path(
    meshcat: Meshcat, name: str, q_xyt: NDArray[np.float64], color: Rgba, lift: float, points: int = 500
) -> None:
    """Draws the planar path of poses (n, 3) as a line a little over the ground."""
    chosen = np.unique(np.linspace(0, len(q_xyt) - 1, points).astype(int))
    line = np.column_stack([q_xyt[chosen, :2], np.full(len(chosen), lift)])
    if len(line) > 1:
        meshcat.SetLine(f"paths/{name}", line.T, 4.0, color)


def _draw_grid(meshcat: Meshcat, size: float) -> None:
    """Draws grid lines over the slab, a power of ten of metres apart, smaller than the robot."""
    pitch = 10.0 ** math.floor(math.log10(size))
    count = 4 * math.ceil(0.0625 * GROUND_SIZE * size / pitch)
    # In pieces of four cells: with software rendering, a line that ends behind the camera vanishes.
    offset, start = (
        pitch * indices.ravel()
        for indices in np.meshgrid(np.arange(-count, count + 1), np.arange(-count, count, 4), indexing="ij")
    )
    end = start + 4 * pitch
    height = np.full_like(offset, 0.001 * size)
    starts = np.column_stack([np.stack([offset, start, height]), np.stack([start, offset, height])])
    ends = np.column_stack([np.stack([offset, end, height]), np.stack([end, offset, height])])
    meshcat.SetLineSegments("grid", starts, ends, 1.0, GRID_COLOR)


def _size(robot: Robot) -> float:
    """Largest horizontal extent of the robot [m]."""
    return max(2 * robot.reach, *robot.body.size[:2])
