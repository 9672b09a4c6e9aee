"""The command line: thin commands over the Python API."""

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from rollerbench.errors import RollerbenchError, RollerbenchWarning, SimulationError

if TYPE_CHECKING:
    from rollerbench.visualization.scenes import View

app = typer.Typer(
    name="rollerbench",
    help="A Drake workbench for wheeled, omnidirectional and wheel-legged mobile robots.",
    epilog="Example: rollerbench run youbot_plus_y",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

BAD_INPUT, FAILED = 2, 3
LOCAL = "localhost"


def main() -> None:
    """Entry point of the command rollerbench."""
    with _clear_messages():
        app()


@app.command(epilog="Example: rollerbench robots youbot_base")
def robots(
    robot: Annotated[str | None, typer.Argument(help="Name of a shipped robot, or path to a robot.yaml.")] = None,
) -> None:
    """List the robots; with one, print its matrices, mobility, isotropy and limits."""
    from rollerbench.description import load_robot
    from rollerbench.report.robots import robot_details, robot_list
    from rollerbench.resources import robot_names

    if robot is None:
        _print(robot_list([load_robot(name) for name in robot_names()]))
    else:
        for table in robot_details(load_robot(robot)):
            _print(table)


@app.command(epilog="Example: rollerbench scenarios")
def scenarios() -> None:
    """List the shipped scenarios."""
    from rollerbench.report.robots import scenario_list
    from rollerbench.resources import scenario_files

    _print(scenario_list(scenario_files()))


@app.command(epilog="Example: rollerbench run youbot_plus_y -o runs/left --set ground.friction=0.5")
def run(
    scenario: Annotated[str, typer.Argument(help="Name of a shipped scenario, or path to a scenario.yaml.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Run folder to write.", show_default="runs/NAME")
    ] = None,
    robot: Annotated[str | None, typer.Option(help="Another robot: a name, or a path to a robot.yaml.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Override a field, such as plant.time_step=0.002."),
    ] = None,
    engine: Annotated[
        str | None,
        typer.Option(help="drake, mujoco, or both: Drake with MuJoCo as a cross-check.", show_default="drake"),
    ] = None,
    check_step: Annotated[
        bool, typer.Option("--check-step", help="Simulate a second time with half the step, and compare.")
    ] = False,
    live: Annotated[bool, typer.Option("--live", help="Show the run in a browser, in real time.")] = False,
    host: Annotated[
        str, typer.Option(help="With --live: address to listen at; 0.0.0.0 lets other machines in.")
    ] = LOCAL,
    port: Annotated[
        int | None, typer.Option(help="With --live: port to listen at; 0 for any.", show_default="first free from 7000")
    ] = None,
    camera: Annotated[str | None, typer.Option(help="iso, top, or follow: with the robot.", show_default="iso")] = None,
    forces: Annotated[
        bool, typer.Option("--forces", help="Show and record the forces of the ground, coloured by slip.")
    ] = False,
    no_recording: Annotated[
        bool, typer.Option("--no-recording", help="Write no recording.html, which is faster.")
    ] = False,
    video: Annotated[
        str | None,
        typer.Option(help="Write a video too: mp4, or gif. No display or GPU is needed.", show_default="none"),
    ] = None,
    diagram: Annotated[
        bool, typer.Option("--diagram", help="Draw the simulated diagram, its systems and ports, as diagram.svg.")
    ] = False,
) -> None:
    """Simulate a scenario, compare it with the equations, and write the run folder.

    With --live, the page can pause, step, slow down and repeat the run; that changes nothing of what is recorded.
    """
    from rollerbench import simulation
    from rollerbench.report.terminal import summary_tables

    overrides = list(set_ or [])
    overrides += [f"engine={engine}"] if engine is not None else []
    overrides += ["check_step=true"] if check_step else []
    overrides += ["recording.html=false"] if no_recording else []
    overrides += [f"recording.video={video}"] if video is not None else []
    overrides += ["recording.diagram=true"] if diagram else []
    overrides += [f"recording.camera={camera}"] if camera is not None else []
    overrides += ["recording.forces=true"] if forces else []
    loaded = simulation.load_scenario(scenario, overrides=overrides, robot=robot)
    if live and loaded.engine == "mujoco":
        raise RollerbenchError("--live: MuJoCo's runs are not shown; accepted: --engine drake or both")
    if not live and (host != LOCAL or port is not None):
        raise RollerbenchError("--host, --port: accepted: together with --live")
    shown = _live_page(host, port) if live else {}
    try:
        with _progress(loaded.name, loaded.duration) as progress:
            result = simulation.run(loaded, output=output, progress=progress, **shown)
    except SimulationError as error:
        if error.result is not None:
            for table in summary_tables(error.result.summary):
                _print(table)
            _print(f"Kept until then: {error.result.folder}")
        raise
    for table in summary_tables(result.summary):
        _print(table)
    _print(f"Written: {result.folder}")


@app.command(epilog="Example: rollerbench teleop youbot_base --set ground.friction=0.3")
def teleop(
    robot: Annotated[str, typer.Argument(help="Name of a shipped robot, or path to a robot.yaml.")],
    host: Annotated[
        str, typer.Option(help="Where to serve the page; 0.0.0.0 lets other machines see it, and drive.")
    ] = LOCAL,
    port: Annotated[int, typer.Option(help="The page's port.", show_default="any that is free")] = 0,
    timeout: Annotated[float, typer.Option(help="Seconds without a word from the page until the robot stops.")] = 0.5,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a field of the scenario, such as ground.friction=0.3."),
    ] = None,
    open_: Annotated[
        bool | None, typer.Option("--open/--no-open", help="Open the page in a browser.", show_default="on a terminal")
    ] = None,
) -> None:
    """Drive a simulated robot by hand, from a page with sliders, keyboard and gamepad, beside its ghost."""
    from rollerbench.simulation.teleop import Teleop

    def ready(url: str) -> None:
        print(f"Drive at {url} (Ctrl-C ends)", file=sys.stderr)
        _browse(url, wanted=open_)

    driven = Teleop(robot, overrides=set_ or [], host=host, port=port, timeout=timeout)
    with suppress(KeyboardInterrupt):
        driven.run(ready)


