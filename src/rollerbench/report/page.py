"""The page of one run, or of several side by side: one HTML file without any request to a server."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from rich.table import Table
from rich.text import Text

from rollerbench.errors import ResourceError
from rollerbench.report import figures as drawing
from rollerbench.report.budget import COLUMNS, budgets
from rollerbench.report.embedding import inline_svg, packed, picture_address
from rollerbench.report.panels import panels_text
from rollerbench.report.parameters import differences, sections
from rollerbench.report.robots import robot_details
from rollerbench.report.rows import summary_rows
from rollerbench.report.stored_run import StoredRun

TITLES = {
    "trajectory": "Path of the body, seen from above: what the equations say, and what was simulated",
    "pose_error": "How far the pose is from the reference",
    "wheel_speeds": "Speeds of the wheels, commanded and measured",
    "wheel_efforts": "Torques of the wheels' motors",
    "wheel_slip": "Slip of the wheels over the ground",
    "error_budget": "Parts of the pose error",
    "body": "Height and inclination of the body",
    "gait": "Which feet are on the ground, and what they bear",
    "feet": "Feet over the ground",
    "joint_efforts": "Torques of the joints' motors",
}


def report_page(runs: Sequence[StoredRun], *, figures: Sequence[Mapping[str, str]] | None = None) -> str:
    """The report of a run, or of several side by side.

    Args:
        runs: What it is about, at least one.
        figures: SVG texts of each run's figures by name; by default they are drawn, those of several runs with the
            same scales.

    Raises:
        ResourceError: there is no run, or one whose recording lacks columns.
    """
    if not runs:
        raise ResourceError("a report is about at least one run, and none was given")
    drawn = figures if figures is not None else drawing.alike_figures([run.recording for run in runs])
    names = labels(runs)
    views = [
        _view(run, f"run{index + 1}", names[index], svgs)
        for index, (run, svgs) in enumerate(zip(runs, drawn, strict=True))
    ]
    environment = Environment(
        loader=PackageLoader("rollerbench.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    if len(runs) == 1:
        parts = {
            "sections": sections(runs[0]),
            "robot_tables": [_plain(table) for table in robot_details(runs[0].robot)],
        }
        return environment.get_template("run.html.j2").render(
            run=views[0], budget_columns=COLUMNS, marks="changed_settings" in runs[0].summary, **parts
        )
    return environment.get_template("comparison.html.j2").render(
        runs=views,
        budget_columns=COLUMNS,
        rows=_key_rows(runs),
        overlaid=_overlaid(runs, names),
        figures=_by_figure(views),
        differences=differences(runs),
    )


def labels(runs: Sequence[StoredRun]) -> list[str]:
    """What tells runs apart: the scenario, if that is not enough the folder too, and if need be a number."""
    scenarios = [str(run.summary["scenario"]) for run in runs]
    known = Counter(scenarios)
    longer = [
        scenario if known[scenario] == 1 or scenario == run.name else f"{scenario} ({run.name})"
        for scenario, run in zip(scenarios, runs, strict=True)
    ]
    seen: Counter[str] = Counter()
    found = []
    for label in longer:
        seen[label] += 1
        found.append(label if seen[label] == 1 else f"{label} {seen[label]}")
    return found


def _view(run: StoredRun, key: str, label: str, svgs: Mapping[str, str]) -> dict[str, Any]:
    """What the templates show of a run."""
    return {
        "key": key,
        "label": label,
        "folder": run.name,
        "summary": run.summary,
        "scenario": run.scenario,
        "robot": run.robot,
        "rows": summary_rows(run.summary),
        "budgets": budgets(run.summary),
        "figures": {
            name: {"title": TITLES[name], "svg": inline_svg(svg, f"{key}-{name}", f"{label}: {TITLES[name]}")}
            for name, svg in svgs.items()
        },
        "page": None if run.page is None else packed(run.page),
        "preview": None if run.preview is None else picture_address(run.preview),
    }


def _key_rows(runs: Sequence[StoredRun]) -> list[tuple[str, list[str], bool]]:
    """Label, values of all runs, and whether they differ, of each key figure."""
    tables = [dict(summary_rows(run.summary)) for run in runs]
    names = dict.fromkeys(name for table in tables for name in table)
    rows = [(name, [table.get(name, "-") for table in tables]) for name in names]
    return [(name, values, len(set(values)) > 1) for name, values in rows]


def _overlaid(runs: Sequence[StoredRun], names: Sequence[str]) -> list[dict[str, Any]]:
    """Figures that show all runs at once."""
    recordings = {name: run.recording for name, run in zip(names, runs, strict=True)}
    drawn = {"trajectory": drawing.trajectory(recordings), "pose_error": drawing.pose_error(recordings)}
    return [
        {"title": TITLES[name], "svg": inline_svg(panels_text(*figure), f"all-{name}", f"All runs: {TITLES[name]}")}
        for name, figure in drawn.items()
    ]


def _by_figure(views: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """For each figure the runs that have it."""
    names = dict.fromkeys(name for view in views for name in view["figures"])
    return [
        {
            "name": name,
            "title": TITLES[name],
            "runs": [{"label": view["label"], **view["figures"][name]} for view in views if name in view["figures"]],
        }
        for name in names
    ]


def _plain(table: Table) -> dict[str, Any]:
    """A terminal's table as text: title, headings, rows, and which columns hold numbers."""
    cells = [[_text(cell) for cell in column.cells] for column in table.columns]
    return {
        "title": _text(table.title or ""),
        "columns": [_text(column.header) for column in table.columns] if table.show_header else [],
        "rows": list(zip(*cells, strict=True)),
    }


def _text(cell: Any) -> str:
    return Text.from_markup(cell).plain if isinstance(cell, str) else str(cell)
