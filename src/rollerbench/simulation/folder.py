"""The run folder: everything about a run, written at once."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rollerbench.description.files import to_yaml
from rollerbench.errors import ResourceError
from rollerbench.recording import Recording
from rollerbench.report.figures import run_figures
from rollerbench.report.page import run_page
from rollerbench.sdf import robot_to_sdf
from rollerbench.simulation.log import Simulated
from rollerbench.simulation.picture import diagram_svg
from rollerbench.simulation.scenario import Scenario

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
    page: str | None,
    second: Simulated | None = None,
) -> None:
    """Writes a run under a temporary name beside its folder, then renames: no half-written run is ever seen."""
    building = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        figures = run_figures(recording)
        (building / "figures").mkdir()
        for name, svg in figures.items():
            (building / "figures" / f"{name}.svg").write_text(svg, encoding="utf-8")
        files: dict[str, str | None] = {
            "scenario.yaml": _resolved(scenario),
            "robot.yaml": to_yaml(scenario.robot),
            "model.sdf": robot_to_sdf(scenario.simulated_robot),
            "summary.json": json.dumps(summary, indent=2, allow_nan=False) + "\n",
            "report.html": run_page(summary, figures, has_recording=page is not None),
            "recording.html": page,
            "diagram.svg": diagram_svg(scenario) if scenario.recording.diagram else None,
        }
        for name, text in files.items():
            if text is not None:
                (building / name).write_text(text, encoding="utf-8")
        (building / "recording.parquet").write_bytes(recording.to_bytes())
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


def _resolved(scenario: Scenario) -> str:
    """The scenario with all its defaults, its robot as the robot.yaml beside it."""
    data = scenario.model_dump(mode="json", exclude={"robot"})
    return to_yaml({"name": data.pop("name"), "summary": data.pop("summary"), "robot": "robot.yaml", **data})
