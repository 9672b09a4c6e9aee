"""Simulates a scenario of a robot on legs with Drake."""

import math

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator

from rollerbench.plant import RobotModel
from rollerbench.simulation.advance import Restart, advance, configure
from rollerbench.simulation.leg_log import leg_recording
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.live import Live, LiveShow
from rollerbench.simulation.log import Progress, Simulated
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.watch import NOT_FINITE, TIP_ANGLE, tilt

FALLEN = 0.5
"""A body below this share of the height that it should have has fallen [-]."""


def simulate(
    scenario: Scenario,
    *,
    meshcat: Meshcat | None = None,
    live: Live | None = None,
    progress: Progress | None = None,
) -> Simulated:
    """Runs a scenario in Drake; a meshcat shows it, paced if it is live.

    Raises:
        DescriptionError: the legs cannot do what they are asked, or Drake refuses a setting.
    """
    # Ideal legs rehearse the command, and refuse what they cannot do before anything is simulated.
    _ = scenario.rehearsal
    station = LegStation(scenario, meshcat=meshcat, log=True, visuals=meshcat is not None)
    simulator = Simulator(station)
    configure(simulator, scenario)
    restart = Restart(simulator, station.parts.logs.values())
    simulator.Initialize()
    watch, show = _Watch(simulator, station), None
    if meshcat is not None:

        def go_back() -> None:
            restart()
            watch.halted = None

        show = LiveShow(meshcat, simulator, scenario, restart=go_back, live=live)
    advanced = advance(simulator, scenario, watch.look, progress, show)
    failure = advanced.failure or watch.halted
    recording = leg_recording(station, scenario, simulator.get_context())
    return Simulated(recording=recording, failure=failure, wall_time=advanced.wall_time)


class _Watch:
    """Looks whether a robot fell, and remembers when it first halted.

    Attributes:
        halted: When and why it halted, in words, or None.
    """

    def __init__(self, simulator: Simulator, station: LegStation) -> None:
        self._parts, context = station.parts, simulator.get_context()
        self._plant_context = station.parts.model.plant.GetMyContextFromRoot(context)
        self._planner_context = station.parts.planner.GetMyContextFromRoot(context)
        self.halted: str | None = None

    def look(self) -> str | None:
        """What makes going on useless, in words, or None."""
        plan = self._parts.planner.plan(self._planner_context)
        if plan.activity == "halt" and self.halted is None:
            self.halted = f"at t = {plan.time:.2f} s the robot halted: {plan.status}"
        return fall(self._parts.model, self._plant_context, plan.desired[2])


def fall(model: RobotModel, context: object, height: float) -> str | None:
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