@app.command(epilog="Example: rollerbench reproduce differential_drive -o reproductions")
def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            help="six_wheel, differential_drive, mecanum, omni_anisotropy, wheel_leg, or all.", show_default=True
        ),
    ] = "all",
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder to write; each paper gets a folder in it.")
    ] = Path("reproductions"),
    no_recording: Annotated[
        bool, typer.Option("--no-recording", help="Runs write no recording.html, which is faster.")
    ] = False,
) -> None:
    """Regenerate the figures and tables of a source paper from theory and from simulation."""
    from rollerbench import studies
    from rollerbench.report.reproduction import results_table

    for name in studies.paper_names() if paper == "all" else [paper]:
        with _progress(name, 0.0) as show:
            done = studies.reproduce(name, output=output / name, recordings=not no_recording, progress=show)
        _print(results_table(done.paper.title, [result.to_dict() for result in done.findings.results]))
        _print(f"Written: {done.folder / 'report.html'}")


@app.command(epilog="Example: rollerbench analyze omni_platform -o analyses/omni --roll-resistance 0.02")
def analyze(
    robot: Annotated[str, typer.Argument(help="Name of a shipped robot, or path to a robot.yaml.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder to write.", show_default="analyses/NAME")
    ] = None,
    roll_resistance: Annotated[
        float, typer.Option(help="Resisting force of a rolling wheel or roller over its load.")
    ] = 0.0,
    ground_friction: Annotated[
        float | None, typer.Option(help="Coefficient of friction of the ground.", show_default="the wheels' own")
    ] = None,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Lay what simulated robots do over the curves; takes some minutes.")
    ] = False,
) -> None:
    """Show what a robot can do in each direction: speed, acceleration before a wheel slips, wheel efforts."""
    from rollerbench import studies
    from rollerbench.report.analysis import analysis_table

    if simulate and roll_resistance >= 1:
        raise RollerbenchError(f"--roll-resistance {roll_resistance:g}: accepted with --simulate: less than 1")
    if simulate:
        from rollerbench.studies.measured_limits import measure_limits
    with _progress(robot, 0.0, unit="steps") as show:
        done = studies.analyze(
            robot,
            output=output,
            roll_resistance=roll_resistance,
            ground_friction=ground_friction,
            measure=measure_limits if simulate else None,
            progress=lambda now, total: show(now, total=total),
        )
    _print(analysis_table(done.capability))
    _print(f"Written: {done.folder / 'report.html'}")


