"""Leng and Cao (2007): speed, acceleration and efforts of four omni wheels by direction of travel."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import OmniWheel, Robot, load_robot
from rollerbench.description.mass import axle_inertia, roller_inertia
from rollerbench.kinematics import limits
from rollerbench.report.drawing import Curve, curves, surface
from rollerbench.simulation import RunResult, Scenario
from rollerbench.studies import leng_cao, omni_runs
from rollerbench.studies.leng_cao import PRINTED
from rollerbench.studies.omni_mistakes import mistakes
from rollerbench.studies.paper import Findings, Paper, Picture, Result

Array = NDArray[np.float64]

ANGLES = (90.0, 60.0, 30.0)
"""Angles delta between neighbouring wheels of figure 3 [deg]."""

EQUAL_LOADS = [PRINTED.weight / 4] * 4
"""The paper's loads of the wheels [N]."""

CLOSE, FARTHER = 60.0, 0.4
"""Wheels closer together than this [deg] stand so far from Bo [m]: at 0.28 m they would overlap."""


def paper_robot(delta_deg: float) -> Robot:
    """The paper's robot: omni_platform with the printed inertias and adhesion, wheels at +-delta/2 and opposite.

    Args:
        delta_deg: Angle between neighbouring wheels [deg].
    """
    robot = load_robot("omni_platform")
    template = _with_inertias(robot.wheels[0])
    distance = template.distance if delta_deg >= CLOSE else FARTHER
    half = 0.5 * delta_deg
    wheels = tuple(
        template.model_copy(update={"name": wheel.name, "azimuth_deg": azimuth, "distance": distance})
        for wheel, azimuth in zip(robot.wheels, (half, 180 - half, 180 + half, 360 - half), strict=True)
    )
    body = robot.body.model_copy(update={"mass": PRINTED.mass - 4 * template.mass})
    return Robot.model_validate(robot.model_copy(update={"wheels": wheels, "body": body}).model_dump())


def _with_inertias(wheel: object) -> OmniWheel:
    """The wheel with the printed inertias, adhesion 1, 1 m/s and no limit of effort."""
    assert isinstance(wheel, OmniWheel)
    roller = roller_inertia(wheel)
    roller_mass = PRINTED.roller_inertia * roller.mass / float(roller.moment[0, 0])
    fields = {"friction": PRINTED.adhesion, "max_effort": None, "max_speed": 1.0 / wheel.radius}
    rollers = wheel.rollers.model_copy(update={"mass": roller_mass})
    light = wheel.model_copy(update={"rollers": rollers, **fields})
    heavy = light.model_copy(update={"mass": light.mass + 1.0})
    more = (PRINTED.wheel_inertia - axle_inertia(light)) / (axle_inertia(heavy) - axle_inertia(light))
    return light.model_copy(update={"mass": light.mass + more})


def scenarios() -> dict[str, Scenario]:
    """Figures 11 and 12; the others are theory."""
    return omni_runs.scenarios(paper_robot)


def evaluate(runs: Mapping[str, RunResult]) -> Findings:
    """All figures, section 3.3, and the mistakes."""
    robot = paper_robot(60.0)
    figure_4, section_3_3, figures_7_8 = _figure_4(), _section_3_3(robot), _figures_7_8(robot)
    figure_11, figure_12 = omni_runs.figure_11(runs, paper_robot), omni_runs.figure_12(runs["figure_12"])
    return Findings(
        results=(*figure_4[0], *section_3_3[0], *figures_7_8[0], *figure_11[0], *figure_12[0]),
        pictures=(figure_4[1], section_3_3[1], *figures_7_8[1], figure_11[1], figure_12[1]),
        mistakes=mistakes(robot),
    )


