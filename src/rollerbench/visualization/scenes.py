"""Scenes of runs: everything that is seen of one or several, from their recordings alone."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench import palette
from rollerbench.description import Robot
from rollerbench.kinematics.bumps import STEP_WIDTH
from rollerbench.palette import Color
from rollerbench.recording import Recording
from rollerbench.visualization import floor, marks
from rollerbench.visualization.model import read_model
from rollerbench.visualization.motion import Motion, motion_of
from rollerbench.visualization.shapes import Box, Item

Array = NDArray[np.float64]

View = Literal["iso", "top", "follow"]
"""Where one looks from: at the whole path from aside, from above, or at the robot wherever it goes."""

FIELD_OF_VIEW = math.radians(40)
"""Vertical angle of the cameras [rad]."""

DIRECTIONS: Mapping[View, tuple[float, float, float]] = {
    "iso": (-0.42, -0.70, 0.58),
    "top": (0.0, -0.002, 1.0),
    "follow": (-0.50, -0.66, 0.56),
}
"""Where the eye is, seen from what it looks at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """What a view shows.

    Attributes:
        target: Point (3,) in W that it looks at [m].
        direction: Unit vector (3,) from there to the eye.
        radius: Radius about the target of what must be seen [m].
        follows: Whether it goes with the robot.
    """

    target: Array
    direction: Array
    radius: float
    follows: bool

    def eye(self, aspect: float) -> Array:
        """Where the eye is (3,) so that everything is seen in a picture of that width over height."""
        angle = min(FIELD_OF_VIEW, 2 * math.atan(aspect * math.tan(0.5 * FIELD_OF_VIEW)))
        return self.target + self.radius / math.sin(0.5 * angle) * self.direction


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneRun:
    """A run in a scene.

    Attributes:
        name: Its name.
        robot: Name of its robot.
        color: Its colour.
        prefix: Path of its frames: prefix + "robot/body" is the body, prefix + "ghost" what the equations predict.
        summary: The content of summary.json.
    """

    name: str
    robot: str
    color: Color
    prefix: str
    summary: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Shapes on frames, and where these are over time.

    Attributes:
        runs: Whose scene it is.
        items: The shapes.
        times: Times (n,) of each moving frame by path [s].
        tracks: Poses (n, 4, 4) of each moving frame by path.
        cameras: The views.
        view: The one at the start.
        shown: Which marks are seen at the start: "forces", "slip".
        pitches: Distances of the grid's lines, the finer first [m].
        slope_deg: Inclination of the first run's ground; x points uphill.
    """

    runs: tuple[SceneRun, ...]
    items: tuple[Item, ...]
    times: Mapping[str, Array]
    tracks: Mapping[str, Array]
    cameras: Mapping[View, Camera]
    view: View
    shown: frozenset[str]
    pitches: tuple[float, ...]
    slope_deg: float

    @property
    def shown_items(self) -> tuple[Item, ...]:
        """What is seen at the start."""
        hidden = {"forces", "slip"} - self.shown
        return tuple(item for item in self.items if hidden.isdisjoint(item.frame.split("/")))

    @property
    def duration(self) -> float:
        """Last time [s]."""
        return max(float(times[-1]) for times in self.times.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenRun:
    """What a scene needs to know of a run.

    Attributes:
        name: What it is called in the legend.
        recording: Its samples.
        model: SDF text of the simulated robot.
        summary: The content of summary.json.
    """

    name: str
    recording: Recording
    model: str
    summary: Mapping[str, Any]


def scene_of(
    runs: Sequence[SeenRun],
    *,
    view: View = "iso",
    forces: bool = False,
    slip: bool = False,
    frames_per_second: float = 30.0,
) -> Scene:
    """The scene of one or several runs.

    Args:
        runs: What to show, overlaid.
        view: The view at the start.
        forces: Whether to show the contacts' forces at the start, of runs that recorded them.
        slip: Whether to show where wheels slid at the start.
        frames_per_second: How often frames move [1/s].
    """
    robots = [robot_of(run.recording) for run in runs]
    size = max(marks.size_of(robot) for robot in robots)
    items: list[Item] = []
    times: dict[str, Array] = {}
    tracks: dict[str, Array] = {}
    seen: list[SceneRun] = []
    for index, (run, robot) in enumerate(zip(runs, robots, strict=True)):
        prefix = "" if len(runs) == 1 else f"run_{index + 1}/"
        color = palette.RUNS[index % len(palette.RUNS)]
        motion = motion_of(run.recording, robot, frames_per_second)
        own, poses = _robot(run, robot, motion, prefix, None if len(runs) == 1 else color)
        for extra, more in _extras(run, robot, motion, prefix):
            own += extra
            poses |= more
        if not any(_same_reference(run, other) for other in runs[:index]):
            own += marks.ghost(robot, f"{prefix}ghost")
            own += _trail(run, run.recording.reference_q_xyt, "reference", palette.REFERENCE, robot, prefix)
        own += _trail(run, run.recording.q_xyt, "simulated", color, robot, prefix)
        items += own
        tracks |= poses
        times |= dict.fromkeys(poses, motion.time)
        seen.append(SceneRun(name=run.name, robot=robot.name, color=color, prefix=prefix, summary=run.summary))
    paths = [path[:, :2] for run in runs for path in (run.recording.q_xyt, run.recording.reference_q_xyt)]
    low, high = (
        np.min([path.min(axis=0) for path in paths], axis=0),
        np.max([path.max(axis=0) for path in paths], axis=0),
    )
    ground = floor.ground(low, high, size)
    return Scene(
        runs=tuple(seen),
        items=(*ground, *_surroundings(runs), *items),
        times=times,
        tracks=tracks,
        cameras=cameras(low, high, size, robots[0]),
        view=view,
        shown=frozenset(name for name, on in (("forces", forces), ("slip", slip)) if on),
        pitches=tuple(floor.grid_pitches(*_reach(ground), size)),
        slope_deg=runs[0].recording.metadata.get("ground", {}).get("slope_deg", 0.0),
    )


def cameras(low: Array, high: Array, size: float, robot: Robot) -> dict[View, Camera]:
    """Views of paths from low (2,) to high (2,) of a robot of a size [m]."""
    height = 0.5 * (robot.body.box_center[2] + 0.5 * robot.body.size[2] - robot.ground_height)
    middle, extent = np.array([*(0.5 * (low + high)), height]), 0.5 * float(np.linalg.norm(high - low))
    whole, near = extent + 0.75 * size, 0.85 * size
    found: dict[View, Camera] = {}
    for view, direction in DIRECTIONS.items():
        follows = view == "follow"
        found[view] = Camera(
            target=np.array([0.0, 0.0, height]) if follows else middle,
            direction=np.array(direction) / np.linalg.norm(direction),
            radius=near if follows else whole,
            follows=follows,
        )
    return found


def robot_of(recording: Recording) -> Robot:
    """The robot that a recording is of, as its controller believes it to be."""
    return Robot.model_validate(recording.metadata["robot_description"])


def _robot(
    run: SeenRun, robot: Robot, motion: Motion, prefix: str, color: Color | None
) -> tuple[list[Item], dict[str, Array]]:
    """The robot, in a colour of its own among several, and where it and its ghost are."""
    model, path = read_model(run.model), f"{prefix}robot"
    items = model.items(set(motion.angles), path)
    if color is not None:
        root = f"{path}/{model.root}"
        items = [_painted(item, color) if item.frame == root and item.name == "box" else item for item in items]
    tracks = model.tracks(motion.X_WB, motion.angles, path)
    arrow_color = palette.SIMULATED if color is None else palette.HEADING
    items.append(marks.heading(robot, f"{path}/{model.root}", arrow_color))
    return items, {**tracks, f"{prefix}ghost": motion.X_WR}


def _extras(run: SeenRun, robot: Robot, motion: Motion, prefix: str) -> list[tuple[list[Item], dict[str, Array]]]:
    found: list[tuple[list[Item], dict[str, Array]]] = [(marks.skid_marks(run.recording, robot, prefix), {})]
    if marks.has_forces(run.recording, robot):
        found.append(marks.forces(run.recording, robot, motion, prefix))
    if robot.legs:
        found.append((marks.footholds(run.recording, robot, prefix), {}))
        found.append(marks.support(run.recording, robot, motion, prefix))
    return found


def _trail(run: SeenRun, q_xyt: Array, layer: str, color: Color, robot: Robot, prefix: str) -> list[Item]:
    """A trail on the ground, and on its steps."""
    heights = np.zeros(len(q_xyt))
    for step in run.recording.metadata.get("ground", {}).get("steps", ()):
        heights[(q_xyt[:, 0] >= step["start"]) & (q_xyt[:, 0] <= step["end"])] = step["height"]
    return marks.trail(
        np.column_stack([q_xyt[:, :2], heights]),
        layer,
        color,
        marks.size_of(robot),
        f"{prefix.replace('/', '_')}{layer}",
    )


def _reach(ground: Sequence[Item]) -> tuple[Array, Array]:
    """Where the ground begins and ends (2,)."""
    slab = ground[0]
    assert isinstance(slab.shape, Box)
    half = 0.5 * np.array(slab.shape.size[:2])
    return slab.X_FG[:2, 3] - half, slab.X_FG[:2, 3] + half


def _same_reference(run: SeenRun, other: SeenRun) -> bool:
    """Whether the equations predict the same of both, so that one ghost does."""
    mine, theirs = run.recording, other.recording
    return (
        mine.metadata["robot_description"] == theirs.metadata["robot_description"]
        and np.array_equal(mine.time, theirs.time)
        and np.allclose(mine.reference_q_xyt, theirs.reference_q_xyt, rtol=0, atol=1e-9)
    )


def _surroundings(runs: Sequence[SeenRun]) -> list[Item]:
    """Bumps and steps of all runs' ground."""
    grounds = [run.recording.metadata.get("ground", {}) for run in runs]
    items = []
    for index, ground in enumerate(grounds):
        if ground in grounds[:index]:
            continue
        if ground.get("bumps"):
            items += floor.bumps(*(np.array(ground["bumps"][key]) for key in ("centers", "half_widths", "heights")))
        items += floor.steps(ground.get("steps", ()), STEP_WIDTH)
    return items


def _painted(item: Item, color: Color) -> Item:
    return Item(frame=item.frame, name=item.name, shape=item.shape, color=color, X_FG=item.X_FG)
