"""Tables of a result, for the terminal and as Markdown."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A table and what to know about it.

    Attributes:
        title: Its title.
        columns: Heads of its columns.
        rows: Cells.
        note: A sentence below.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


def sheets(result: Mapping[str, Any]) -> list[Sheet]:
    """All tables of a result."""
    found: list[Sheet] = []
    if "accuracy" in result:
        found += _accuracy(result["accuracy"])
    for name, unit in (("rollers", "rollers a wheel"), ("robots", "robots in one plant")):
        if name in result:
            found.append(_scaling(result[name], name, unit))
    if "memory" in result:
        found.append(_memory(result["memory"]))
    if "kinematics" in result:
        found.append(_kinematics(result["kinematics"]))
    return found


def markdown(result: Mapping[str, Any], figures: Iterable[str]) -> str:
    """The tables and figures as a Markdown page."""
    lines = ["# Benchmark", ""]
    for name, value in {**result["machine"], **result["versions"]}.items():
        lines.append(f"- {name}: {value}")
    lines += [f"- {message}" for message in result["missing"]]
    for sheet in sheets(result):
        lines += ["", f"## {sheet.title}", "", _line(sheet.columns), _line("---" for _ in sheet.columns)]
        lines += [_line(row) for row in sheet.rows]
        if sheet.note:
            lines += ["", sheet.note]
    for figure in figures:
        lines += ["", f"![{figure}]({figure})"]
    return "\n".join(lines) + "\n"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _accuracy(result: Mapping[str, Any]) -> list[Sheet]:
    names = list(result["motions"])
    rows = [
        [row["family"], row["label"], f"{row['worst_percent']:.2g}", _worst(row), _range(row, "speed")]
        for row in sorted(result["timed"], key=lambda row: (row["family"], row["worst_percent"]))
    ]
    fronts = Sheet(
        title="Real-time factor and error",
        columns=["engine", "setting", "worst error [%]", "in", "real-time factor (quartiles)"],
        rows=rows,
        note=f"Worst over {', '.join(names)}: final position, for the turn yaw, against the engine's own converged "
        f"reference, in % of the path. {len(result['trials'])} settings were tried.",
    )
    target = result["target_percent"]
    ratios = Sheet(
        title=f"rollerbench windowed over others at {target:g} % error",
        columns=["against", "its best setting", "ratio of real-time factors (quartiles)"],
        rows=[[row["against"], row["setting"], _range(row, "ratio")] for row in result["ratios"]],
        note="Median of the ratios within rounds of interleaved runs. Engines that are missing have no setting "
        "within that error.",
    )
    references = []
    for name, row in result["references"].items():
        others = ", ".join(
            f"{other} {max(apart.values()):.2g}" for other, apart in row["other_engines_percent"].items()
        )
        remaining = max(row["change_at_twice_the_step_percent"].values())
        references.append([name, row["setting"], f"{remaining:.2g}", others])
    converged = Sheet(
        title="Converged references",
        columns=["engine", "setting", "change from twice the step [%]", "worst difference to others [%]"],
        rows=references,
    )
    return [ratios, fronts, converged]


def _worst(row: Mapping[str, Any]) -> str:
    errors = row["errors_percent"]
    return max(errors, key=errors.__getitem__)


def _range(row: Mapping[str, Any], name: str) -> str:
    return f"{row[name]:.3g} ({row[f'{name}_low']:.3g} to {row[f'{name}_high']:.3g})"


def _scaling(rows: Sequence[Mapping[str, Any]], unit: str, title: str) -> Sheet:
    counts = sorted({row[unit] for row in rows})
    lines: dict[tuple[str, str], dict[int, str]] = {}
    for row in rows:
        cell = "failed" if "failure" in row else f"{row['us']:.0f}"
        lines.setdefault((row["family"], row["label"]), {})[row[unit]] = cell
    return Sheet(
        title=f"Time of a step against {title} [us]",
        columns=["engine", "setting", *map(str, counts)],
        rows=[[*head, *(cells.get(count, "") for count in counts)] for head, cells in lines.items()],
    )


def _memory(rows: Sequence[Mapping[str, Any]]) -> Sheet:
    cells = [
        [row["family"], "failed", row["failure"]]
        if "failure" in row
        else [row["family"], f"{row['imported_mb']:.0f}", f"{row['peak_mb']:.0f}"]
        for row in rows
    ]
    return Sheet(
        title="Peak memory [MB]",
        columns=["engine", "after its import", "after one simulated second"],
        rows=cells,
        note="One process each. MuJoCo and PyBullet without Drake, but with rollerbench's description.",
    )


def _kinematics(rows: Sequence[Mapping[str, Any]]) -> Sheet:
    cells = [
        [
            row["function"],
            f"{row['batch']:,}",
            f"{row['twists_per_second'] / 1e6:.3g}",
            f"{row['wheel_speeds_per_second'] / 1e6:.3g}",
        ]
        for row in rows
    ]
    return Sheet(
        title="Kinematics of four Mecanum wheels",
        columns=["function", "batch", "million twists a second", "million wheel speeds a second"],
        rows=cells,
        note="Four wheel speeds belong to a twist. WPILib (robotpy-wpimath) is called in a loop, objects made before.",
    )
