"""How far the simulated robot is from where the equations say."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.recording import Recording

STANDSTILL = 1e-9
"""Speeds and lengths below this count as none [m/s, m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseError:
    """Simulated minus reference pose.

    Attributes:
        final_position: Distance at the end [m].
        final_yaw: Yaw error at the end [rad], counter-clockwise positive.
        max_position: Largest distance of the run [m].
        max_yaw: Largest size of the yaw error of the run [rad].
        along_track: Part of the final distance along the reference's last direction of travel [m], ahead positive.
            Where the reference does not travel, along its heading.
        cross_track: Part of the final distance to the left of that direction [m].
        percent_of_path: Final distance over the length of the reference path [%]; None if there is no path.
    """

    final_position: float
    final_yaw: float
    max_position: float
    max_yaw: float
    along_track: float
    cross_track: float
    percent_of_path: float | None


def pose_error(recording: Recording) -> PoseError:
    """Pose error of a recording, at its end and at its worst."""
    error = recording.q_xyt - recording.reference_q_xyt
    distance = np.hypot(error[:, 0], error[:, 1])
    direction = last_direction(recording)
    ahead, left = np.array([np.cos(direction), np.sin(direction)]), np.array([-np.sin(direction), np.cos(direction)])
    path = path_length(recording)
    return PoseError(
        final_position=float(distance[-1]),
        final_yaw=float(error[-1, 2]),
        max_position=float(distance.max()),
        max_yaw=float(np.abs(error[:, 2]).max()),
        along_track=float(error[-1, :2] @ ahead),
        cross_track=float(error[-1, :2] @ left),
        percent_of_path=float(100 * distance[-1] / path) if path > STANDSTILL else None,
    )


def path_length(recording: Recording) -> float:
    """Length of the reference path [m]."""
    return float(np.sum(_arc_lengths(recording.reference_q_xyt)))


def rotation(recording: Recording) -> float:
    """Angle that the reference turns through, back and forth both counted [rad]."""
    return float(np.sum(np.abs(np.diff(recording.reference_q_xyt[:, 2]))))


def _arc_lengths(q_xyt: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths (n - 1,) of the arcs between poses: chord over sinc of half the turn."""
    steps = np.diff(q_xyt, axis=0)
    arcs: NDArray[np.float64] = np.hypot(steps[:, 0], steps[:, 1]) / np.sinc(0.5 * steps[:, 2] / np.pi)
    return arcs


def last_direction(recording: Recording) -> float:
    """Direction of travel of the reference when it last moved, in W [rad]."""
    v, yaw = recording.reference_v_xyw_B, recording.reference_q_xyt[:, 2]
    moving = np.flatnonzero(np.hypot(v[:, 0], v[:, 1]) > STANDSTILL)
    if not moving.size:
        return float(yaw[-1])
    last = moving[-1]
    return float(yaw[last] + np.arctan2(v[last, 1], v[last, 0]))