def _figure_4() -> tuple[list[Result], Picture]:
    results, rhombi = [], []
    for delta in ANGLES:
        corners = limits.speed_polygon(paper_robot(delta)).vertices
        ahead, aside = corners[:, 0].max(), corners[:, 1].max()
        item = f"Figure 4, {delta:g} deg"
        results += [
            Result(item=item, quantity="largest speed at 0 deg, wheels at 1 m/s", unit="m/s", theory=float(ahead)),
            Result(item=item, quantity="largest speed at 90 deg", unit="m/s", theory=float(aside)),
            Result(item=item, quantity="interior angle of the rhombus at 0 deg", unit="deg", printed=delta,
                   theory=math.degrees(2 * math.atan2(aside, ahead))),
            Result(item=item, quantity="radius of its inscribed circle", unit="m/s", printed=1.0,
                   theory=float(ahead * aside / math.hypot(ahead, aside))),
        ]  # fmt: skip
        closed = np.vstack([corners, corners[:1]])
        rhombi.append(Curve(label=f"{delta:g} deg", x=closed[:, 0], y=closed[:, 1]))
    turn = np.linspace(0, 2 * np.pi, 181)
    circle = Curve(label="1 m/s", x=np.cos(turn), y=np.sin(turn), style=":")
    picture = Picture(
        name="figure_04",
        title="Figure 4.",
        caption="Largest velocities of the body for wheels 90, 60 and 30 deg apart, wheels at 1 m/s: rhombi about the "
        "unit circle whose interior angles are those between neighbouring wheels.",
        svg=curves("speed along x [m/s]", {"speed along y [m/s]": [*rhombi, circle]}, equal=True),
    )
    return results, picture


def _section_3_3(robot: Robot) -> tuple[list[Result], Picture]:
    """Largest acceleration by direction: the paper's formula, and the rigid body's."""
    degrees = np.arange(0.0, 90.1, 1.0)
    beta = np.radians(degrees)
    resistance = PRINTED.roll_resistance
    apart = limits.max_acceleration(
        robot, beta, roll_resistance=resistance, adhesion="independent", loads=EQUAL_LOADS
    ).value
    circle = limits.max_acceleration(robot, beta, roll_resistance=resistance, loads=EQUAL_LOADS).value
    best = limits.max_acceleration(robot, beta, roll_resistance=resistance).value
    shared = limits.max_acceleration(robot, beta, roll_resistance=resistance, sharing="least_norm").value
    printed = leng_cao.max_acceleration(beta)
    results = []
    for angle in (0, 15, 30, 45, 75, 90):
        where = f"largest acceleration at {angle} deg"
        results += [
            Result(item="Section 3.3", quantity=f"{where}, adhesion along and across apart (printed: equation (18))",
                   unit="m/s²", printed=float(printed[angle]) if angle <= 30 else None, theory=float(apart[angle])),
            Result(item="Section 3.3", quantity=f"{where}, friction circle", unit="m/s²", theory=float(circle[angle])),
            Result(item="Section 3.3", quantity=f"{where}, friction circle and weight transfer, efforts of least norm",
                   unit="m/s²", theory=float(shared[angle])),
        ]  # fmt: skip
    slip = leng_cao.roller_slip_acceleration(0.0)
    results.append(Result(item="Equation (20)", quantity="acceleration at which rollers would slip, at 0 deg",
                          unit="m/s²", theory=float(slip)))  # fmt: skip
    lines = [
        Curve(label="equation (18) as printed", x=degrees, y=printed),
        Curve(label="adhesion along and across apart", x=degrees, y=apart, style="--"),
        Curve(label="friction circle", x=degrees, y=circle, style="-."),
        Curve(label="and weight transfer, best sharing", x=degrees, y=best, style=":"),
        Curve(label="and weight transfer, efforts of least norm", x=degrees, y=shared),
    ]
    picture = Picture(
        name="section_3_3",
        title="Section 3.3.",
        caption="Largest acceleration before a wheel slips, wheels 60 deg apart. The paper loads all wheels alike; "
        "weight transfer, here by a mass centre 0.12 m above the ground, hardly matters if the wheels share the push "
        "as well as they can, and much if opposite wheels push alike.",
        svg=curves("direction [deg]", {"largest acceleration [m/s²]": lines}),
    )
    return results, picture


