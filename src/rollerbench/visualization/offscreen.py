"""Draws scenes with Drake's VTK, without a display or a GPU."""

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    LightParameter,
    MakeRenderEngineVtk,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo

from rollerbench import palette
from rollerbench.errors import RollerbenchError
from rollerbench.visualization.drake_shapes import drake_shape
from rollerbench.visualization.lens import axes
from rollerbench.visualization.scenes import FIELD_OF_VIEW, Scene
from rollerbench.visualization.shapes import Item

Array = NDArray[np.float64]

LAMP = np.array([-0.45, 0.15, 1.0]) / np.linalg.norm([-0.45, 0.15, 1.0])
"""Where the lamp over the scene is (3,)."""

HEADLIGHT = 0.75
"""Intensity of the light beside the camera."""

NEAREST, FARTHEST = 0.05, 30.0
"""What is drawn, over the distance from the eye to what it looks at."""


class Offscreen:
    """Draws a scene at any of its times.

    Both lights are such that level faces appear in just their colour: the marks on the ground are as bright as the
    palette has them.
    """

    def __init__(self, scene: Scene, direction: Array, width: int, height: int) -> None:
        """Prepares the pictures.

        Args:
            scene: What to draw.
            direction: Unit vector (3,) from what is looked at to the eye.
            width: Of the pictures [pixel].
            height: Of the pictures [pixel].

        Raises:
            RollerbenchError: this machine cannot draw.
        """
        self._scene, self._direction, self._size = scene, direction, (width, height)
        self._graph = SceneGraph()
        try:
            self._graph.AddRenderer("vtk", MakeRenderEngineVtk(_engine(direction)))
        except RuntimeError as error:
            raise RollerbenchError(f"pictures cannot be drawn on this machine: {error}") from error
        self._source = self._graph.RegisterSource("scene")
        self._frames: dict[str, FrameId] = {
            path: self._graph.RegisterFrame(self._source, GeometryFrame(path)) for path in scene.tracks
        }
        for index, item in enumerate(scene.shown_items):
            self._register(item, f"{index}_{item.name}")
        self._context = self._graph.CreateDefaultContext()

    def picture(self, time: float, eye: Array, distance: float) -> NDArray[np.uint8]:
        """What is seen (height, width, 3) at a time [s] from a point (3,) at a distance from what matters [m]."""
        poses = FramePoseVector()
        for path, frame in self._frames.items():
            X_WF = self._scene.tracks[path][sample(self._scene.times[path], time)]
            poses.set_value(frame, RigidTransform(RotationMatrix(X_WF[:3, :3]), X_WF[:3, 3]))
        self._graph.get_source_pose_port(self._source).FixValue(self._context, poses)
        seen = self._graph.get_query_output_port().Eval(self._context)
        lens = CameraInfo(*self._size, FIELD_OF_VIEW)
        reach = ClippingRange(NEAREST * distance, FARTHEST * distance)
        camera = ColorRenderCamera(RenderCameraCore("vtk", lens, reach, RigidTransform()), False)
        X_WC = RigidTransform(RotationMatrix(axes(self._direction)), eye)
        image = seen.RenderColorImage(camera, SceneGraph.world_frame_id(), X_WC)
        return np.array(image.data[..., :3])

    def _register(self, item: Item, name: str) -> None:
        look = PerceptionProperties()
        look.AddProperty("phong", "diffuse", Rgba(*item.color, item.opacity))
        look.AddProperty("label", "id", RenderLabel.kDontCare)
        instance = GeometryInstance(RigidTransform(item.X_FG), drake_shape(item.shape), name)
        instance.set_perception_properties(look)
        if item.frame in self._frames:
            self._graph.RegisterGeometry(self._source, self._frames[item.frame], instance)
        else:
            self._graph.RegisterAnchoredGeometry(self._source, instance)


def sample(times: Array, time: float) -> int:
    """Index of the frame that is shown at a time: the last that has begun."""
    return int(np.clip(np.searchsorted(times, time + 1e-9, side="right") - 1, 0, len(times) - 1))


def _engine(direction: Array) -> RenderEngineVtkParams:
    """A lamp over the scene and a light beside the camera, which add up to 1 on level faces."""
    above = (1.0 - HEADLIGHT * direction[2]) / LAMP[2]
    lights = [
        LightParameter(type="directional", frame="world", direction=-towards, intensity=intensity)
        for towards, intensity in ((LAMP, max(above, 0.0)), (direction, HEADLIGHT))
    ]
    return RenderEngineVtkParams(default_clear_color=np.array(palette.SKY[0]), lights=lights)
