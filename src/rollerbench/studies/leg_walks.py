"""Figure 8 of Song et al.: a hexapod crawls like an insect and walks like a mammal, as planned and as simulated."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot, load_robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.kinematics.gaits import LegCommand, LegMode
from rollerbench.report.drawing import Curve, curves, gait_diagram
from rollerbench.resources import scenario_files
from rollerbench.simulation import RunResult, Scenario, load_scenario
from rollerbench.simulation.rehearsal import rehearse
from rollerbench.studies.paper import Picture, Result

Array = NDArray[np.float64]

DURATION, PERIOD = 5.0, 0.01
"""Of the planned walks, and of a period of control [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """A walk of figure 8.

    Attributes:
        figure: Its letter.
        name: What it is called.
        posture: The robot's posture.
        speed: Speed ahead [m/s].
    """

    figure: str
    name: str
    posture: str
    speed: float


WALKS = {
    "hexapod_tripod_walk": Walk(figure="a", name="insect crawl", posture="insect", speed=0.2),
    "hexapod_mammal_walk": Walk(figure="b", name="mammal walk", posture="mammal", speed=0.15),
}
"""By the scenario that simulates it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedWalk:
    """What a plan has body and feet do over n periods.

    Attributes:
        time: Times (n,) [s].
        q_xyt: Planar poses (n, 3) of the body [m, m, rad].
        feet: Lowest points (n, k, 3) of the feet's wheels [m].
        on_ground: Which feet (n, k) are on the ground.
        margins: Static margins (n,) [m].
        q_rates: Joint speeds (n, k, 4) [rad/s].
    """

    time: Array
    q_xyt: Array
    feet: Array
    on_ground: NDArray[np.bool_]
    margins: Array
    q_rates: Array


def scenarios() -> dict[str, Scenario]:
    """The walks, as far as they are shipped."""
    return {name: load_scenario(name) for name in WALKS if name in scenario_files()}


def planned(walk: Walk, robot: Robot) -> PlannedWalk:
    """Has ideal legs carry out a walk, without a simulation."""
    mode = LegMode(posture=walk.posture)
    command = LegCommand(v_xyw_B=np.array([walk.speed, 0.0, 0.0]), offset=np.zeros(6), mode=mode)
    gravity = np.array([0.0, 0.0, -GRAVITY])
    found = rehearse(robot, [(np.inf, command)], DURATION, PERIOD, gravity, walk.name)
    return PlannedWalk(
        time=found.time,
        q_xyt=np.array([plan.q_xyt for plan in found.plans]),
        feet=np.array([plan.feet_P for plan in found.plans]),
        on_ground=np.array([plan.swing < 0 for plan in found.plans]),
        margins=found.margins,
        q_rates=found.q_rates,
    )


def walk_findings(scenario: str, run: RunResult | None) -> tuple[list[Result], list[Picture]]:
    """A walk as planned and, where there is a run of its scenario, as simulated.

    Args:
        scenario: One of `WALKS`.
        run: The run of the scenario of this name, if it is shipped.
    """
    walk = WALKS[scenario]
    robot = load_robot("wheel_leg_hexapod") if run is None else run.scenario.robot
    plan = planned(walk, robot)
    results, pictures = _plan_results(walk, plan), _plan_pictures(walk, plan, robot, run)
    return (results if run is None else [*results, *_run_results(walk, run)]), pictures


def _plan_results(walk: Walk, plan: PlannedWalk) -> list[Result]:
    item = f"Figure 8{walk.figure}, {walk.name}"
    walking = plan.time > 1.0
    numbers = {
        (f"way ahead in {DURATION:g} s at {walk.speed:g} m/s, planned", "m"): plan.q_xyt[-1, 0],
        ("share of the time that a foot is on the ground", "-"): plan.on_ground[walking].mean(),
        ("fewest feet on the ground", "-"): plan.on_ground.sum(axis=1).min(),
        ("largest height of a foot over the ground", "mm"): 1e3 * plan.feet[..., 2].max(),
        ("smallest static margin", "mm"): 1e3 * plan.margins.min(),
        ("largest joint speed", "rad/s"): np.abs(plan.q_rates).max(),
    }
    return [
        Result(item=item, quantity=quantity, unit=unit, theory=float(value))
        for (quantity, unit), value in numbers.items()
    ]


def _run_results(walk: Walk, run: RunResult) -> list[Result]:
    """How the simulated body follows its reference."""
    item, recording = f"Figure 8{walk.figure}, {walk.name}", run.recording
    columns, reference, simulated = recording.columns, recording.reference_q_xyt, recording.q_xyt
    away = np.hypot(*(simulated - reference)[:, :2].T)
    numbers = {
        ("way ahead of the simulated walk", "m"): (reference[-1, 0], simulated[-1, 0]),
        ("largest distance of the body from its reference", "mm"): (0.0, 1e3 * away.max()),
        ("largest error of the heading", "deg"): (
            0.0, np.degrees(np.abs(simulated - reference)[:, 2].max())),
        ("largest roll or pitch", "deg"): (
            0.0, np.degrees(max(np.abs(columns["roll"]).max(), np.abs(columns["pitch"]).max()))),
        ("range of the body's height", "mm"): (0.0, 1e3 * np.ptp(columns["z"])),
    }  # fmt: skip
    return [
        Result(item=item, quantity=quantity, unit=unit, theory=float(theory), simulated=float(value))
        for (quantity, unit), (theory, value) in numbers.items()
    ]


def _plan_pictures(walk: Walk, plan: PlannedWalk, robot: Robot, run: RunResult | None) -> list[Picture]:
    legs = [leg.name for leg in robot.legs]
    panels = {
        "way ahead [m]": [Curve(label="planned", x=plan.time, y=plan.q_xyt[:, 0])],
        "static margin [mm]": [Curve(label="planned", x=plan.time, y=1e3 * plan.margins)],
    }
    if run is not None:
        recording = run.recording
        columns, t = recording.columns, recording.time
        panels["way ahead [m]"].append(Curve(label="simulated", x=t, y=columns["x"], style="--"))
        panels["way aside [mm]"] = [Curve(label="simulated", x=t, y=1e3 * columns["y"])]
        panels["height, from the start [mm]"] = [
            Curve(label="simulated", x=t, y=1e3 * (columns["z"] - columns["z"][0]))
        ]
        panels["attitude [deg]"] = [
            Curve(label=name, x=t, y=np.degrees(columns[name]), style=style)
            for name, style in (("roll", "-"), ("pitch", "--"), ("yaw", "-."))
        ]
    heights = {name: 1e3 * plan.feet[:, index, 2] for index, name in enumerate(legs)}
    on_ground: Mapping[str, NDArray[np.bool_]] = {name: plan.on_ground[:, index] for index, name in enumerate(legs)}
    shown = "" if run is None else " Simulated: the body of the run below."
    return [
        Picture(
            name=f"figure_08{walk.figure}",
            title=f"Figure 8{walk.figure}, {walk.name}: the gait.",
            caption=f"Planned heights of the feet at {walk.speed:g} m/s; bars show which feet are on the ground.",
            svg=gait_diagram(plan.time, heights, on_ground),
        ),
        Picture(
            name=f"figure_08{walk.figure}_body",
            title=f"Figure 8{walk.figure}, {walk.name}: the body.",
            caption="Way of the body, and level distance of the centre of mass from the edge of the polygon of the "
            f"feet on the ground.{shown}",
            svg=curves("time [s]", panels),
        ),
    ]
