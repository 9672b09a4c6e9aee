"""How well a robot stood and walked on its legs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.recording import Recording

Array = NDArray[np.float64]

STANDS = 0.5
"""Feet whose stance is above this stand [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegMetrics:
    """Figures of a recording of a robot on legs.

    Attributes:
        steps: Steps of all legs together.
        largest_slip: Longest way that a foot slid over the ground in one stance [m]; wheels that roll do not slide.
        mean_slip: Mean of these ways over all stances [m].
        height_error: Largest deviation of the body's height from what it should be [m].
        tilt_error: Largest deviation of its roll or pitch [rad].
        largest_effort: Largest torque of a joint's motor [N m].
    """

    steps: int
    largest_slip: float
    mean_slip: float
    height_error: float
    tilt_error: float
    largest_effort: float


def leg_metrics(recording: Recording) -> LegMetrics:
    """Figures of a recording that has legs."""
    columns, legs = recording.columns, recording.metadata["legs"]
    slips, steps = [], 0
    for leg in legs:
        stands = columns[f"{leg}.stance"] > STANDS
        change = np.flatnonzero(np.diff(stands.astype(int)))
        steps += int(np.sum(~stands[change])) if len(change) else 0
        slip = np.column_stack([columns[f"{leg}.slip_x"], columns[f"{leg}.slip_y"]])
        slips += [_slid(part, recording.time) for part in _runs(stands, slip)]
    efforts = [values for name, values in columns.items() if ".effort_" in name]
    tilt = [columns[name] - columns[f"desired_{name}"] for name in ("roll", "pitch")]
    return LegMetrics(
        steps=steps,
        largest_slip=float(max(slips, default=0.0)),
        mean_slip=float(np.mean(slips)) if slips else 0.0,
        height_error=float(np.abs(columns["z"] - columns["desired_z"]).max()),
        tilt_error=float(np.abs(tilt).max()),
        largest_effort=float(np.abs(efforts).max()),
    )


def _runs(mask: NDArray[np.bool_], values: Array) -> list[Array]:
    """Values (m, 2) of each uninterrupted stretch of a mask."""
    edges = np.flatnonzero(np.diff(mask.astype(int))) + 1
    return [part for part, on in zip(np.split(values, edges), np.split(mask, edges), strict=True) if len(on) and on[0]]


def _slid(slip: Array, time: Array) -> float:
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    return float(np.hypot(*slip.T).sum() * step)
