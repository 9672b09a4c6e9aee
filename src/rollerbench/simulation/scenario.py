"""What a run simulates: robot, command, controller, plant, ground. From and to scenario.yaml."""

import copy
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from rollerbench.description import Robot, load_robot
from rollerbench.description.files import read_yaml, validate
from rollerbench.description.inertia import GRAVITY
from rollerbench.description.part import Flag, Name, Part, Positive
from rollerbench.description.problems import Problem, refuse
from rollerbench.errors import DescriptionError, RollerbenchError
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.bumps import Bumps
from rollerbench.kinematics.dynamics import RollingDynamics
from rollerbench.kinematics.motion import Motion, effort_motion, twist_motion, wheel_motion
from rollerbench.kinematics.paths import TimeOptimal
from rollerbench.kinematics.profile import reference_poses
from rollerbench.resources import scenario_file
from rollerbench.sdf.window import size_on_bumps
from rollerbench.simulation.commands import Command, WheelEffortsCommand, WheelSpeedsCommand
from rollerbench.simulation.imperfections import Errors
from rollerbench.simulation.leg_command import GaitCommand
from rollerbench.simulation.path_commands import AlongPath
from rollerbench.simulation.rehearsal import Rehearsal, rehearse
from rollerbench.simulation.scenario_problems import scenario_problems
from rollerbench.simulation.settings import (
    Controller,
    Ground,
    LegControl,
    OpenLoop,
    PlantSettings,
    PoseTracking,
    RecordingSettings,
    SimulatorSettings,
    WheelControl,
    with_type,
)


def _robot_from(value: Any, info: ValidationInfo) -> Robot:
    """A Robot from its description, or from a name or path, which is relative to the scenario's folder."""
    folder = (info.context or {}).get("folder")
    try:
        if isinstance(value, str) and folder is not None and _is_robot(Path(folder) / value):
            return load_robot(Path(folder) / value)
        if isinstance(value, str | Path | Mapping | Robot):
            return load_robot(value)
    except RollerbenchError as error:
        refuse([Problem((), str(error))])
    raise ValueError("accepted: the name of a shipped robot, a path to a robot.yaml, or a robot's description")


def _is_robot(path: Path) -> bool:
    try:
        return path.is_file() or (path / "robot.yaml").is_file()
    except OSError:
        return False


