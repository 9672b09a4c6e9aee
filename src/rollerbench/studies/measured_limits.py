"""What simulated robots can do in each direction: speed, slip onset and efforts, to lay over the theory."""

import math
import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator

from rollerbench.analysis.limits import Capability
from rollerbench.description import Robot, load_robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import SimulationError
from rollerbench.kinematics import limits
from rollerbench.kinematics.limits.loads import supporting_wheels
from rollerbench.plant import follow_rollers
from rollerbench.recording import Recording
from rollerbench.report.limits import Measured, Points
from rollerbench.sdf.contact import static_penetration
from rollerbench.simulation.drake_engine import simulate
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.station import Station

Array = NDArray[np.float64]

PUSH_RAMP, SLIP_TIME, SLIP_STEPS = 1.6, 3.0, 60
"""Runs that look for slip: time in which the push builds up, and whole time, in periods of the robot bouncing on its
wheels, and steps. The loads must be able to follow, and the wheels still have to stand as the equations have it: later
their rollers lift them by more than they sink in, and their loads come and go."""

SLIPPING = 0.1
"""A wheel slides when its slip grows by more than this share of the robot's acceleration [-]."""

LIFTED = 0.001
"""A wheel with less than this part of the mean load has lifted off [-]."""

EFFORT_STEP = 2e-3
"""Step of runs that measure efforts [s]."""

BISECTIONS = 6

GENTLE = 1.5
"""Acceleration towards the largest speed [m/s2]."""

STEADY_TIME = 0.8
"""How long a robot runs at it [s]."""

START_TIME = 0.8
"""Time of the smooth start in which efforts are measured [s]."""

