"""The content of summary.json."""

import dataclasses
import platform
from importlib.metadata import version
from typing import Any

import numpy as np

from rollerbench.analysis import height_ripple, pose_error, wheel_slip
from rollerbench.analysis.pose_error import path_length, rotation
from rollerbench.recording import Recording
from rollerbench.simulation.scenario import Scenario


def versions() -> dict[str, str]:
    """Versions of what computed a result."""
    return {"rollerbench": version("rollerbench"), "drake": version("drake"), "python": platform.python_version()}


def summarize(scenario: Scenario, recording: Recording, *, wall_time: float, failure: str | None) -> dict[str, Any]:
    """Key figures of a run, SI units.

    Args:
        scenario: What was simulated.
        recording: What was recorded.
        wall_time: Time that the simulation took, without building and writing [s].
        failure: Why it did not reach the end, or None.
    """
    simulated = float(recording.time[-1])
    return {
        "robot": scenario.robot.name,
        "scenario": scenario.name,
        "status": "ok" if failure is None else "failed",
        "failure": failure,
        "seed": scenario.seed,
        "versions": versions(),
        "duration": simulated,
        "wall_time": wall_time,
        "realtime_factor": simulated / wall_time,
        "path_length": path_length(recording),
        "rotation": rotation(recording),
        "reference_final_pose": _pose(recording.reference_q_xyt),
        "simulated_final_pose": _pose(recording.q_xyt),
        "odometry_final_pose": _pose(recording.odometry_q_xyt),
        "pose_error": dataclasses.asdict(pose_error(recording)),
        "wheel_slip": wheel_slip(recording),
        "height_ripple": height_ripple(recording),
        "error_budget": None,
    }


def _pose(q_xyt: np.ndarray[Any, np.dtype[np.float64]]) -> list[float]:
    return [float(value) for value in q_xyt[-1]]
