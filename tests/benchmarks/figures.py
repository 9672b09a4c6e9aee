"""Plots of a result."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

COLORS = {
    "rollerbench windowed": "tab:blue",
    "rollerbench full": "tab:cyan",
    "MuJoCo elliptic": "tab:red",
    "MuJoCo pyramidal": "tab:orange",
    "PyBullet": "tab:green",
}
FLOOR = 1e-3
"""Errors below are drawn here [%]."""


def draw(result: Mapping[str, Any], folder: Path) -> list[str]:
    """Writes svg files; returns their names."""
    names = []
    if "accuracy" in result:
        names.append(_save(_accuracy(result["accuracy"]), folder / "accuracy.svg"))
    for name, label in (("rollers", "rollers a wheel"), ("robots", "robots in one plant")):
        if name in result:
            names.append(_save(_scaling(result[name], name, label), folder / f"{name}.svg"))
    if "kinematics" in result:
        names.append(_save(_kinematics(result["kinematics"]), folder / "kinematics.svg"))
    return names


def _axes(x: str, y: str) -> tuple[Any, Any]:
    # Without pyplot, which would keep figures and pick a window system.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 5.0), layout="constrained")
    axes = figure.add_subplot()
    axes.set(xscale="log", yscale="log", xlabel=x, ylabel=y)
    axes.grid(visible=True, which="both", alpha=0.3)
    return figure, axes


def _save(figure: Any, path: Path) -> str:
    figure.savefig(path)
    return path.name


def _accuracy(result: Mapping[str, Any]) -> Any:
    figure, axes = _axes("worst error over the six motions [%]", "real-time factor [-]")
    for family, color in COLORS.items():
        tried = [row for row in result["trials"] if row["family"] == family and not row["failure"]]
        axes.plot(
            [max(row["worst_percent"], FLOOR) for row in tried],
            [row["speed_once"] for row in tried],
            ".",
            color=color,
            alpha=0.2,
        )
        rows = [row for row in result["timed"] if row["family"] == family]
        if not rows:
            continue
        x, y = [max(row["worst_percent"], FLOOR) for row in rows], [row["speed"] for row in rows]
        spread = [
            [row["speed"] - row["speed_low"] for row in rows],
            [row["speed_high"] - row["speed"] for row in rows],
        ]
        axes.errorbar(x, y, yerr=spread, fmt="o", color=color, label=family, capsize=2)
        edge = _front(list(zip(x, y, strict=True)))
        axes.plot([point[0] for point in edge], [point[1] for point in edge], color=color, drawstyle="steps-post")
    axes.axvline(result["target_percent"], color="black", linestyle=":", label="target")
    axes.set_xlim(0.5 * FLOOR, 12.0)
    axes.legend()
    return figure


def _front(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points that no other is both more accurate and faster than, by error."""
    edge: list[tuple[float, float]] = []
    for point in sorted(points, key=lambda point: (point[0], -point[1])):
        if not edge or point[1] > edge[-1][1]:
            edge.append(point)
    return edge


def _scaling(rows: Sequence[Mapping[str, Any]], unit: str, label: str) -> Any:
    figure, axes = _axes(label, "time of a step [us]")
    series: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        if "failure" not in row:
            series.setdefault((row["family"], row["label"]), []).append(row)
    styles: dict[str, int] = {}
    for (family, setting), points in series.items():
        style = ("-o", "--s", ":^")[min(2, styles.setdefault(family, 0))]
        styles[family] += 1
        x, y = [row[unit] for row in points], [row["us"] for row in points]
        axes.plot(x, y, style, color=COLORS[family], label=f"{family}, {setting}")
    counts = sorted({row[unit] for row in rows})
    axes.set_xticks(counts, labels=[str(count) for count in counts], minor=False)
    axes.minorticks_off()
    axes.legend(fontsize="small")
    return figure


def _kinematics(rows: Sequence[Mapping[str, Any]]) -> Any:
    figure, axes = _axes("twists a call [-]", "wheel speeds a second [1/s]")
    functions = list(dict.fromkeys(row["function"] for row in rows))
    for index, name in enumerate(functions):
        points = [row for row in rows if row["function"] == name]
        y = [row["wheel_speeds_per_second"] for row in points]
        if len(points) > 1:
            axes.plot([row["batch"] for row in points], y, "-o", color=f"C{index}", label=name)
        else:
            axes.axhline(y[0], color=f"C{index}", linestyle="--", label=name)
    axes.axhline(1e8, color="black", linestyle=":", label="100 million")
    axes.legend(fontsize="small")
    return figure
