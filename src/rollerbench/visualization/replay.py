"""Stored runs in the viewer of the Python package meshcat, from their folders alone and without Drake."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rollerbench.description.files import write_atomically
from rollerbench.errors import ResourceError
from rollerbench.stored import read_recording, read_summary, read_text, run_folder, whole_folder
from rollerbench.visualization.model import read_model
from rollerbench.visualization.page import commands, scene_page
from rollerbench.visualization.scenes import Scene, SeenRun, View, scene_of

NEEDED = ("summary.json", "model.sdf", "recording.parquet")
"""Files without which a run cannot be shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """Runs to look at; a notebook shows them as a cell's last value.

    Attributes:
        scene: What is seen.
    """

    scene: Scene

    def page(self) -> str:
        """One HTML page that needs neither a server nor a network."""
        return scene_page(self.scene)

    def write(self, path: str | Path) -> Path:
        """Writes the page.

        Raises:
            ResourceError: it cannot be written.
        """
        file = Path(path)
        try:
            write_atomically(file, self.page())
        except OSError as error:
            raise ResourceError(f"{file}: cannot be written: {error}") from error
        return file

    def show_in(self, visualizer: Any) -> None:
        """Shows the runs in a meshcat.Visualizer of one's own, from the start."""
        for command in commands(self.scene):
            visualizer.window.send(_Lowered(command))

    def _repr_html_(self) -> str:
        source = html.escape(self.page(), quote=True)
        return f'<iframe srcdoc="{source}" style="width: 100%; height: 480px; border: 0"></iframe>'


class _Lowered:
    """A command as meshcat's window takes it, which asks commands for their content."""

    def __init__(self, command: dict[str, Any]) -> None:
        self._command = command

    def lower(self) -> dict[str, Any]:
        return self._command


def replay(
    runs: str | Path | Sequence[str | Path],
    *,
    camera: View = "iso",
    forces: bool = False,
    slip: bool = False,
    frames_per_second: float = 30.0,
) -> Replay:
    """Shows stored runs without simulating them again, several of them overlaid.

    Args:
        runs: Run folders, or files in them.
        camera: The view at the start; "follow" goes with the first run's robot.
        forces: Whether to show the contacts' forces at the start, of runs that recorded them.
        slip: Whether to show where wheels slid at the start.
        frames_per_second: How often robots move [1/s]; each frame is a sample of the recording.

    Raises:
        ResourceError: a folder is not a run's, or not whole.
    """
    folders = [run_folder(run) for run in ([runs] if isinstance(runs, str | Path) else runs)]
    if not folders:
        raise ResourceError("replay: no run folder; accepted: one or more")
    if not frames_per_second > 0:
        raise ResourceError(f"frames_per_second = {frames_per_second}: accepted: more than 0")
    seen = [read_run(folder) for folder in folders]
    names = [run.name for run in seen]
    # Runs of one scenario are told apart by their folders.
    named = [
        SeenRun(
            name=f"{run.name} ({folder})" if names.count(run.name) > 1 else run.name,
            recording=run.recording,
            model=run.model,
            summary=run.summary,
        )
        for run, folder in zip(seen, folders, strict=True)
    ]
    return Replay(scene=scene_of(named, view=camera, forces=forces, slip=slip, frames_per_second=frames_per_second))


def read_run(path: str | Path) -> SeenRun:
    """What a run folder, given as such or by a file in it, tells of what was seen.

    Raises:
        ResourceError: it is not a run's folder, or not whole.
    """
    folder = whole_folder(path, NEEDED)
    summary, model = read_summary(folder / "summary.json"), read_text(folder / "model.sdf")
    read_model(model, folder / "model.sdf")
    return SeenRun(
        name=summary["scenario"],
        recording=read_recording(folder / "recording.parquet"),
        model=model,
        summary=summary,
    )
