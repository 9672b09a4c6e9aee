"""The robot's surroundings in Meshcat, and the page that keeps a run."""

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Meshcat, MeshcatParams, MeshcatVisualizer, MeshcatVisualizerParams, Rgba, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import DiagramBuilder

from rollerbench.description import Robot

GROUND_COLOR = np.array([0.88, 0.89, 0.90, 1.0])
GRID_COLOR = Rgba(0.70, 0.72, 0.75, 1.0)
REFERENCE_COLOR = Rgba(0.10, 0.45, 0.85, 1.0)
SIMULATED_COLOR = Rgba(0.90, 0.45, 0.05, 1.0)


def local_meshcat() -> Meshcat:
    """A Meshcat server that only this machine can reach."""
    return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))


def add_ground_visual(plant: MultibodyPlant, robot: Robot) -> None:
    """Draws the ground, a slab whose top is z = 0, in a plant that is not finalized; Meshcat shows no half space."""
    side = 60 * _size(robot)
    slab = Box(side, side, 0.01 * side)
    pose = RigidTransform([0.0, 0.0, -0.005 * side])
    plant.RegisterVisualGeometry(plant.world_body(), pose, slab, "ground", GROUND_COLOR)


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
    meshcat.SetProperty("/Background", "top_color", [0.93, 0.95, 0.98])
    meshcat.SetProperty("/Background", "bottom_color", [0.80, 0.84, 0.90])
    size = _size(robot)
    _draw_grid(meshcat, size)
    draw_path(meshcat, "reference", reference_q_xyt, REFERENCE_COLOR, lift=0.004 * size)
    low, high = reference_q_xyt[:, :2].min(axis=0) - size, reference_q_xyt[:, :2].max(axis=0) + size
    center, span = 0.5 * (low + high), float(np.max(high - low))
    target = np.array([*center, -0.5 * robot.ground_height])
    meshcat.SetCameraPose(target + span * np.array([-0.55, -0.75, 0.6]), target)


def draw_path(
    meshcat: Meshcat, name: str, q_xyt: NDArray[np.float64], color: Rgba, lift: float, points: int = 500
) -> None:
    """Draws the planar path of poses (n, 3) as a line a little over the ground."""
    chosen = np.unique(np.linspace(0, len(q_xyt) - 1, points).astype(int))
    line = np.column_stack([q_xyt[chosen, :2], np.full(len(chosen), lift)])
    if len(line) > 1:
        meshcat.SetLine(f"paths/{name}", line.T, 4.0, color)


def _draw_grid(meshcat: Meshcat, size: float, lines: int = 60) -> None:
    """Draws grid lines a power of ten of metres apart, close to the robot's size."""
    pitch = 10.0 ** round(math.log10(size))
    reach = 0.5 * lines * pitch
    offsets = np.linspace(-reach, reach, lines + 1)
    height = np.full_like(offsets, 0.002 * size)
    edge = np.full_like(offsets, reach)
    starts = np.column_stack([np.stack([offsets, -edge, height]), np.stack([-edge, offsets, height])])
    ends = np.column_stack([np.stack([offsets, edge, height]), np.stack([edge, offsets, height])])
    meshcat.SetLineSegments("grid", starts, ends, 1.0, GRID_COLOR)


def _size(robot: Robot) -> float:
    """Largest horizontal extent of the robot [m]."""
    reach = max(math.hypot(*wheel.p_BoHo_B[:2]) + wheel.swivel_offset + wheel.radius for wheel in robot.wheels)
    return max(2 * reach, *robot.body.size[:2])