class Scenario(Part):
    """One run, fully described.

    Attributes:
        name: Name of the scenario.
        summary: One line for lists.
        robot: The robot; in YAML its name, a path relative to the scenario's file, or its description.
        duration: Simulated time [s].
        command: What the robot is asked to do.
        controller: How the command becomes wheel speeds; or with robots on legs, joint torques.
        plant: How Drake simulates.
        ground: What the robot stands on.
        errors: What differs from robot.yaml in the simulated robot.
        engine: "drake", "mujoco", or "both": Drake, and MuJoCo as a cross-check.
        check_step: Whether to run a second time with half the step, to see what the step does.
        simulator: Further settings of Drake's simulator.
        recording: What the run leaves behind.
        seed: Seed of everything random.
    """

    name: Name
    summary: str = ""
    robot: Annotated[Robot, BeforeValidator(_robot_from, json_schema_input_type=str | Robot)]
    duration: Positive
    command: Command
    controller: Annotated[Controller, BeforeValidator(with_type, json_schema_input_type=Controller)] = Field(
        default=OpenLoop(), discriminator="type"
    )
    plant: PlantSettings = PlantSettings()
    ground: Ground = Ground()
    errors: Errors = Errors()
    engine: Literal["drake", "mujoco", "both"] = "drake"
    check_step: Flag = False
    simulator: SimulatorSettings = SimulatorSettings()
    recording: RecordingSettings = RecordingSettings()
    seed: Annotated[int, Field(strict=True, ge=0)] = 0

    @model_validator(mode="after")
    def _command_fits(self) -> Self:
        refuse(list(scenario_problems(self)))
        return self

    @property
    def wheel_control(self) -> WheelControl:
        """The controller of a robot on wheels."""
        return self.controller if isinstance(self.controller, WheelControl) else OpenLoop()

    @property
    def tracking(self) -> PoseTracking | None:
        """The feedback of the pose of a robot on wheels, if there is any."""
        return self.controller if isinstance(self.controller, PoseTracking) else None

    @property
    def leg_control(self) -> LegControl:
        """The controller of a robot on legs."""
        return self.controller if isinstance(self.controller, LegControl) else LegControl()

    @cached_property
    def rehearsal(self) -> Rehearsal:
        """What ideal legs make of a gait command.

        Raises:
            DescriptionError: they cannot carry it out.
        """
        assert isinstance(self.command, GaitCommand)
        course, gravity = self.command.course(self.robot), -GRAVITY * self.ground.up_W
        return rehearse(self.robot, course, self.duration, self.leg_control.period, gravity, self.name)

    @cached_property
    def simulated_robot(self) -> Robot:
        """The robot with its imperfections.

        Raises:
            DescriptionError: such a robot cannot stand.
        """
        return self.errors.applied(self.robot)

    @cached_property
    def bumps(self) -> Bumps | None:
        """What rises above the level ground.

        Raises:
            DescriptionError: there would be too many bumps, or the command cannot be followed (see `motion`).
        """
        if self.errors.ground_bumps is None:
            return None
        times = np.arange(0.0, self.duration, self.plant.time_step)
        path = reference_poses(self.motion.twist, times)
        return self.errors.ground_bumps.scattered(self.simulated_robot, path, self.seed)

    @property
    def window_size(self) -> int:
        """Number of simulated rollers of a windowed wheel: as many as the ground needs."""
        bumps = self.errors.ground_bumps
        return max(self.plant.roller_window, 0 if bumps is None else size_on_bumps(self.simulated_robot, bumps.height))

    @property
    def is_time_optimal(self) -> bool:
        """Whether the speed of the command is time-optimal."""
        return isinstance(self.command, AlongPath) and self.command.speed_law == "time_optimal"

    @cached_property
    def fastest(self) -> TimeOptimal:
        """The motion of a command whose speed is time-optimal.

        Raises:
            KinematicsError: the robot cannot follow the path.
        """
        assert isinstance(self.command, AlongPath)
        return self.command.fastest(self.robot, self.ground)

    @cached_property
    def motion(self) -> Motion:
        """What the controller makes of the command.

        Raises:
            InfeasibleTwist: a tyre would skid.
            KinematicsError: wheel speeds are commanded, and they do not determine the twist.
            DescriptionError: a wheel would have to turn faster than its max_speed.
        """
        if isinstance(self.command, GaitCommand):
            raise DescriptionError(f"{self.name}: a gait command moves legs; accepted: commands for wheels")
        kinematics = WheelKinematics(self.robot, rollers=self.wheel_control.rollers)
        if isinstance(self.command, WheelEffortsCommand):
            dynamics = RollingDynamics(kinematics, self.ground.roll_resistance)
            efforts = self.command.wheel_effort_profile(self.robot, self.duration, self.plant.time_step)
            motion = effort_motion(dynamics, efforts, self.duration, self.plant.time_step)
        elif isinstance(self.command, WheelSpeedsCommand):
            speeds = self.command.wheel_speed_profile(self.robot, self.duration, self.plant.time_step)
            motion = wheel_motion(kinematics, speeds)
        else:
            step = self.plant.time_step
            optimal = self.is_time_optimal
            twist = self.fastest.twist if optimal else self.command.twist(self.robot, self.duration, step)
            motion = twist_motion(kinematics, twist, project=self.command.infeasible == "project")
        self._require_speeds(motion)
        return motion

    def _require_speeds(self, motion: Motion) -> None:
        for wheel, rate in zip(self.robot.steered_wheels, motion.steering_angles.peak_rate, strict=True):
            limit = getattr(wheel, "max_steering_speed", None)
            if limit is not None and rate > limit * (1 + 1e-9):
                raise DescriptionError(
                    f"{self.name}: the command turns wheel {wheel.name} about its swivel axis at {rate:.4g} rad/s; "
                    f"accepted: up to its max_steering_speed = {limit:g} (slower, or with a rest before the turn)"
                )
        for wheel, peak in zip(self.robot.driven_wheels, motion.wheel_speeds.peak, strict=True):
            if wheel.max_speed is not None and peak > wheel.max_speed * (1 + 1e-9):
                raise DescriptionError(
                    f"{self.name}: the command asks wheel {wheel.name} for {peak:.4g} rad/s; "
                    f"accepted: up to its max_speed = {wheel.max_speed:g}"
                )

    def step_rule(self) -> tuple[float, str | None]:
        """Largest plant step that follows the rollers' hand-over at the commanded speeds [s], and whose it is.

        A wheel may turn by a sixth of its roller pitch in a step. Infinite if no wheel with rollers is commanded.
        """
        if self.robot.legs:
            return math.inf, None
        peak = self.motion.wheel_speeds.peak
        limits = {
            wheel.name: wheel.ring.pitch / 6 / speed
            for wheel, speed in zip(self.robot.driven_wheels, peak, strict=True)
            if wheel.ring is not None and speed > 0
        }
        if not limits:
            return math.inf, None
        name = min(limits, key=limits.__getitem__)
        return float(limits[name]), name


def load_scenario(
    source: str | Path | Mapping[str, Any] | Scenario,
    *,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    robot: str | Path | Robot | None = None,
) -> Scenario:
    """A scenario from the name of a shipped one, a path to a scenario.yaml, or its content.

    Args:
        source: The scenario.
        overrides: Fields to replace, by dotted path: {"plant.time_step": 0.002} or ["plant.time_step=0.002"].
        robot: Another robot than the scenario's.

    Raises:
        ResourceError: there is no such scenario or robot.
        DescriptionError: it is not valid; the message names file, line, field, value and what is accepted.
    """
    path = None
    if isinstance(source, Scenario):
        data: Any = {name: getattr(source, name) for name in Scenario.model_fields}
        if not isinstance(overrides, Mapping) and not overrides and robot is None:
            return source
        data = {name: v if isinstance(v, Robot) else _dumped(v) for name, v in data.items()}
    elif isinstance(source, Mapping):
        data = copy.deepcopy(dict(source))
    else:
        path = scenario_file(source)
        data = read_yaml(path)
    for key, value in _parsed(overrides).items():
        _set(data, key, value)
    if robot is not None:
        data["robot"] = load_robot(robot)
    return validate(Scenario, data, path)


def _dumped(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, Part) else value


def _parsed(overrides: Mapping[str, Any] | Sequence[str]) -> dict[str, Any]:
    if isinstance(overrides, Mapping):
        return dict(overrides)
    result = {}
    for text in overrides:
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise DescriptionError(f"--set {text!r}: accepted: KEY=VALUE, such as plant.time_step=0.002")
        try:
            result[key.strip()] = YAML(typ="safe", pure=True).load(value)
        except (YAMLError, ValueError) as error:
            raise DescriptionError(f"--set {text!r}: the value is not valid YAML") from error
    return result


def _set(data: Any, dotted: str, value: Any) -> None:
    *path, last = dotted.split(".")
    for step in path:
        if step not in data or data[step] is None:
            data[step] = {}
        data = data[step]
        if not isinstance(data, dict):
            raise DescriptionError(f"--set {dotted}: {step} has no fields")
    data[last] = value
