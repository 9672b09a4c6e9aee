"""Figures of a run as SVG."""

import io
from itertools import cycle

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rollerbench.recording import Recording

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
"""Distinguishable with colour-blindness: Okabe and Ito (2008)."""

STYLES = ("-", "--", "-.", ":")


def run_figures(recording: Recording) -> dict[str, str]:
    """SVG texts of a run's figures by name."""
    return {
        "trajectory": trajectory(recording),
        "pose_error": pose_error(recording),
        "wheel_speeds": wheel_speeds(recording),
        "wheel_slip": wheel_slip(recording),
    }


def trajectory(recording: Recording) -> str:
    """Reference, simulated and odometry path in the plane."""
    figure, (axes,) = _figure(1)
    for label, path, style, color in (
        ("reference", recording.reference_q_xyt, "-", COLORS[0]),
        ("simulated", recording.q_xyt, "--", COLORS[1]),
        ("odometry", recording.odometry_q_xyt, ":", COLORS[2]),
    ):
        axes.plot(path[:, 0], path[:, 1], style, color=color, label=label)
        axes.plot(path[-1, 0], path[-1, 1], "o", color=color, markersize=4)
    _widen(axes, recording)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend()
    return _svg(figure)


def pose_error(recording: Recording) -> str:
    """Position and yaw error over time."""
    figure, (position, yaw) = _figure(2)
    error = recording.q_xyt - recording.reference_q_xyt
    for index, (name, style) in enumerate(zip(("x", "y"), STYLES, strict=False)):
        position.plot(recording.time, 1e3 * error[:, index], style, color=COLORS[index], label=name)
    position.set_ylabel("position error [mm]")
    position.legend()
    yaw.plot(recording.time, np.degrees(error[:, 2]), color=COLORS[2])
    yaw.set_ylabel("yaw error [deg]")
    yaw.set_xlabel("time [s]")
    return _svg(figure)


def wheel_speeds(recording: Recording) -> str:
    """Commanded and measured wheel speeds over time."""
    figure, (axes,) = _figure(1)
    command, speed = recording.wheels("command"), recording.wheels("speed")
    for index, (name, color) in enumerate(zip(recording.wheel_names, cycle(COLORS), strict=False)):
        axes.plot(recording.time, speed[:, index], color=color, label=name)
        axes.plot(recording.time, command[:, index], "--", color=color, linewidth=1)
    axes.set_ylabel("wheel speed [rad/s] (dashed: command)")
    axes.set_xlabel("time [s]")
    axes.legend()
    return _svg(figure)


def wheel_slip(recording: Recording) -> str:
    """Slip speed of each wheel over time."""
    figure, (axes,) = _figure(1)
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))
    slip = np.where(recording.wheels("depth") >= 0, slip, np.nan)
    for index, (name, color) in enumerate(zip(recording.wheel_names, cycle(COLORS), strict=False)):
        axes.plot(recording.time, 1e3 * slip[:, index], color=color, label=name, linewidth=0.8)
    axes.set_ylabel("slip over the ground [mm/s]")
    axes.set_xlabel("time [s]")
    axes.legend()
    return _svg(figure)


def _figure(rows: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(7.0, 2.6 * rows + 1.2), layout="constrained")
    axes = [figure.add_subplot(rows, 1, row + 1) for row in range(rows)]
    for each in axes:
        each.grid(visible=True, color="0.9")
        each.set_axisbelow(True)
    return figure, axes


def _widen(axes: Axes, recording: Recording) -> None:
    """Shows at least a tenth of the path's length, or a millimetre, across: numerical noise shall look like none."""
    both = np.vstack([recording.reference_q_xyt[:, :2], recording.q_xyt[:, :2]])
    low, high = both.min(axis=0), both.max(axis=0)
    span = max(0.1 * float(np.max(high - low)), 1e-3)
    center, half = 0.5 * (low + high), 0.55 * np.maximum(high - low, span)
    axes.set_xlim(center[0] - half[0], center[0] + half[0])
    axes.set_ylim(center[1] - half[1], center[1] + half[1])


def _svg(figure: Figure) -> str:
    stream = io.StringIO()
    # A fixed salt and no date: the same run gives the same file.
    with mpl.rc_context({"svg.hashsalt": "rollerbench", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    return stream.getvalue()
