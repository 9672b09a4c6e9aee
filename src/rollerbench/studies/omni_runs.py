"""The simulated figures of Leng and Cao (2007): largest speeds by direction, and a run driven by torques alone."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.kinematics import WheelKinematics, limits
from rollerbench.report.drawing import Curve, curves
from rollerbench.simulation import RunResult, Scenario, load_scenario
from rollerbench.studies.leng_cao import PRINTED
from rollerbench.studies.paper import Picture, Result

Array = NDArray[np.float64]

ANGLES = (90, 60, 30)
"""Angles between neighbouring wheels of the speed runs [deg]."""

QUANTISED = "speeds_60_in_steps"

DIRECTIONS_DEG = np.arange(90.0, 450.0, 10.0)
"""Directions of a speed run, one after the other, from the slowest on [deg]."""

CHANGE, STEADY = 1.0, 0.4
"""Times of a change of direction, and at a steady speed before the next one [s]."""

SPEED_STEP = 0.1
"""Step of the wheels' surface speeds in the paper's simulation [m/s]."""

DIRECTION, ACCELERATION, WAY = math.radians(45), 1.0, 0.7 * math.sqrt(2)
"""Of figure 12 [rad, m/s2, m]."""

PUSH_STEP = 5e-4
"""Time step of figure 12 [s]."""


def scenarios(robot_of: Callable[[float], Robot]) -> dict[str, Scenario]:
    """A run over all directions for each angle between wheels, one with speeds in steps, and the run by torques."""
    made = {}
    for angle in ANGLES:
        summary = f"Every 10 deg as fast as the wheels can, wheels {angle} deg apart"
        made[f"speeds_{angle}"] = _round_trip(f"speeds_{angle}", summary, robot_of(angle), _polygon(robot_of(angle)))
    summary = "The same with wheel speeds in steps of 0.1 m/s, wheels 60 deg apart"
    made[QUANTISED] = _round_trip(QUANTISED, summary, robot_of(60), _quantised(robot_of(60)))
    robot = robot_of(60)
    efforts = limits.wheel_efforts(robot, DIRECTION, ACCELERATION, roll_resistance=PRINTED.roll_resistance)
    made["figure_12"] = load_scenario(
        {
            "name": "figure_12",
            "summary": "Driven by the torques for 1 m/s2 along 45 deg alone",
            "robot": _without_limits(robot),
            "duration": 1.5,
            "command": {
                "type": "wheel_efforts",
                "wheel_efforts": {w.name: float(t) for w, t in zip(robot.wheels, efforts, strict=True)},
            },
            "ground": {"friction": PRINTED.adhesion, "roll_resistance": PRINTED.roll_resistance},
            "plant": {"time_step": PUSH_STEP},
        }
    )
    return made


def figure_11(runs: Mapping[str, RunResult], robot_of: Callable[[float], Robot]) -> tuple[list[Result], Picture]:
    """Largest speeds found in simulation beside those of the equations."""
    results, panel = [], []
    for name in [*(f"speeds_{angle}" for angle in ANGLES), QUANTISED]:
        robot = robot_of(float(name.split("_")[1]))
        wanted = _quantised(robot) if name == QUANTISED else _polygon(robot)
        found = _found(runs[name])
        apart = f"{name.split('_')[1]} deg"
        steps = ", wheel speeds in steps of 0.1 m/s" if name == QUANTISED else ""
        worst = int(np.argmax(np.linalg.norm(found - wanted, axis=1) / np.linalg.norm(wanted, axis=1)))
        for index in sorted({0, 27, worst}):
            which = " (worst direction)" if index == worst else ""
            results.append(
                Result(
                    item="Figure 11",
                    quantity=f"largest speed at {DIRECTIONS_DEG[index] % 360:g} deg{which}, wheels {apart} apart"
                    + steps,
                    unit="m/s",
                    theory=float(np.hypot(*wanted[index])),
                    simulated=float(np.hypot(*found[index])),
                )
            )
        if name != QUANTISED:
            corners = limits.speed_polygon(robot).vertices
            closed = np.vstack([corners, corners[:1]])
            panel.append(Curve(label=f"{apart}, equations", x=closed[:, 0], y=closed[:, 1]))
        style = "x" if name == QUANTISED else "."
        panel.append(Curve(label=f"{apart}{steps}, Drake", x=found[:, 0], y=found[:, 1], style=style))
    picture = Picture(
        name="figure_11",
        title="Figure 11.",
        caption="Largest velocities every 10 deg, the fastest wheel at 1 m/s, for wheels 90, 60 and 30 deg apart. With "
        "wheel speeds in steps of 0.1 m/s, as the paper had them, points scatter about the rhombus: that is arithmetic "
        "and not the robot.",
        svg=curves("speed along x [m/s]", {"speed along y [m/s]": panel}, equal=True),
    )
    return results, picture


def figure_12(run: RunResult) -> tuple[list[Result], Picture]:
    """The way of a robot that torques alone drive."""
    recording = run.recording
    along = np.array([math.cos(DIRECTION), math.sin(DIRECTION)])
    way = recording.q_xyt[:, :2] @ along
    aside = recording.q_xyt[:, :2] @ np.array([-along[1], along[0]])
    there = int(np.searchsorted(way, WAY))
    arrived = float(np.interp(WAY, way, recording.time))
    slip = np.hypot(recording.wheels("slip_x"), recording.wheels("slip_y"))[:there]
    item = "Figure 12"
    results = [
        Result(item=item, quantity="time for 0.7 m along x and y", unit="s", simulated=arrived,
               theory=math.sqrt(2 * WAY / ACCELERATION)),
        Result(item=item, quantity="largest distance from the straight line", unit="m", theory=0.0,
               simulated=float(np.abs(aside[:there]).max())),
        Result(item=item, quantity="yaw at the end", unit="deg", theory=0.0,
               simulated=math.degrees(float(recording.q_xyt[there, 2]))),
        Result(item=item, quantity="rms slip of the wheels", unit="m/s", theory=0.0,
               simulated=float(np.sqrt(np.mean(slip**2)))),
    ]  # fmt: skip
    lines = [
        Curve(label="Drake", x=recording.q_xyt[: there + 1, 0], y=recording.q_xyt[: there + 1, 1]),
        Curve(label="asked for", x=np.array([0.0, 0.7]), y=np.array([0.0, 0.7]), style="--"),
    ]
    picture = Picture(
        name="figure_12",
        title="Figure 12.",
        caption="Path of the robot under the torques that inverse dynamics gives for 1 m/s² along 45 deg; nothing "
        "controls its wheels or its pose.",
        svg=curves("x [m]", {"y [m]": lines}, equal=True),
    )
    return results, picture


def _polygon(robot: Robot) -> Array:
    """Largest velocities (n, 2) in the directions [m/s]."""
    directions = np.radians(DIRECTIONS_DEG)
    speeds = limits.max_speed(robot, directions).value
    polygon: Array = speeds[:, np.newaxis] * np.column_stack([np.cos(directions), np.sin(directions)])
    return polygon


def _quantised(robot: Robot) -> Array:
    """The velocities (n, 2) whose wheel speeds are those of the polygon, rounded to the step [m/s]."""
    kinematics = WheelKinematics(robot)
    radius = robot.wheels[0].radius
    twists = np.column_stack([_polygon(robot), np.zeros(len(DIRECTIONS_DEG))])
    surface = np.round(radius * kinematics.inverse(twists) / SPEED_STEP) * SPEED_STEP
    velocities: Array = kinematics.forward(surface / radius)[:, :2]
    return velocities


def _without_limits(robot: Robot) -> Robot:
    data = robot.model_dump(mode="json", exclude_none=True)
    for wheel in data["wheels"]:
        wheel.pop("max_speed", None)
    return Robot.model_validate(data)


def _round_trip(name: str, summary: str, robot: Robot, velocities: Array) -> Scenario:
    """A run that holds one velocity after the other."""
    pieces: list[dict[str, Any]] = [
        {"duration": CHANGE + STEADY, "v_xyw_B": [*velocity, 0.0]} for velocity in velocities.tolist()
    ]
    pieces[-1]["duration"] += CHANGE
    return load_scenario(
        {
            "name": name,
            "summary": summary,
            "robot": _without_limits(robot),
            "duration": sum(piece["duration"] for piece in pieces),
            "command": {"type": "twist", "pieces": pieces, "ramp": CHANGE},
            "ground": {"friction": PRINTED.adhesion},
            "recording": {"html": False},
        }
    )


def _found(run: RunResult) -> Array:
    """Mean velocities (n, 2) in the steady times [m/s]."""
    recording = run.recording
    found = []
    for index in range(len(DIRECTIONS_DEG)):
        start = index * (CHANGE + STEADY) + CHANGE
        first, last = np.searchsorted(recording.time, [start + 0.05 * STEADY, start + 0.95 * STEADY])
        turn = recording.q_xyt[first, 2]
        moved = recording.q_xyt[last, :2] - recording.q_xyt[first, :2]
        moved /= recording.time[last] - recording.time[first]
        cos, sin = math.cos(turn), math.sin(turn)
        found.append([cos * moved[0] + sin * moved[1], cos * moved[1] - sin * moved[0]])
    return np.array(found)
