"""The command: python -m tests.benchmarks."""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from . import accuracy, kinematics, memory, scaling
from .engines import FAMILIES, available
from .figures import draw
from .machine import describe
from .motions import TWISTS, motions, robot_with_rollers
from .tables import markdown, sheets

PARTS = ("accuracy", "rollers", "robots", "memory", "kinematics")
EXAMPLES = """Examples:

  python -m tests.benchmarks --quick

  python -m tests.benchmarks -o out/benchmark

  python -m tests.benchmarks --only kinematics --only memory
"""

Measure = Callable[[Callable[[str], None]], Any]


def main() -> None:
    """Runs the command."""
    app = typer.Typer(add_completion=False, rich_markup_mode="rich", pretty_exceptions_enable=False)
    app.command(epilog=EXAMPLES)(benchmark)
    app(prog_name="python -m tests.benchmarks")


def benchmark(
    quick: Annotated[bool, typer.Option("--quick", help="Few settings and short motions: a few minutes.")] = False,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder of the results.")] = Path("benchmark"),
    only: Annotated[
        list[str] | None, typer.Option(help=f"Only this part, may be repeated: {', '.join(PARTS)}.")
    ] = None,
    engine: Annotated[
        list[str] | None, typer.Option(help="Only this engine, may be repeated: rollerbench, mujoco, pybullet.")
    ] = None,
    rounds: Annotated[int | None, typer.Option(min=1, help="Rounds of interleaved runs (7; 3 if quick).")] = None,
    smoke: Annotated[bool, typer.Option("--smoke", hidden=True)] = False,
) -> None:
    """Measures rollerbench beside MuJoCo and PyBullet, on one core. Takes about half an hour; --quick some minutes.

    Writes benchmark.json, benchmark.md and svg figures. Engines that are not installed are named and left out.
    """
    console = Console()
    parts = tuple(only or PARTS)
    for name in parts:
        if name not in PARTS:
            raise typer.BadParameter(f"{name}: accepted: {', '.join(PARTS)}", param_hint="--only")
    effort = "smoke" if smoke else "quick" if quick else "full"
    rounds = rounds or {"smoke": 1, "quick": 3}.get(effort, 7)
    result = _measured(console, parts, effort, rounds, engine)
    with tempfile.TemporaryDirectory() as folder:
        _write(result, Path(folder))
        _publish(Path(folder), output)
    for sheet in sheets(result):
        table = Table(*map(escape, sheet.columns), title=escape(sheet.title), title_justify="left")
        for row in sheet.rows:
            table.add_row(*map(escape, row))
        console.print(table)
        if sheet.note:
            console.print(escape(sheet.note), style="dim")
    console.print(f"Results: {output}")


def _measured(
    console: Console, parts: tuple[str, ...], effort: str, rounds: int, only: list[str] | None
) -> dict[str, Any]:
    engines, missing = available()
    if only:
        engines = [each for each in engines if each.name.lower() in [name.lower() for name in only]]
    if not engines:
        raise typer.BadParameter("none of these is installed", param_hint="--engine")
    for message in missing:
        console.print(f"[yellow]{escape(message)}[/yellow]")
    duration = {"smoke": 0.4, "quick": 2.5}.get(effort, 3.0)
    by_name = {each.name: each for each in engines}
    families = [family for family in FAMILIES if family.split()[0] in by_name]
    robot = robot_with_rollers()
    # The ramps are long enough for the friction of wheels that move sideways at top speed.
    ramp = 0.2 if effort == "smoke" else 0.5
    moves = motions(robot, duration=duration, ramp=ramp, names=("y",) if effort == "smoke" else tuple(TWISTS))
    settings = scaling.SETTINGS[::3] if effort == "smoke" else scaling.SETTINGS
    rollers = {"smoke": (6,), "quick": (6, 12, 24)}.get(effort, scaling.ROLLER_COUNTS)
    robots = {"smoke": (2,), "quick": (1, 4)}.get(effort, scaling.ROBOT_COUNTS)
    batches = {"smoke": (10,), "quick": kinematics.BATCHES[::2]}.get(effort, kinematics.BATCHES)
    scaled = {"duration": max(0.4, 0.4 * duration), "rounds": rounds, "settings": settings}
    measures: dict[str, Measure] = {
        "accuracy": lambda say: accuracy.measure(engines, robot, moves, effort=effort, rounds=rounds, progress=say),
        "rollers": lambda say: scaling.against_rollers(by_name, rollers, **scaled, progress=say),
        "robots": lambda say: scaling.against_robots(by_name, robots, **scaled, progress=say),
        "memory": lambda say: memory.measure(families[1:3] if effort == "smoke" else families, say),
        "kinematics": lambda say: kinematics.measure(batches, rounds, say),
    }
    result: dict[str, Any] = {
        "made": datetime.now(UTC).isoformat(timespec="seconds"),
        "effort": effort,
        "rounds": rounds,
        "machine": describe(),
        "versions": {each.name: f"{each.version}; {each.notes}" for each in engines},
        "missing": missing,
    }
    columns = (SpinnerColumn(), TextColumn("{task.fields[part]}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, TextColumn("{task.description}"), console=console, transient=True) as bar:
        task = bar.add_task("", total=len(PARTS), part="")
        bar.update(task, total=len(parts))
        for part in parts:
            bar.update(task, part=part)
            result[part] = measures[part](lambda text: bar.update(task, description=escape(text[:90])))
            bar.advance(task)
    return result


def _write(result: dict[str, Any], folder: Path) -> None:
    text = json.dumps(result, indent=1, default=str)
    (folder / "benchmark.json").write_text(text.replace("Infinity", "null").replace("NaN", "null"))
    names = draw(result, folder)
    (folder / "benchmark.md").write_text(markdown(result, names))


def _publish(folder: Path, output: Path) -> None:
    """Moves each file to its place at once, so that no half-written one is ever seen there."""
    output.mkdir(parents=True, exist_ok=True)
    for source in sorted(folder.iterdir()):
        handle, name = tempfile.mkstemp(dir=output)
        os.close(handle)
        shutil.copyfile(source, name)
        Path(name).chmod(0o644)
        Path(name).replace(output / source.name)
    sys.stdout.flush()
