"""Runs a scenario: simulate, record, compare with the equations, write the run folder."""

import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.framework import Context

from rollerbench.errors import DescriptionError, RollerbenchWarning, SimulationError
from rollerbench.kinematics.profile import reference_poses
from rollerbench.recording import Recording
from rollerbench.simulation.drake_config import simulator_config
from rollerbench.simulation.folder import check_folder, write_folder
from rollerbench.simulation.log import recording_of
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.station import Station
from rollerbench.simulation.summary import summarize, versions
from rollerbench.simulation.watch import fault
from rollerbench.visualization.scene import SIMULATED_COLOR, draw_path, dress_scene, local_meshcat

SETTLE_TIME = 0.25
"""Time that the robot stands still, in a simulation of its own, to find how it rests on its wheels [s]."""

CHUNK = 0.05
"""Simulated time between two looks at the robot [s]."""

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What came out of a run.

    Attributes:
        scenario: What was simulated.
        recording: Samples over time.
        summary: The content of summary.json.
        folder: The run folder; None if nothing was written.
    """

    scenario: Scenario
    recording: Recording
    summary: Mapping[str, Any]
    folder: Path | None


def run(
    scenario: Scenario | str | Path | Mapping[str, Any],
    *,
    output: str | Path | None = None,
    save: bool = True,
    meshcat: Meshcat | None = None,
    progress: Progress | None = None,
) -> RunResult:
    """Simulates a scenario.

    Args:
        scenario: Scenario, name of a shipped one, path to a scenario.yaml, or its content.
        output: Run folder to write, new or from an earlier run; by default runs/NAME.
        save: Whether to write the run folder.
        meshcat: A Meshcat to show the robot in while it is simulated.
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
    _warn_about_step(scenario)
    keep_page = scenario.recording.html and folder is not None
    if meshcat is None and keep_page:
        meshcat = local_meshcat()
    station = Station(scenario, meshcat=meshcat, log=True)
    simulator = Simulator(station)
    try:
        ApplySimulatorConfig(simulator_config(scenario), simulator)
    except (RuntimeError, ValueError, SystemExit) as error:
        raise DescriptionError(f"simulator: Drake refuses these settings: {error}") from error
    context = simulator.get_mutable_context()
    try:
        _stand_at_rest(simulator, station, scenario)
    except (RuntimeError, SystemExit) as error:
        raise SimulationError(f"{scenario.name}: Drake cannot let the robot stand: {error}") from error

    if meshcat is not None:
        times = np.arange(0.0, scenario.duration, scenario.plant.time_step)
        dress_scene(meshcat, scenario.robot, reference_poses(scenario.motion.twist, times))
        meshcat.StartRecording(
            frames_per_second=scenario.recording.frames_per_second, set_visualizations_while_recording=True
        )
    started = time.perf_counter()
    failure = _advance(simulator, station, scenario, progress)
    wall_time = time.perf_counter() - started
    recording = recording_of(
        station, scenario, context, {"robot": scenario.robot.name, "scenario": scenario.name, **versions()}
    )
    if not len(recording.time):
        raise SimulationError(f"{scenario.name}: {failure}; nothing was recorded")
    page = None
    if meshcat is not None:
        draw_path(meshcat, "simulated", recording.q_xyt, SIMULATED_COLOR, lift=0.004 * scenario.robot.body.size[0])
        meshcat.StopRecording()
        meshcat.PublishRecording()
        page = meshcat.StaticHtml() if keep_page else None
    summary = summarize(scenario, recording, wall_time=wall_time, failure=failure)
    if folder is not None:
        write_folder(folder, scenario, recording, summary, page)
    result = RunResult(scenario=scenario, recording=recording, summary=summary, folder=folder)
    if failure is not None:
        raise SimulationError(f"{scenario.name}: {failure}", result)
    return result


def _stand_at_rest(simulator: Simulator, station: Station, scenario: Scenario) -> None:
    """Starts the robot at the origin, at rest, its weight on its wheels as a moment of standing still leaves it."""
    trial = Station(scenario, command="external")
    waiting = Simulator(trial)
    trial.GetInputPort("v_xyw_B").FixValue(waiting.get_mutable_context(), np.zeros(3))
    model, plant_context = trial.parts.model, _plant_context(trial, waiting)
    model.set_pose(plant_context, (0.0, 0.0, 0.0))
    waiting.AdvanceTo(SETTLE_TIME)
    what = fault(model, plant_context)
    if what is not None:
        raise SimulationError(f"{scenario.name}: before it was to move {what}")
    positions = model.plant.GetPositions(plant_context)
    pose = model.plant.EvalBodyPoseInWorld(plant_context, model.body)

    model, plant_context = station.parts.model, _plant_context(station, simulator)
    model.plant.SetPositions(plant_context, positions)
    roll, pitch, _ = RollPitchYaw(pose.rotation()).vector()
    upright = RigidTransform(RollPitchYaw(roll, pitch, 0.0), [0.0, 0.0, pose.translation()[2]])
    model.plant.SetFreeBodyPose(plant_context, model.body, upright)
    simulator.Initialize()


def _plant_context(station: Station, simulator: Simulator) -> Context:
    return station.parts.model.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())


def _advance(simulator: Simulator, station: Station, scenario: Scenario, progress: Progress | None) -> str | None:
    """Simulates to the end; returns what went wrong, or None."""
    context, model = simulator.get_context(), station.parts.model
    plant_context = model.plant.GetMyContextFromRoot(context)
    step, duration = scenario.plant.time_step, scenario.duration
    # Times are multiples of the step, as Drake counts them, so that the last sample is part of the log.
    steps, chunk = math.floor(duration / step + 1e-6), max(1, round(CHUNK / step))
    try:
        for count in [*range(chunk, steps, chunk), steps]:
            now = count * step
            simulator.AdvanceTo(now)
            what = fault(model, plant_context)
            if what is not None:
                return f"at t = {now:.3f} s {what}"
            if progress is not None:
                progress(now)
    except KeyboardInterrupt:
        return f"interrupted at t = {context.get_time():.3f} s"
    except (RuntimeError, SystemExit) as error:
        return f"at t = {context.get_time():.3f} s Drake stopped: {error}"
    return None


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
