"""Pictures and videos of scenes, drawn without a display or a GPU."""

import importlib.util
import io
import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from rollerbench.errors import RollerbenchError
from rollerbench.visualization import lens
from rollerbench.visualization.offscreen import Offscreen, sample
from rollerbench.visualization.scenes import Scene, View

Array = NDArray[np.float64]

VideoFormat = Literal["mp4", "gif"]

FINER = 1
"""Stills are drawn so many times larger and then made smaller, which smooths thin lines."""

MARGIN = 0.05
"""Share of a picture that stays free along each edge."""

GIF_SIZE = (640, 360)
MP4_SIZE = (960, 540)

GIF_PERIOD = 0.08
"""Least time between frames of a GIF [s]; its clock counts hundredths of a second."""

GIF_COLORS = 128

LARGEST = 4096
"""Width or height [pixel]."""

Progress = Callable[[float], None]
"""Called with the time of each frame [s]."""


def check(kind: VideoFormat) -> None:
    """Checks, before anything is simulated, that such a video can be made.

    Raises:
        RollerbenchError: a package is missing.
    """
    if kind == "mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise RollerbenchError(
            "a video as mp4 needs the package imageio-ffmpeg: pip install 'rollerbench[video]'; gif works without it"
        )


def preview(
    scene: Scene, *, time: float | None = None, width: int = 960, height: int = 540, view: View | None = None
) -> bytes:
    """A still picture of robots, ghosts and the trails about them, as PNG.

    Args:
        scene: What to draw.
        time: When [s]; by default at the end.
        width: Of the picture [pixel].
        height: Of the picture [pixel].
        view: From where; by default as the scene starts. All of them come as close as the picture allows.

    Raises:
        RollerbenchError: a size is out of range, or this machine cannot draw.
    """
    _check_size(width, height)
    time = scene.duration if time is None else time
    direction = scene.cameras[view or scene.view].direction
    eye, distance = lens.closest_eye(lens.near(scene, time), direction, width / height, MARGIN)
    offscreen = Offscreen(scene, direction, FINER * width, FINER * height)
    picture = Image.fromarray(offscreen.picture(time, eye, distance))
    kept = io.BytesIO()
    picture.resize((width, height), Image.Resampling.BOX).save(kept, format="PNG", optimize=True)
    return kept.getvalue()


def video(
    scene: Scene,
    path: str | Path,
    *,
    width: int | None = None,
    height: int | None = None,
    frames_per_second: float = 30.0,
    view: View | None = None,
    progress: Progress | None = None,
) -> None:
    """Writes a video in real time, whose caption tells the time and the pose errors.

    Args:
        scene: What to show.
        path: File to write; its ending says whether as mp4 (H.264) or as gif.
        width: Of the picture [pixel]; by default 960, of a gif 640. For mp4 odd ones lose a pixel.
        height: Of the picture [pixel]; by default 540, of a gif 360.
        frames_per_second: Frames [1/s]; of a gif 12.5 at most.
        view: From where; by default as the scene starts.
        progress: Called with the time of each frame [s].

    Raises:
        RollerbenchError: the ending or a size cannot be accepted, or a package is missing.
    """
    path = Path(path)
    if path.suffix not in (".mp4", ".gif"):
        raise RollerbenchError(f"{path}: ends with {path.suffix!r}; accepted: .mp4, .gif")
    kind: VideoFormat = "mp4" if path.suffix == ".mp4" else "gif"
    check(kind)
    usual = MP4_SIZE if kind == "mp4" else GIF_SIZE
    width, height = width or usual[0], height or usual[1]
    _check_size(width, height)
    if not frames_per_second > 0:
        raise RollerbenchError(f"frames_per_second = {frames_per_second:g}: accepted: more than 0")
    film = _Film(scene, width - width % 2, height - height % 2, view or scene.view)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
        building = Path(folder) / path.name
        if kind == "mp4":
            _write_mp4(film, building, frames_per_second, progress)
        else:
            _write_gif(film, building, frames_per_second, progress)
        building.replace(path)


