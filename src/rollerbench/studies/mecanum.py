"""Huai and Jin (2022): the ten motions of a Mecanum platform, and a closed trajectory of 100 s."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.odometry import integrate, rotate
from rollerbench.report.drawing import Curve, curves
from rollerbench.simulation import RunResult, Scenario, load_scenario
from rollerbench.studies.paper import Findings, Mistake, Paper, Picture, Result

Array = NDArray[np.float64]

WHEELS = ("front_left", "rear_left", "rear_right", "front_right")
"""The paper's wheels 1 to 4."""

TABLE_1: dict[str, tuple[str, tuple[float, float, float], tuple[float, float, float, float]]] = {
    "+X": ("mecanum_minus_y", (1, 0, 0), (2.5, -2.5, 2.5, -2.5)),
    "-X": ("mecanum_plus_y", (-1, 0, 0), (-2.5, 2.5, -2.5, 2.5)),
    "+Y": ("mecanum_plus_x", (0, 1, 0), (2.5, 2.5, 2.5, 2.5)),
    "-Y": ("mecanum_minus_x", (0, -1, 0), (-2.5, -2.5, -2.5, -2.5)),
    "45 deg": ("mecanum_plus_x_minus_y", (1, 1, 0), (5, 0, 5, 0)),
    "-45 deg": ("mecanum_minus_x_minus_y", (1, -1, 0), (0, -5, 0, -5)),
    "135 deg": ("mecanum_plus_x_plus_y", (-1, 1, 0), (0, 5, 0, 5)),
    "-135 deg": ("mecanum_minus_x_plus_y", (-1, -1, 0), (-5, 0, -5, 0)),
    "counter-clockwise": ("mecanum_turn_counter_clockwise", (0, 0, 1), (-3.5, -3.5, 3.5, 3.5)),
    "clockwise": ("mecanum_turn_clockwise", (0, 0, -1), (3.5, 3.5, -3.5, -3.5)),
}
"""By the paper's motion: our scenario, the velocity (right, forward, counter-clockwise), the printed wheel speeds."""

CLOSED = "youbot_closed_trajectory"


def scenarios() -> dict[str, Scenario]:
    """The ten motions of table 1 and the closed trajectory."""
    return {name: load_scenario(name) for name in [*(name for name, *_ in TABLE_1.values()), CLOSED]}


def body_twist(velocity: tuple[float, float, float]) -> Array:
    """The paper's velocity (right, forward, counter-clockwise) as a twist v_xyw_B."""
    right, forward, turn = velocity
    return np.array([forward, -right, turn], dtype=np.float64)


def evaluate(runs: Mapping[str, RunResult]) -> Findings:
    """Table 1, figures 6 and 7, and the mistakes."""
    table, figure_6, figure_7 = _table_1(runs), _figure_6(runs), _figure_7(runs[CLOSED])
    kinematics = WheelKinematics(runs["mecanum_plus_x"].scenario.robot)
    return Findings(
        results=(*table, *figure_6[0], *figure_7[0]),
        pictures=(*figure_6[1], *figure_7[1]),
        mistakes=_mistakes(kinematics),
    )


def _table_1(runs: Mapping[str, RunResult]) -> list[Result]:
    results = []
    for motion, (name, velocity, printed) in TABLE_1.items():
        recording = runs[name].recording
        steady = (recording.time > 1.0) & (recording.time < 2.0)
        theory = WheelKinematics(runs[name].scenario.robot).inverse(body_twist(velocity))
        for number, (wheel, value) in enumerate(zip(WHEELS, printed, strict=True), start=1):
            results.append(
                Result(item=f"Table 1, {motion}", quantity=f"speed of wheel {number}", unit="rad/s", printed=value,
                       theory=float(theory[recording.wheel_names.index(wheel)]),
                       simulated=float(recording.columns[f"{wheel}.speed"][steady].mean()))
            )  # fmt: skip
    return results


