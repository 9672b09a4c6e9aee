"""Simulates a scenario with Drake."""

from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from rollerbench.errors import SimulationError
from rollerbench.plant import follow_rollers
from rollerbench.simulation.advance import Restart, advance, configure
from rollerbench.simulation.live import Live, LiveShow
from rollerbench.simulation.log import Progress, Simulated, provenance, recording_of, station_samples
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.station import Station
from rollerbench.simulation.watch import SETTLE_TIME, fault


def simulate(
    scenario: Scenario,
    *,
    meshcat: Meshcat | None = None,
    live: Live | None = None,
    progress: Progress | None = None,
) -> Simulated:
    """Runs a scenario in Drake; a meshcat shows it, paced if it is live.

    Raises:
        DescriptionError: Drake refuses a setting.
        SimulationError: the robot cannot stand.
    """
    station = Station(scenario, meshcat=meshcat, log=True, visuals=meshcat is not None)
    simulator = Simulator(station)
    follow_rollers(simulator)
    configure(simulator, scenario)
    restart = start_at_rest(simulator, station, scenario)
    show = None
    if meshcat is not None:
        show = LiveShow(meshcat, simulator, scenario, restart=restart, live=live)
    model, plant_context = station.parts.model, _plant_context(station, simulator)
    advanced = advance(simulator, scenario, lambda: fault(model, plant_context), progress, show)
    samples = station_samples(station, scenario, simulator.get_context())
    recording = recording_of(samples, scenario, provenance(scenario, "drake"))
    return Simulated(recording=recording, failure=advanced.failure, wall_time=advanced.wall_time)


def start_at_rest(simulator: Simulator, station: Station, scenario: Scenario) -> Restart:
    """Starts the robot at the origin, at rest, its weight on its wheels as a moment of standing still leaves it.

    Raises:
        SimulationError: the robot cannot stand.
    """
    try:
        _stand(simulator, station, scenario)
        restart = Restart(simulator, station.parts.logs.values())
        simulator.Initialize()
    except (RuntimeError, SystemExit) as error:
        raise SimulationError(f"{scenario.name}: Drake cannot let the robot stand: {error}") from error
    return restart


def _stand(simulator: Simulator, station: Station, scenario: Scenario) -> None:
    trial = Station(scenario, command="rest", visuals=False)
    waiting = Simulator(trial)
    follow_rollers(waiting)
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


def _plant_context(station: Station, simulator: Simulator) -> Context:
    return station.parts.model.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
