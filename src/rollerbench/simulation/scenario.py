"""What a run simulates: robot, command, controller, plant, ground. From and to scenario.yaml."""

import copy
import math
from collections.abc import Iterator, Mapping, Sequence
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
from rollerbench.kinematics.profile import reference_poses
from rollerbench.resources import scenario_file
from rollerbench.sdf.window import size_on_bumps
from rollerbench.simulation.commands import Command, WheelEffortsCommand, WheelSpeedsCommand
from rollerbench.simulation.imperfections import Errors
from rollerbench.simulation.leg_command import GaitCommand
from rollerbench.simulation.rehearsal import Rehearsal, rehearse
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
        problems = list(self.command.problems(self.robot, self.duration, self.plant.time_step))
        problems += self.errors.problems(self.robot)
        problems += _leg_problems(self) if self.robot.legs else _wheel_problems(self)
        if self.wheel_control.pid is not None and self.wheel_control.servo != "pid":
            problems.append(Problem(("controller", "pid"), "gains without their controller; accepted: with servo: pid"))
        if isinstance(self.command, WheelEffortsCommand) and self.ground.slope_deg:
            message = "torques have a reference on level ground only; accepted: 0, or another command"
            problems.append(Problem(("ground", "slope_deg"), message, self.ground.slope_deg))
        if isinstance(self.command, WheelEffortsCommand) and self.errors.drives(self.robot) is not None:
            message = (
                "torques do not go through a drivetrain; accepted: without gear_error, backlash_deg, encoder_counts"
            )
            problems.append(Problem(("errors",), message))
        if self.plant.time_step > self.duration:
            message = f"accepted: at most the duration, {self.duration:g}"
            problems.append(Problem(("plant", "time_step"), message, self.plant.time_step))
        refuse(problems)
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
            twist = self.command.twist(self.robot, self.duration, self.plant.time_step)
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


def _wheel_problems(scenario: Scenario) -> Iterator[Problem]:
    if not scenario.robot.driven_wheels:
        yield Problem(("robot",), "no wheel is driven; accepted: a robot with driven: true somewhere")
    if isinstance(scenario.controller, LegControl):
        message = "the robot has no legs; accepted: open_loop, pose_tracking"
        yield Problem(("controller", "type"), message, scenario.controller.type)
    if scenario.tracking is not None:
        yield from _tracking_problems(scenario, scenario.tracking)
    if scenario.ground.steps:
        yield Problem(("ground", "steps"), "for robots on legs only; accepted: errors.ground_bumps for wheels")


def _tracking_problems(scenario: Scenario, tracking: PoseTracking) -> Iterator[Problem]:
    yield from _period_problems(scenario, tracking.period)
    if isinstance(scenario.command, WheelEffortsCommand):
        message = "torques are given, so none are left to feedback; accepted: twist, wheel_speeds, waypoints, path"
        yield Problem(("command", "type"), message, scenario.command.type)
    if scenario.engine != "drake":
        message = "feedback of the pose is simulated by Drake only; accepted: drake, or controller: open_loop"
        yield Problem(("engine",), message, scenario.engine)
    if tracking.max_wheel_jerk is not None and tracking.max_wheel_acceleration is None:
        yield Problem(
            ("controller", "max_wheel_jerk"), "accepted: with max_wheel_acceleration", tracking.max_wheel_jerk
        )


def _period_problems(scenario: Scenario, period: float) -> Iterator[Problem]:
    step = scenario.plant.time_step
    if abs(period / step - round(period / step)) > 1e-6 or period < step * (1 - 1e-9):
        message = f"accepted: a multiple of the plant's step, {step:g}"
        yield Problem(("controller", "period"), message, period)


def _leg_problems(scenario: Scenario) -> Iterator[Problem]:
    name, control = scenario.robot.name, scenario.controller
    if not isinstance(scenario.command, GaitCommand):
        yield Problem(("command", "type"), f"{name} stands on legs; accepted: gait", scenario.command.type)
    if isinstance(control, WheelControl) and control != OpenLoop():
        yield Problem(("controller", "type"), f"{name} stands on legs; accepted: legs", control.type)
    yield from _period_problems(scenario, scenario.leg_control.period)
    if scenario.engine != "drake":
        yield Problem(
            ("engine",), f"{name} stands on legs, which only Drake simulates; accepted: drake", scenario.engine
        )
    lift = scenario.command.lift if isinstance(scenario.command, GaitCommand) else math.inf
    for index, rise in enumerate(scenario.ground.steps):
        if rise.height >= lift:
            message = f"feet are lifted by {lift:g} m; accepted: less, or a larger command.lift"
            yield Problem(("ground", "steps", index, "height"), message, rise.height)
        wheels = max(leg.wheel.radius for leg in scenario.robot.legs)
        first, last = scenario.robot.contact_points_B[:, 0].max() + wheels, scenario.robot.contact_points_B[:, 0].min()
        if rise.start < first and rise.end > last - wheels:
            message = f"feet stand there at the start; accepted: {first:.3g} or more"
            yield Problem(("ground", "steps", index, "start"), message, rise.start)
    if scenario.ground.roll_resistance:
        message = "of wheels only; accepted: 0 for a robot on legs"
        yield Problem(("ground", "roll_resistance"), message, scenario.ground.roll_resistance)


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
