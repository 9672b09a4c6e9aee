"""Figures of what a base can do in each direction."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from rollerbench.analysis.limits import Capability
from rollerbench.kinematics import limits
from rollerbench.kinematics.limits import Limit
from rollerbench.report.drawing import COLORS, STYLES, new_figure, new_polar_figure, svg_text

Array = NDArray[np.float64]

CAUSE_COLORS = {"speed": COLORS[0], "adhesion": COLORS[1], "effort": COLORS[2], "lift-off": COLORS[3]}

VARIANT_LABELS = {
    "best": "best sharing, friction circle",
    "least_norm": "efforts of least norm, friction circle",
    "independent": "best sharing, adhesion along and across apart",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Points:
    """Measured values to lay over the curves of theory.

    Attributes:
        directions: Directions (n,) [rad].
        values: Values (n,), or for efforts (n, n_driven), in the curves' unit.
    """

    directions: Array
    values: Array


Measured = Mapping[str, Points]
"""Points by figure: "speed" [m/s], "acceleration" [m/s2], "efforts" [N m] at the reference acceleration."""


def limit_figures(found: Capability, measured: Measured | None = None) -> dict[str, str]:
    """SVG texts by name; those for which theory has nothing to show are left out."""
    points = measured or {}
    figures = {}
    if found.speed.feasible.any():
        figures["speed"] = speed(found, points.get("speed"))
        figures["speed_and_yaw"] = speed_and_yaw(found)
    if found.accelerations["best"].feasible.any():
        figures["acceleration"] = acceleration(found, points.get("acceleration"))
    if not found.few and any(limit.feasible.any() for limit in (found.speed, found.accelerations["best"])):
        figures["limiting_wheels"] = limiting_wheels(found)
    if np.isfinite(found.efforts).any() and len(found.map_accelerations) > 1:
        figures["efforts"] = efforts(found, points.get("efforts"))
        if not found.few:
            figures["effort_map"] = effort_map(found)
    return figures


def speed(found: Capability, points: Points | None = None) -> str:
    """Largest speed over the direction, at some yaw rates."""
    figure, axes = new_polar_figure()
    for row, yaw_rate in enumerate(found.yaw_rates):
        label = f"turning at {yaw_rate:.3g} rad/s" if row else "without turning"
        _rays_or_curve(axes, found, found.speeds.value[row], row, label)
    _lay_over(axes, points)
    return _finish_polar(figure, axes, "largest speed [m/s]")


def acceleration(found: Capability, points: Points | None = None) -> str:
    """Largest acceleration over the direction, for ways to share the push."""
    figure, axes = new_polar_figure()
    for row, (name, limit) in enumerate(found.accelerations.items()):
        _rays_or_curve(axes, found, limit.value, row, VARIANT_LABELS[name])
    _lay_over(axes, points)
    return _finish_polar(figure, axes, "largest acceleration [m/s²]")


def speed_and_yaw(found: Capability) -> str:
    """Largest speed over the yaw rate, in some directions."""
    figure, (axes,) = new_figure(1)
    directions = np.radians([0.0, 45.0, 90.0])
    if not found.all_round:
        # Forward and backward are alike.
        directions = found.directions[found.goes & (found.directions < np.pi - 1e-9)]
    yaw_rates = found.max_yaw_rate * np.linspace(-1.0, 1.0, 201) if np.isfinite(found.max_yaw_rate) else np.zeros(1)
    for direction, color, style in zip(directions, COLORS, cycle(STYLES), strict=False):
        limit = limits.max_speed(found.robot, direction, yaw_rate=yaw_rates)
        axes.plot(yaw_rates, limit.value, style, color=color, label=f"at {np.degrees(direction):.3g} deg")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("yaw rate [rad/s]")
    axes.set_ylabel("largest speed [m/s]")
    axes.legend()
    return svg_text(figure)


def limiting_wheels(found: Capability) -> str:
    """Which wheel is at its limit in which direction, and why."""
    wheels = found.robot.wheel_names
    shown = [("speed", found.speed), ("acceleration", found.accelerations["best"])]
    shown = [(label, limit) for label, limit in shown if limit.feasible.any()]
    figure = Figure(figsize=(7.0, (0.32 * len(wheels) + 0.75) * len(shown) + 0.4), layout="constrained")
    for panel, (label, limit) in enumerate(shown, start=1):
        axes = figure.add_subplot(len(shown), 1, panel)
        _bands(axes, found, limit)
        axes.set_yticks(range(len(wheels)), wheels)
        axes.set_ylim(len(wheels) - 0.5, -0.5)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(range(0, 361, 30))
        axes.set_title(label, loc="left", fontsize="medium")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.set_xlabel("direction of travel [deg]")
    return svg_text(figure)


def efforts(found: Capability, points: Points | None = None) -> str:
    """Efforts over the direction at one acceleration, or over the acceleration where there are few directions."""
    if found.few:
        return _efforts_of_few(found, points)
    figure, axes = new_polar_figure()
    names = [wheel.name for wheel in found.robot.driven_wheels]
    values = np.abs(found.efforts[:, found.reference])
    for index, (name, color, style) in enumerate(zip(names, cycle(COLORS), cycle(STYLES), strict=False)):
        axes.plot(found.directions, values[:, index], style, color=color, label=name, linewidth=1.4)
        if points is not None:
            axes.plot(points.directions, np.abs(points.values[:, index]), "o", color=color, markersize=3.5)
    return _finish_polar(figure, axes, f"|effort| at {found.map_accelerations[found.reference]:.3g} m/s² [N m]")


def effort_map(found: Capability) -> str:
    """Efforts over direction and acceleration, one panel a wheel; hatched beyond the largest acceleration."""
    names = [wheel.name for wheel in found.robot.driven_wheels]
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    figure = Figure(figsize=(7.0, 2.3 * rows + 0.6), layout="constrained")
    degrees = np.degrees(found.directions)
    largest = float(np.nanmax(np.abs(found.efforts))) or 1.0
    top = found.map_accelerations[-1] or 1.0
    bound = found.accelerations["least_norm"].value
    for index, name in enumerate(names):
        axes = figure.add_subplot(rows, columns, index + 1)
        levels = np.linspace(-largest, largest, 21)
        filled = axes.contourf(
            degrees, found.map_accelerations, found.efforts[..., index].T, levels=levels, cmap="RdBu_r"
        )
        axes.fill_between(
            degrees, np.nan_to_num(bound), top, facecolor="none", edgecolor="0.35", hatch="////", linewidth=0.0
        )
        axes.plot(degrees, bound, color="black", linewidth=1.2)
        axes.set_ylim(0.0, top)
        axes.set_xticks(range(0, 361, 90))
        axes.set_title(name, loc="left", fontsize="medium")
        if index % columns == 0:
            axes.set_ylabel("acceleration [m/s²]")
        if index >= len(names) - columns:
            axes.set_xlabel("direction [deg]")
    figure.colorbar(filled, ax=figure.axes, label="effort [N m]", aspect=40)
    return svg_text(figure)


def _efforts_of_few(found: Capability, points: Points | None) -> str:
    """Efforts over the acceleration, a panel for each direction."""
    ways = np.flatnonzero(found.goes & (found.directions < 2 * np.pi - 1e-9))
    figure, rows = new_figure(len(ways))
    for axes, way in zip(rows, ways, strict=True):
        for index, (wheel, color, style) in enumerate(
            zip(found.robot.driven_wheels, cycle(COLORS), cycle(STYLES), strict=False)
        ):
            axes.plot(found.map_accelerations, found.efforts[way, :, index], style, color=color, label=wheel.name)
            if points is not None:
                here = np.abs(points.directions - found.directions[way]) < 1e-6
                reference = np.full(here.sum(), found.map_accelerations[found.reference])
                axes.plot(reference, points.values[here, index], "o", color=color, markersize=4)
        for name, gray in (("best", "0.2"), ("least_norm", "0.6")):
            value = found.accelerations[name].value[way]
            if np.isfinite(value):
                axes.axvline(value, color=gray, linestyle=":", label=f"limit, {VARIANT_LABELS[name].split(',')[0]}")
        axes.set_ylabel(f"effort at {np.degrees(found.directions[way]):.4g} deg [N m]")
    rows[0].legend(fontsize="small")
    rows[-1].set_xlabel("acceleration [m/s²]")
    return svg_text(figure)


def _rays_or_curve(axes: PolarAxes, found: Capability, values: Array, row: int, label: str) -> None:
    """A closed curve, or rays where the base can go in few directions, the later ones thinner."""
    color, style = COLORS[row], STYLES[row]
    if not found.few:
        axes.plot(found.directions, values, style, color=color, label=label, linewidth=1.5)
        return
    for position, index in enumerate(np.flatnonzero(np.isfinite(values) & (found.directions < 2 * np.pi - 1e-9))):
        axes.plot(
            np.full(2, found.directions[index]),
            [0.0, values[index]],
            marker="o",
            markevery=[1],
            markersize=(9, 6, 3)[row],
            color=color,
            label=None if position else label,
            linewidth=(5.0, 3.0, 1.2)[row],
        )


def _lay_over(axes: PolarAxes, points: Points | None) -> None:
    if points is not None:
        axes.plot(points.directions, points.values, "o", color="black", markersize=4, fillstyle="none", label="Drake")


def _finish_polar(figure: Figure, axes: PolarAxes, title: str) -> str:
    axes.set_ylim(0.0, 1.08 * max(float(np.nanmax(line.get_ydata())) for line in axes.lines))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_title(title + "; 0 deg is forward, 90 deg left", fontsize="medium")
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
    return svg_text(figure)


def _bands(axes: Axes, found: Capability, limit: Limit) -> None:
    degrees = np.degrees(found.directions)
    half = 0.5 * np.gradient(degrees)
    for cause, color in CAUSE_COLORS.items():
        here = limit.feasible & (limit.cause == cause)
        for wheel in range(len(found.robot.wheels)):
            edges = np.diff(np.concatenate([[0], (here & limit.at_limit[:, wheel]).astype(int), [0]]))
            first, last = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
            left, right = degrees[first] - half[first], degrees[last] + half[last]
            axes.broken_barh(list(zip(left, right - left, strict=True)), (wheel - 0.35, 0.7), color=color, linewidth=0)
        if here.any():
            axes.plot([], [], "s", color=color, label=cause)
