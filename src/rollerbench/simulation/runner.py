"""Runs a scenario: simulate, record, compare with the equations, write the run folder."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydrake.geometry import Meshcat

from rollerbench.errors import RollerbenchWarning, SimulationError
from rollerbench.recording import Recording
from rollerbench.sdf import robot_to_sdf
from rollerbench.simulation import drake_engine, leg_engine, mujoco_engine, picture
from rollerbench.simulation.folder import check_folder, write_folder
from rollerbench.simulation.live import Live
from rollerbench.simulation.log import Progress, Simulated
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.summary import apart, cross_check, summarize
from rollerbench.visualization import render
from rollerbench.visualization.scenes import Scene, SeenRun, scene_of


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What came out of a run.

    Attributes:
        scenario: What was simulated.
        recording: Samples over time.
        summary: The content of summary.json.
        folder: The run folder; None if nothing was written.
        cross_check: Samples of the second engine, where scenario.engine is "both".
    """

    scenario: Scenario
    recording: Recording
    summary: Mapping[str, Any]
    folder: Path | None
    cross_check: Recording | None = None


def run(
    scenario: Scenario | str | Path | Mapping[str, Any],
    *,
    output: str | Path | None = None,
    save: bool = True,
    meshcat: Meshcat | None = None,
    live: Live | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Simulates a scenario.

    Args:
        scenario: Scenario, name of a shipped one, path to a scenario.yaml, or its content.
        output: Run folder to write, new or from an earlier run; by default runs/NAME.
        save: Whether to write the run folder.
        meshcat: A Meshcat to show the robot in while Drake simulates it, with its ghost and trails.
        live: How to pace the run to real time, with buttons in the meshcat; without, it is as fast as it can be.
        progress: Called with the simulated time [s] now and then.

    Returns:
        The result; its folder holds it too.

    Raises:
        ResourceError, DescriptionError: the scenario, or the output folder, cannot be accepted.
        InfeasibleTwist: the command would make a tyre skid.
        SimulationError: the simulation failed, or was interrupted. What was computed until then is in its `result`,
            and in the run folder.
    """
    scenario = load_scenario(scenario)
    folder = Path(output if output is not None else Path("runs") / scenario.name) if save else None
    if folder is not None:
        check_folder(folder)
        if scenario.recording.diagram:
            picture.check()
        if scenario.recording.video is not None:
            render.check(scenario.recording.video)
    if scenario.engine != "drake":
        mujoco_engine.check(scenario)
    _warn_about_step(scenario)

    if live is not None and meshcat is None:
        raise SimulationError("run: live: accepted: together with a meshcat")

    simulated = _simulated(scenario, meshcat, live, progress)
    recording, failure = simulated.recording, simulated.failure
    if not len(recording.time):
        raise SimulationError(f"{scenario.name}: {failure}; nothing was recorded")
    second = half = None
    try:
        if scenario.engine == "both" and failure is None:
            second = mujoco_engine.simulate(scenario, progress=progress)
            failure = _named("the cross-check with MuJoCo", second.failure)
        if scenario.check_step and failure is None:
            half = _simulated(_at_half_step(scenario), progress=progress)
            failure = _named("the run with half the step", half.failure)
    except SimulationError as error:
        failure = str(error)
    summary = summarize(
        scenario,
        simulated,
        half_step=apart(half.recording, recording) if half is not None and half.failure is None else None,
        second=cross_check(second, recording) if second is not None else None,
    )
    if folder is not None:
        model = robot_to_sdf(scenario.simulated_robot)
        scene = _scene(scenario, recording, summary, model)
        write_folder(folder, scenario, recording, summary, model, scene, second, progress=progress)
    result = RunResult(
        scenario=scenario,
        recording=recording,
        summary=summary,
        folder=folder,
        cross_check=None if second is None else second.recording,
    )
    if failure is not None:
        raise SimulationError(f"{scenario.name}: {failure}", result)
    return result


def _simulated(
    scenario: Scenario,
    meshcat: Meshcat | None = None,
    live: Live | None = None,
    progress: Progress | None = None,
) -> Simulated:
    if scenario.engine == "mujoco":
        return mujoco_engine.simulate(scenario, progress=progress)
    if scenario.robot.legs:
        return leg_engine.simulate(scenario, meshcat=meshcat, live=live, progress=progress)
    return drake_engine.simulate(scenario, meshcat=meshcat, live=live, progress=progress)


def _scene(scenario: Scenario, recording: Recording, summary: Mapping[str, Any], model: str) -> Scene | None:
    """What pages, pictures and videos show; None if there shall be none."""
    settings = scenario.recording
    if not settings.html and settings.video is None:
        return None
    run = SeenRun(name=scenario.name, recording=recording, model=model, summary=summary)
    marks = {"forces": settings.forces, "slip": settings.slip}
    return scene_of([run], view=settings.camera, frames_per_second=settings.frames_per_second, **marks)


def _at_half_step(scenario: Scenario) -> Scenario:
    step = scenario.plant.time_step
    if scenario.engine == "mujoco":
        step = mujoco_engine.time_step(scenario)
    return scenario.model_copy(
        update={"plant": scenario.plant.model_copy(update={"time_step": 0.5 * step}), "check_step": False}
    )


def _named(run: str, failure: str | None) -> str | None:
    return None if failure is None else f"{run}: {failure}"


def _warn_about_step(scenario: Scenario) -> None:
    largest, wheel = scenario.step_rule()
    if scenario.plant.time_step > largest:
        warnings.warn(
            f"{scenario.name}: at the commanded speeds wheel {wheel} turns by more than a sixth of its roller pitch "
            f"in a step of plant.time_step = {scenario.plant.time_step:g} s, so the robot may hop; "
            f"fine: up to {largest:.2g} s",
            RollerbenchWarning,
            stacklevel=3,
        )
