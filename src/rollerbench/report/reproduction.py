"""The page of a reproduced paper."""

from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from rich.markup import escape
from rich.table import Table

ROUNDING = 1e-9
"""Numbers smaller than this are shown as 0: they are rounding errors, in every unit that is used."""


def reproduction_page(
    *,
    paper: Mapping[str, Any],
    results: Sequence[Mapping[str, Any]],
    pictures: Sequence[Any],
    mistakes: Sequence[Mapping[str, Any]],
    runs: Sequence[Mapping[str, Any]],
    versions: Mapping[str, str],
) -> str:
    """The report.html of a reproduction.

    Args:
        paper: name, title, citation, introduction.
        results: Entries of results.json.
        pictures: Objects with name, title, caption, svg.
        mistakes: Entries of results.json.
        runs: name, summary, and whether there is a page, of each run folder under runs/.
        versions: Versions of rollerbench, Drake and Python.
    """
    environment = Environment(loader=PackageLoader("rollerbench.report"), autoescape=True, undefined=StrictUndefined)
    drawn = [
        {"name": p.name, "title": p.title, "caption": p.caption, "svg": Markup(p.svg[p.svg.index("<svg") :])}
        for p in pictures
    ]
    proven = [
        {**m, "proof": [(p["quantity"], f"{number(p['value'])} {p['unit']}".removesuffix(" -")) for p in m["proof"]]}
        for m in mistakes
    ]
    return environment.get_template("reproduction.html.j2").render(
        paper=paper, results=_rows(results), pictures=drawn, mistakes=proven, runs=runs, versions=versions
    )


def results_table(title: str, results: Sequence[Mapping[str, Any]]) -> Table:
    """The results for the terminal."""
    table = Table(title=escape(title), title_justify="left", title_style="bold")
    for column in ("Item", "Quantity"):
        table.add_column(column)
    for column in ("Printed", "Theory", "Simulated", "Difference"):
        table.add_column(column, justify="right")
    table.add_column("Unit")
    for row in _rows(results):
        table.add_row(
            *(escape(row[key]) for key in ("item", "quantity", "printed", "theory", "simulated", "difference", "unit"))
        )
    return table


def number(value: float | None) -> str:
    """A number to five digits, rounding errors as 0; a dash for none."""
    return "-" if value is None else _text(value, 5)


def _text(value: float, digits: int) -> str:
    return "0" if abs(value) < ROUNDING else f"{value:.{digits}g}"


def _rows(results: Sequence[Mapping[str, Any]]) -> list[dict[str, str]]:
    return [
        {
            **{key: str(row[key]) for key in ("item", "quantity", "unit")},
            **{key: number(row[key]) for key in ("printed", "theory", "simulated")},
            "difference": "-" if row["difference"] is None else _text(row["difference"], 2),
        }
        for row in results
    ]
