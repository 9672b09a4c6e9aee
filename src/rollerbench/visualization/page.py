"""A scene as one HTML page with the viewer of the Python package meshcat: no server, no network."""

import base64
import itertools
import json
import math
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import umsgpack
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench import palette
from rollerbench.palette import Color
from rollerbench.visualization.scenes import FIELD_OF_VIEW, Scene, SceneRun
from rollerbench.visualization.shapes import Box, Cylinder, Ellipsoid, Item, Shape

Array = NDArray[np.float64]

Command = dict[str, Any]

AXLE = Rotation.from_euler("x", 90, degrees=True).as_matrix()
"""Turns the viewer's cylinders, which lie along y, onto z."""

LEAP = 10.0
"""Distance between two frames that nothing drives [m]."""

SEGMENTS = 32
"""Of round shapes."""


def scene_page(scene: Scene) -> str:
    """The page of a scene: the viewer, what it shows, its legend and its controls."""
    environment = Environment(
        loader=PackageLoader("rollerbench.visualization"), autoescape=True, undefined=StrictUndefined
    )
    data = b"".join(_framed(umsgpack.packb(command)) for command in commands(scene))
    return environment.get_template("scene.html.j2").render(
        title=", ".join(run.name for run in scene.runs),
        viewer=Markup(_viewer()),
        data=base64.b64encode(data).decode("ascii"),
        runs=[_legend(scene, run) for run in scene.runs],
        settings=Markup(_inert(json.dumps(_settings(scene)))),
        marks=_marks(scene),
        grid=" and ".join(f"{pitch:g} m" for pitch in scene.pitches) or "none",
        slope=scene.slope_deg,
        simulated=palette.css(palette.SIMULATED),
        reference=palette.css(palette.REFERENCE),
    )


def _viewer() -> str:
    """The script of the viewer, from the package's files: to import it would start parts of a server."""
    spec = find_spec("meshcat")
    assert spec is not None
    assert spec.origin is not None
    return (Path(spec.origin).parent / "viewer" / "dist" / "main.min.js").read_text(encoding="utf-8")


def commands(scene: Scene) -> Iterator[Command]:
    """What to tell a meshcat viewer, in its own format, the same for the same scene."""
    yield {"type": "set_property", "path": "/Grid", "property": "visible", "value": False}
    yield {"type": "set_property", "path": "/Axes", "property": "visible", "value": False}
    for name, color in zip(("top_color", "bottom_color"), palette.SKY, strict=True):
        yield {"type": "set_property", "path": "/Background", "property": name, "value": list(color)}
    for light, intensity in (("AmbientLight", 0.75), ("FillLight", 0.35)):
        yield {"type": "set_property", "path": f"/Lights/{light}/<object>", "property": "intensity", "value": intensity}
    numbers = itertools.count(1)
    for item in scene.items:
        path = f"/{item.frame}/{item.name}"
        yield {"type": "set_object", "path": path, "object": _object(item, numbers)}
        pose = item.X_FG.copy()
        if isinstance(item.shape, Cylinder):
            pose[:3, :3] = pose[:3, :3] @ AXLE
        yield {"type": "set_transform", "path": path, "matrix": pose.T.ravel().tolist()}
    for path, track in scene.tracks.items():
        yield {"type": "set_transform", "path": f"/{path}", "matrix": track[0].T.ravel().tolist()}
    yield {
        "type": "set_animation",
        "path": "",
        "animations": [_animation(path, scene.times[path], track) for path, track in scene.tracks.items()],
        "options": {"play": True, "repetitions": 1},
    }


def _animation(path: str, times: Array, track: Array) -> Command:
    turns = Rotation.from_matrix(track[:, :3, :3]).as_quat()
    tracks = []
    for name, kind, values in (("position", "vector3", track[:, :3, 3]), ("quaternion", "quaternion", turns)):
        of, shown = _held(times, values) if name == "position" else (times, values)
        kept = _changes(shown)
        pairs = zip(of[kept].tolist(), shown[kept].tolist(), strict=True)
        keys = [{"time": time, "value": value} for time, value in pairs]
        tracks.append({"name": f".{name}", "type": kind, "keys": keys})
    return {"path": f"/{path}", "clip": {"fps": 1, "name": "default", "tracks": tracks}}


def _held(times: Array, values: Array) -> tuple[Array, Array]:
    """Positions (n, 3) that wait where they are until they leap; from one place to the next nothing is seen to move."""
    leaps = np.flatnonzero(np.linalg.norm(np.diff(values, axis=0), axis=1) > LEAP) + 1
    return np.insert(times, leaps, times[leaps] - 1e-6), np.insert(values, leaps, values[leaps - 1], axis=0)


def _changes(values: Array) -> NDArray[np.bool_]:
    """Which of values (n, ...) the others do not tell: first, last, and those that differ from a neighbour."""
    differs = (np.diff(values, axis=0) != 0).any(axis=1)
    return np.concatenate([[True], differs[1:] | differs[:-1], [True]]) if len(values) > 1 else np.array([True])


