"""Figures of runs: of each run alone, and of several with the same scales."""

from collections.abc import Mapping, Sequence
from itertools import chain, islice

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rollerbench import analysis, palette
from rollerbench.palette import css
from rollerbench.recording import Recording
from rollerbench.report.legs_drawn import leg_figures
from rollerbench.report.panels import Look, at_least, looks, new_panels, panels_text, plot, plot_path, run_looks

Drawn = tuple[Figure, list[Axes]]
"""A figure and its panels."""

REFERENCE = Look(color=css(palette.REFERENCE), style="--")

ODOMETRY = Look(color="#009E73", style=":")

NOTHING = 1e-3
"""Errors that are smaller are drawn as none [mm, deg]."""

SHORTEST = 1e-3
"""Paths are drawn as if they were at least that long each way [m]."""

FEW = 4
"""Up to so many wheels share a panel."""

LONG = 22
"""Letters that are too many for the title of a panel of half a figure's width."""

REACH = 0.4
"""Scales reach to limits where torques come up to this share of them; else that would flatten the curves."""


def run_figures(recording: Recording) -> dict[str, str]:
    """SVG texts of a run's figures by name."""
    return {name: panels_text(*drawn) for name, drawn in drawn_run(recording).items()}


def alike_figures(recordings: Sequence[Recording]) -> list[dict[str, str]]:
    """SVG texts of the figures of several runs, those of one name with the same scales."""
    return [{name: panels_text(*drawn) for name, drawn in run.items()} for run in drawn_alike(recordings)]


def drawn_alike(recordings: Sequence[Recording]) -> list[dict[str, Drawn]]:
    """The figures of several runs by name, those of one name with the same scales."""
    runs = [drawn_run(recording) for recording in recordings]
    for name in dict.fromkeys(name for run in runs for name in run):
        _same_scales([run[name][1] for run in runs if name in run])
    return runs


def drawn_run(recording: Recording) -> dict[str, Drawn]:
    """The figures of a run by name."""
    shared = {"trajectory": trajectory({"": recording}), "pose_error": pose_error({"": recording})}
    if "legs" in recording.metadata:
        return {**shared, **leg_figures(recording)}
    return {
        **shared,
        "wheel_speeds": wheel_speeds(recording),
        "wheel_efforts": wheel_efforts(recording),
        "wheel_slip": wheel_slip(recording),
        "error_budget": error_budget(recording),
    }


def trajectory(recordings: Mapping[str, Recording]) -> Drawn:
    """Paths in the plane: the reference, and what was simulated; of a single run also its odometry.

    Args:
        recordings: By what the legend shall call them; a single one needs no name.
    """
    figure, (axes,) = new_panels(["y [m]"], "x [m]", height=3.1)
    curves = 3 * len(recordings)
    paths = [recording.reference_q_xyt[:, :2] for recording in recordings.values()]
    same = all(path.shape == paths[0].shape and np.allclose(path, paths[0], atol=1e-9) for path in paths)
    for (name, recording), look in zip(recordings.items(), run_looks(), strict=False):
        if not same:
            own = Look(color=look.color, style=":")
            plot_path(axes, recording.reference_q_xyt[:, :2], own, f"{name}: reference", curves=curves, width=1.0)
        plot_path(axes, recording.q_xyt[:, :2], look, name or "simulated", curves=curves)
    if same:
        plot_path(axes, paths[0], REFERENCE, "reference", curves=curves, width=1.0)
    if len(recordings) == 1:
        plot_path(axes, recording.odometry_q_xyt[:, :2], ODOMETRY, "odometry", curves=curves)
    axes.update_datalim(recording.q_xyt[0, :2] + [[-SHORTEST, -SHORTEST], [SHORTEST, SHORTEST]])
    axes.set_aspect("equal", adjustable="datalim")
    return figure, [axes]


def pose_error(recordings: Mapping[str, Recording]) -> Drawn:
    """How far the pose is from the reference over time; of a single run also how far odometry believes it to be.

    Args:
        recordings: By what the legend shall call them; a single one needs no name.
    """
    figure, panels = new_panels(["error in x [mm]", "error in y [mm]", "error in yaw [deg]"], "time [s]", height=1.2)
    lines = [(name or "simulated", recording, recording.q_xyt) for name, recording in recordings.items()]
    if len(recordings) == 1:
        lines += [("odometry", recording, recording.odometry_q_xyt) for recording in recordings.values()]
    shown = chain(islice(run_looks(), len(recordings)), [ODOMETRY])
    for (name, recording, poses), look in zip(lines, shown, strict=False):
        error = (poses - recording.reference_q_xyt) * [1e3, 1e3, np.degrees(1.0)]
        for axes, values in zip(panels, error.T, strict=True):
            plot(axes, recording.time, values, look, name, curves=3 * len(lines))
    for axes in panels:
        at_least(axes, 2 * NOTHING)
    return figure, panels


