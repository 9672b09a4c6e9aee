"""Changes of posture: by stepping, or by rolling on all wheels."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from rollerbench.description import Posture
from rollerbench.kinematics.gaits.smooth import quintic
from rollerbench.kinematics.legs.group import Hold, LegGroup

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

STEP_TIME = 0.8
"""Time in which a leg steps into another posture [s]."""

CLIMB_SPEED = 0.1
"""Mean speed at which the body rises and sinks [m/s]."""

ROLL_SPEED = 0.06
"""Mean speed at which wheels roll into another posture [m/s]."""

PIVOT_SPEED = 0.6
"""Mean speed at which wheels pivot under their hips [rad/s]."""

NEAR = 0.2
"""Share of this straight way after which its direction no longer follows from the leg's [-]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """Where wheels roll, at m even steps.

    Attributes:
        contact: Places (m, k, 2) of the feet, in B [m].
        heading: Directions (m, k) in which the wheels roll ahead, without jumps [rad].
    """

    contact: Array
    heading: Array

    @property
    def reversed(self) -> "Course":
        """The same way back."""
        return Course(contact=self.contact[::-1], heading=self.heading[::-1])

    @property
    def length(self) -> float:
        """Length of the longest way [m]."""
        return float(np.linalg.norm(np.diff(self.contact, axis=0), axis=-1).sum(axis=0).max())

    def at(self, u: float) -> tuple[Array, Array]:
        """Places (k, 2) and directions (k,) at the share u of the way."""
        place = min(max(u, 0.0), 1.0) * (len(self.contact) - 1)
        low = min(int(place), len(self.contact) - 2)
        part = place - low
        return (
            (1 - part) * self.contact[low] + part * self.contact[low + 1],
            (1 - part) * self.heading[low] + part * self.heading[low + 1],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """A part of a change.

    Attributes:
        kind: "climb": the body moves to another height, feet at rest; "step": legs move through the air; "roll": all
            feet roll, as the body moves to another height.
        duration: Its time [s].
        height: Height of the body at its end [m].
        legs: Which legs step (k,).
        course: Where wheels roll, if they do.
        straight: Whether they roll straight towards their hip, or from there: the legs' last joints then rest.
    """

    kind: Literal["climb", "step", "roll"]
    duration: float
    height: float
    legs: Flags
    course: Course | None = None
    straight: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Change:
    """A change under way.

    Attributes:
        posture: The posture that it leads to.
        stages: What is left to do, the present stage first.
        elapsed: Time since the present stage began [s].
        height: Height of the body when it began [m].
        q_from: Joint angles (k, n) when it began [rad].
        q_to: Joint angles (k, n) at which stepping legs arrive [rad].
        steps: Joint angles (k, n) over the progress of legs that step.
        contact: Where the feet were (k, 2), in B [m].
        heading: In which directions (k,) the wheels then rolled ahead [rad].
    """

    posture: Posture
    stages: tuple[Stage, ...]
    elapsed: float = 0.0
    height: float
    q_from: Array
    q_to: Array
    steps: CubicSpline | None = None
    contact: Array
    heading: Array

    @property
    def progress(self) -> float:
        """Progress of the present stage, from 0 to 1, smooth."""
        return float(quintic(self.elapsed / self.stages[0].duration))

    @property
    def linear(self) -> float:
        """Progress of the present stage in time, from 0 to 1."""
        return min(1.0, self.elapsed / self.stages[0].duration)


def stepping_stages(height: float, step_height: float, end_height: float, groups: list[Flags]) -> list[Stage]:
    """Down to where both postures reach the ground, one group of legs after the other, and up again."""
    none = np.zeros_like(groups[0])
    stages = [_climb(height, step_height, none)]
    stages += [Stage(kind="step", duration=STEP_TIME, height=step_height, legs=group) for group in groups]
    stages += [_climb(step_height, end_height, none)]
    return [stage for stage in stages if stage.duration > 0]


def _climb(start: float, end: float, legs: Flags) -> Stage:
    distance = abs(end - start)
    duration = max(0.4, distance / CLIMB_SPEED) if distance > 1e-6 else 0.0
    return Stage(kind="climb", duration=duration, height=end, legs=legs)


def stepping_path(group: LegGroup, q_from: Array, q_to: Array, pose: Array, lift: float) -> CubicSpline:
    """Joint angles (k, n) over the progress 0..1 from one stance to another, through the air.

    Joints go evenly, bent on the way such that the feet are lifted.

    Args:
        group: The legs.
        q_from: Joint angles (k, n) at the start [rad].
        q_to: Joint angles (k, n) at the end [rad].
        pose: Pose (4, 4) of the body over the ground.
        lift: Height of the feet's lowest points in the middle [m].
    """
    nodes, angles = np.linspace(0.0, 1.0, 5), [q_from]
    free = Hold(rows=0 * q_from, values=np.zeros(len(q_from)), heading=np.zeros(len(q_from), dtype=bool), near=q_from)
    for s in nodes[1:-1]:
        q = q_from + s * (q_to - q_from)
        centers = group.frames(q)[:, -1, :3, 3] @ pose[:3, :3].T + pose[:3, 3]
        centers[:, 2] = group.wheel_radius + lift * (0.75 if s != 0.5 else 1.0)
        q, _, _ = group.inverse((centers - pose[:3, 3]) @ pose[:3, :3], replace(free, near=q), iterations=40)
        angles.append(q)
    return CubicSpline(nodes, [*angles, q_to], bc_type="natural")


def rolling_stages(
    outer: tuple[Array, Array], pivots: Array, inner: tuple[Array, Array], hips: Array, heights: tuple[float, float]
) -> list[Stage]:
    """From feet beside the body to feet under the hips, without a wheel that slips.

    Legs turn about their hips while their feet follow as castors, until they point straight away from the hips; then
    they roll straight under them, and there pivot, while the body climbs. No leg leans across its wheel on the way.

    Args:
        outer: Places (k, 2) in B [m] and directions (k,) [rad] of the wheels at the start.
        pivots: Where the upright axes of the last joints then are (k, 2), in B [m].
        inner: Places and directions at the end.
        hips: Where the hips' axes are (k, 2), in B [m].
        heights: Heights of the body at the start and at the end [m].
    """
    contact, turned = _trailed(outer, pivots, hips)
    curve, turning = contact, contact[-1]
    near = inner[0] + NEAR * (turning - inner[0])
    turn = inner[1] - turned[-1]
    turn = np.arctan2(np.sin(turn), np.cos(turn))
    low, high = heights
    rest = turned[-1]
    ways = [Course(contact=curve, heading=turned), _line((turning, near), (rest, rest))]
    ways += [_line((near, inner[0]), (rest, rest)), _line((inner[0], inner[0]), (rest, rest + turn))]
    times = [max(0.5, way.length / ROLL_SPEED) for way in ways]
    times[-1] = max(0.5, float(np.abs(turn).max()) / PIVOT_SPEED, abs(high - low) / CLIMB_SPEED)
    every = np.ones(len(contact), dtype=bool)
    return [
        Stage(kind="roll", duration=time, height=height, legs=every, course=way, straight=straight)
        for way, time, height, straight in zip(
            ways, times, (low, low, low, high), (False, True, False, False), strict=True
        )
    ]


def _trailed(outer: tuple[Array, Array], pivots: Array, hips: Array) -> tuple[Array, Array]:
    """Places (m, k, 2) and directions (m, k) of wheels that follow as castors while their legs turn about their hips.

    The axis of the castor is at the distance r from the hip, in the direction a, and the foot trails from the
    axis in the direction a + b. It does not slip if da/db = -1 / (1 + r cos(b) / trail); b goes to 0.
    """
    arm, tail = pivots - hips, outer[0] - pivots
    r, trail = np.hypot(*arm.T), np.hypot(*tail.T)
    away, bearing = np.arctan2(arm[:, 1], arm[:, 0]), np.arctan2(tail[:, 1], tail[:, 0])
    start = np.arctan2(np.sin(bearing - away), np.cos(bearing - away))
    b = start * np.linspace(1.0, 0.0, 401)[:, np.newaxis]
    rate = -1.0 / (1.0 + r * np.cos(b) / trail)
    a = away + cumulative_trapezoid(rate, b, axis=0, initial=0)
    axis = hips + r[:, np.newaxis] * np.stack([np.cos(a), np.sin(a)], axis=-1)
    places = axis + trail[:, np.newaxis] * np.stack([np.cos(a + b), np.sin(a + b)], axis=-1)
    return places, outer[1] + (a + b) - (away + start)


def reversed_stages(stages: list[Stage], height: float) -> list[Stage]:
    """The way back, to a height of the body at its end [m]."""
    heights = [height, *(stage.height for stage in stages[:-1])]
    pairs = zip(stages[::-1], heights[::-1], strict=True)
    return [replace(stage, course=stage.course and stage.course.reversed, height=h) for stage, h in pairs]


def _line(places: tuple[Array, Array], headings: tuple[Array, Array]) -> Course:
    """Evenly from places (k, 2) and directions (k,) to others."""
    return Course(contact=np.stack(places), heading=np.stack(headings))