def _object(item: Item, numbers: Iterator[int]) -> Command:
    geometry, material, own = (f"00000000-0000-4000-8000-{next(numbers):012x}" for _ in range(3))
    matrix = np.eye(4)
    if isinstance(item.shape, Ellipsoid):
        matrix[:3, :3] = np.diag(item.shape.radii)
    return {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [{"uuid": geometry, **_geometry(item.shape)}],
        "materials": [
            {
                "uuid": material,
                "type": "MeshLambertMaterial" if item.lit else "MeshBasicMaterial",
                "color": _integer(item.color),
                "opacity": item.opacity,
                "transparent": item.opacity < 1,
                # What one sees through must not hide what lies behind it.
                "depthWrite": item.opacity == 1,
                "side": 2 if not isinstance(item.shape, Box | Cylinder | Ellipsoid) else 0,
            }
        ],
        "object": {
            "uuid": own,
            "type": "Mesh",
            "geometry": geometry,
            "material": material,
            "matrix": matrix.T.ravel().tolist(),
        },
    }


def _geometry(shape: Shape) -> Command:
    if isinstance(shape, Box):
        return {"type": "BoxGeometry", **dict(zip(("width", "height", "depth"), map(float, shape.size), strict=True))}
    if isinstance(shape, Cylinder):
        radius, height = float(shape.radius), float(shape.length)
        size = {"radiusTop": radius, "radiusBottom": radius, "height": height}
        return {"type": "CylinderGeometry", **size, "radialSegments": SEGMENTS}
    if isinstance(shape, Ellipsoid):
        return {"type": "SphereGeometry", "radius": 1.0, "widthSegments": SEGMENTS, "heightSegments": SEGMENTS // 2}
    vertices = {
        "itemSize": 3,
        "type": "Float32Array",
        "array": umsgpack.Ext(0x17, shape.vertices.astype("<f4").tobytes()),
        "normalized": False,
    }
    faces = {
        "itemSize": 3,
        "type": "Uint32Array",
        "array": umsgpack.Ext(0x16, shape.faces.astype("<u4").tobytes()),
        "normalized": False,
    }
    return {"type": "BufferGeometry", "data": {"attributes": {"position": vertices}, "index": faces}}


def _legend(scene: Scene, run: SceneRun) -> dict[str, Any]:
    """What the legend says of a run."""
    summary = run.summary
    error, lines = summary["pose_error"], []
    percent = error["percent_of_path"]
    share = "" if percent is None else f" ({percent:.2f} % of path)"
    lines.append(("Position error at the end", f"{1e3 * error['final_position']:.1f} mm{share}"))
    lines.append(("Yaw error at the end", f"{math.degrees(error['final_yaw']):z.2f} deg"))
    if "wheel_slip" in summary:
        lines.append(("Largest slip", f"{1e3 * summary['wheel_slip']['max']:.0f} mm/s"))
    if "legs" in summary:
        lines.append(("Steps", f"{summary['legs']['steps']}"))
    lines.append(("Real-time factor", f"{summary['realtime_factor']:.1f}"))
    return {
        "name": run.name,
        "robot": run.robot,
        "color": palette.css(run.color),
        "lines": lines,
        "failure": summary["failure"],
    }


def _marks(scene: Scene) -> dict[str, Any]:
    """Which marks a scene has, for the legend and the check boxes."""
    frames = {item.frame.rpartition("/")[2] if "/" in item.frame else item.frame for item in scene.items}
    slip = any(frame.endswith("slip") for frame in frames)
    return {
        "forces": any("forces/" in path for path in scene.tracks),
        "feet": any("support/" in path for path in scene.tracks),
        "slip": [
            (f"over {1e3 * speed:g} mm/s", palette.css(color))
            for speed, color in zip(palette.SLIP_SPEEDS, palette.SLIP_COLORS, strict=True)
        ],
        "has_slip": slip,
        "support": any("support/" in path for path in scene.tracks),
        "shown": scene.shown,
        "support_color": palette.css(palette.SUPPORT),
        "force_color": palette.css(palette.FORCE),
    }


def _settings(scene: Scene) -> dict[str, Any]:
    """What the page's script needs."""
    return {
        "view": scene.view,
        "fieldOfView": math.degrees(FIELD_OF_VIEW),
        "duration": scene.duration,
        "prefixes": [run.prefix for run in scene.runs],
        "cameras": {
            name: {
                "target": camera.target.tolist(),
                "direction": camera.direction.tolist(),
                "radius": camera.radius,
                "follows": camera.follows,
            }
            for name, camera in scene.cameras.items()
        },
    }


def _framed(message: bytes) -> bytes:
    """A message after its length in bytes."""
    return len(message).to_bytes(4, "little") + message


def _inert(text: str) -> str:
    """JSON that cannot end a script element."""
    return text.replace("<", "\\u003c")


def _integer(color: Color) -> int:
    red, green, blue = (round(255 * value) for value in color)
    return 65536 * red + 256 * green + blue
