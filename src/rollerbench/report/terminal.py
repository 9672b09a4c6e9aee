"""Tables for the terminal."""

from collections.abc import Iterable, Mapping
from typing import Any

from rich.markup import escape
from rich.table import Table

from rollerbench.report.budget import COLUMNS, budgets
from rollerbench.report.rows import summary_rows


def summary_tables(summary: Mapping[str, Any]) -> list[Table]:
    """The key figures of a run, and where its pose error comes from, if that is known."""
    tables = [summary_table(summary)]
    return [*tables, budget_table(summary)] if budgets(summary) else tables


def summary_table(summary: Mapping[str, Any]) -> Table:
    """The key figures of a run."""
    table = Table(title=summary["scenario"], show_header=False, title_justify="left", title_style="bold")
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for label, value in summary_rows(summary):
        table.add_row(label, escape(value))
    return table


def budget_table(summary: Mapping[str, Any]) -> Table:
    """Why the pose is not where the equations say; a second engine's budget under the first one's."""
    table = Table(title="Where the pose error comes from", title_justify="left", title_style="bold")
    for index, column in enumerate(COLUMNS):
        table.add_column(escape(column), justify="right" if 0 < index < len(COLUMNS) - 1 else "left")
    found = budgets(summary)
    for engine, rows in found.items():
        if len(found) > 1:
            table.add_row(f"[bold]{engine}[/bold]")
        for row in rows:
            table.add_row(*map(escape, row))
        table.add_section()
    return table


def matrix_table(title: str, rows: Iterable[tuple[str, Iterable[float]]], columns: Iterable[str]) -> Table:
    """A matrix with names of its rows and columns."""
    # Escaped, for rich reads [rad/s] as markup.
    table = Table(title=escape(title), title_justify="left", title_style="bold")
    table.add_column("")
    for column in columns:
        table.add_column(escape(column), justify="right")
    for name, values in rows:
        table.add_row(name, *(f"{value + 0.0:.6g}" for value in values))
    return table