def _figures_7_8(robot: Robot) -> tuple[list[Result], list[Picture]]:
    """Efforts of wheels 1 and 3, and 2 and 4, over direction and acceleration."""
    degrees, accelerations = np.arange(0.0, 90.1, 1.5), np.linspace(0.0, 3.0, 31)
    beta = np.radians(degrees)
    limit = limits.max_acceleration(robot, beta, roll_resistance=PRINTED.roll_resistance, loads=EQUAL_LOADS).value
    both = _efforts(robot, beta[:, np.newaxis], accelerations)
    labels = ("direction [deg]", "acceleration [m/s²]")
    pictures = [
        Picture(
            name=f"figure_0{figure}",
            title=f"Figure {figure}.",
            caption=f"Effort of wheels {wheels} that the rigid body needs, up to the acceleration at which a wheel "
            f"slips; {steps}.",
            svg=surface((*labels, "effort [N m]"), degrees, accelerations,
                        np.where(accelerations <= limit[:, np.newaxis], both[..., index], np.nan)),
        )
        for figure, index, wheels, steps in (
            (7, 0, "1 and 3", "steps where these wheels turn the other way (30 deg) and where rollers 2 and 4 do (60)"),
            (8, 1, "2 and 4", "the step at 60 deg is the drag of their own rollers, which roll the other way"),
        )
    ]  # fmt: skip
    results = []
    for angle in (0, 15, 45, 75, 90):
        ours, theirs = _efforts(robot, math.radians(angle), 1.0), leng_cao.efforts(math.radians(angle), 1.0)
        for index, wheels in enumerate(("1 and 3", "2 and 4")):
            # The formulas are printed for directions below 30 deg.
            printed = float(theirs[index]) if angle < 30 else None
            results.append(
                Result(item=f"Figure {7 + index}", unit="N m", printed=printed, theory=float(ours[index]),
                       quantity=f"effort of wheels {wheels} at {angle} deg and 1 m/s² (printed: equation "
                                f"({24 + index}))")
            )  # fmt: skip
    near = _efforts(robot, np.radians([30 - 1e-6, 30 + 1e-6]), 1.0)[:, 0]
    results.append(Result(item="Figure 7", quantity="drop of the effort at 30 deg", unit="N m",
                          theory=float(near[0] - near[1])))  # fmt: skip
    return results, pictures


def _efforts(robot: Robot, beta: NDArray[np.float64] | float, acceleration: NDArray[np.float64] | float) -> Array:
    """Efforts (..., 2) of wheels 1 and 3, and of 2 and 4, positive as the paper counts them.

    Its wheels 1 and 3 push the robot ahead when wheel 3, whose heading is -60 deg, turns forward; of 2 and 4, wheel 4.
    """
    found = limits.wheel_efforts(robot, beta, acceleration, roll_resistance=PRINTED.roll_resistance, loads=EQUAL_LOADS)
    return found[..., [2, 3]]


PAPER = Paper(
    name="omni_anisotropy",
    title="Four omni wheels: what they can do in each direction",
    citation="Leng C., Cao Q. (2007): Anisotropy of 4-wheeled omnidirectional mobile robots. CAAI Transactions on "
    "Intelligent Systems 2(3), 45-51.",
    introduction=(
        "Wheels 1 to 4 stand at azimuths delta/2, 180 deg - delta/2, 180 deg + delta/2 and -delta/2; directions count "
        "from the x axis, which halves the angle between wheels 1 and 4. Weight, radii, inertias and resistance are "
        "those of section 3.4.",
        "Theory is the rigid body with its wheels and rollers (rollerbench.limits), with the paper's equal loads of a "
        "quarter of the weight unless weight transfer is named. Where a table says printed, it is the value of the "
        "paper's formula as printed.",
    ),
    scenarios=scenarios,
    evaluate=evaluate,
)