@app.command(epilog="Example: rollerbench replay runs/left runs/slippery --html both.html")
def replay(
    runs: Annotated[list[Path], typer.Argument(help="Run folders, or files in them; several are overlaid.")],
    html: Annotated[
        Path | None, typer.Option("--html", help="Write one HTML file instead of showing it.", show_default=False)
    ] = None,
    camera: Annotated[str, typer.Option(help="iso, top, or follow: with the first robot.")] = "iso",
    forces: Annotated[bool, typer.Option("--forces", help="Show forces of the ground, if recorded.")] = False,
    slip: Annotated[bool, typer.Option("--slip", help="Show where wheels slid.")] = False,
    host: Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 lets other machines look.")] = LOCAL,
    port: Annotated[int, typer.Option(help="Port to listen at.", show_default="any free one", min=0, max=65535)] = 0,
    open_: Annotated[
        bool | None, typer.Option("--open/--no-open", help="Open a browser.", show_default="on a terminal")
    ] = None,
) -> None:
    """Show stored runs without simulating them again; needs no Drake."""
    from rollerbench.visualization.replay import replay as replay_runs
    from rollerbench.visualization.serve import serve_page

    if html is not None:
        _check_page(html)
    shown = replay_runs([*runs], camera=_view(camera), forces=forces, slip=slip)
    if html is not None:
        _write(html, shown.page())
        _print(f"Written: {html}")
        return

    def ready(address: str) -> None:
        print(f"{address} (Ctrl-C ends)", file=sys.stderr)
        _browse(address, wanted=open_)

    with suppress(KeyboardInterrupt):
        serve_page(shown.page(), host=host, port=port, ready=ready)


@app.command(epilog="Example: rollerbench report runs/a runs/b -o comparison.html")
def report(
    runs: Annotated[list[Path], typer.Argument(help="Run folders, or files in them such as recording.parquet.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="File to write.", show_default="RUN/report.html; comparison.html of several"
        ),
    ] = None,
) -> None:
    """Write the report of a run again, or of several side by side; nothing is simulated."""
    from rollerbench.report.page import report_page
    from rollerbench.report.stored_run import StoredRun
    from rollerbench.stored import run_folder

    target = (
        output
        if output is not None
        else (run_folder(runs[0]) / "report.html" if len(runs) == 1 else Path("comparison.html"))
    )
    _check_page(target)
    _write(target, report_page([StoredRun.read(run) for run in runs]))
    _print(f"Written: {target}")


@app.command(epilog="Example: rollerbench build youbot_base")
def build(
    robots: Annotated[
        list[str] | None,
        typer.Argument(help="Names or robot.yaml files; by default all shipped robots.", show_default=False),
    ] = None,
) -> None:
    """Write the SDF model of robots beside their robot.yaml."""
    from rollerbench.description import load_robot
    from rollerbench.resources import robot_file, robot_names
    from rollerbench.sdf import robot_to_sdf

    for name in robots or robot_names():
        file = robot_file(name)
        robot = load_robot(file)
        target = file.parent / f"{robot.name}.sdf"
        _write(target, robot_to_sdf(robot))
        _print(f"{target}")


@app.command(epilog="Example: rollerbench export youbot_base --format mjcf -o youbot_base.xml")
def export(
    robot: Annotated[str, typer.Argument(help="Name of a shipped robot, or path to a robot.yaml.")],
    format_: Annotated[str, typer.Option("--format", help="sdf, or mjcf (for MuJoCo).")] = "sdf",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write.", show_default="standard output")
    ] = None,
) -> None:
    """Write a robot as a model for other simulators."""
    from rollerbench.description import Robot, load_robot
    from rollerbench.sdf import robot_to_mjcf, robot_to_sdf

    writers: dict[str, Callable[[Robot], str]] = {"sdf": robot_to_sdf, "mjcf": robot_to_mjcf}
    if format_ not in writers:
        raise RollerbenchError(f"--format {format_!r}: accepted: {', '.join(writers)}")
    text = writers[format_](load_robot(robot))
    if output is None:
        print(text, end="")
        return
    _write(output, text)
    _print(f"{output}")


