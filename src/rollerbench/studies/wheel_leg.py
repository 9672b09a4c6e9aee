"""Song et al. (2012): a leg of four joints, three of them as a support mechanism, and a robot that walks on six."""

import itertools
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs import LegKinematics
from rollerbench.report.drawing import COLORS, Curve, SpaceCurve, curves, space
from rollerbench.simulation import RunResult
from rollerbench.studies import leg_support, leg_walks, song
from rollerbench.studies.leg_mistakes import mistakes
from rollerbench.studies.paper import Findings, Paper, Picture, Result

Array = NDArray[np.float64]

TWISTS = (-90.0, 0.0, 90.0, 180.0)
"""Right angles alpha4 that may have given the printed rotation [deg]."""

SAMPLES = 101
"""Places along the motion of a leg."""


def evaluate(runs: Mapping[str, RunResult]) -> Findings:
    """All figures, the printed pose, and the mistakes; of figure 8 what the plan says, and the runs that there are."""
    found = theory()
    walks = [leg_walks.walk_findings(name, runs.get(name)) for name in leg_walks.WALKS]
    return Findings(
        results=(*found.results, *itertools.chain.from_iterable(results for results, _ in walks)),
        pictures=(*found.pictures, *itertools.chain.from_iterable(pictures for _, pictures in walks)),
        mistakes=found.mistakes,
    )


def theory() -> Findings:
    """What takes no run: the pose (2.7), figures 4 to 7, and the mistakes."""
    errors = leg_support.noisy_errors()
    figures_4_5, mechanism, noise = _figures_4_5(), leg_support.figure_7(), leg_support.conditioning(errors)
    return Findings(
        results=(*_pose(), *figures_4_5[0], *mechanism[0], *noise[0]),
        pictures=(*figures_4_5[1], *mechanism[1], noise[1]),
        mistakes=mistakes(errors),
    )


def _pose() -> list[Result]:
    """The foot's pose at the printed angles: matrix (2.7)."""
    pose = LegKinematics(song.leg()).forward(song.ANGLES)
    drake = 1e3 * _foot_in_drake(song.ANGLES[np.newaxis])[0]
    results = [
        Result(item="Matrix (2.7)", quantity=f"{axis} of the foot", unit="mm", printed=float(printed),
               theory=float(ours), simulated=float(simulated))
        for axis, printed, ours, simulated in zip("xyz", song.POSITION, 1e3 * pose[:3, 3], drake, strict=True)
    ]  # fmt: skip
    defect = song.least_defect(song.ROTATION)
    results.append(
        Result(item="Matrix (2.7)", quantity="largest entry of R R' - 1 with the signs that make it least", unit="-",
               printed=defect, theory=song.least_defect(np.abs(pose[:3, :3])))
    )  # fmt: skip
    sizes = {twist: np.abs(song.rotation_with(twist)) for twist in TWISTS}
    results += [
        Result(item="Matrix (2.7)", quantity=f"size of R{row + 1}{column + 1}, alpha4 = {twist:g} deg", unit="-",
               printed=float(song.ROTATION[row, column]),
               theory=float(sizes[twist][row, column]))
        for twist in (song.ALPHA_4, 0.0) for row in range(3) for column in range(3)
    ]  # fmt: skip
    results += [
        Result(item="Matrix (2.7)", quantity=f"sizes that fit, of nine, alpha4 = {twist:g} deg", unit="-",
               printed=9.0, theory=float(np.sum(song.entries_that_fit(twist))))
        for twist in TWISTS
    ]  # fmt: skip
    return results


def _foot_in_drake(q: Array) -> Array:
    """The foot (n, 3) in the leg's base [m] at joint angles (n, 4), in Drake."""
    robot = song.three_legs()
    stand = np.broadcast_to([leg.posture("standing") for leg in robot.legs], (len(q), 3, 4)).copy()
    stand[:, 0] = q
    return np.asarray(song.feet_in_drake(robot, stand)[:, 0] - robot.legs[0].X_BL[:3, 3])


def _figures_4_5() -> tuple[list[Result], list[Picture]]:
    """All four joints from 0 to the printed angles, at constant speeds."""
    share = np.linspace(0.0, 1.0, SAMPLES)
    q = share[:, np.newaxis] * song.ANGLES
    ours, drake = 1e3 * LegKinematics(song.leg()).position(q), 1e3 * _foot_in_drake(q)
    way = float(np.sum(np.linalg.norm(np.diff(ours, axis=0), axis=1)))
    way_in_drake = float(np.sum(np.linalg.norm(np.diff(drake, axis=0), axis=1)))
    results = [
        Result(item="Figures 4 and 5", quantity="length of the foot's path", unit="mm", theory=way,
               simulated=way_in_drake),
        Result(item="Figures 4 and 5", quantity="largest distance between the two paths", unit="mm", theory=0.0,
               simulated=float(np.linalg.norm(drake - ours, axis=1).max())),
    ]  # fmt: skip
    first, last = (1e3 * (song.bones_B(song.leg(), angles) - song.leg().hip) for angles in q[[0, -1]])
    lines = [
        SpaceCurve(label="leg at 0 deg", points=first, color="0.7", width=3.0),
        SpaceCurve(label="leg at (90, 30, 45, 60) deg", points=last, color="0.3", width=3.0),
        SpaceCurve(label="foot, theory", points=ours, color=COLORS[0]),
        SpaceCurve(label="foot, Drake", points=drake[::10], color=COLORS[1], style="o"),
    ]
    panels = {
        f"{axis} [mm]": [
            Curve(label="theory", x=share, y=ours[:, index]),
            Curve(label="Drake", x=share[::10], y=drake[::10, index], style="o"),
        ]
        for index, axis in enumerate("xyz")
    }
    pictures = [
        Picture(
            name="figure_04",
            title="Figures 4 and 5.",
            caption="Path of the foot while all four joints turn from 0 to (90, 30, 45, 60) deg at constant speeds: "
            "by the Denavit-Hartenberg rows, and of the model in Drake.",
            svg=space(("x [mm]", "y [mm]", "z [mm]"), lines, elevation=20.0, azimuth=35.0),
        ),
        Picture(
            name="figure_05",
            title="Figures 4 and 5, coordinates (printed as figure 2.28).",
            caption="The same over the motion, in the leg's base. The paper prints no duration.",
            svg=curves("share of the motion [-]", panels),
        ),
    ]
    return results, pictures


PAPER = Paper(
    name="wheel_leg",
    title="Wheel-legs: one leg, three that support, six that walk",
    citation="Song M., Wang X., Zhou H., Zhou Y.: Research on kinematic for the mechanism of wheel-leg mobile robot "
    "with multi-sports mode (in Chinese; no year is printed, its latest references are of 2012).",
    introduction=(
        "The paper prints one set of joint angles with the pose of the foot, the lengths of 90 mm that belong to it, "
        "and the size of the body; for everything else of the leg and the mechanism dimensions were chosen: hips 100 "
        "mm from the centre of the body, feet on level ground. Simulated are the same joint angles in Drake, whose "
        "multibody kinematics knows the SDF model and not the Denavit-Hartenberg rows.",
        "The text of the paper at hand is a copy in which formulas have lost their signs. Where a table says printed, "
        "it is the number without a sign, and what is said of the rotation holds for any choice of signs.",
        "Figure 8 shows a prototype whose dimensions are not printed. Here walks the shipped model "
        "wheel_leg_hexapod, as planned by rollerbench.kinematics.gaits.",
    ),
    scenarios=leg_walks.scenarios,
    evaluate=evaluate,
)