def _figure_6(runs: Mapping[str, RunResult]) -> tuple[list[Result], list[Picture]]:
    """Where the printed wheel speeds lead: by forward kinematics, and in the simulation."""
    results, paths, turns = [], [], []
    for motion, (name, velocity, printed) in TABLE_1.items():
        run, recording = runs[name], runs[name].recording
        kinematics = WheelKinematics(run.scenario.robot)
        wheels = dict(zip(WHEELS, printed, strict=True))
        twist = kinematics.forward([wheels[wheel] for wheel in recording.wheel_names])
        # Each ramp counts half.
        theory = integrate(np.zeros(3), twist, run.scenario.duration - run.scenario.command.model_dump()["ramp"])
        end = recording.q_xyt[-1]
        if velocity[2]:
            results.append(Result(item=f"Figure 6, {motion}", quantity="yaw at the end", unit="deg",
                                  theory=math.degrees(theory[2]), simulated=math.degrees(end[2])))  # fmt: skip
            turns.append(Curve(label=motion, x=recording.time, y=np.degrees(recording.q_xyt[:, 2])))
            continue
        direction = theory[:2] / np.hypot(*theory[:2])
        aside = np.array([-direction[1], direction[0]])
        results += [
            Result(item=f"Figure 6, {motion}", quantity="distance along the motion", unit="m",
                   theory=float(theory[:2] @ direction), simulated=float(end[:2] @ direction)),
            Result(item=f"Figure 6, {motion}", quantity="distance across it", unit="mm",
                   theory=0.0, simulated=float(1e3 * end[:2] @ aside)),
        ]  # fmt: skip
        # The paper's axes: X right, Y forward.
        paths.append(Curve(label=motion, x=-recording.q_xyt[:, 1], y=recording.q_xyt[:, 0]))
    caption = (
        "Paths of the eight translations in the paper's axes, X right and Y forward. Sideways and diagonal paths fall "
        "short by 1.2 and 0.6 %: wheels with twelve rollers are not textbook wheels (see mecanum_platform/README.md)."
    )
    pictures = [
        Picture(
            name="figure_06",
            title="Figure 6.",
            caption=caption,
            svg=curves("X [m]", {"Y [m]": paths}, equal=True),
        ),
        Picture(
            name="figure_06_turns",
            title="Figure 6, the turns.",
            caption="Yaw in the two turns on the spot.",
            svg=curves("time [s]", {"yaw [deg]": turns}),
        ),
    ]
    return results, pictures


def _figure_7(run: RunResult) -> tuple[list[Result], list[Picture]]:
    recording, t = run.recording, run.recording.time
    length = run.summary["path_length"]
    closing = float(np.hypot(*(recording.q_xyt[-1] - recording.q_xyt[0])[:2]))
    rate = recording.columns["wz"]
    results = [
        Result(item="Figure 7", quantity="length of the trajectory", unit="m", theory=length,
               simulated=float(np.sum(np.hypot(*np.diff(recording.q_xyt[:, :2], axis=0).T)))),
        Result(item="Figure 7", quantity="gap between end and start", unit="mm", theory=0.0, simulated=1e3 * closing),
        Result(item="Figure 7", quantity="gap over the length", unit="%", theory=0.0, simulated=100 * closing / length),
        Result(item="Figure 7", quantity="largest change of the heading", unit="deg", theory=0.0,
               simulated=math.degrees(np.abs(recording.q_xyt[:, 2]).max())),
        Result(item="Figure 7", quantity="largest yaw rate (printed: its order)", unit="rad/s", printed=1e-3,
               theory=0.0, simulated=float(np.abs(rate).max())),
        Result(item="Figure 7", quantity="root mean square yaw rate", unit="rad/s",
               theory=0.0, simulated=float(np.sqrt(np.mean(rate**2)))),
    ]  # fmt: skip
    path, reference = recording.q_xyt, recording.reference_q_xyt
    lines = [
        Curve(label="theory", x=reference[:, 0], y=reference[:, 1]),
        Curve(label="simulated", x=path[:, 0], y=path[:, 1], style="--"),
    ]
    pictures = [
        Picture(
            name="figure_07",
            title="Figure 7.",
            caption="Yaw rate on a closed trajectory of 100 s, open loop.",
            svg=curves("time [s]", {"yaw rate [rad/s]": [Curve(label="simulated", x=t, y=rate)]}),
        ),
        Picture(
            name="figure_07_trajectory",
            title="Figure 7, the trajectory.",
            caption="A figure of eight with fixed heading, for the paper prints neither shape nor size.",
            svg=curves("x [m]", {"y [m]": lines}, equal=True),
        ),
    ]
    return results, pictures


