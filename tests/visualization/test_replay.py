"""Stored runs are shown from their folders alone, without Drake, as they were recorded."""

import base64
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import umsgpack

import rollerbench as rb
from browser import opened

SPEED = {"type": "twist", "v_xyw_B": [0.25, 0.15, 0.4], "ramp": 0.2}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The same run on good ground and on slippery ground."""
    top = tmp_path_factory.mktemp("runs")
    for name, friction in (("good", 0.8), ("slippery", 0.05)):
        scenario = {"name": "turn", "robot": "youbot_base", "duration": 1.0, "command": SPEED}
        rb.run({**scenario, "ground": {"friction": friction}}, output=top / name)
    return [top / "good", top / "slippery"]


def told(page: str) -> list[dict[str, Any]]:
    """What a page tells meshcat's viewer."""
    (text,) = re.findall(r'<script id="scene"[^>]*>([^<]*)</script>', page)
    data = base64.b64decode(text)

    def messages() -> Iterator[bytes]:
        at = 0
        while at < len(data):
            length = int.from_bytes(data[at : at + 4], "little")
            yield data[at + 4 : at + 4 + length]
            at += 4 + length

    return [umsgpack.unpackb(message) for message in messages()]


def positions(page: str, path: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and positions of a frame in a page."""
    animation = next(command for command in told(page) if command["type"] == "set_animation")
    clip = next(each["clip"] for each in animation["animations"] if each["path"] == path)
    keys = next(track for track in clip["tracks"] if track["name"] == ".position")["keys"]
    return np.array([key["time"] for key in keys]), np.array([key["value"] for key in keys])


def test_a_machine_without_drake_replays_the_recorded_poses(folders: list[Path], tmp_path: Path) -> None:
    """The command runs with pydrake out of reach; its poses equal the recording's to 1e-9."""
    page = tmp_path / "both.html"
    code = "import sys; sys.modules['pydrake'] = None; from rollerbench.cli import main; main()"
    arguments = [sys.executable, "-c", code, "replay", *map(str, folders), "--html", str(page)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for number, folder in enumerate(folders, start=1):
        recording = rb.Recording.read(folder)
        times, places = positions(page.read_text(encoding="utf-8"), f"/run_{number}/robot/body")
        assert (times[0], times[-1]) == (recording.time[0], recording.time[-1])
        expected = [np.interp(times, recording.time, recording.columns[name]) for name in "xyz"]
        np.testing.assert_allclose(places, np.column_stack(expected), atol=1e-9)


def test_the_runs_own_page_is_what_replay_shows(folders: list[Path]) -> None:
    """recording.html and a replay of the folder are the same to the byte."""
    stored = (folders[0] / "recording.html").read_text(encoding="utf-8")
    assert rb.replay(folders[0]).page() == stored


def test_a_notebook_shows_a_replay_without_a_server(folders: list[Path]) -> None:
    shown = rb.replay(folders)._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert "run_2" in shown


def test_a_visualizer_of_ones_own_is_told_the_same(folders: list[Path]) -> None:
    class Window:
        def __init__(self) -> None:
            self.sent: list[dict[str, Any]] = []

        def send(self, command: Any) -> None:
            lowered = command.lower()
            assert lowered["type"]
            self.sent.append(lowered)

    class Visualizer:
        window = Window()

    replayed = rb.replay(folders)
    replayed.show_in(Visualizer())
    assert len(Visualizer.window.sent) == len(told(replayed.page()))


def test_two_runs_are_seen_with_their_numbers(folders: list[Path], tmp_path: Path) -> None:
    """Both robots, told apart by folder and colour; the error now is the distance of robot and ghost that are shown."""
    file = rb.replay(folders, slip=True).write(tmp_path / "both.html")
    with opened(file, 1200, 700) as watched:
        page = watched.page
        page.wait_for_function("viewer.animator.duration > 0")
        page.evaluate("animator.pause(); seek(animator.duration)")
        page.wait_for_timeout(300)
        text = page.inner_text("#legend")
        assert "good)" in text
        assert "slippery)" in text
        for index, folder in enumerate(folders):
            error = json.loads((folder / "summary.json").read_text())["pose_error"]["final_position"]
            assert page.locator(".now").nth(index).inner_text().startswith(f"{1e3 * error:.1f} mm")
        assert float(page.input_value("#scrubber")) == pytest.approx(1.0, abs=2e-3)
        assert page.is_checked("[data-shows=slip]")
        assert watched.errors == []
        assert watched.requests == []


def test_what_is_no_run_is_refused(folders: list[Path], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    broken = tmp_path / "broken"
    broken.mkdir()
    for name in ("recording.parquet", "model.sdf"):
        (broken / name).write_bytes((folders[0] / name).read_bytes())
    (broken / "summary.json").write_text("{")
    for folder, message in (
        (tmp_path / "none", "no such folder"),
        (tmp_path / "empty", "recording.parquet"),
        (broken, "not valid JSON"),
    ):
        with pytest.raises(rb.ResourceError, match=message):
            rb.replay(folder)
    with pytest.raises(rb.ResourceError, match="one or more"):
        rb.replay([])
