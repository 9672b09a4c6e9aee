"""Changes of posture: by stepping, or by rolling on all wheels."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Posture
from rollerbench.kinematics.legs.smooth import quintic

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

STEP_TIME = 0.8
"""Time in which a leg steps into another posture [s]."""

CLIMB_SPEED = 0.1
"""Mean speed at which the body rises and sinks [m/s]."""

ROLL_SPEED = 0.06
"""Mean speed at which wheels roll into another posture [m/s]."""

BEND = 0.6
"""Distance of the control points of a rolling foot's path from its ends, over that of its ends [-]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """A part of a change.

    Attributes:
        kind: "climb": the body moves to another height, feet at rest; "step": legs move through the air; "roll": all
            feet roll, as the body moves to another height.
        duration: Its time [s].
        height: Height of the body at its end [m].
        legs: Which legs step (k,).
    """

    kind: Literal["climb", "step", "roll"]
    duration: float
    height: float
    legs: Flags


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
        paths: Control points (k, 4, 2) in B of the feet that roll [m].
        headings: Directions (k,) of the wheels as they begin to roll [rad].
    """

    posture: Posture
    stages: tuple[Stage, ...]
    elapsed: float = 0.0
    height: float
    q_from: Array
    q_to: Array
    paths: Array
    headings: Array

    @property
    def progress(self) -> float:
        """Progress of the present stage, from 0 to 1, smooth."""
        return float(quintic(self.elapsed / self.stages[0].duration))

    @property
    def linear(self) -> float:
        """Progress of the present stage in time, from 0 to 1."""
        return min(1.0, self.elapsed / self.stages[0].duration)

    def next_stage(self, q: Array, height: float) -> "Change":
        """The change when its next stage begins, at joint angles q (k, n)."""
        return replace(self, stages=self.stages[1:], elapsed=0.0, height=height, q_from=q)


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


def rolling_paths(start: Array, end: Array, headings: tuple[Array, Array], turn: Array) -> Array:
    """Control points (k, 4, 2) of the cubic curves along which wheels roll from one place to another.

    A wheel sets off along its line and arrives along it, so that it turns with its path; whether it rolls ahead or back
    is chosen by the turn that its leg makes.

    Args:
        start: Where the feet are (k, 2) [m].
        end: Where they shall be (k, 2) [m].
        headings: Directions of the wheels, at the start and at the end, (k,) each [rad].
        turn: By how much the legs turn them (k,), counted with full turns [rad].
    """
    reach = BEND * np.maximum(np.hypot(*(end - start).T), 0.02)[:, np.newaxis]
    first, last = (np.column_stack([np.cos(angle), np.sin(angle)]) for angle in headings)
    options = [
        np.stack([start, start + sign * reach * first, end - sign * reach * last, end], axis=1) for sign in (1.0, -1.0)
    ]
    turns = np.array([_turning(curve(paths, np.linspace(0, 1, 101))[1]) for paths in options])
    best = np.argmin(np.abs(turns - turn), axis=0)
    return np.where(best[:, np.newaxis, np.newaxis] == 0, *options)


def curve(paths: Array, u: Array) -> tuple[Array, Array]:
    """Points and derivatives (k, m, 2) of cubic curves at parameters u (m,)."""
    p = paths[:, :, np.newaxis]
    s, r = u[:, np.newaxis], 1 - u[:, np.newaxis]
    points = r**3 * p[:, 0] + 3 * r**2 * s * p[:, 1] + 3 * r * s**2 * p[:, 2] + s**3 * p[:, 3]
    slopes = 3 * (r**2 * (p[:, 1] - p[:, 0]) + 2 * r * s * (p[:, 2] - p[:, 1]) + s**2 * (p[:, 3] - p[:, 2]))
    return points, slopes


def path_turn(paths: Array, u: float) -> Array:
    """By how much curves have turned (k,) from their start to the parameter u [rad]."""
    return _turning(curve(paths, np.linspace(0.0, max(u, 1e-9), 41))[1])


def rolling_time(paths: Array) -> float:
    """Time that the longest of the curves takes [s]."""
    points, _ = curve(paths, np.linspace(0, 1, 101))
    lengths = np.sum(np.linalg.norm(np.diff(points, axis=1), axis=-1), axis=1)
    return float(max(1.0, lengths.max() / ROLL_SPEED))


def _turning(slopes: Array) -> Array:
    angles = np.unwrap(np.arctan2(slopes[..., 1], slopes[..., 0]), axis=1)
    turned: Array = angles[:, -1] - angles[:, 0]
    return turned
