"""Figures of a run of a robot on legs ."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rollerbench.palette import REFERENCE, css
from rollerbench.recording import Recording
from rollerbench.report.panels import Look, at_least, looks, new_panels, plot, run_looks

DESIRED = Look(color=css(REFERENCE), style="--")


def leg_figures(recording: Recording) -> dict[str, tuple[Figure, list[Axes]]]:
    """The figures that only robots on legs have, and their panels, by name."""
    return {
        "body": body(recording),
        "gait": gait(recording),
        "feet": feet(recording),
        "joint_efforts": joint_efforts(recording),
    }


def body(recording: Recording) -> tuple[Figure, list[Axes]]:
    """Height and inclination of the body over time, as they are and as they should be."""
    labels = ("height of the body [mm]", "roll [deg]", "pitch [deg]")
    figure, panels = new_panels(labels, "time [s]", height=1.2)
    simulated = next(run_looks())
    for axes, name, scale, span in zip(panels, ("z", "roll", "pitch"), (1e3, *[np.degrees(1.0)] * 2), (1.0, 0.1, 0.1),
                                       strict=True):  # fmt: skip
        plot(axes, recording.time, scale * recording.columns[name], simulated, "simulated", curves=6)
        desired = scale * recording.columns[f"desired_{name}"]
        plot(axes, recording.time, desired, DESIRED, "desired", curves=6, width=1.0)
        at_least(axes, span)
    return figure, panels


def gait(recording: Recording) -> tuple[Figure, list[Axes]]:
    """Bars of the times in which each foot stands, and what the feet bear."""
    legs, time = recording.metadata["legs"], recording.time
    figure, panels = new_panels(["foot that stands [-]", "load [N]"], "time [s]", height=1.5)
    bars, loads = panels
    for row, (leg, look) in enumerate(zip(legs, looks(), strict=False)):
        stands = np.concatenate([[0.0], recording.columns[f"{leg}.stance"] > 0, [0.0]])
        starts, ends = np.flatnonzero(np.diff(stands) > 0), np.flatnonzero(np.diff(stands) < 0) - 1
        spans = list(zip(time[starts], time[ends] - time[starts], strict=True))
        bars.broken_barh(spans, (row - 0.4, 0.8), color=look.color, linewidth=0)
        plot(loads, time, recording.columns[f"{leg}.load"], look, leg, curves=len(legs), width=0.8)
    bars.set_yticks(range(len(legs)), legs)
    bars.set_ylim(len(legs) - 0.5, -0.5)
    return figure, panels


def feet(recording: Recording) -> tuple[Figure, list[Axes]]:
    """Heights of the feet, and how fast those on the ground slide."""
    figure, panels = new_panels(["height of the foot [mm]", "slip while it stands [mm/s]"], "time [s]", height=1.5)
    columns, legs = recording.columns, recording.metadata["legs"]
    for leg, look in zip(legs, looks(), strict=False):
        speed = 1e3 * np.hypot(columns[f"{leg}.slip_x"], columns[f"{leg}.slip_y"])
        slip = np.where(columns[f"{leg}.stance"] > 0.5, speed, np.nan)
        plot(panels[0], recording.time, 1e3 * columns[f"{leg}.foot_z"], look, leg, curves=2 * len(legs), width=1.0)
        plot(panels[1], recording.time, slip, look, curves=2 * len(legs), width=0.8)
    at_least(panels[0], 1.0)
    at_least(panels[1], 1e-2)
    return figure, panels


def joint_efforts(recording: Recording) -> tuple[Figure, list[Axes]]:
    """The largest torque of each joint and of the wheels over all legs."""
    figure, panels = new_panels(["largest torque of all legs [N m]"], "time [s]")
    columns = recording.columns
    numbers = sorted({name.rpartition("_")[2] for name in columns if ".effort_" in name}, key=int)
    parts = {f"joint {number}": f".effort_{number}" for number in numbers} | {"wheel": ".wheel_effort"}
    for (label, ending), look in zip(parts.items(), looks(), strict=False):
        efforts = [np.abs(values) for name, values in columns.items() if name.endswith(ending)]
        plot(panels[0], recording.time, np.max(efforts, axis=0), look, label, curves=len(parts), width=1.0)
    at_least(panels[0], 1e-3)
    return figure, panels