def _mistakes(kinematics: WheelKinematics) -> tuple[Mistake, ...]:
    speeds = kinematics.inverse([1.0, 0.0, 0.0])[0], kinematics.inverse([0.0, 0.0, 1.0])
    printed_turn = TABLE_1["counter-clockwise"][2][3]
    delta, half_wheelbase, half_track = math.radians(30), 0.7, 0.7
    velocity = np.array([1.0, 0.5])
    wheel = np.array([half_wheelbase, half_track])
    turned = rotate(delta, velocity)
    moved = integrate([0.0, 0.0, delta], [1.0, 0.0, 0.5], 1.0)
    return (
        Mistake(
            where="Section 4.1",
            claim="Table 1 was computed with L = K = r = 0.6 m.",
            correction="It needs r = 0.4 m and L + K = 1.4 m, which the robot here has.",
            proof={
                "wheel speed at 1 m/s with r = 0.6 m": (1 / 0.6, "rad/s"),
                "with r = 0.4 m": (float(speeds[0]), "rad/s"),
                "in table 1": (2.5, "rad/s"),
                "wheel speed at 1 rad/s with L = K = r = 0.6 m": (1.2 / 0.6, "rad/s"),
                "with r = 0.4 m and L + K = 1.4 m": (float(np.abs(speeds[1]).max()), "rad/s"),
                "in table 1, as printed": (printed_turn, "rad/s"),
            },
        ),
        Mistake(
            where="Equation (2)",
            claim="The wheel's velocity is the sum of the platform's and the product w R.",
            correction="It is a cross product of vectors, as (5) then writes: sizes do not add up.",
            proof={
                "speed of a wheel at (0.7, 0.7) m, platform at (1, 0) m/s and 1 rad/s, sizes added": (
                    1.0 + float(np.hypot(*wheel)), "m/s"),
                "with the cross product": (float(np.hypot(1.0 - wheel[1], wheel[0])), "m/s"),
            },
        ),
        Mistake(
            where="Equations (8) and (11)",
            claim="The yaw rate is the angle delta.",
            correction="It is the rate of delta.",
            proof={
                "delta of a platform that turned at 0.5 rad/s for 1 s from 30 deg": (float(moved[2]), "rad"),
                "its yaw rate": (0.5, "rad/s"),
            },
        ),
        Mistake(
            where="Equation (10)",
            claim="The world's velocity on the left is the rotated world's velocity.",
            correction="On the left belongs the velocity in the platform's axes.",
            proof={
                "largest violation as printed, at delta = 30 deg for a world velocity of (1, 0.5) m/s": (
                    float(np.abs(rotate(-delta, velocity) - velocity).max()), "m/s"),
                "with the platform's velocity on the left: violation of (9) after (10)": (
                    float(np.abs(rotate(-delta, turned) - velocity).max()), "m/s"),
            },
        ),
    )  # fmt: skip


PAPER = Paper(
    name="mecanum",
    title="Mecanum platform: ten motions and a closed trajectory",
    citation="Huai C., Jin Z. (2022): Simulation analysis of mobile platform of grinding robot based on Mcnamu wheel. "
    "Journal of East China Jiaotong University 39(5), 112-119.",
    introduction=(
        "Table 1 and figure 6 were simulated with the dimensions that the table needs, r = 0.4 m and L + K = 1.4 m, "
        "and figure 7 with the base of the KUKA youBot, which the paper's simulation used too.",
        "The paper's axes are X right and Y forward; its wheels 1 to 4 are front left, rear left, rear right and front "
        "right. Sideways and in turns the simulated platform falls short of the equations, for they hold for "
        "infinitely many rollers; wheels here have twelve.",
    ),
    scenarios=scenarios,
    evaluate=evaluate,
)
