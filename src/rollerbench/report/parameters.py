"""The parameters of runs as text: one by one, by section, and where runs differ."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from rollerbench.description import Robot
from rollerbench.report.stored_run import StoredRun

MAIN = "run"
"""The section of what belongs to no other."""

NOT_SHOWN = ("name", "summary", "robot")
"""Fields of scenario.yaml that stand elsewhere on a page."""


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values by their dotted names, as `--set` takes them; lists and empty mappings count as values."""
    found: dict[str, Any] = {}
    for key, value in data.items():
        name = f"{prefix}{key}"
        found |= flat(value, f"{name}.") if isinstance(value, Mapping) and value else {name: value}
    return found


def settings(run: StoredRun) -> dict[str, str]:
    """All fields of a run's scenario.yaml as text, by dotted name."""
    return {name: text(value) for name, value in flat(run.scenario).items() if name not in NOT_SHOWN}


def sections(run: StoredRun) -> dict[str, list[tuple[str, str, bool]]]:
    """Name, text, and whether it differs from the default, of each field, by section of scenario.yaml."""
    changed = set(run.summary.get("changed_settings", ()))
    found: dict[str, list[tuple[str, str, bool]]] = {MAIN: []}
    for name, value in settings(run).items():
        section, _, field = name.partition(".") if "." in name else (MAIN, "", name)
        found.setdefault(section, []).append((field, value, name in changed))
    return found


def differences(runs: Sequence[StoredRun]) -> list[tuple[str, list[str]]]:
    """Names of parameters that are not the same in all runs, and what each run has; a dash where it has none."""
    tables = [_described(run) for run in runs]
    same_robot = len({run.robot.name for run in runs}) == 1
    if same_robot:
        tables = [{**table, **_of_robot(run.robot)} for table, run in zip(tables, runs, strict=True)]
    names = dict.fromkeys(name for table in tables for name in table)
    # An empty mapping says no more than that what others hold in it is missing.
    wholes = {name[: place.start()] for name in names for place in re.finditer(r"\.", name)}
    tops = list(dict.fromkeys(name.partition(".")[0] for name in names))
    kept = sorted((name for name in names if name not in wholes), key=lambda name: tops.index(name.partition(".")[0]))
    rows = [(name, [table.get(name, "-") for table in tables]) for name in kept]
    return [(name, values) for name, values in rows if len(set(values)) > 1]


def text(value: Any) -> str:
    """A value as a person writes it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {text(item)}" for key, item in value.items()) or "none"
    if isinstance(value, list | tuple):
        separator = "; " if any(isinstance(item, Mapping) for item in value) else ", "
        return separator.join(map(text, value)) or "none"
    return str(value)


def _described(run: StoredRun) -> dict[str, str]:
    first = {"scenario": run.summary["scenario"], "robot": run.robot.name, "engine": run.summary["engine"]}
    versions = {f"version of {name}": text(version) for name, version in run.summary["versions"].items()}
    return {**first, **settings(run), **versions}


def _of_robot(robot: Robot) -> dict[str, str]:
    data = robot.model_dump(mode="json", exclude={"name", "summary", "source"})
    for kind in ("wheels", "legs", "postures"):
        data[kind] = {part.pop("name"): part for part in data[kind]}
    return {name: text(value) for name, value in flat(data, "robot.").items()}