@app.command(epilog="Example: rollerbench schema > robot.schema.json")
def schema(
    scenario: Annotated[
        bool, typer.Option("--scenario", help="The schema of scenario.yaml instead of robot.yaml.")
    ] = False,
) -> None:
    """Print the JSON Schema of robot.yaml, for editors."""
    import json

    from pydantic import BaseModel

    from rollerbench.description import Robot

    model: type[BaseModel] = Robot
    if scenario:
        from rollerbench.simulation import Scenario

        model = Scenario
    print(json.dumps(model.model_json_schema(), indent=2))


def _check_page(target: Path) -> None:
    """Refuses to write a page over anything but a page, such as a run's recording.parquet."""
    if target.suffix.lower() != ".html" or target.is_dir():
        raise RollerbenchError(f"{str(target)!r}: accepted: a file to write that ends in .html, such as page.html")


def _write(target: Path, text: str) -> None:
    from rollerbench.description.files import write_atomically

    if target.is_dir():
        raise RollerbenchError(f"{target}: is a folder; accepted: a file to write")
    try:
        write_atomically(target, text)
    except OSError as error:
        raise RollerbenchError(f"{target}: cannot be written: {error}") from error


def _view(camera: str) -> "View":
    from rollerbench.visualization.scenes import DIRECTIONS

    for view in DIRECTIONS:
        if camera == view:
            return view
    raise RollerbenchError(f"--camera {camera!r}: accepted: {', '.join(DIRECTIONS)}")


def _live_page(host: str, port: int | None) -> dict[str, Any]:
    """What shows a run live: arguments of `run`. At a terminal a browser opens, and the page stays until Enter."""
    from rollerbench.simulation import Live
    from rollerbench.visualization.surroundings import local_meshcat

    meshcat = local_meshcat(host, port)
    print(f"Live at {meshcat.web_url()}", file=sys.stderr)
    print(
        "Space pauses, . steps, R resets, - and = change the speed, 1 2 3 the view; or Open Controls.", file=sys.stderr
    )
    asked = False

    def stay() -> bool:
        nonlocal asked
        if not asked:
            asked = True
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
            print("The run is over. Reset in the page repeats it; Enter ends.", file=sys.stderr)
        return not select.select([sys.stdin], [], [], 0.0)[0]

    if not sys.stdin.isatty():
        return {"meshcat": meshcat, "live": Live()}
    import select
    import termios

    _browse(meshcat.web_url())
    return {"meshcat": meshcat, "live": Live(patience=5.0, stay=stay)}


def _browse(address: str, *, wanted: bool | None = None) -> None:
    """Opens a browser if that is wanted, or, where nothing is said, if somebody sits at the terminal."""
    import webbrowser

    if sys.stdout.isatty() if wanted is None else wanted:
        webbrowser.open(address)


@contextmanager
def _clear_messages() -> Iterator[None]:
    """Bad input ends with one message and exit status 2, a failed simulation with 3; warnings are one line each."""

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        print(f"warning: {message}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", RollerbenchWarning)
        warnings.showwarning = show
        try:
            yield
        except SimulationError as error:
            print(f"failed: {error}", file=sys.stderr)
            raise SystemExit(FAILED) from None
        except RollerbenchError as error:
            print(f"error: {error}", file=sys.stderr)
            raise SystemExit(BAD_INPUT) from None


class Show(Protocol):
    """Moves a progress bar."""

    def __call__(self, now: float, label: str | None = None, total: float | None = None) -> None:
        """Shows the time now [s], from here on with another label or total if given."""


@contextmanager
def _progress(label: str, total: float, unit: str = "s") -> Iterator[Show]:
    """A progress bar on the terminal's standard error, in simulated seconds or another unit; nothing elsewhere."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    amount = TextColumn("{task.completed:.2f}/{task.total:g} s" if unit == "s" else f"{{task.completed:.0f}} {unit}")
    columns = (TextColumn("{task.description}"), BarColumn(), amount)
    console = Console(stderr=True)
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(label, total=total)

        def show(now: float, label: str | None = None, total: float | None = None) -> None:
            bar.update(task, completed=now, description=label, total=total)

        yield show


def _print(what: object) -> None:
    from rich.console import Console

    # Piped output is not cut to a terminal's width.
    console = Console(highlight=False, soft_wrap=True) if sys.stdout.isatty() else Console(highlight=False, width=140)
    console.print(what, markup=False) if isinstance(what, str) else console.print(what)
