"""The content of summary.json."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollerbench.analysis import error_budget, height_ripple, leg_metrics, pose_error, wheel_slip
from rollerbench.analysis.pose_error import last_direction, path_length, rotation
from rollerbench.kinematics.odometry import rotate
from rollerbench.recording import Recording
from rollerbench.report.parameters import flat
from rollerbench.simulation.log import Simulated, versions
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.settings import OpenLoop

Array = NDArray[np.float64]


def summarize(
    scenario: Scenario, simulated: Simulated, *, half_step: Array | None = None, second: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Key figures of a run, SI units.

    Args:
        scenario: What was simulated.
        simulated: What came out.
        half_step: Final pose (3,) of a second run with half the step minus this one's.
        second: Figures of a second engine, from `cross_check`.
    """
    recording, duration = simulated.recording, float(simulated.recording.time[-1])
    return {
        "robot": scenario.robot.name,
        "scenario": scenario.name,
        "engine": recording.metadata["engine"],
        "status": "ok" if simulated.failure is None else "failed",
        "failure": simulated.failure,
        "seed": scenario.seed,
        "changed_settings": changed_settings(scenario),
        "versions": versions(scenario.engine),
        "duration": duration,
        "wall_time": simulated.wall_time,
        "realtime_factor": duration / simulated.wall_time if simulated.wall_time else 0.0,
        "path_length": path_length(recording),
        "rotation": rotation(recording),
        "reference_final_pose": _pose(recording.reference_q_xyt),
        **_outcome(recording, half_step, legs=bool(scenario.robot.legs)),
        **({"legs": leg_figures(scenario, recording)} if scenario.robot.legs else {}),
        "cross_check": second,
    }


def changed_settings(scenario: Scenario) -> list[str]:
    """Dotted names of the scenario's fields that differ from their defaults."""
    own = {"name", "summary", "robot"}
    changed = flat(scenario.model_dump(mode="json", exclude=own, exclude_defaults=True))
    # Each type of controller counts its own type as a default.
    kind = ["controller.type"] if scenario.controller.type != OpenLoop().type else []
    return [*(name for name, value in changed.items() if value != {}), *kind]


def cross_check(second: Simulated, recording: Recording) -> dict[str, Any]:
    """Figures of a second engine that simulated the same scenario as a recording."""
    return {
        "engine": second.recording.metadata["engine"],
        "failure": second.failure,
        "apart": [float(value) for value in apart(second.recording, recording)],
        **_outcome(second.recording, None),
    }


def apart(other: Recording, recording: Recording) -> Array:
    """Pose of another recording minus that of this one (3,) at the last time that both have [m, m, rad]."""
    last = min(other.time[-1], recording.time[-1])
    poses = [np.array([np.interp(last, each.time, column) for column in each.q_xyt.T]) for each in (other, recording)]
    return poses[0] - poses[1]


def leg_figures(scenario: Scenario, recording: Recording) -> dict[str, Any]:
    """Key figures of legs, SI units."""
    return {
        **dataclasses.asdict(leg_metrics(recording)),
        "planned_static_margin": float(scenario.rehearsal.margins.min()),
    }


def _outcome(recording: Recording, half_step: Array | None, *, legs: bool = False) -> dict[str, Any]:
    change = None
    if half_step is not None:
        ahead, left = rotate(-last_direction(recording), half_step[:2])
        x, y, yaw = half_step
        values = {"x": x, "y": y, "yaw": yaw, "along_track": ahead, "cross_track": left}
        change = {name: float(value) for name, value in values.items()}
    poses = {
        "simulated_final_pose": _pose(recording.q_xyt),
        "odometry_final_pose": _pose(recording.odometry_q_xyt),
        "pose_error": dataclasses.asdict(pose_error(recording)),
    }
    if legs:
        return {**poses, "error_budget": {"half_step": change}}
    return {
        **poses,
        "wheel_slip": wheel_slip(recording),
        "height_ripple": height_ripple(recording),
        "error_budget": {"parts": error_budget(recording).to_dict(), "half_step": change},
    }


def _pose(q_xyt: Array) -> list[float]:
    return [float(value) for value in q_xyt[-1]]
