"""The run folder: everything about a run, written at once."""

import json
import shutil
import tempfile
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from rollerbench.description.files import to_yaml
from rollerbench.errors import ResourceError, RollerbenchError, RollerbenchWarning
from rollerbench.recording import Recording
from rollerbench.report.figures import run_figures
from rollerbench.report.page import report_page
from rollerbench.report.stored_run import StoredRun
from rollerbench.simulation.log import Progress, Simulated
from rollerbench.simulation.picture import diagram_svg
from rollerbench.simulation.scenario import Scenario
from rollerbench.visualization.page import scene_page
from rollerbench.visualization.render import preview, video
from rollerbench.visualization.scenes import Scene

T = TypeVar("T")

RUN_FILES = {
    *("scenario.yaml", "robot.yaml", "model.sdf", "recording.parquet", "summary.json"),
    *("recording.html", "report.html", "figures", "cross_check.parquet", "diagram.svg"),
    *("preview.png", "recording.mp4", "recording.gif"),
}
"""Everything that a run writes, and so may replace."""


def check_folder(folder: Path) -> None:
    """Checks, before anything is computed, that a run may be written there.

    Raises:
        ResourceError: it is a file, holds something else than a run, or cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise ResourceError(f"{folder}: is a file; accepted: a new folder, or that of an earlier run")
    if folder.resolve() == Path.cwd():
        raise ResourceError(f"{folder}: is the current folder; accepted: a folder in it, such as runs/name")
    foreign = sorted({path.name for path in folder.iterdir()} - RUN_FILES) if folder.is_dir() else []
    if foreign:
        raise ResourceError(
            f"{folder}: holds something else than a run ({', '.join(foreign[:3])}); "
            "accepted: a new folder, or that of an earlier run"
        )
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder.parent).close()
    except OSError as error:
        raise ResourceError(f"{folder}: cannot be written: {error}") from error


def write_folder(
    folder: Path,
    scenario: Scenario,
    recording: Recording,
    summary: Mapping[str, Any],
    model: str,
    scene: Scene | None,
    second: Simulated | None = None,
    *,
    progress: Progress | None = None,
) -> None:
    """Writes a run under a temporary name beside its folder, then renames: no half-written run is ever seen.

    Args:
        folder: Where to.
        scenario: What was simulated.
        recording: What was recorded.
        summary: The content of summary.json.
        model: The content of model.sdf.
        scene: What page, picture and video show; None if there shall be none.
        second: What a second engine simulated.
        progress: Called with the time of each frame of a video [s].
    """
    building = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    settings = scenario.recording
    try:
        figures = run_figures(recording)
        page = scene_page(scene) if scene is not None and settings.html else None
        picture = _drawn(lambda: preview(scene)) if scene is not None and settings.preview else None
        (building / "figures").mkdir()
        for name, svg in figures.items():
            (building / "figures" / f"{name}.svg").write_text(svg, encoding="utf-8")
        stored = _stored(folder.name, scenario, recording, summary, page, picture)
        files: dict[str, str | None] = {
            "scenario.yaml": _resolved(scenario),
            "robot.yaml": to_yaml(scenario.robot),
            "model.sdf": model,
            "summary.json": json.dumps(summary, indent=2, allow_nan=False) + "\n",
            "report.html": report_page([stored], figures=[figures]),
            "recording.html": page,
            "diagram.svg": diagram_svg(scenario) if scenario.recording.diagram else None,
        }
        for name, text in files.items():
            if text is not None:
                (building / name).write_text(text, encoding="utf-8")
        (building / "recording.parquet").write_bytes(recording.to_bytes())
        if picture is not None:
            (building / "preview.png").write_bytes(picture)
        if scene is not None and settings.video is not None:
            film = building / f"recording.{settings.video}"
            rate = settings.frames_per_second
            _drawn(lambda: video(scene, film, frames_per_second=rate, progress=progress))
        if second is not None:
            (building / "cross_check.parquet").write_bytes(second.recording.to_bytes())
        building.chmod(0o755)
        if folder.exists():
            old = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
            folder.replace(old / "old")
            building.replace(folder)
            shutil.rmtree(old)
        else:
            building.replace(folder)
    except BaseException:
        shutil.rmtree(building, ignore_errors=True)
        raise


def _drawn(draw: Callable[[], T]) -> T | None:
    """What is drawn, or a warning where a machine cannot draw: the run is worth keeping without it."""
    try:
        return draw()
    except RollerbenchError as error:
        warnings.warn(str(error), RollerbenchWarning, stacklevel=2)
        return None


def _stored(
    name: str,
    scenario: Scenario,
    recording: Recording,
    summary: Mapping[str, Any],
    page: str | None,
    picture: bytes | None,
) -> StoredRun:
    """The run as its folder will hold it."""
    return StoredRun(
        name=name,
        summary=summary,
        recording=recording,
        scenario=_fields(scenario),
        robot=scenario.robot,
        page=None if page is None else page.encode(),
        preview=picture,
    )


def _resolved(scenario: Scenario) -> str:
    """The scenario with all its defaults, its robot as the robot.yaml beside it."""
    return to_yaml(_fields(scenario))


def _fields(scenario: Scenario) -> dict[str, Any]:
    data = scenario.model_dump(mode="json", exclude={"robot"})
    return {"name": data.pop("name"), "summary": data.pop("summary"), "robot": "robot.yaml", **data}
