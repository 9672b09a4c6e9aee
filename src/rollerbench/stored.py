"""What a run folder holds, checked once as it is read: later code trusts it."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from rollerbench.analysis.budget import MEANINGS
from rollerbench.analysis.legs import LegMetrics
from rollerbench.analysis.pose_error import PoseError
from rollerbench.description import Robot
from rollerbench.description.problems import problems_of
from rollerbench.errors import ResourceError
from rollerbench.recording import Recording

Pose = Annotated[list[float], Field(min_length=3, max_length=3)]


class _Versions(BaseModel):
    rollerbench: str
    drake: str
    python: str


class _Part(BaseModel):
    along_track: float
    cross_track: float
    yaw: float
    position_share: float | None
    yaw_share: float | None


class _HalfStep(BaseModel):
    x: float
    y: float
    yaw: float
    along_track: float
    cross_track: float


class _Halved(BaseModel):
    half_step: _HalfStep | None


class _Budget(_Halved):
    parts: dict[str, _Part]


class _CrossCheck(BaseModel):
    engine: str
    failure: str | None
    apart: Pose
    simulated_final_pose: Pose
    error_budget: _Budget


@dataclass(frozen=True, slots=True, kw_only=True)
class _Legs(LegMetrics):
    planned_static_margin: float


class _Slip(BaseModel):
    rms: float
    max: float


class _Summary(BaseModel):
    """What pages read from any summary.json."""

    robot: str
    scenario: str
    engine: str
    status: str
    failure: str | None
    seed: int
    changed_settings: list[str] = []
    versions: _Versions
    duration: float
    realtime_factor: float
    path_length: float
    rotation: float
    reference_final_pose: Pose
    simulated_final_pose: Pose
    odometry_final_pose: Pose
    pose_error: PoseError
    cross_check: _CrossCheck | None


class _WheelSummary(_Summary):
    wheel_slip: _Slip
    height_ripple: float
    error_budget: _Budget


class _LegSummary(_Summary):
    legs: _Legs
    error_budget: _Halved


def run_folder(path: str | Path) -> Path:
    """A run folder, given as such or by a file in it."""
    return Path(path).parent if Path(path).is_file() else Path(path)


def whole_folder(path: str | Path, needed: Iterable[str]) -> Path:
    """A run folder, given as such or by a file in it, that holds the needed files.

    Raises:
        ResourceError: it is not there, or lacks some.
    """
    folder = run_folder(path)
    if not folder.is_dir():
        raise ResourceError(
            f"{folder}: no such folder; accepted: the folder of a run, such as `rollerbench run` writes"
        )
    missing = [name for name in needed if not (folder / name).is_file()]
    if missing:
        raise ResourceError(
            f"{folder}: not the folder of a run: it lacks {', '.join(missing)}; "
            "accepted: a folder that `rollerbench run` wrote"
        )
    return folder


def read_text(file: Path) -> str:
    """The content of a text file.

    Raises:
        ResourceError: it cannot be read.
    """
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ResourceError(f"{file}: cannot be read as text: {error}") from error


def read_summary(file: Path) -> Mapping[str, Any]:
    """The content of summary.json, with everything that pages read.

    Raises:
        ResourceError: it cannot be read, or lacks something.
    """
    text = read_text(file)
    try:
        summary = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ResourceError(f"{file}: not valid JSON: {error}") from error
    if not isinstance(summary, dict):
        raise ResourceError(f"{file}: not the summary of a run: expected keys, found {type(summary).__name__}")
    model = _LegSummary if "legs" in summary else _WheelSummary
    try:
        model.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise ResourceError(f"{file}: not the summary of a run: {_faults(error, model)}") from error
    second = summary["cross_check"]
    for engine in [summary, second] if second else [summary]:
        unknown = sorted(set(engine["error_budget"].get("parts", ())) - set(MEANINGS))
        if unknown:
            raise ResourceError(f"{file}: unknown parts of the error: {unknown[0]}; accepted: {', '.join(MEANINGS)}")
    return summary


def read_recording(file: Path) -> Recording:
    """A recording with samples, and with all columns of the robot that it describes.

    Raises:
        ResourceError: it cannot be read, or lacks something.
    """
    recording = Recording.read(file)
    if not len(recording.time):
        raise ResourceError(f"{file}: holds no sample")
    robot = _described(file, recording)
    parts = (list(recording.wheel_names), recording.metadata.get("legs", []))
    described = (list(robot.wheel_names), [leg.name for leg in robot.legs])
    if parts != described:
        raise ResourceError(f"{file}: has wheels and legs {parts}, its robot_description {described}")
    joints = [(leg.name, k + 1) for leg in robot.legs for k in range(len(leg.links))]
    missing = [f"{leg}.{what}_{k}" for leg, k in joints for what in ("joint", "effort")]
    missing = [name for name in missing if name not in recording.columns]
    if missing:
        raise ResourceError(f"{file}: not a recording of {robot.name}: it lacks {_listed(missing)}")
    return recording


def _described(file: Path, recording: Recording) -> Robot:
    """The robot that a recording is of; the ones with injected errors are checked too."""
    metadata = recording.metadata
    needed = ("robot", "robot_description", *(() if "legs" in metadata else ("injected", "rollers")))
    missing = [name for name in needed if name not in metadata]
    if missing:
        raise ResourceError(f"{file}: does not tell of which robot it is: it lacks {', '.join(missing)}")
    try:
        for injected in dict(metadata.get("injected", {})).values():
            Robot.model_validate(injected)
        return Robot.model_validate(metadata["robot_description"])
    except ValidationError as error:
        raise ResourceError(
            f"{file}: its robot is none of this version of rollerbench: {_faults(error, Robot)}; "
            f"accepted: a recording of this version, not of {metadata.get('rollerbench', 'an unknown one')}"
        ) from error


def _faults(error: ValidationError, model: type[BaseModel]) -> str:
    missing = [".".join(map(str, item["loc"])) for item in error.errors() if item["type"] == "missing"]
    return f"it lacks {_listed(missing)}" if missing else str(problems_of(error, model)[0])


def _listed(names: list[str], most: int = 5) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