class _Film:
    """The frames of a video."""

    def __init__(self, scene: Scene, width: int, height: int, view: View) -> None:
        self.scene, self.size = scene, (width, height)
        self._camera = scene.cameras[view]
        self._offscreen = Offscreen(scene, self._camera.direction, width, height)
        if self._camera.follows:
            self._eye = self._camera.eye(width / height)
            self._distance = float(np.linalg.norm(self._eye - self._camera.target))
        else:
            direction = self._camera.direction
            self._eye, self._distance = lens.closest_eye(lens.whole(scene), direction, width / height, MARGIN)
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        self._font = ImageFont.truetype(fonts / "DejaVuSans.ttf", max(round(height / 30), 9))

    def frame(self, time: float) -> Image.Image:
        """The picture at a time [s]."""
        eye = self._eye
        if self._camera.follows:
            place = _pose(self.scene, f"{self.scene.runs[0].prefix}robot/body", time)[:2, 3]
            eye = eye + np.array([*place, 0.0])
        picture = Image.fromarray(self._offscreen.picture(time, eye, self._distance))
        self._caption(picture, time)
        return picture

    def _caption(self, picture: Image.Image, time: float) -> None:
        draw = ImageDraw.Draw(picture)
        line = 1.5 * self._font.size
        left, top = 0.8 * line, self.size[1] - (len(self.scene.runs) + 0.6) * line
        for index, run in enumerate(self.scene.runs):
            position, yaw = pose_error(self.scene, run.prefix, time)
            color = tuple(round(255 * value) for value in run.color)
            place = (left, top + index * line)
            draw.rectangle(
                (place[0], place[1] + 0.15 * line, place[0] + 0.3 * line, place[1] + 0.65 * line), fill=color
            )
            text = f"{run.name}   {time:5.2f} s   {1e3 * position:.1f} mm, {math.degrees(yaw):+.2f}° off"
            draw.text((place[0] + 0.7 * line, place[1]), text, fill=(40, 45, 52), font=self._font)


def pose_error(scene: Scene, prefix: str, time: float) -> tuple[float, float]:
    """How far a run is from what the equations predict at a time [s]: in position [m] and yaw [rad]."""
    X_WB, X_WR = (_pose(scene, f"{prefix}{frame}", time) for frame in ("robot/body", "ghost"))
    turn = X_WR[:3, :3].T @ X_WB[:3, :3]
    return float(np.linalg.norm(X_WB[:2, 3] - X_WR[:2, 3])), math.atan2(turn[1, 0], turn[0, 0])


def frame_times(scene: Scene, frames_per_second: float) -> Iterator[float]:
    """Times of frames from the start to the end, both included [s]."""
    for index in range(round(scene.duration * frames_per_second) + 1):
        yield min(index / frames_per_second, scene.duration)


def _write_mp4(film: _Film, path: Path, frames_per_second: float, progress: Progress | None) -> None:
    """H.264 in yuv420p, which browsers and presentations play."""
    import imageio_ffmpeg

    parameters = ["-crf", "20", "-preset", "veryfast", "-movflags", "+faststart"]
    parameters += ["-vf", "scale=out_color_matrix=bt709", "-colorspace", "bt709"]
    parameters += ["-color_primaries", "bt709", "-color_trc", "bt709"]
    writer = imageio_ffmpeg.write_frames(
        str(path),
        film.size,
        fps=frames_per_second,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        output_params=parameters,
    )
    writer.send(None)
    try:
        for time in frame_times(film.scene, frames_per_second):
            writer.send(film.frame(time).tobytes())
            if progress is not None:
                progress(time)
    finally:
        writer.close()


def _write_gif(film: _Film, path: Path, frames_per_second: float, progress: Progress | None) -> None:
    """Frames in one palette, so that what stands still does not flicker and takes no space."""
    hundredths = max(round(100 / frames_per_second), round(100 * GIF_PERIOD))
    chosen = np.linspace(0.0, film.scene.duration, 4)
    samples = np.concatenate([np.asarray(film.frame(time)) for time in chosen])
    colors = Image.fromarray(samples).quantize(GIF_COLORS, method=Image.Quantize.MEDIANCUT)
    frames = []
    for time in frame_times(film.scene, 100 / hundredths):
        frames.append(film.frame(time).quantize(palette=colors, dither=Image.Dither.NONE))
        if progress is not None:
            progress(time)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=10 * hundredths, loop=0, optimize=True)


def _pose(scene: Scene, path: str, time: float) -> Array:
    return scene.tracks[path][sample(scene.times[path], time)]


def _check_size(width: int, height: int) -> None:
    for name, value in (("width", width), ("height", height)):
        if not 16 <= value <= LARGEST:
            raise RollerbenchError(f"{name} = {value}: accepted: 16 to {LARGEST} pixels")
