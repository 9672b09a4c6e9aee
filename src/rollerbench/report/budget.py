"""The error budget of a run as text, for tables on terminals and pages."""

import math
from collections.abc import Mapping
from typing import Any

from rollerbench.analysis.budget import MEANINGS

COLUMNS = ("Part", "Ahead [mm]", "Left [mm]", "of position", "Yaw [deg]", "of yaw", "What it is")


def budget_rows(budget: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """One row of `COLUMNS` for each part of a budget, and their sum.

    Args:
        budget: error_budget.parts of a summary.
    """
    rows = [_row(name, part, MEANINGS[name]) for name, part in budget.items()]
    total = {key: sum(part[key] for part in budget.values()) for key in ("along_track", "cross_track", "yaw")}
    shares = ("position_share", "yaw_share")
    total |= {key: _sum([part[key] for part in budget.values()]) for key in shares}
    return [*rows, _row("sum", total, "the pose error")]


def half_step_row(change: Mapping[str, float]) -> tuple[str, ...]:
    """The row of a second run at half the step.

    Args:
        change: error_budget.half_step of a summary.
    """
    known = {**change, "position_share": None, "yaw_share": None}
    return _row("(half step)", known, "how far a second run with half the step ends from this one")


def _row(name: str, part: Mapping[str, Any], meaning: str) -> tuple[str, ...]:
    return (
        name,
        _fixed(1e3 * part["along_track"], 3),
        _fixed(1e3 * part["cross_track"], 3),
        _percent(part["position_share"]),
        _fixed(math.degrees(part["yaw"]), 4),
        _percent(part["yaw_share"]),
        meaning,
    )


def _sum(shares: list[float | None]) -> float | None:
    known = [share for share in shares if share is not None]
    return sum(known) if known else None


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{_fixed(100 * share, 1)} %"


def _fixed(value: float, digits: int) -> str:
    # Adding 0.0 turns -0 into 0.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def budgets(summary: Mapping[str, Any]) -> dict[str, list[tuple[str, ...]]]:
    """The rows of all budgets in a summary, by engine: with a cross-check there are two, of a robot on legs none."""
    if "legs" in summary:
        return {}
    found = [(summary["engine"], summary["error_budget"])]
    if summary["cross_check"] is not None:
        found.append((summary["cross_check"]["engine"], summary["cross_check"]["error_budget"]))
    return {
        engine: budget_rows(budget["parts"]) + ([half_step_row(budget["half_step"])] if budget["half_step"] else [])
        for engine, budget in found
    }
