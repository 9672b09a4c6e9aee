"""The pages of a run open offline in a real browser and show what they should."""

import io
import json
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import rollerbench as rb
from browser import opened
from rollerbench import palette


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scenario = rb.load_scenario("youbot_plus_y", overrides={"duration": 1.0, "command.ramp": 0.2})
    result = rb.run(scenario, output=tmp_path_factory.mktemp("runs") / "run")
    assert result.folder is not None
    return result.folder


def _pixels(png: bytes) -> np.ndarray:
    return matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]


def _near(pixels: np.ndarray, color: tuple[float, float, float], tolerance: float = 0.12) -> np.ndarray:
    """Which pixels (h, w) have a colour."""
    return np.abs(pixels - np.array(color)).max(axis=-1) < tolerance


def test_the_recording_plays_offline_from_the_start_with_its_numbers(folder: Path) -> None:
    with opened(folder / "recording.html", 760, 480) as watched:
        page = watched.page
        page.wait_for_function("!animator.playing && animator.time > 0.999", timeout=60_000)
        assert page.evaluate("animator.duration") == pytest.approx(1.0, abs=1e-6)
        legend = page.inner_text("#legend")
        error = json.loads((folder / "summary.json").read_text())["pose_error"]["final_position"]
        assert f"{1e3 * error:.1f} mm" in legend
        assert "Real-time factor" in legend
        ended = _pixels(page.screenshot())
        # The button starts it again.
        page.click("#play")
        page.wait_for_function("animator.playing && animator.time < 0.999")
        page.evaluate("animator.pause(); seek(0)")
        page.wait_for_timeout(300)
        started = _pixels(page.screenshot())
        assert watched.requests == []
        assert watched.errors == []
    ground = ended[-200:-80]
    assert (np.ptp(ground, axis=-1) < 0.15).mean() > 0.6
    assert ground.std() > 0.005  # grid lines
    assert _near(ended, palette.SIMULATED, 0.05).sum() > 100  # heading arrow and trail
    assert np.abs(started - ended).max() > 0.2


def test_cameras_and_marks_can_be_chosen(folder: Path) -> None:
    """Top looks down, follow keeps the robot in the middle, and a check box hides the ghost."""
    with opened(folder / "recording.html", 760, 480) as watched:
        page = watched.page
        page.wait_for_function("animator.duration > 0")
        page.evaluate("animator.pause()")
        page.click("[data-view=top]")
        x, y, z = page.evaluate("viewer.camera.position.toArray()")
        target = page.evaluate("viewer.controls.target.toArray()")
        assert np.hypot(x - target[0], z - target[2]) < 0.01 * (y - target[1])
        page.click("[data-view=follow]")
        for time in (0.0, 1.0):
            page.evaluate(f"seek({time})")
            page.wait_for_timeout(300)
            robot = page.evaluate("viewer.scene_tree.find(['robot', 'body']).object.position.toArray()")
            at = page.evaluate("viewer.controls.target.toArray()")
            np.testing.assert_allclose([at[0], -at[2]], robot[:2], atol=1e-6)
        page.uncheck("[data-shows=ghost]")
        assert not page.evaluate("viewer.scene_tree.find(['ghost']).object.visible")
        assert watched.errors == []


@pytest.mark.parametrize("gear_error", [0.0, 0.1])
def test_ghost_and_robot_are_apart_when_errors_are_injected_and_coincide_when_not(
    tmp_path: Path, gear_error: float
) -> None:
    """From above, the ghost is seen over the ground, where no robot is, as far as they are apart."""
    scenario = {
        "name": "arc",
        "robot": "differential_cart",
        "duration": 2.0,
        "command": {"type": "twist", "v_xyw_B": [0.5, 0.0, 0.0], "ramp": 0.2},
        "errors": {"gear_error": {"left": {"constant": gear_error}}},
        "recording": {"camera": "top"},
    }
    result = rb.run(scenario, output=tmp_path / "run")
    with opened(tmp_path / "run" / "recording.html", 760, 480) as watched:
        page = watched.page
        page.wait_for_function("animator.duration > 0")
        page.uncheck("[data-shows=trails]")
        page.evaluate("animator.pause(); seek(animator.duration)")
        page.wait_for_timeout(300)
        shots = []
        for ghost in (page.check, page.uncheck):
            ghost("[data-shows=ghost]")
            page.wait_for_timeout(300)
            shots.append(_pixels(page.screenshot())[20:-100, 330:])
        assert watched.errors == []
    shown, hidden = shots
    changed = np.abs(shown - hidden).max(axis=-1) > 0.04
    over_ground = changed & (hidden.min(axis=-1) > 0.75)
    apart = result.summary["pose_error"]["final_position"]
    assert (apart > 0.04) == (gear_error != 0)
    assert changed.sum() > 2000
    assert (over_ground.sum() > 0.3 * changed.sum()) == (gear_error != 0), over_ground.sum() / changed.sum()
