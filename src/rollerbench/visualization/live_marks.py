"""Forces of the ground, and feet that stand, of a robot that is being simulated, in Drake's Meshcat."""

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, Rgba

from rollerbench import palette
from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.visualization import marks
from rollerbench.visualization.live_scene import draw
from rollerbench.visualization.model import transform
from rollerbench.visualization.shapes import Item, polygon

Array = NDArray[np.float64]

COLORS = (palette.FORCE, *palette.SLIP_COLORS)
"""Of arrows, by how fast what they push slides."""


class ForceArrows:
    """Arrows of the ground's forces on wheels or feet, coloured by slip (`palette.SLIP_SPEEDS`)."""

    def __init__(self, meshcat: Meshcat, robot: Robot) -> None:
        """Makes an arrow of each colour for each wheel or foot; all wait out of sight."""
        self._meshcat = meshcat
        parts, size = robot.wheels or robot.legs, marks.size_of(robot)
        length = marks.force_length(robot)
        self._scale = length * len(parts) / (robot.mass * GRAVITY)
        self._longest, self._least = length * len(parts), 0.02 * length
        self._buried = transform(np.eye(3), np.array([0.0, 0.0, marks.BURIED * size]))
        self._shown = [0] * len(parts)
        shape = marks.arrow(self._longest, palette.FORCE_WIDTH * size)
        self._frames = [[f"forces/{part.name}_{rank}" for rank in range(len(COLORS))] for part in parts]
        for frames in self._frames:
            for frame, color in zip(frames, COLORS, strict=True):
                draw(meshcat, Item(frame=frame, name="arrow", shape=shape, color=color))
                meshcat.SetTransform(f"/{frame}", self._buried)

    def show(self, places: Array, forces: Array, slips: Array) -> None:
        """Moves the arrows.

        Args:
            places: Where the ground touches (n, 3) [m].
            forces: Its forces (n, 3) on wheels or feet, in their order [N].
            slips: How fast these slide (n,) [m/s].
        """
        sizes = np.linalg.norm(forces, axis=1)
        lengths = np.minimum(self._scale * sizes, self._longest)
        up = forces / np.maximum(sizes, 1e-9)[:, np.newaxis]
        poses = transform(marks.towards(up), places + lengths[:, np.newaxis] * up)
        ranks = np.searchsorted(palette.SLIP_SPEEDS, slips, side="right")
        for index, frames in enumerate(self._frames):
            before, rank = self._shown[index], int(ranks[index])
            if rank != before:
                self._meshcat.SetTransform(f"/{frames[before]}", self._buried)
            seen = lengths[index] > self._least
            self._meshcat.SetTransform(f"/{frames[rank]}", poses[index] if seen else self._buried)
            self._shown[index] = rank


class SupportPolygon:
    """The polygon of the feet that stand."""

    PATH = "/support/polygon"

    def __init__(self, meshcat: Meshcat, robot: Robot) -> None:
        """Draws nothing yet."""
        self._meshcat, self._size = meshcat, marks.size_of(robot)
        self._color = Rgba(*palette.SUPPORT, palette.SUPPORT_OPACITY)
        self._feet = np.zeros((0, 3))

    def show(self, feet: Array) -> None:
        """Draws it for the lowest points (n, 3) of the feet that stand [m], if they moved."""
        if len(feet) == len(self._feet) and np.abs(feet - self._feet).max(initial=0.0) < 0.02 * self._size:
            return
        self._feet = feet.copy()
        corners = marks.hull(feet)
        if corners is None:
            self._meshcat.Delete(self.PATH)
            return
        shape = polygon(corners + np.array([0.0, 0.0, marks.height_of("support", self._size)]))
        self._meshcat.SetTriangleMesh(self.PATH, shape.vertices.T, shape.faces.T.astype(np.int32), self._color)
