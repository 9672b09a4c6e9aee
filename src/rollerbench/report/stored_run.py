"""A run as its folder holds it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from rollerbench.description import Robot, load_robot
from rollerbench.errors import DescriptionError, ResourceError
from rollerbench.recording import Recording
from rollerbench.stored import read_recording, read_summary, read_text, whole_folder

NEEDED = ("scenario.yaml", "robot.yaml", "recording.parquet", "summary.json")
"""Files without which a folder is not that of a run."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRun:
    """What a run left behind, which reports are made from; Drake is not needed to read it.

    Attributes:
        name: Name of the folder, which tells apart runs of the same scenario.
        summary: The content of summary.json.
        recording: Samples over time.
        scenario: The content of scenario.yaml, with all its fields.
        robot: The robot as its equations have it.
        page: recording.html; None if none was written.
        preview: A picture of the recording as PNG, preview.png; None if there is none.
    """

    name: str
    summary: Mapping[str, Any]
    recording: Recording
    scenario: Mapping[str, Any]
    robot: Robot
    page: bytes | None = None
    preview: bytes | None = None

    @classmethod
    def read(cls, folder: str | Path) -> "StoredRun":
        """Reads a run folder, given as such or by a file in it, such as recording.parquet.

        Raises:
            ResourceError: it is not there, not the folder of a run, or holds a broken file.
        """
        path = whole_folder(folder, NEEDED)
        return cls(
            name=path.resolve().name,
            summary=read_summary(path / "summary.json"),
            recording=read_recording(path / "recording.parquet"),
            scenario=_scenario(path / "scenario.yaml"),
            robot=_robot(path / "robot.yaml"),
            page=_bytes(path / "recording.html"),
            preview=_bytes(path / "preview.png"),
        )


def _scenario(file: Path) -> Mapping[str, Any]:
    try:
        scenario = YAML(typ="safe", pure=True).load(read_text(file))
    except (YAMLError, ValueError, RecursionError) as error:
        raise ResourceError(f"{file}: not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(scenario, dict):
        raise ResourceError(f"{file}: expected a mapping of keys to values, found {type(scenario).__name__}")
    if "summary" not in scenario:
        raise ResourceError(f"{file}: not the scenario of a run: it lacks summary")
    return scenario


def _robot(file: Path) -> Robot:
    try:
        return load_robot(file)
    except DescriptionError as error:
        raise ResourceError(str(error)) from error


def _bytes(file: Path) -> bytes | None:
    try:
        return file.read_bytes() if file.is_file() else None
    except OSError as error:
        raise ResourceError(f"{file}: cannot be read: {error}") from error