DIRECTION_STEP_DEG = 10.0
"""Step of the directions [deg]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    robot: Robot
    direction: float
    roll_resistance: float
    ground_friction: float | None
    acceleration: float


def measure_limits(
    found: Capability, progress: Callable[[float, float], None] | None = None, *, workers: int | None = None
) -> Measured:
    """Simulates an analysed robot every 10 deg, or in the few directions that it can go, on all cores.

    Args:
        found: What theory says.
        progress: Called with the directions that are done and the directions there are.
        workers: Number of processes; by default one for each core.

    Returns:
        "speed": speeds with a wheel at its limit [m/s]; "acceleration": those at which a wheel begins to slide or lifts
        off under the efforts of `limits.wheel_efforts`, whatever its motors can do [m/s2]; "efforts": those of the
        wheels' servos at the reference acceleration of found [N m]. NaN where a simulation failed, or no wheel slid at
        four times the acceleration of theory.
    """
    few = found.directions[found.goes & (found.directions < 2 * np.pi - 1e-9)]
    directions = np.radians(np.arange(0.0, 360.0, DIRECTION_STEP_DEG)) if found.all_round else few
    tasks = [
        _Task(
            robot=found.robot,
            direction=float(direction),
            roll_resistance=found.roll_resistance,
            ground_friction=found.ground_friction,
            acceleration=float(found.map_accelerations[found.reference]),
        )
        for direction in directions
    ]
    if not tasks:
        return {}
    rows: list[tuple[float, float, Array]] = []
    # Processes that start afresh: Drake's threads do not survive a fork.
    count = min(len(tasks), workers or os.cpu_count() or 1)
    with ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn")) as pool:
        for row in pool.map(_measure, tasks):
            rows.append(row)
            if progress is not None:
                progress(float(len(rows)), float(len(tasks)))
    columns = zip(*rows, strict=True)
    names = ("speed", "acceleration", "efforts")
    return {
        name: Points(directions=directions, values=np.array(column))
        for name, column in zip(names, columns, strict=True)
    }


def _measure(task: _Task) -> tuple[float, float, Array]:
    """Speed, acceleration and efforts; NaN where the robot tips over or leaves the ground."""

    def or_nan(measure: Callable[[_Task], Any], nothing: Any) -> Any:
        try:
            return measure(task)
        except SimulationError:
            return nothing

    none = np.full(len(task.robot.driven_wheels), np.nan)
    return or_nan(_speed, math.nan), or_nan(_slip_onset, math.nan), or_nan(_efforts, none)


def _speed(task: _Task) -> float:
    """Mean speed along the direction once the wheels turn as fast as they may."""
    wanted = float(limits.max_speed(task.robot, task.direction).value)
    if not math.isfinite(wanted):
        return math.nan
    ramp = max(0.2, wanted / GENTLE)
    command = _twist(task, wanted * (1 - 1e-9), ramp)
    duration = 2 * ramp + STEADY_TIME
    largest, _ = _scenario(task, task.robot, duration, command).step_rule()
    recording = _recorded(_scenario(task, task.robot, duration, command, time_step=min(0.005, 0.9 * largest)))
    steady = np.flatnonzero((recording.time > ramp + 0.05) & (recording.time < ramp + STEADY_TIME))
    first, last = steady[0], steady[-1]
    way = recording.q_xyt[last, :2] - recording.q_xyt[first, :2]
    return float(np.hypot(*way) / (recording.time[last] - recording.time[first]))


def _slip_onset(task: _Task) -> float:
    """Acceleration at which the efforts of inverse dynamics make a wheel slide or lift off, by bisection."""
    robot = _strong(task)
    limit = limits.max_acceleration(
        robot,
        task.direction,
        sharing="least_norm",
        roll_resistance=task.roll_resistance,
        ground_friction=_ground(task),
    )
    wanted = float(limit.value)
    if not math.isfinite(wanted) or wanted <= 0:
        return math.nan
    low, high = 0.8 * wanted, 1.2 * wanted
    if _gives_way(task, robot, low):
        low = 0.0
    if not _gives_way(task, robot, high):
        high = 4.0 * wanted
        if not _gives_way(task, robot, high):
            return math.nan
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _gives_way(task, robot, middle) else (middle, high)
    return 0.5 * (low + high)


def _gives_way(task: _Task, robot: Robot, acceleration: float) -> bool:
    efforts = _wheel_efforts(task, robot, acceleration)
    bounce = 2 * math.pi * math.sqrt(static_penetration(robot) / GRAVITY)
    duration = SLIP_TIME * bounce
    command = {
        "type": "wheel_efforts",
        "ramp": PUSH_RAMP * bounce,
        "wheel_efforts": {
            wheel.name: float(effort) for wheel, effort in zip(robot.driven_wheels, efforts, strict=True)
        },
    }
    # Twice as long, so that the push has not begun to end.
    scenario = _scenario(task, robot, 2 * duration, command, time_step=duration / SLIP_STEPS)
    station = Station(scenario, visuals=False)
    simulator = Simulator(station)
    follow_rollers(simulator)
    simulator.AdvanceTo(duration)
    context = simulator.get_context()
    slip, loads = (station.GetOutputPort(name).Eval(context) for name in ("slip", "normal_forces"))
    carrying = loads[supporting_wheels(robot)]
    return bool(np.max(slip) > SLIPPING * acceleration * duration or np.min(carrying) < LIFTED * np.mean(carrying))


def _efforts(task: _Task) -> Array:
    """Mean efforts of the servos in the middle of a smooth start, where the acceleration is nearly even."""
    robot = _strong(task)
    if not np.isfinite(_wheel_efforts(task, robot, task.acceleration)).all():
        return np.full(len(robot.driven_wheels), np.nan)
    # A cubic step rises by 0.296 of its height in the middle fifth of its time.
    command = _twist(task, task.acceleration * START_TIME * 0.2 / 0.296, START_TIME)
    recording = _recorded(_scenario(task, robot, 2 * START_TIME, command, time_step=EFFORT_STEP))
    middle = np.abs(recording.time / START_TIME - 0.5) < 0.1
    driven = [index for index, wheel in enumerate(robot.wheels) if wheel.driven]
    mean: Array = recording.wheels("effort")[middle][:, driven].mean(axis=0)
    return mean


def _wheel_efforts(task: _Task, robot: Robot, acceleration: float) -> Array:
    return limits.wheel_efforts(robot, task.direction, acceleration, roll_resistance=task.roll_resistance, strict=False)


def _strong(task: _Task) -> Robot:
    """The robot with motors without limits, its swivelling wheels turned to the direction."""
    data = task.robot.model_dump(mode="json", exclude_none=True)
    for wheel, friction in zip(data["wheels"], _friction(task), strict=True):
        wheel["friction"] = friction * _ground(task) / (2 * _ground(task) - friction)
        for name in ("max_speed", "max_effort", "max_steering_speed", "max_steering_effort"):
            wheel.pop(name, None)
        if wheel["type"] in ("castor", "steered"):
            wheel["heading_deg"] = math.degrees(task.direction)
    return load_robot(data)


def _friction(task: _Task) -> list[float]:
    """Coefficients of friction between the wheels and the ground: a wheel's a and the ground's b make 2ab / (a + b)."""
    own, ground = [wheel.friction for wheel in task.robot.wheels], task.ground_friction
    return own if ground is None else [2 * a * ground / (a + ground) for a in own]


def _ground(task: _Task) -> float:
    """Friction of a ground that with wheels as those of `_strong` makes `_friction`."""
    return max(_friction(task))


def _twist(task: _Task, speed: float, ramp: float) -> dict[str, Any]:
    v_xyw_B = [speed * math.cos(task.direction), speed * math.sin(task.direction), 0.0]
    return {"type": "twist", "v_xyw_B": v_xyw_B, "ramp": ramp, "infeasible": "project"}


def _scenario(
    task: _Task, robot: Robot, duration: float, command: dict[str, Any], time_step: float = 0.005
) -> Scenario:
    return load_scenario(
        {
            "name": "limits",
            "robot": robot,
            "duration": duration,
            "command": command,
            "plant": {"time_step": time_step},
            "ground": {"roll_resistance": task.roll_resistance, "friction": _ground(task)},
        }
    )


def _recorded(scenario: Scenario) -> Recording:
    simulated = simulate(scenario)
    if simulated.failure is not None:
        raise SimulationError(f"{scenario.robot.name}: {simulated.failure}")
    return simulated.recording
