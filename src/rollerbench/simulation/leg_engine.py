"""Simulates a scenario of a robot on legs with Drake."""

import math
import time

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from rollerbench.errors import DescriptionError, SimulationError
from rollerbench.plant import RobotModel
from rollerbench.simulation.drake_config import simulator_config
from rollerbench.simulation.leg_log import leg_recording
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.log import Progress, Simulated
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.watch import CHUNK, NOT_FINITE, TIP_ANGLE, tilt
from rollerbench.visualization.scene import dress_scene

FALLEN = 0.5
"""A body below this share of the height that it should have has fallen [-]."""


def simulate(scenario: Scenario, *, meshcat: Meshcat | None = None, progress: Progress | None = None) -> Simulated:
    """Runs a scenario in Drake; a meshcat records it.

    Raises:
        DescriptionError: the legs cannot do what they are asked, or Drake refuses a setting.
    """
    reference = scenario.rehearsal.reference
    station = LegStation(scenario, meshcat=meshcat, log=True, visuals=meshcat is not None)
    simulator = Simulator(station)
    try:
        ApplySimulatorConfig(simulator_config(scenario), simulator)
    except (RuntimeError, ValueError, SystemExit) as error:
        raise DescriptionError(f"simulator: Drake refuses these settings: {error}") from error
    simulator.Initialize()
    if meshcat is not None:
        dress_scene(meshcat, scenario.robot, reference)
        meshcat.StartRecording(
            frames_per_second=scenario.recording.frames_per_second, set_visualizations_while_recording=True
        )
    started = time.perf_counter()
    failure = _advance(simulator, station, scenario, progress)
    wall_time = time.perf_counter() - started
    recording = leg_recording(station, scenario, simulator.get_context())
    return Simulated(recording=recording, failure=failure, wall_time=wall_time)


def _advance(simulator: Simulator, station: LegStation, scenario: Scenario, progress: Progress | None) -> str | None:
    """Simulates to the end; returns what went wrong, or None."""
    context, parts = simulator.get_context(), station.parts
    plant_context = parts.model.plant.GetMyContextFromRoot(context)
    planner_context = parts.planner.GetMyContextFromRoot(context)
    step, duration = scenario.plant.time_step, scenario.duration
    steps, chunk = math.floor(duration / step + 1e-6), max(1, round(CHUNK / step))
    halted = ""
    try:
        for count in [*range(chunk, steps, chunk), steps]:
            simulator.AdvanceTo(count * step)
            plan = parts.planner.plan(planner_context)
            what = _fall(parts.model, plant_context, plan.desired[2])
            if what is not None:
                return f"at t = {count * step:.3f} s {what}"
            if plan.activity == "halt" and not halted:
                halted = f"at t = {plan.time:.2f} s the robot halted: {plan.status}"
            if progress is not None:
                progress(count * step)
    except KeyboardInterrupt:
        return f"interrupted at t = {context.get_time():.3f} s"
    except SimulationError as error:
        return str(error)
    except (RuntimeError, SystemExit) as error:
        return f"at t = {context.get_time():.3f} s Drake stopped: {error}"
    return halted or None


def _fall(model: RobotModel, context: object, height: float) -> str | None:
    """Whether the robot fell, in words, or None."""
    if not np.isfinite(model.plant.GetPositionsAndVelocities(context, model.model_instance)).all():
        return NOT_FINITE
    pose = model.plant.EvalBodyPoseInWorld(context, model.body)
    angle = tilt(pose.rotation().matrix())
    if angle > TIP_ANGLE:
        return f"the robot tipped over: its body is inclined by {math.degrees(angle):.0f} deg"
    if pose.translation()[2] < FALLEN * height:
        return f"the robot fell: its body is {pose.translation()[2]:.3g} m over the ground instead of {height:.3g}"
    return None