def wheel_speeds(recording: Recording) -> Drawn:
    """Commanded and measured speed of each wheel, a panel each; of free wheels their own speed."""
    names = recording.wheel_names
    command, measured, speed = (recording.wheels(column) for column in ("command", "measured", "speed"))
    labels = [_of_wheel(name, "speed", "rad/s") for name in names]
    figure, panels = new_panels(labels, "time [s]", columns=2, height=1.0, alike=True)
    of_motor, of_free = islice(looks(), 2)
    for index, axes in enumerate(panels):
        driven = bool(np.isfinite(command[:, index]).any())
        values, look, label = (measured, of_motor, "measured") if driven else (speed, of_free, "wheel without motor")
        plot(axes, recording.time, values[:, index], look, label, curves=2 * len(names), width=1.8)
        if driven:
            plot(axes, recording.time, command[:, index], REFERENCE, "commanded", curves=2 * len(names), width=1.0)
    at_least(panels[0], 1e-2)
    return figure, panels


def wheel_efforts(recording: Recording) -> Drawn:
    """Torques of the driven wheels' motors, with their limits where they have any."""
    efforts = recording.wheels("effort")
    driven = np.flatnonzero(np.isfinite(efforts).any(axis=0))
    described = {wheel["name"]: wheel for wheel in recording.metadata.get("robot_description", {}).get("wheels", ())}
    limits = {name: wheel["max_effort"] for name, wheel in described.items() if wheel.get("max_effort")}
    figure, panels = _of_wheels(recording, "torque", "N m", efforts, driven)
    largest = float(np.nanmax(np.abs(efforts))) if driven.size else 0.0
    names = [recording.wheel_names[index] for index in driven]
    for axes, own in zip(panels, [names] if len(panels) == 1 else [[name] for name in names], strict=True):
        for limit in sorted({limits[name] for name in own if name in limits}):
            seen = axes.get_ylim()
            for sign, label in ((1, f"limit {limit:g} N m"), (-1, "_")):
                axes.axhline(sign * limit, color="0.3", linestyle="--", linewidth=1.0, label=label)
            if largest < REACH * limit:
                axes.set_ylim(seen)
    at_least(panels[0], 1e-3)
    return figure, panels


def wheel_slip(recording: Recording) -> Drawn:
    """Slip speed of each wheel over time."""
    slip = 1e3 * np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))
    slip = np.where(recording.wheels("depth") >= 0, slip, np.nan)
    figure, panels = _of_wheels(recording, "slip", "mm/s", slip, np.arange(slip.shape[1]))
    at_least(panels[0], NOTHING)
    return figure, panels


def error_budget(recording: Recording) -> Drawn:
    """Parts of the pose error over time."""
    budget = analysis.error_budget(recording)
    labels = ("parts of the error in x [mm]", "in y [mm]", "in yaw [deg]")
    figure, panels = new_panels(labels, "time [s]", height=1.3)
    curves = 3 * (len(budget.parts) + 1)
    for index, (axes, scale) in enumerate(zip(panels, (1e3, 1e3, np.degrees(1.0)), strict=True)):
        for (name, part), look in zip(budget.parts.items(), looks(), strict=False):
            plot(axes, recording.time, scale * part[:, index], look, name.replace("_", " "), curves=curves)
        total = scale * budget.total[:, index]
        plot(axes, recording.time, total, Look(color="0.2", style="-"), "pose error", curves=curves, width=0.8)
        at_least(axes, 2 * NOTHING)
    return figure, panels


def _of_wheels(
    recording: Recording, what: str, unit: str, values: NDArray[np.float64], chosen: NDArray[np.intp]
) -> Drawn:
    """A quantity (n, n_wheels) of the chosen wheels: in one panel if they are few, else each in its own."""
    names = [recording.wheel_names[index] for index in chosen]
    curves = len(names)
    if len(names) <= FEW:
        figure, panels = new_panels([f"{what} [{unit}]"], "time [s]")
        for name, index, look in zip(names, chosen, looks(), strict=False):
            plot(panels[0], recording.time, values[:, index], look, name, curves=curves, width=1.1)
        return figure, panels
    labels = [_of_wheel(name, what, unit) for name in names]
    figure, panels = new_panels(labels, "time [s]", columns=2, height=1.0, alike=True)
    for axes, index in zip(panels, chosen, strict=True):
        plot(axes, recording.time, values[:, index], next(looks()), curves=curves, width=1.1)
    return figure, panels


def _of_wheel(name: str, what: str, unit: str) -> str:
    """Title of a wheel's panel, without the quantity where it would be too long."""
    return f"{name}, {what} [{unit}]" if len(name) + len(what) < LONG else f"{name} [{unit}]"


def _same_scales(runs: Sequence[Sequence[Axes]]) -> None:
    """Gives panels of several figures the same limits: one by one, or all, where they are not as many wheels."""
    pairs: list[Sequence[Axes]] = list(zip(*runs, strict=True)) if len({*map(len, runs)}) == 1 else [[*chain(*runs)]]
    for panels in pairs:
        if panels[0].get_aspect() != "auto":
            for axes in panels:
                axes.update_datalim(np.concatenate([other.dataLim.get_points() for other in panels]))
                axes.autoscale_view()
            continue
        for name in ("xlim", "ylim"):
            limits = np.array([getattr(axes, f"get_{name}")() for axes in panels])
            for axes in panels:
                getattr(axes, f"set_{name}")(limits[:, 0].min(), limits[:, 1].max())
