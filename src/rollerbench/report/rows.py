"""Key figures of a run as labelled text, for tables on terminals and pages."""

import math
from collections.abc import Mapping
from typing import Any

Row = tuple[str, str]


def summary_rows(summary: Mapping[str, Any]) -> list[Row]:
    """Label and value of each key figure in a summary."""
    error = summary["pose_error"]
    rows = [
        ("Robot", summary["robot"]),
        ("Simulated time", f"{summary['duration']:.3f} s"),
        ("Path, rotation", f"{summary['path_length']:.4f} m, {_degrees(summary['rotation'])}"),
        ("Reference pose", _pose(summary["reference_final_pose"])),
        ("Simulated pose", _pose(summary["simulated_final_pose"])),
        ("Odometry pose", _pose(summary["odometry_final_pose"])),
        ("Position error", f"{_mm(error['final_position'])}{_percent(error['percent_of_path'])}"),
        ("  ahead, left", f"{_mm(error['along_track'])}, {_mm(error['cross_track'])}"),
        ("  largest", _mm(error["max_position"])),
        ("Yaw error", f"{_degrees(error['final_yaw'])}, largest {_degrees(error['max_yaw'])}"),
        *(_leg_rows(summary["legs"]) if "legs" in summary else _wheel_rows(summary)),
        ("Real-time factor", f"{summary['realtime_factor']:.1f}, {summary['engine']}"),
    ]
    if "legs" in summary and summary["error_budget"]["half_step"]:
        rows.append(_half_step_row(summary["error_budget"]["half_step"]))
    if summary["cross_check"]:
        rows += _cross_check_rows(summary["cross_check"])
    if summary["failure"]:
        rows.insert(0, ("Failed", summary["failure"]))
    return rows


def _wheel_rows(summary: Mapping[str, Any]) -> list[Row]:
    slip = summary["wheel_slip"]
    return [
        ("Wheel slip", f"rms {_mm(slip['rms'])}/s, largest {_mm(slip['max'])}/s"),
        ("Height ripple", f"{_mm(summary['height_ripple'])}"),
    ]


def _leg_rows(legs: Mapping[str, Any]) -> list[Row]:
    return [
        ("Steps", f"{legs['steps']}"),
        ("Slip in a stance", f"mean {_mm(legs['mean_slip'])}, largest {_mm(legs['largest_slip'])}"),
        ("Height, tilt error", f"largest {_mm(legs['height_error'])}, {_degrees(legs['tilt_error'])}"),
        ("Stability margin", f"{_mm(legs['planned_static_margin'])} at least, as planned"),
        ("Joint torque", f"{legs['largest_effort']:.1f} N m at most"),
    ]


def _half_step_row(change: Mapping[str, float]) -> Row:
    return (
        "Half the step",
        f"ends {_mm(math.hypot(change['x'], change['y']))}, {_degrees(change['yaw'])} from this run",
    )


def _cross_check_rows(second: Mapping[str, Any]) -> list[Row]:
    """What a second engine says, and how far it ends from the first."""
    x, y, yaw = second["apart"]
    rows = [
        (f"{second['engine']}: pose", _pose(second["simulated_final_pose"])),
        ("  from this one", f"{_mm(math.hypot(x, y))}, {_degrees(yaw)}"),
    ]
    return [*rows, ("  failed", second["failure"])] if second["failure"] else rows


def _mm(metres: float) -> str:
    return f"{1e3 * metres:z.3f} mm"


def _degrees(radians: float) -> str:
    return f"{math.degrees(radians):z.4f} deg"


def _pose(pose: list[float]) -> str:
    return f"x {pose[0]:z.4f} m, y {pose[1]:z.4f} m, yaw {_degrees(pose[2])}"


def _percent(percent: float | None) -> str:
    return "" if percent is None else f" ({percent:.3f} % of the path)"
