"""Figures of a run as SVG."""

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes

from rollerbench import analysis
from rollerbench.recording import Recording
from rollerbench.report.drawing import COLORS, STYLES, new_figure, svg_text
from rollerbench.report.legs_drawn import leg_figures

NOTHING = 1e-3
"""Errors that are smaller are drawn as none [mm, deg]."""


def run_figures(recording: Recording) -> dict[str, str]:
    """SVG texts of a run's figures by name."""
    if "legs" in recording.metadata:
        return {"trajectory": trajectory(recording), "pose_error": pose_error(recording), **leg_figures(recording)}
    return {
        "trajectory": trajectory(recording),
        "pose_error": pose_error(recording),
        "wheel_speeds": wheel_speeds(recording),
        "wheel_slip": wheel_slip(recording),
        "error_budget": error_budget(recording),
    }


def trajectory(recording: Recording) -> str:
    """Reference, simulated and odometry path in the plane."""
    figure, (axes,) = new_figure(1)
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
    return svg_text(figure)


def pose_error(recording: Recording) -> str:
    """Position and yaw error over time."""
    figure, (position, yaw) = new_figure(2)
    error = recording.q_xyt - recording.reference_q_xyt
    for index, (name, style) in enumerate(zip(("x", "y"), STYLES, strict=False)):
        position.plot(recording.time, 1e3 * error[:, index], style, color=COLORS[index], label=name)
    position.set_ylabel("position error [mm]")
    position.legend()
    yaw.plot(recording.time, np.degrees(error[:, 2]), color=COLORS[2])
    yaw.set_ylabel("yaw error [deg]")
    yaw.set_xlabel("time [s]")
    return svg_text(figure)


def wheel_speeds(recording: Recording) -> str:
    """Commanded and measured wheel speeds over time."""
    figure, (axes,) = new_figure(1)
    command, speed = recording.wheels("command"), recording.wheels("speed")
    for index, (name, color) in enumerate(zip(recording.wheel_names, cycle(COLORS), strict=False)):
        axes.plot(recording.time, speed[:, index], color=color, label=name)
        axes.plot(recording.time, command[:, index], "--", color=color, linewidth=1)
    axes.set_ylabel("wheel speed [rad/s] (dashed: command)")
    axes.set_xlabel("time [s]")
    axes.legend()
    return svg_text(figure)


def wheel_slip(recording: Recording) -> str:
    """Slip speed of each wheel over time."""
    figure, (axes,) = new_figure(1)
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))
    slip = np.where(recording.wheels("depth") >= 0, slip, np.nan)
    for index, (name, color) in enumerate(zip(recording.wheel_names, cycle(COLORS), strict=False)):
        axes.plot(recording.time, 1e3 * slip[:, index], color=color, label=name, linewidth=0.8)
    axes.set_ylabel("slip over the ground [mm/s]")
    axes.set_xlabel("time [s]")
    axes.legend()
    return svg_text(figure)


def error_budget(recording: Recording) -> str:
    """Parts of the pose error over time."""
    budget = analysis.error_budget(recording)
    figure, rows = new_figure(3)
    labels = ("x [mm]", "y [mm]", "yaw [deg]")
    for index, (axes, label, scale) in enumerate(zip(rows, labels, (1e3, 1e3, np.degrees(1.0)), strict=True)):
        for (name, part), color, style in zip(budget.parts.items(), cycle(COLORS), cycle(STYLES), strict=False):
            axes.plot(recording.time, scale * part[:, index], style, color=color, label=name, linewidth=1.3)
        axes.plot(recording.time, scale * budget.total[:, index], color="0.2", label="pose error", linewidth=0.8)
        axes.set_ylabel(label)
        if np.ptp(scale * budget.total[:, index]) < NOTHING:
            # Rounding errors shall look like none.
            axes.set_ylim(-NOTHING, NOTHING)
    rows[0].legend()
    rows[-1].set_xlabel("time [s]")
    return svg_text(figure)


def _widen(axes: Axes, recording: Recording) -> None:
    """Shows at least a tenth of the path's length, or a millimetre, across: numerical noise shall look like none."""
    both = np.vstack([recording.reference_q_xyt[:, :2], recording.q_xyt[:, :2]])
    low, high = both.min(axis=0), both.max(axis=0)
    span = max(0.1 * float(np.max(high - low)), 1e-3)
    center, half = 0.5 * (low + high), 0.55 * np.maximum(high - low, span)
    axes.set_xlim(center[0] - half[0], center[0] + half[0])
    axes.set_ylim(center[1] - half[1], center[1] + half[1])
