"""Tables for the terminal."""

from collections.abc import Iterable, Mapping
from typing import Any

from rich.markup import escape
from rich.table import Table

from rollerbench.report.rows import summary_rows


def summary_table(summary: Mapping[str, Any]) -> Table:
    """The key figures of a run."""
    table = Table(title=summary["scenario"], show_header=False, title_justify="left", title_style="bold")
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for label, value in summary_rows(summary):
        table.add_row(label, escape(value))
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
