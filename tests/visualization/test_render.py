"""Pictures and videos show robot, ghost and trails where they are, in their colours."""

import importlib.util
import io
import math
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

import rollerbench as rb
from rollerbench import palette
from rollerbench.errors import RollerbenchError
from rollerbench.sdf import robot_to_sdf
from rollerbench.visualization import lens
from rollerbench.visualization.offscreen import Offscreen
from rollerbench.visualization.render import check, pose_error, preview, video
from rollerbench.visualization.scenes import FIELD_OF_VIEW, Scene, SeenRun, scene_of

WIDTH, HEIGHT = 320, 180


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A cart whose gears are wrong by a fifth, so that it ends elsewhere than its ghost."""
    scenario = rb.load_scenario(
        {
            "name": "cart",
            "robot": "differential_cart",
            "duration": 1.0,
            "command": {"type": "twist", "v_xyw_B": [0.5, 0.0, 0.0], "ramp": 0.2},
            "errors": {"gear_error": {"all": {"constant": 0.2}}},
        }
    )
    result = rb.run(scenario, save=False)
    model = robot_to_sdf(scenario.simulated_robot)
    return scene_of([SeenRun(name="cart", recording=result.recording, model=model, summary=result.summary)])


def _pixel(p_W: np.ndarray, eye: np.ndarray, direction: np.ndarray) -> tuple[int, int]:
    x, y, z = lens.axes(direction).T @ (p_W - eye)
    focal = 0.5 * HEIGHT / math.tan(0.5 * FIELD_OF_VIEW)
    return int(0.5 * HEIGHT + focal * y / z), int(0.5 * WIDTH + focal * x / z)


def test_level_marks_appear_in_their_own_colour_where_they_are(scene: Scene) -> None:
    direction = scene.cameras["top"].direction
    eye, distance = lens.closest_eye(lens.whole(scene), direction, WIDTH / HEIGHT, 0.05)
    picture = Offscreen(scene, direction, WIDTH, HEIGHT).picture(scene.duration, eye, distance)
    X_WB, X_WR = scene.tracks["robot/body"][-1], scene.tracks["ghost"][-1]
    ahead = X_WB[0, 3] - X_WR[0, 3]
    assert ahead > 0.05
    assert pose_error(scene, "", scene.duration)[0] == pytest.approx(ahead, rel=1e-3)
    arrows = [item for item in scene.items if item.name == "heading"]
    for arrow, X_WF in zip(arrows, (X_WB, X_WR), strict=True):
        # The shaft's end, which the other arrow does not cover.
        side = -0.4 if arrow.frame == "ghost" else 0.4
        vertices = arrow.shape.vertices  # type: ignore[union-attr]
        middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
        middle[0] += side * np.ptp(vertices[:, 0])
        row, column = _pixel(X_WF[:3, :3] @ middle + X_WF[:3, 3], eye, direction)
        np.testing.assert_allclose(picture[row, column] / 255, arrow.color, atol=0.02)
    for color in (palette.SIMULATED, palette.REFERENCE):
        near = np.abs(picture / 255 - color).max(axis=-1) < 0.03
        assert near.sum() > 10
    corner = picture[3, 3] / 255
    assert corner.min() > 0.75


def test_the_closest_eye_sees_all_points_and_touches_the_edges() -> None:
    points = np.random.default_rng(1).normal(size=(50, 3))
    direction = np.array([-0.42, -0.70, 0.58])
    direction /= np.linalg.norm(direction)
    for aspect in (0.6, 1.8):
        eye, distance = lens.closest_eye(points, direction, aspect, 0.0)
        p_C = (points - eye) @ lens.axes(direction)
        assert p_C[:, 2].min() > 0
        assert p_C[:, 2].min() < distance < p_C[:, 2].max()
        slope = math.tan(0.5 * FIELD_OF_VIEW)
        reach = np.abs(p_C[:, :2] / p_C[:, 2:]).max(axis=0) / [slope * aspect, slope]
        assert reach.max() == pytest.approx(1.0, abs=1e-9)


def test_a_preview_has_the_size_and_robot_and_trails(scene: Scene) -> None:
    picture = Image.open(io.BytesIO(preview(scene, width=WIDTH, height=HEIGHT)))
    assert (picture.format, picture.size) == ("PNG", (WIDTH, HEIGHT))
    pixels = np.asarray(picture.convert("RGB")) / 255
    for color in (palette.SIMULATED, palette.REFERENCE, palette.GROUND):
        assert (np.abs(pixels - color).max(axis=-1) < 0.03).sum() > 10
    assert 0.05 < (pixels.mean(axis=-1) < 0.4).mean() < 0.6


# imageio-ffmpeg leaves the pipes of what it reads open.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_mp4_lasts_as_long_as_the_run_and_moves(scene: Scene, tmp_path: Path) -> None:
    seen: list[float] = []
    video(scene, tmp_path / "run.mp4", width=161, height=91, frames_per_second=8, progress=seen.append)
    assert list(tmp_path.iterdir()) == [tmp_path / "run.mp4"]
    np.testing.assert_allclose(seen, np.arange(9) / 8)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "run.mp4"))
    about = next(reader)
    frames = [np.frombuffer(frame, dtype=np.uint8).astype(int) for frame in reader]
    assert about["size"] == (160, 90)
    assert about["codec"] == "h264"
    assert about["pix_fmt"].startswith("yuv420p")
    assert about["duration"] == pytest.approx(9 / 8, abs=0.02)
    assert len(frames) == 9
    assert np.abs(frames[0] - frames[-1]).max() > 60


def test_a_gif_plays_in_real_time(scene: Scene, tmp_path: Path) -> None:
    video(scene, tmp_path / "run.gif", width=160, height=90)
    with Image.open(tmp_path / "run.gif") as picture:
        durations = []
        for index in range(picture.n_frames):
            picture.seek(index)
            durations.append(picture.info["duration"])
        assert picture.size == (160, 90)
    assert sum(durations) == pytest.approx(1000, abs=90)


def test_what_cannot_be_drawn_is_refused(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RollerbenchError, match=r"ends with '\.avi'; accepted: \.mp4, \.gif"):
        video(scene, tmp_path / "run.avi")
    with pytest.raises(RollerbenchError, match="width = 5: accepted: 16 to 4096"):
        preview(scene, width=5)
    with pytest.raises(RollerbenchError, match="frames_per_second = 0"):
        video(scene, tmp_path / "run.gif", frames_per_second=0.0)
    with monkeypatch.context() as patched:
        patched.setattr(importlib.util, "find_spec", lambda name: None)
        with pytest.raises(RollerbenchError, match=r"pip install 'rollerbench\[video\]'"):
            check("mp4")
        check("gif")
    assert list(tmp_path.iterdir()) == []
