"""A Meshcat server, and the robot's surroundings as plants have them drawn there."""

import logging

import numpy as np
from pydrake.geometry import (
    Box,
    Ellipsoid,
    Meshcat,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody
from pydrake.systems.framework import DiagramBuilder

from rollerbench import palette
from rollerbench.description import Robot
from rollerbench.errors import ResourceError
from rollerbench.kinematics.bumps import Bumps
from rollerbench.visualization.marks import size_of
from rollerbench.visualization.serve import EVERYWHERE

GROUND_SIZE = 40
"""Side of the ground that is shown, over the size of the robot [-]."""


def local_meshcat(host: str = "localhost", port: int | None = None) -> Meshcat:
    """A Meshcat server that only this machine can reach, unless it is told otherwise.

    Args:
        host: Name or address of this machine to listen at; "0.0.0.0" for all that it has, so that others can look too.
        port: Port to listen at, 0 or from 1024 to 65535; 0 for any free one, None for the first that is from 7000 on.

    Raises:
        ResourceError: it cannot listen there.
    """
    if port is not None and not (port == 0 or 1024 <= port <= 65535):
        raise ResourceError(f"port = {port}: accepted: 0 for any that is free, or from 1024 to 65535")
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)  # Drake would announce the address, as the callers do.
    try:
        return Meshcat(MeshcatParams(host="*" if host in EVERYWHERE else host, port=port, show_stats_plot=False))
    except (RuntimeError, SystemExit) as error:
        where = host if port is None else f"{host}, port {port}"
        raise ResourceError(
            f"cannot listen at {where}: accepted: a name or address of this machine, and a port that is free"
        ) from error
    finally:
        logger.setLevel(level)


def add_ground_visual(plant: MultibodyPlant, robot: Robot) -> None:
    """Draws the ground as a slab in a plant that is not finalized; Meshcat shows no half space.

    Its top is a thousandth of the robot's size below z = 0, so that lines on the ground show.
    """
    size = size_of(robot)
    side, thickness = GROUND_SIZE * size, palette.GROUND_THICKNESS * size
    slab = Box(side, side, thickness)
    pose = RigidTransform([0.0, 0.0, -0.5 * thickness - 0.001 * size])
    plant.RegisterVisualGeometry(plant.world_body(), pose, slab, "ground", np.array([*palette.GROUND, 1.0]))


def add_bump_visuals(plant: MultibodyPlant, body: RigidBody, bumps: Bumps) -> None:
    """Draws bumps on the body that carries them, in a plant that is not finalized.

    As flat ellipsoids of their heights and widths: Meshcat's spheres are too coarse to show a small cap of a large one.
    """
    places = zip(bumps.centers_W, bumps.half_widths, bumps.heights, strict=True)
    for index, ((x, y, _), half_width, height) in enumerate(places):
        shape = Ellipsoid(half_width, half_width, height)
        plant.RegisterVisualGeometry(
            body, RigidTransform([x, y, 0.0]), shape, f"bump_{index}", np.array([*palette.BUMP, 1.0])
        )


def add_meshcat(
    builder: DiagramBuilder, scene_graph: SceneGraph, meshcat: Meshcat, frames_per_second: float
) -> MeshcatVisualizer:
    """Shows a scene graph's illustration geometry in Meshcat."""
    parameters = MeshcatVisualizerParams(publish_period=1 / frames_per_second)
    return MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, parameters)
