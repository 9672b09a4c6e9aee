"""What Drake's Meshcat shows beside a robot that is being simulated: ground, ghost, trails; and its cameras."""

import math

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, Rgba

from rollerbench import palette
from rollerbench.description import Robot
from rollerbench.palette import Color
from rollerbench.visualization import floor, marks
from rollerbench.visualization.drake_shapes import drake_shape
from rollerbench.visualization.scenes import FIELD_OF_VIEW, Camera, View, cameras
from rollerbench.visualization.shapes import Item, Mesh, ribbon

Array = NDArray[np.float64]

ASPECT = 1.3
"""Width over height of a window, which Meshcat does not tell."""

STATION_GROUND = "/drake/visualizer/ground"
"""Ground that a station draws in its Meshcat, without a grid."""

LEFTOVERS = ("/ghost", "/heading", "/trails", "/forces", "/support")
"""What an earlier run may have left in a Meshcat."""

TRAIL_PIECES = 200
"""Pieces of a trail that are kept, so that days of driving stay small."""

TRAIL_PIECE = 60
"""Points of a piece of a trail: only the last piece is drawn anew when the robot moves on."""


class LiveScene:
    """Ground, ghost, trails and camera of a robot in Drake's Meshcat.

    The robot itself is shown by a MeshcatVisualizer (`rollerbench.build_station(meshcat=...)`); this shows what belongs
    to it, from the poses that it is told.
    """

    def __init__(
        self, meshcat: Meshcat, robot: Robot, *, camera: View = "iso", reference_q_xyt: Array | None = None
    ) -> None:
        """Dresses a Meshcat, after the simulator is initialized, which makes Meshcat draw the robot.

        Args:
            meshcat: Where to draw.
            robot: The robot, as its equations have it.
            camera: The view at the start.
            reference_q_xyt: Path (n, 3) that it will be asked to drive, if known; the ground reaches beyond it.
        """
        self._meshcat, self._robot, self._size = meshcat, robot, marks.size_of(robot)
        for leftover in LEFTOVERS:
            meshcat.Delete(leftover)
        path = np.zeros((1, 3)) if reference_q_xyt is None else reference_q_xyt
        self._low, self._high = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
        if reference_q_xyt is None:
            self._low, self._high = self._low - self._size, self._high + self._size
        self._trails = {
            "reference": _Trail(meshcat, "reference", palette.REFERENCE, self._size),
            "simulated": _Trail(meshcat, "simulated", palette.SIMULATED, self._size),
        }
        _even_light(meshcat)
        self._draw_ground()
        for item in marks.ghost(robot, "ghost"):
            draw(meshcat, item)
        draw(meshcat, marks.heading(robot, "heading", palette.SIMULATED))
        self.camera(camera)

    def show(self, X_WB: Array, X_WR: Array) -> None:
        """Moves the ghost and the heading arrow, and lets the trails grow.

        Args:
            X_WB: Pose (4, 4) of the robot's body.
            X_WR: Pose (4, 4) of its body as the equations predict it.
        """
        self._meshcat.SetTransform("/ghost", X_WR)
        self._meshcat.SetTransform("/heading", X_WB)
        self._trails["reference"].grow(X_WR[:2, 3])
        self._trails["simulated"].grow(X_WB[:2, 3])
        places = np.stack([X_WB[:2, 3], X_WR[:2, 3]])
        if (places.min(axis=0) < self._low).any() or (places.max(axis=0) > self._high).any():
            # Rarely: the ground grows by some lengths of the robot at a time.
            self._low = np.minimum(self._low, places.min(axis=0) - 5 * self._size)
            self._high = np.maximum(self._high, places.max(axis=0) + 5 * self._size)
            self._draw_ground()
        if self._view.follows:
            self._follow(X_WB[:2, 3])

    def camera(self, view: View) -> None:
        """Looks from another view."""
        self._view: Camera = cameras(self._low, self._high, self._size, self._robot)[view]
        self._followed: Array = np.full(2, np.nan)
        self._meshcat.SetCameraPose(self._view.eye(ASPECT), self._view.target)
        self._meshcat.SetProperty("/Cameras/default/rotated/<object>", "fov", math.degrees(FIELD_OF_VIEW))

    def restart(self) -> None:
        """Forgets the trails; to be called after the simulator is initialized anew."""
        self._draw_ground()
        for trail in self._trails.values():
            trail.restart()

    def _follow(self, place: Array) -> None:
        if not np.linalg.norm(place - self._followed) < 0.01 * self._size:
            self._followed = place.copy()
            aside = np.array([*place, 0.0])
            self._meshcat.SetCameraPose(self._view.eye(ASPECT) + aside, self._view.target + aside)

    def _draw_ground(self) -> None:
        self._meshcat.Delete(STATION_GROUND)
        for item in floor.ground(self._low, self._high, self._size):
            draw(self._meshcat, item)


class _Trail:
    """A band on the ground that grows, in pieces."""

    def __init__(self, meshcat: Meshcat, layer: str, color: Color, size: float) -> None:
        self._meshcat, self._layer, self._color = meshcat, layer, Rgba(*color)
        reference = layer == "reference"
        self._width = (palette.REFERENCE_TRAIL_WIDTH if reference else palette.TRAIL_WIDTH) * size
        self._height, self._step = marks.height_of(layer, size), 0.02 * size
        self._points: list[Array] = []
        self._piece = 0

    def grow(self, place: Array) -> None:
        if self._points and np.linalg.norm(place - self._points[-1]) < self._step:
            return
        self._points.append(place.copy())
        band = ribbon(np.array(self._points), self._width, self._height)
        if band is not None:
            path = f"/trails/{self._layer}/{self._piece}"
            self._meshcat.SetTriangleMesh(path, band.vertices.T, band.faces.T.astype(np.int32), self._color)
        if len(self._points) >= TRAIL_PIECE:
            self._points, self._piece = self._points[-2:], self._piece + 1
            if self._piece >= TRAIL_PIECES:
                self._meshcat.Delete(f"/trails/{self._layer}/{self._piece - TRAIL_PIECES}")

    def restart(self) -> None:
        self._meshcat.Delete(f"/trails/{self._layer}")
        self._points, self._piece = [], 0


def draw(meshcat: Meshcat, item: Item) -> None:
    """Draws an item in Drake's Meshcat; its frame is moved by SetTransform."""
    path, color = f"/{item.frame}/{item.name}", Rgba(*item.color, item.opacity)
    if isinstance(item.shape, Mesh):
        meshcat.SetTriangleMesh(path, item.shape.vertices.T, item.shape.faces.T.astype(np.int32), color)
    else:
        meshcat.SetObject(path, drake_shape(item.shape), color)
    meshcat.SetTransform(path, item.X_FG)


def _even_light(meshcat: Meshcat) -> None:
    """Hides Meshcat's own grid, and its lamps, which leave bright spots in the middle of dark ground."""
    for path in ("Grid", "Axes", "Lights/SpotLight", "Lights/PointLightNegativeX", "Lights/PointLightPositiveX"):
        meshcat.SetProperty(f"/{path}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 2.7)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", 1.2)
    for name, color in zip(("top_color", "bottom_color"), palette.SKY, strict=True):
        meshcat.SetProperty("/Background/<object>", name, list(color))
