"""The pages of a run open offline in a real browser and show what they should."""

import io
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import rollerbench as rb
from browser import opened


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scenario = rb.load_scenario("youbot_plus_y", overrides={"duration": 1.0, "command.ramp": 0.2})
    result = rb.run(scenario, output=tmp_path_factory.mktemp("runs") / "run")
    assert result.folder is not None
    return result.folder


def _pixels(png: bytes) -> np.ndarray:
    return matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]


def test_the_recording_shows_robot_and_ground_without_a_request_and_moves(folder: Path) -> None:
    """The animation lasts as long as the run, and the robot is elsewhere at its end."""
    with opened(folder / "recording.html") as watched:
        page = watched.page
        page.wait_for_function("viewer.animator.duration > 0")
        assert page.evaluate("viewer.animator.duration") == pytest.approx(1.0, abs=1 / 30)
        shots = []
        for time in (0.0, 1.0):
            page.evaluate(f"viewer.animator.pause(); viewer.animator.seek({time})")
            page.wait_for_timeout(500)
            shots.append(_pixels(page.screenshot()))
        assert watched.requests == []
        assert watched.errors == []
    start, end = shots
    red, _, blue = np.moveaxis(start, -1, 0)
    # The robot's body is the only saturated blue; the ground is nearly grey and fills the lower edge.
    body = (blue > 0.4) & (blue - red > 0.25)
    assert 0.002 < body.mean() < 0.3
    ground = start[-200:]
    assert (np.ptp(ground, axis=-1) < 0.15).mean() > 0.8
    assert ground.std() > 0.005  # grid lines
    assert len(np.unique((start * 16).astype(int).reshape(-1, 3), axis=0)) > 20
    assert np.abs(start - end).max() > 0.2
