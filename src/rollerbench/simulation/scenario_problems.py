"""What of a scenario does not fit together."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rollerbench.description.problems import Problem
from rollerbench.errors import KinematicsError
from rollerbench.simulation.commands import WheelEffortsCommand
from rollerbench.simulation.leg_command import GaitCommand
from rollerbench.simulation.settings import LegControl, OpenLoop, PoseTracking, WheelControl

if TYPE_CHECKING:
    from rollerbench.simulation.scenario import Scenario


def scenario_problems(scenario: "Scenario") -> Iterator[Problem]:
    """All problems of a scenario whose sections are valid each by itself."""
    command, control = scenario.command, scenario.wheel_control
    of_command = list(command.problems(scenario.robot, scenario.duration, scenario.plant.time_step))
    yield from of_command
    if not of_command and scenario.is_time_optimal:
        yield from _time_optimal_problems(scenario)
    yield from scenario.errors.problems(scenario.robot)
    yield from _leg_problems(scenario) if scenario.robot.legs else _wheel_problems(scenario)
    if control.pid is not None and control.servo != "pid":
        yield Problem(("controller", "pid"), "gains without their controller; accepted: with servo: pid")
    if isinstance(command, WheelEffortsCommand) and scenario.ground.slope_deg:
        message = "torques have a reference on level ground only; accepted: 0, or another command"
        yield Problem(("ground", "slope_deg"), message, scenario.ground.slope_deg)
    if isinstance(command, WheelEffortsCommand) and scenario.errors.drives(scenario.robot) is not None:
        message = "torques do not go through a drivetrain; accepted: without gear_error, backlash_deg, encoder_counts"
        yield Problem(("errors",), message)
    if scenario.plant.time_step > scenario.duration:
        message = f"accepted: at most the duration, {scenario.duration:g}"
        yield Problem(("plant", "time_step"), message, scenario.plant.time_step)


def _time_optimal_problems(scenario: "Scenario") -> Iterator[Problem]:
    if scenario.ground.slope_deg:
        message = "time_optimal knows the limits on level ground only; accepted: 0, or another command.speed_law"
        yield Problem(("ground", "slope_deg"), message, scenario.ground.slope_deg)
        return
    try:
        needed = scenario.fastest.duration
    except KinematicsError as error:
        yield Problem(("command",), str(error))
        return
    if needed > scenario.duration:
        message = f"the path takes {math.ceil(1e3 * needed) / 1e3:g} s at least; accepted: a duration of that or more"
        yield Problem(("duration",), message, scenario.duration)


def _wheel_problems(scenario: "Scenario") -> Iterator[Problem]:
    if not scenario.robot.driven_wheels:
        yield Problem(("robot",), "no wheel is driven; accepted: a robot with driven: true somewhere")
    if isinstance(scenario.controller, LegControl):
        message = "the robot has no legs; accepted: open_loop, pose_tracking"
        yield Problem(("controller", "type"), message, scenario.controller.type)
    if scenario.tracking is not None:
        yield from _tracking_problems(scenario, scenario.tracking)
    if scenario.ground.steps:
        yield Problem(("ground", "steps"), "for robots on legs only; accepted: errors.ground_bumps for wheels")


def _tracking_problems(scenario: "Scenario", tracking: PoseTracking) -> Iterator[Problem]:
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


def _period_problems(scenario: "Scenario", period: float) -> Iterator[Problem]:
    step = scenario.plant.time_step
    if abs(period / step - round(period / step)) > 1e-6 or period < step * (1 - 1e-9):
        message = f"accepted: a multiple of the plant's step, {step:g}"
        yield Problem(("controller", "period"), message, period)


def _leg_problems(scenario: "Scenario") -> Iterator[Problem]:
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
