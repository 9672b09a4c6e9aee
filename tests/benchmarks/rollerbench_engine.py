"""rollerbench itself: Drake, with all rollers or with those near the ground."""

import itertools
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import MatrixGain, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import rollerbench as rb
from rollerbench.plant import RobotModel
from rollerbench.simulation.drake_config import plant_config

from .engine import Run, Setting
from .motions import Motion

SETTLE_TIME = 0.25
"""Time that a robot stands before it moves [s]."""

MODELS = {"rollerbench windowed": "windowed", "rollerbench full": "full"}
CONTACTS = ("lagged", "similar", "fast")


class RollerbenchEngine:
    """The station of a scenario, without logs, and with the monitor that windowed rollers need."""

    name = "rollerbench"
    notes = "the station of a scenario, odometry included, without logs; errors are those against the full model"

    def __init__(self) -> None:
        self.version = f"{version('rollerbench')} (Drake {version('drake')})"

    def reference(self, effort: str) -> tuple[Setting, Setting]:
        """All rollers, and a tenth of the usual stiction tolerance, at a small step."""
        step = {"smoke": 1e-3, "quick": 5e-4}.get(effort, 2.5e-4)
        options = {"contact_approximation": "lagged", "stiction_tolerance": 1e-5}
        fine = Setting(family="rollerbench full", time_step=step, options=options)
        return fine, fine.with_step(2 * step)

    def ladder(self, effort: str) -> list[Setting]:
        """Both roller models with three approximations at several steps."""
        contacts = {"smoke": ("lagged",)}.get(effort, CONTACTS)
        steps = {"smoke": (5e-3,), "quick": (2e-3, 4e-3, 5e-3)}.get(
            effort, (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 7e-3, 8e-3)
        )
        return [
            Setting(family=family, time_step=step, options={"contact_approximation": contact})
            for family, contact, step in itertools.product(MODELS, contacts, steps)
        ]

    def refinements(self, effort: str) -> Sequence[Mapping[str, Any]]:
        """None: the ladder is all there is."""
        return ()

    def prepare(self, robot: rb.Robot, motions: Sequence[Motion], setting: Setting) -> "RollerbenchRunner":
        """Builds a station for each motion."""
        return RollerbenchRunner(motions, setting)


class RollerbenchRunner:
    """A simulator for each motion, and their states at rest."""

    def __init__(self, motions: Sequence[Motion], setting: Setting) -> None:
        plant = {"roller_model": MODELS[setting.family], "time_step": setting.time_step, **setting.options}
        self._scenarios = [
            rb.load_scenario(motion.scenario, overrides={f"plant.{k}": v for k, v in plant.items()})
            for motion in motions
        ]
        positions = _settled(self._scenarios[0])
        self._simulators, self._starts = [], []
        for scenario in self._scenarios:
            station = rb.build_station(scenario)
            simulator = _simulator(station)
            context = simulator.get_mutable_context()
            model = station.parts.model
            plant_context = model.plant.GetMyMutableContextFromRoot(context)
            model.plant.SetPositions(plant_context, positions)
            _place_upright(model, plant_context, 0.0)
            self._simulators.append(simulator)
            self._starts.append(context.Clone())

    def run(self, index: int) -> Run:
        """Simulates the motion of this index."""
        simulator, scenario = self._simulators[index], self._scenarios[index]
        wall_time = _timed(simulator, self._starts[index], scenario.duration)
        station, context = simulator.get_system(), simulator.get_context()
        pose = np.array(station.GetOutputPort("pose").Eval(context))
        return Run(q_xyt=pose, wall_time=wall_time)

    def close(self) -> None:
        """Nothing is held."""


class CrowdRunner:
    """Several robots in one plant, in a row along y, that all do the same."""

    def __init__(self, motion: Motion, setting: Setting, count: int, spacing: float) -> None:
        """Builds the diagram.

        Args:
            motion: What the robots do.
            setting: How they are simulated.
            count: How many there are.
            spacing: Distance from one to the next [m].
        """
        plant_settings = {"roller_model": MODELS[setting.family], "time_step": setting.time_step, **setting.options}
        overrides = {f"plant.{k}": v for k, v in plant_settings.items()}
        scenario = rb.load_scenario(motion.scenario, overrides=overrides)
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlant(plant_config(scenario), builder)
        windowed = setting.family == "rollerbench windowed"
        extra = {"roller_model": "windowed", "builder": builder} if windowed else {}
        models = [rb.add_robot(plant, scenario.robot, **extra) for _ in range(count)]
        rb.add_ground(plant, friction=scenario.ground.friction)
        plant.Finalize()
        speeds = scenario.motion.wheel_speeds
        trajectory = PiecewisePolynomial.CubicHermite(speeds.breaks, speeds.values.T, speeds.slopes.T)
        source = builder.AddSystem(TrajectorySource(trajectory))
        for model in models:
            servo = builder.AddSystem(MatrixGain(model.desired_state_matrix()))
            builder.Connect(source.get_output_port(), servo.get_input_port())
            builder.Connect(servo.get_output_port(), plant.get_desired_state_input_port(model.model_instance))
        self._diagram, self._duration = builder.Build(), scenario.duration
        self._simulator = _simulator(self._diagram)
        context = self._simulator.get_mutable_context()
        for index, model in enumerate(models):
            model.set_pose(plant.GetMyMutableContextFromRoot(context), (0.0, index * spacing, 0.0))
        self._start = context.Clone()
        self._read = lambda: np.array(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))

    def run(self, index: int) -> Run:
        """Simulates the motion; the pose is not read."""
        wall_time = _timed(self._simulator, self._start, self._duration)
        if not np.isfinite(self._read()).all():
            raise rb.SimulationError("the state is not finite")
        return Run(q_xyt=np.zeros(3), wall_time=wall_time)

    def close(self) -> None:
        """Nothing is held."""


def _timed(simulator: Simulator, start: Context, duration: float) -> float:
    context = simulator.get_mutable_context()
    context.SetTimeStateAndParametersFrom(start)
    simulator.Initialize()
    started = time.perf_counter()
    simulator.AdvanceTo(duration)
    return time.perf_counter() - started


def _simulator(diagram: Any) -> Simulator:
    simulator = Simulator(diagram)
    rb.follow_rollers(simulator)
    return simulator


def _settled(scenario: rb.Scenario) -> NDArray[np.float64]:
    """Positions of the plant after the robot stood for a moment."""
    station = rb.build_station(scenario, command="external")
    simulator = _simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("twist_command").FixValue(context, np.zeros(3))
    model = station.parts.model
    plant_context = model.plant.GetMyMutableContextFromRoot(context)
    model.set_pose(plant_context, (0.0, 0.0, 0.0))
    simulator.Initialize()
    simulator.AdvanceTo(SETTLE_TIME)
    return np.array(model.plant.GetPositions(plant_context))


def _place_upright(model: RobotModel, context: Context, yaw: float) -> None:
    """Back to the origin, at the height and inclination of before."""
    pose = model.plant.EvalBodyPoseInWorld(context, model.body)
    roll, pitch, _ = RollPitchYaw(pose.rotation()).vector()
    upright = RigidTransform(RollPitchYaw(roll, pitch, yaw), [0.0, 0.0, pose.translation()[2]])
    model.plant.SetFreeBodyPose(context, model.body, upright)
