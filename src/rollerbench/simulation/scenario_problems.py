"""What of a scenario does not fit together."""

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from rollerbench.description.problems import Problem
from rollerbench.errors import DescriptionError, KinematicsError
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.tracking import axle_speed, on_an_axle, tracking_law
from rollerbench.kinematics.twist_limits import MAX_SAMPLES, twist_limits
from rollerbench.simulation.commands import WheelEffortsCommand
from rollerbench.simulation.leg_command import GaitCommand
from rollerbench.simulation.settings import LARGEST_GAIN, LegControl, OpenLoop, PoseTracking, WheelControl

if TYPE_CHECKING:
    from rollerbench.simulation.scenario import Scenario


def scenario_problems(scenario: "Scenario") -> Iterator[Problem]:
    """All problems of a scenario whose sections are valid each by itself."""
    found = list(_problems(scenario))
    yield from found
    # Speeds and limits mean something only if all else fits.
    if not found and scenario.tracking is not None:
        yield from _loop_problems(scenario, scenario.tracking)


def _problems(scenario: "Scenario") -> Iterator[Problem]:
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


def _loop_problems(scenario: "Scenario", tracking: PoseTracking) -> Iterator[Problem]:
    """Whether the feedback is slow enough for the period, and for the mean that limits the jerk."""
    kinematics = WheelKinematics(scenario.robot)
    try:
        tracking_law(kinematics)
    except KinematicsError as error:
        yield Problem(("controller", "type"), f"{error}; accepted: open_loop", tracking.type)
        return
    most, speed = LARGEST_GAIN / tracking.period, _axle_speed(scenario, kinematics)
    turning = tracking.heading + math.sqrt(2) * speed * tracking.lateral
    if turning > most * (1 + 1e-9):
        accepted = _four_digits((most - tracking.heading) / (math.sqrt(2) * speed), math.floor)
        message = (
            f"at {speed:.4g} m/s the heading would follow at a rate of {turning:.4g}/s; "
            f"accepted: up to {accepted}, or a shorter controller.period"
        )
        yield Problem(("controller", "lateral"), message, tracking.lateral)
        return
    yield from _jerk_problems(kinematics, tracking, max(tracking.position, turning))


def _axle_speed(scenario: "Scenario", kinematics: WheelKinematics) -> float:
    """Largest commanded speed of a robot with tyres on an axle, along them [m/s]; 0 for others."""
    if not on_an_axle(kinematics):
        return 0.0
    try:
        twist = scenario.motion.twist
    except (KinematicsError, DescriptionError):
        return 0.0  # Who asks for the motion hears why there is none.
    return float(np.abs(axle_speed(kinematics, twist.values)).max())


def _jerk_problems(kinematics: WheelKinematics, tracking: PoseTracking, gain: float) -> Iterator[Problem]:
    """A mean of N twists is late by (N - 1) / 2 periods, on top of the one for which a twist is held."""
    period, acceleration, jerk = tracking.period, tracking.max_wheel_acceleration, tracking.max_wheel_jerk
    if acceleration is None or jerk is None:
        return
    longest = min(math.floor(2 * LARGEST_GAIN / max(gain * period, 1e-9) - 1 + 1e-9), MAX_SAMPLES)
    try:
        samples = twist_limits(kinematics, period, max_wheel_acceleration=acceleration, max_wheel_jerk=jerk).samples
        taken = f"{samples}"
    except KinematicsError:
        # Of positive numbers, only the mean can be refused.
        samples, taken = MAX_SAMPLES + 1, f"more than {MAX_SAMPLES}"
    if samples > longest:
        least = _four_digits(2 * acceleration / (longest * period), math.ceil)
        message = (
            f"it takes a mean of {taken} periods of control, by which the feedback would be too late at gains of "
            f"{gain:.4g}/s; accepted: {least} or more, or a smaller max_wheel_acceleration, or smaller gains"
        )
        yield Problem(("controller", "max_wheel_jerk"), message, jerk)


def _four_digits(value: float, rounding: Callable[[float], int]) -> str:
    """A value of 0 or more, rounded so that it is still accepted."""
    if value <= 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    nearest = round(value / unit)
    whole = nearest if math.isclose(value / unit, nearest, rel_tol=1e-12) else rounding(value / unit)
    return f"{whole * unit:.4g}"


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
