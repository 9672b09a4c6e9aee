"""Analyses a robot: what it can do in each direction, as numbers, figures and a page."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rollerbench.analysis.limits import STEPS, Capability, capability
from rollerbench.description import Robot
from rollerbench.description.files import write_atomically
from rollerbench.errors import ResourceError
from rollerbench.kinematics.limits import Limit
from rollerbench.kinematics.rows import wheeled
from rollerbench.report.analysis import analysis_page
from rollerbench.report.limits import Measured, limit_figures
from rollerbench.simulation.log import versions
from rollerbench.studies.folder import claim, write_figures

Progress = Callable[[float, float], None]
"""Called with the steps done and the steps there are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """An analysed robot.

    Attributes:
        capability: What theory says.
        measured: Points found by simulation, by figure; none without one.
        folder: Where everything was written.
    """

    capability: Capability
    measured: Measured
    folder: Path


def analyze(
    robot: Robot | str | Path,
    *,
    output: str | Path | None = None,
    roll_resistance: float = 0.0,
    ground_friction: float | None = None,
    measure: Callable[[Capability, Progress], Measured] | None = None,
    progress: Progress | None = None,
) -> Analysis:
    """Largest speeds and accelerations, efforts and isotropy of a robot.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        output: Folder to write: figures/*.svg, analysis.json, report.html; by default analyses/NAME.
        roll_resistance: Resisting force of a rolling wheel or roller over its load [-].
        ground_friction: Coefficient of friction of the ground; None for each wheel's own.
        measure: Finds points to lay over the curves, by simulation for example; called with what theory says and with
            progress.
        progress: Called now and then.

    Raises:
        ResourceError: there is no such robot, or the folder cannot be written or holds something else.
        KinematicsError: an argument is malformed, or the robot stands on legs.
    """
    loaded = wheeled(robot)
    folder = Path("analyses") / loaded.name if output is None else Path(output)
    earlier = claim(
        folder, files={"analysis.json", "report.html"}, folders={"figures"}, index="analysis.json", what="analysis"
    )
    show = progress or (lambda done, total: None)
    found = capability(
        loaded,
        roll_resistance=roll_resistance,
        ground_friction=ground_friction,
        progress=lambda done, total: show(done, STEPS + 1.0),
    )
    measured = {} if measure is None else measure(found, show)
    figures = limit_figures(found, measured)
    # The page of an earlier analysis does not belong to the figures that are about to replace its figures.
    for name in ("report.html", "analysis.json"):
        (folder / name).unlink(missing_ok=True)
    try:
        numbers = {**_numbers(found, measured), "figures": write_figures(folder, figures, earlier)}
        write_atomically(folder / "analysis.json", json.dumps(numbers, allow_nan=False) + "\n")
        write_atomically(folder / "report.html", analysis_page(found, figures, versions()))
    except OSError as error:
        raise ResourceError(f"{folder}: cannot be written: {error}") from error
    show(STEPS + 1.0, STEPS + 1.0)
    return Analysis(capability=found, measured=measured, folder=folder)


def _numbers(found: Capability, measured: Measured) -> dict[str, Any]:
    """The content of analysis.json; what does not exist is null."""
    isotropy, polygon = found.isotropy, found.polygon
    return {
        "robot": found.robot.name,
        "versions": versions(),
        "roll_resistance": found.roll_resistance,
        "ground_friction": found.ground_friction,
        "isotropy": {
            "characteristic_length": isotropy.characteristic_length,
            "condition_number": _plain(isotropy.condition_number),
            "manipulability": _plain(isotropy.manipulability),
            "speed_ratio": None if isotropy.speed_ratio is None else _plain(isotropy.speed_ratio),
        },
        "speed_polygon": None
        if polygon is None
        else {
            "vertices": polygon.vertices.tolist(),
            "edge_wheels": [list(names) for names in polygon.edge_wheels],
            "exact": polygon.exact,
        },
        "max_yaw_rate": _plain(found.max_yaw_rate),
        "directions": found.directions.tolist(),
        "max_speed": _limit(found.speed),
        "max_acceleration": {name: _limit(limit) for name, limit in found.accelerations.items()},
        "efforts": {
            "wheels": [wheel.name for wheel in found.robot.driven_wheels],
            "accelerations": found.map_accelerations.tolist(),
            "values": _plain(found.efforts),
        },
        "measured": {
            name: {"directions": _plain(points.directions), "values": _plain(points.values)}
            for name, points in measured.items()
        },
    }


def _limit(limit: Limit) -> Mapping[str, Any]:
    return {
        "value": _plain(limit.value),
        "cause": limit.cause.tolist(),
        "wheels": [list(limit.wheels(i)) for i in range(len(limit.value))],
    }


def _plain(value: ArrayLike) -> Any:
    """Numbers for JSON to nine digits, None for those that are not finite."""

    def plain(item: Any) -> Any:
        if isinstance(item, list):
            return [plain(each) for each in item]
        return float(f"{item:.9g}") if math.isfinite(item) else None

    return plain(np.asarray(value, dtype=np.float64).tolist())
