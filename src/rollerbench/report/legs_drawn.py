"""Figures of a run of a robot on legs as SVG."""

from itertools import cycle

import numpy as np
from matplotlib.axes import Axes

from rollerbench.recording import Recording
from rollerbench.report.drawing import COLORS, STYLES, new_figure, svg_text


def leg_figures(recording: Recording) -> dict[str, str]:
    """SVG texts of the figures that only robots on legs have, by name."""
    return {
        "body": body(recording),
        "gait": gait(recording),
        "feet": feet(recording),
        "joint_efforts": joint_efforts(recording),
    }


def body(recording: Recording) -> str:
    """Height and inclination of the body over time, as they are and as they should be."""
    figure, (height, tilt) = new_figure(2)
    columns, time = recording.columns, recording.time
    height.plot(time, 1e3 * columns["z"], color=COLORS[0], label="simulated")
    height.plot(time, 1e3 * columns["desired_z"], "--", color="0.2", linewidth=1, label="desired")
    height.set_ylabel("height [mm]")
    for (name, color), style in zip((("roll", COLORS[1]), ("pitch", COLORS[2])), STYLES, strict=False):
        tilt.plot(time, np.degrees(columns[name]), style, color=color, label=name)
        tilt.plot(time, np.degrees(columns[f"desired_{name}"]), "--", color="0.2", linewidth=0.8)
    tilt.set_ylabel("inclination [deg] (dashed: desired)")
    tilt.set_xlabel("time [s]")
    for axes in (height, tilt):
        axes.legend()
    _no_noise(height, 1.0)
    _no_noise(tilt, 0.1)
    return svg_text(figure)


def gait(recording: Recording) -> str:
    """Bars of the times in which each foot stands; below, what the feet bear."""
    figure, (bars, loads) = new_figure(2)
    legs, time = recording.metadata["legs"], recording.time
    for row, (leg, color) in enumerate(zip(legs, cycle(COLORS), strict=False)):
        stands = recording.columns[f"{leg}.stance"] > 0
        bars.fill_between(time, row - 0.4, row + 0.4, where=list(stands), color=color, linewidth=0)
        loads.plot(time, recording.columns[f"{leg}.load"], color=color, linewidth=0.8, label=leg)
    bars.set_yticks(range(len(legs)), legs)
    bars.invert_yaxis()
    bars.set_xlim(time[0], time[-1] if len(time) > 1 else time[0] + 1)
    loads.set_xlim(bars.get_xlim())
    loads.set_ylabel("load [N]")
    loads.set_xlabel("time [s]")
    loads.legend(ncols=2)
    return svg_text(figure)


def feet(recording: Recording) -> str:
    """Heights of the feet, and how fast those on the ground slide."""
    figure, (height, slip) = new_figure(2)
    columns, time = recording.columns, recording.time
    for leg, color in zip(recording.metadata["legs"], cycle(COLORS), strict=False):
        height.plot(time, 1e3 * columns[f"{leg}.foot_z"], color=color, linewidth=1, label=leg)
        speed = 1e3 * np.hypot(columns[f"{leg}.slip_x"], columns[f"{leg}.slip_y"])
        slip.plot(time, np.where(columns[f"{leg}.stance"] > 0.5, speed, np.nan), color=color, linewidth=0.8)
    height.set_ylabel("foot height [mm]")
    height.legend(ncols=2)
    slip.set_ylabel("slip in stance [mm/s]")
    slip.set_xlabel("time [s]")
    _no_noise(height, 1.0)
    return svg_text(figure)


def joint_efforts(recording: Recording) -> str:
    """The largest torque of each joint over all legs, joint by joint."""
    figure, (axes,) = new_figure(1)
    columns = recording.columns
    numbers = sorted({name.rpartition("_")[2] for name in columns if ".effort_" in name}, key=int)
    for number, color, style in zip(numbers, cycle(COLORS), cycle(STYLES), strict=False):
        efforts = [np.abs(values) for name, values in columns.items() if name.endswith(f".effort_{number}")]
        axes.plot(recording.time, np.max(efforts, axis=0), style, color=color, linewidth=1, label=f"joint {number}")
    axes.set_ylabel("largest torque of all legs [N m]")
    axes.set_xlabel("time [s]")
    axes.legend()
    return svg_text(figure)


def _no_noise(axes: Axes, span: float) -> None:
    """Shows at least a span of values: numerical noise shall look like none."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * span, middle + 0.5 * span)
