"""What all figures share: colours, axes, curves, SVG text."""

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import cast

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
"""Distinguishable with colour-blindness: Okabe and Ito (2008)."""

FONTS = "'DejaVu Sans', Verdana, sans-serif"
"""Fonts of about the widths with which figures are laid out; others are narrower."""

STYLES = ("-", "--", "-.", ":")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve:
    """A line of a figure.

    Attributes:
        label: Its name in the legend; empty for none.
        x: Abscissae (n,).
        y: Ordinates (n,).
        style: Matplotlib's format, such as "--" or "o".
        color: Its colour; by default the next one.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: str = "-"
    color: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpaceCurve:
    """A line in space.

    Attributes:
        label: Its name in the legend; empty for none.
        points: Points (n, 3).
        color: Its colour.
        style: Matplotlib's format, such as "--" or "o".
        width: Width of the line.
    """

    label: str
    points: NDArray[np.float64]
    color: str
    style: str = "-"
    width: float = 1.5


def curves(
    xlabel: str, panels: Mapping[str, Sequence[Curve]], *, equal: bool = False, logarithmic: bool = False
) -> str:
    """SVG text of panels one below the other, by the label of their ordinate.

    Args:
        xlabel: Label of the abscissa.
        panels: Curves of each panel.
        equal: Whether both axes have one scale, as a map has.
        logarithmic: Whether the ordinates are.
    """
    figure, rows = new_figure(len(panels))
    for axes, (ylabel, lines) in zip(rows, panels.items(), strict=True):
        for line, color in zip(lines, cycle(COLORS), strict=False):
            axes.plot(
                line.x, line.y, line.style, color=line.color or color, label=line.label, markersize=4, linewidth=1.3
            )
        axes.set_ylabel(ylabel)
        if len(lines) > 1:
            axes.legend()
        if equal:
            axes.set_aspect("equal", adjustable="datalim")
        elif logarithmic:
            axes.set_yscale("log")
        elif np.ptp(np.concatenate([line.y for line in lines])) < 1e-9:
            # A constant is drawn as one, not as the noise of its last digits.
            axes.set_ylim(float(lines[0].y[0]) - 1.0, float(lines[0].y[0]) + 1.0)
    rows[-1].set_xlabel(xlabel)
    return svg_text(figure)


def new_figure(rows: int) -> tuple[Figure, list[Axes]]:
    """A figure with panels one below the other, on a light grid."""
    figure = Figure(figsize=(7.0, 2.6 * rows + 1.2), layout="constrained")
    axes = [figure.add_subplot(rows, 1, row + 1) for row in range(rows)]
    for each in axes:
        each.grid(visible=True, color="0.9")
        each.set_axisbelow(True)
    return figure, axes


def new_polar_figure() -> tuple[Figure, PolarAxes]:
    """A figure over directions of travel: forward is up, left is left."""
    figure = Figure(figsize=(7.0, 5.6), layout="constrained")
    axes = cast(PolarAxes, figure.add_subplot(projection="polar"))
    axes.set_theta_zero_location("N")
    axes.set_thetagrids(range(0, 360, 30))
    axes.set_rlabel_position(75)
    axes.grid(visible=True, color="0.88")
    axes.set_axisbelow(True)
    return figure, axes


def surface(
    labels: tuple[str, str, str], x: NDArray[np.float64], y: NDArray[np.float64], z: NDArray[np.float64]
) -> str:
    """SVG text of a surface z (n, m) over x (n,) and y (m,); parts without a value are left out.

    Args:
        labels: Labels of the three axes.
        x: First abscissae (n,).
        y: Second abscissae (m,).
        z: Heights (n, m).
    """
    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    axes = cast(Axes3D, figure.add_subplot(projection="3d"))
    grid = np.meshgrid(x, y, indexing="ij")
    known = z[np.isfinite(z)]
    axes.plot_surface(
        *grid, z, cmap="viridis", vmin=known.min(), vmax=known.max(), rcount=60, ccount=40, linewidth=0.1,
        edgecolor="white",
    )  # fmt: skip
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    axes.set_zlabel(labels[2])
    axes.view_init(elev=28.0, azim=-125.0)
    axes.set_box_aspect(None, zoom=0.88)
    return svg_text(figure)


def space(
    labels: tuple[str, str, str], lines: Sequence[SpaceCurve], *, elevation: float = 24.0, azimuth: float = -60.0
) -> str:
    """SVG text of lines in space, all three axes on one scale.

    Args:
        labels: Labels of the three axes.
        lines: The lines.
        elevation: Of the eye over the x-y plane [deg].
        azimuth: Direction of the eye about z from x [deg].
    """
    figure = Figure(figsize=(7.0, 5.8))
    axes = cast(Axes3D, figure.add_axes((0.0, 0.13, 1.0, 0.87), projection="3d"))
    for line in lines:
        axes.plot(*line.points.T, line.style, color=line.color, label=line.label, linewidth=line.width, markersize=4)
    axes.set_xlabel(labels[0], labelpad=8.0)
    axes.set_ylabel(labels[1], labelpad=8.0)
    axes.set_zlabel(labels[2], labelpad=6.0)
    axes.locator_params(nbins=5)
    axes.view_init(elev=elevation, azim=azimuth)
    points = np.concatenate([line.points for line in lines])
    middle, extent = 0.5 * (points.max(axis=0) + points.min(axis=0)), 1.05 * np.ptp(points, axis=0)
    extent = np.maximum(extent, 0.3 * extent.max())
    for name, center, size in zip("xyz", middle, extent, strict=True):
        getattr(axes, f"set_{name}lim")(center - 0.5 * size, center + 0.5 * size)
    axes.set_box_aspect(tuple(extent), zoom=1.05)
    figure.legend(loc="lower center", ncols=4)
    return svg_text(figure)


def gait_diagram(
    time: NDArray[np.float64],
    heights: Mapping[str, NDArray[np.float64]],
    on_ground: Mapping[str, NDArray[np.bool_]],
) -> str:
    """SVG text of a gait: for each foot its height, and a bar while it is on the ground.

    Args:
        time: Times (n,) [s].
        heights: Height (n,) of each foot [mm].
        on_ground: Whether each foot is on the ground (n,).
    """
    figure = Figure(figsize=(7.0, 0.75 * len(heights) + 0.9), layout="constrained")
    rows = figure.subplots(len(heights), 1, sharex=True, sharey=True)
    highest = max(float(height.max()) for height in heights.values())
    for axes, (name, height) in zip(rows, heights.items(), strict=True):
        axes.fill_between(time, -0.35 * highest, -0.08 * highest, where=on_ground[name], color=COLORS[0], linewidth=0)
        axes.plot(time, height, color=COLORS[1], linewidth=1.3)
        axes.set_ylabel(name.replace("_", " "), rotation=0, ha="right", va="center")
        axes.set_ylim(-0.42 * highest, 1.15 * highest)
        axes.set_xlim(time[0], time[-1])
        axes.grid(visible=True, color="0.9")
        axes.set_axisbelow(True)
    rows[-1].set_xlabel("time [s]")
    figure.supylabel("height of the foot [mm]", fontsize="medium")
    return svg_text(figure)


def svg_text(figure: Figure) -> str:
    """The figure as SVG, the same text for the same figure."""
    stream = io.StringIO()
    FigureCanvasSVG(figure)
    layout = figure.get_layout_engine()
    if layout is not None:
        # Laid out once: left to savefig, the figure would be laid out and drawn twice.
        layout.execute(figure)
        figure.set_layout_engine(None)
    # A fixed salt and no date: the same run gives the same file. Letters stay text, which can be searched and is small.
    with mpl.rc_context({"svg.hashsalt": "rollerbench", "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = re.sub(r"'DejaVu Sans'(, [^;\"]+)?", FONTS, stream.getvalue())
    # A hundredth of a point is finer than any screen.
    return re.sub(r' d="[^"]+"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)
