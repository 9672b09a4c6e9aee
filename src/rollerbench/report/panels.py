"""Panels of the figures of runs: narrow, so that a phone shows them readable, and laid out without any search."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, ScalarFormatter
from numpy.typing import NDArray

from rollerbench.palette import RUNS, css
from rollerbench.report.drawing import COLORS, STYLES, svg_text

Array = NDArray[np.float64]

WIDTH = 4.8
"""Of a figure [inch]: on a phone's 340 pixels its letters of 9 points are 9 pixels high."""

FONT = 9.0
"""Size of letters [point]."""

TITLE, FOOT, GAP, LINE, RIGHT = 0.24, 0.42, 0.12, 0.19, 0.12
"""Heights of a panel's title, of ticks and label below, between rows, of a legend's line; the right margin [inch]."""

STEPS = (1, 2, 2.5, 5, 10)
"""Of numbers at the axes."""

POINTS_OF_CURVE, POINTS_OF_FIGURE = 1500, 6500
"""Most points of a curve, and of all curves of a figure, that are drawn."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """How a line looks: colour and style both tell it from others.

    Attributes:
        color: Its colour.
        style: Matplotlib's format.
    """

    color: str
    style: str


def run_looks() -> Iterator[Look]:
    """Looks of what was simulated, of one run after the other, in the colours that scenes have for them."""
    for index in count():
        yield Look(color=css(RUNS[index % len(RUNS)]), style=STYLES[index % len(STYLES)])


def looks() -> Iterator[Look]:
    """Looks of one line after the other; the palette's yellow is too pale for lines on white."""
    colors = COLORS[:-1]
    for index in count():
        turn, place = divmod(index, len(colors))
        yield Look(color=colors[place], style=STYLES[(place + turn) % len(STYLES)])


def kept(values: Array, most: int = POINTS_OF_CURVE) -> NDArray[np.intp]:
    """Indices, ascending, of the samples that are drawn: first, last, and the extremes of each stretch.

    A stretch without a value keeps a sample without one, so that gaps stay gaps.

    Args:
        values: Values (n,) or (n, k), k of which share their samples.
        most: Most indices that are wanted; if there are fewer samples, all are kept.
    """
    columns = values.reshape(len(values), -1)
    n, k = columns.shape
    if n <= most:
        return np.arange(n)
    missing = np.isnan(columns)
    wanted = 2 * k + bool(missing.any())
    stretches = max(1, (most - 2) // wanted)
    starts = np.linspace(0, n, stretches + 1).astype(int)[:-1]
    length = int(np.diff([*starts, n]).max())
    # Stretches of one length: the shorter ones take the first sample of the next.
    rows = np.minimum(starts[:, np.newaxis] + np.arange(length), n - 1)
    found = [np.array([0, n - 1])]
    for column, gap in zip(columns.T, missing.T, strict=True):
        low, high = np.where(gap, np.inf, column)[rows], np.where(gap, -np.inf, column)[rows]
        found += [starts + low.argmin(axis=1), starts + high.argmax(axis=1)]
    if missing.any():
        gaps = np.isnan(columns.sum(axis=1))[rows]
        found.append((starts + gaps.argmax(axis=1))[gaps.any(axis=1)])
    return np.unique(np.minimum(np.concatenate(found), n - 1))


def plot(axes: Axes, x: Array, y: Array, look: Look, label: str = "", *, curves: int = 1, width: float = 1.3) -> None:
    """Draws a curve over time or along x, thinned; a single sample as a dot.

    Args:
        axes: Where.
        x: Abscissae (n,), ascending.
        y: Ordinates (n,).
        look: Colour and style.
        label: Its name in the legend; empty for none.
        curves: Number of curves of the figure.
        width: Of the line [point].
    """
    chosen = kept(y, min(POINTS_OF_CURVE, POINTS_OF_FIGURE // curves))
    _draw(axes, x[chosen], y[chosen], look, label, width)


def plot_path(axes: Axes, path: Array, look: Look, label: str = "", *, curves: int = 1, width: float = 1.5) -> None:
    """Draws a path (n, 2) in the plane, thinned, with a dot at its end."""
    chosen = kept(path, min(POINTS_OF_CURVE, POINTS_OF_FIGURE // curves))
    _draw(axes, path[chosen, 0], path[chosen, 1], look, label, width)
    axes.plot(*path[-1], "o", color=look.color, markersize=4)


def _draw(axes: Axes, x: Array, y: Array, look: Look, label: str, width: float) -> None:
    marker = "o" if len(x) == 1 else ""
    axes.plot(x, y, look.style, color=look.color, linewidth=width, marker=marker, markersize=4, label=label or "_")


def new_panels(
    ylabels: Sequence[str], xlabel: str, *, columns: int = 1, height: float = 1.5, alike: bool = False
) -> tuple[Figure, list[Axes]]:
    """A figure of panels row by row, all over the same abscissa.

    Args:
        ylabels: What each panel shows, with its unit; stands above it.
        xlabel: What the abscissa is, with its unit.
        columns: Panels in a row.
        height: Of a panel [inch].
        alike: Whether all ordinates have one scale.
    """
    rows = -(-len(ylabels) // columns)
    figure = Figure(figsize=(WIDTH, rows * (TITLE + height + GAP) + FOOT), dpi=72)
    panels: list[Axes] = []
    for index, ylabel in enumerate(ylabels):
        first = panels[0] if panels else None
        axes = figure.add_subplot(rows, columns, index + 1, sharex=first, sharey=first if alike else None)
        axes.grid(visible=True, color="0.9")
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color("0.6")
        lowest = index + columns >= len(ylabels)
        outer = index % columns == 0 or not alike
        axes.tick_params(labelsize=FONT, length=3, color="0.6", labelbottom=lowest, labelleft=outer)
        axes.set_ylabel(ylabel, rotation=0, ha="left", va="bottom", fontsize=FONT)
        if lowest:
            axes.set_xlabel(xlabel, fontsize=FONT)
        if first is None:
            axes.xaxis.set_major_locator(MaxNLocator(6 if columns == 1 else 4, steps=STEPS))
        if first is None or not alike:
            axes.yaxis.set_major_locator(MaxNLocator(4, steps=STEPS))
            axes.yaxis.set_major_formatter(ScalarFormatter(useOffset=False))
        panels.append(axes)
    return figure, panels


def at_least(axes: Axes, span: float) -> None:
    """Shows at least a span of values: numerical noise shall look like none."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * span, middle + 0.5 * span)


def panels_text(figure: Figure, panels: Sequence[Axes]) -> str:
    """SVG text of panels: a legend of their curves on top, room for their numbers at the left.

    The size of the figure grows by the legend's lines.
    """
    lines = _entries(panels)
    columns, rows = _legend_size([str(line.get_label()) for line in lines])
    width, body = figure.get_size_inches()
    height = body + LINE * rows
    figure.set_size_inches(width, height)
    _place(panels, (width, height), LINE * rows)
    if lines:
        figure.legend(
            handles=lines, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=columns, frameon=False, fontsize=FONT,
            borderpad=0.0, borderaxespad=0.1, labelspacing=0.25, columnspacing=1.2, handlelength=2.2, handletextpad=0.5,
        )  # fmt: skip
    return svg_text(figure)


def _entries(panels: Sequence[Axes]) -> list[Line2D]:
    """A line of each label, in the order in which they were drawn; none where a single one needs no name."""
    found: dict[str, Line2D] = {}
    for axes in panels:
        for line in axes.get_lines():
            found.setdefault(str(line.get_label()), line)
    return [line for label, line in found.items() if not label.startswith("_")]


def _legend_size(labels: Sequence[str]) -> tuple[int, int]:
    """Columns and rows of a legend, from the widths of its letters."""
    if not labels:
        return 1, 0
    entry = (0.56 * FONT * max(map(len, labels)) + (2.2 + 0.5 + 1.2) * FONT) / 72
    columns = max(1, min(len(labels), int((WIDTH + 1.2 * FONT / 72) / entry)))
    return columns, -(-len(labels) // columns)


def _place(panels: Sequence[Axes], size: tuple[float, float], top: float) -> None:
    """Sets places in inches: only how wide the numbers at the left are must be measured."""
    (width, height), figure, spec = size, panels[0].get_figure(root=True), panels[0].get_subplotspec()
    assert figure is not None
    assert spec is not None
    rows, columns = spec.get_gridspec().get_geometry()
    pitch = (height - top - FOOT) / rows
    numbered = [axes for axes in panels if axes.yaxis.get_tick_params()["labelleft"]]

    def place(left: float, between: float) -> None:
        wide, tall = (width - left - RIGHT - between * (columns - 1)) / columns, pitch - GAP - TITLE
        for index, axes in enumerate(panels):
            row, column = divmod(index, columns)
            x, y = left + column * (wide + between), height - top - (row + 1) * pitch + GAP
            axes.set_position((x / width, y / height, wide / width, tall / height))
            axes.yaxis.set_label_coords(0.0, 1.0 + 0.06 / tall)

    # The numbers depend a little on the panels' size.
    place(0.5, 0.5)
    renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    labels = [label for axes in numbered for label in axes.get_yticklabels()]
    room = max((label.get_window_extent(renderer).width / 72 for label in labels), default=0.0) + 0.1
    place(room, room + 0.1 if len(numbered) > rows else 0.2)
