"""The reproduction of Song et al. (2012): the printed pose, the support mechanism, the planned walks."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import rollerbench as rb
from rollerbench.kinematics.gaits.planner import START_SHARE
from rollerbench.resources import scenario_files
from rollerbench.studies import leg_support, leg_walks, reproduce, song, wheel_leg
from rollerbench.studies.paper import Findings
from rollerbench.studies.reproduce import PAPERS


@pytest.fixture(scope="module")
def findings() -> Findings:
    return wheel_leg.theory()


@pytest.fixture(scope="module")
def plans() -> dict[str, leg_walks.PlannedWalk]:
    robot = rb.load_robot("wheel_leg_hexapod")
    return {name: leg_walks.planned(walk, robot) for name, walk in leg_walks.WALKS.items()}


@pytest.fixture
def _planned_once(plans: dict[str, leg_walks.PlannedWalk], monkeypatch: pytest.MonkeyPatch) -> None:
    by_figure = {walk.figure: plans[name] for name, walk in leg_walks.WALKS.items()}
    monkeypatch.setattr(leg_walks, "planned", lambda walk, robot: by_figure[walk.figure])


def row(findings: Findings, item: str, quantity: str) -> Any:
    (found,) = (r for r in findings.results if r.item.startswith(item) and quantity in r.quantity)
    return found


def proof(findings: Findings, where: str) -> list[float]:
    (mistake,) = (m for m in findings.mistakes if m.where == where)
    return [value for value, _ in mistake.proof.values()]


def test_the_printed_position(findings: Findings) -> None:
    for axis, printed in zip("xyz", (-77.9423, 57.7693, 143.5802), strict=True):
        result = row(findings, "Matrix (2.7)", f"{axis} of the foot")
        # Half of the last printed digit.
        assert result.theory == pytest.approx(printed, abs=5e-5)
        # The SDF model carries fifteen digits of metres through four frames.
        assert result.simulated == pytest.approx(result.theory, abs=1e-8)
        assert result.printed == abs(printed)


def test_the_printed_rotation_is_none_whatever_its_signs(findings: Findings) -> None:
    first_row, printed, mended, entry = proof(findings, "Matrix (2.7), rotation")
    assert first_row == pytest.approx(1.067, abs=5e-4)
    assert printed == pytest.approx(0.125, abs=5e-4)
    assert mended < 2e-4
    assert entry == pytest.approx(0.0, abs=1e-12)
    rotation = rb.legs.LegKinematics(song.leg()).forward(song.ANGLES)[:3, :3]
    assert song.least_defect(np.abs(rotation)) == pytest.approx(0.0, abs=1e-12)


def test_which_twist_the_printed_rotation_has(findings: Findings) -> None:
    assert proof(findings, "Table 1 and matrix (2.7)") == [3, 8, 3, 8]
    for twist in (0.0, 180.0):
        assert np.argwhere(~song.entries_that_fit(twist)).tolist() == [[0, 2]]
    for twist in (-90.0, 90.0):
        assert song.entries_that_fit(twist).tolist() == [[True, False, False]] * 3


def test_the_other_mistakes(findings: Findings) -> None:
    ours, mirrored = proof(findings, "Matrix (2.7), position")
    assert ours == pytest.approx(-mirrored) == pytest.approx(-77.9423, abs=5e-5)
    rounding, printed, position = proof(findings, "Section 2, comparison")
    assert printed > 100 * rounding
    assert position < 5e-5
    distance, spread, radius = proof(findings, "Section 2.2, origin")
    assert spread == pytest.approx(0.0, abs=1e-9)
    assert distance > radius + 10.0


def test_the_leg_of_the_equations_is_that_in_drake(findings: Findings) -> None:
    length = row(findings, "Figures 4 and 5", "length")
    assert length.simulated == pytest.approx(length.theory, abs=1e-7)
    assert row(findings, "Figures 4 and 5", "largest distance").simulated < 1e-8
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (20, 3, 4))
    robot = song.three_legs()
    ours = [
        rb.legs.LegKinematics(leg).position(q[:, i]) @ leg.X_BL[:3, :3].T + leg.hip for i, leg in enumerate(robot.legs)
    ]
    assert song.feet_in_drake(robot, q) == pytest.approx(np.stack(ours, axis=1), abs=1e-11)


def test_the_drawn_leg_has_the_lengths_of_the_paper() -> None:
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (20, 4))
    points = song.bones_B(song.leg(), q)
    assert np.linalg.norm(np.diff(points, axis=1), axis=2) == pytest.approx(song.LENGTH, abs=1e-12)


def test_exact_joints_give_the_exact_pose(findings: Findings) -> None:
    assert row(findings, "Figure 7", "change of a distance").theory < 1e-9
    for method in leg_support.METHODS:
        assert row(findings, "Figure 7", f"position by {method}").theory < 1e-9
        assert row(findings, "Figure 7", f"attitude by {method}").theory < 1e-9
        assert row(findings, "Figure 7", f"position by {method}").simulated < 1e-7


def test_the_support_mechanism_moves_all_it_can() -> None:
    _, poses, q = leg_support.motion()
    assert (np.ptp(q, axis=0) > np.radians(15.0)).all()
    assert (np.ptp(poses[:, :3, 3], axis=0) > 0.015).all()
    # Smooth: no branch of the inverse kinematics is left for another.
    assert np.abs(np.diff(q, axis=0)).max() < np.radians(5.0)
    assert q[0] == pytest.approx(q[-1], abs=1e-9)


def test_the_circumcentre_is_ill_conditioned(findings: Findings) -> None:
    numbers = proof(findings, "Section 2.2, position")
    (equal, equal_worst, fit, fit_worst), (obtuse, obtuse_worst, still, still_worst) = numbers[:4], numbers[4:]
    # The middle of three feet with independent errors: that of a mean of three, chi with three degrees of freedom.
    assert fit == pytest.approx(np.sqrt(8 / np.pi) / np.sqrt(3), rel=0.05)
    assert fit < equal < 1.5 * fit
    assert (still, still_worst) == pytest.approx((fit, fit_worst), rel=1e-9)
    assert obtuse > 20 * still
    assert obtuse_worst > 50 * still_worst
    assert equal_worst < 5.0
    # The tilt of a thin triangle is nobody's to mend.
    by_center, by_fit = (
        row(findings, "Section 2.2", f"mean error of Bo 150 mm above it, feet with an angle of 165 deg, {m}").theory
        for m in leg_support.METHODS
    )
    assert 1.5 * by_fit < by_center
    assert by_fit > 10.0


@pytest.mark.parametrize("name", list(leg_walks.WALKS))
def test_planned_walks(name: str, plans: dict[str, leg_walks.PlannedWalk]) -> None:
    walk, plan = leg_walks.WALKS[name], plans[name]
    # The twist takes START_SHARE of a period of 1 s to come up, evenly on both sides of the middle.
    assert plan.q_xyt[-1] == pytest.approx([walk.speed * (leg_walks.DURATION - 0.5 * START_SHARE), 0.0, 0.0], abs=1e-3)
    assert plan.on_ground.sum(axis=1).min() >= 3
    assert plan.margins.min() > 0.05
    assert plan.feet[..., 2].max() == pytest.approx(0.05, abs=1e-3)
    assert (plan.feet[..., 2][plan.on_ground] == 0).all()
    # Feet on the ground stay where they are, as long as wheels and legs do not lean sideways.
    both = plan.on_ground[1:] & plan.on_ground[:-1]
    assert np.linalg.norm(np.diff(plan.feet, axis=0), axis=2)[both].max() < 1e-6


@pytest.mark.usefixtures("_planned_once")
def test_a_simulated_walk_is_held_against_its_reference() -> None:
    name, time = "hexapod_mammal_walk", np.linspace(0.0, 5.0, 51)
    columns = dict.fromkeys(("y", "roll", "pitch", "yaw", "reference_y", "reference_yaw"), np.zeros(51))
    columns |= {"time": time, "reference_x": 0.15 * time, "x": 0.149 * time, "z": 0.4 + 0.001 * np.sin(time)}
    columns["pitch"] = np.radians(0.5) * np.sin(time)
    recording = rb.Recording(columns=columns, wheel_names=())
    run: Any = SimpleNamespace(recording=recording, scenario=SimpleNamespace(robot=rb.load_robot("wheel_leg_hexapod")))
    results, pictures = leg_walks.walk_findings(name, run)
    found = {r.quantity: r for r in results}
    assert found["way ahead of the simulated walk"].difference == pytest.approx(-0.005)
    assert found["largest distance of the body from its reference"].simulated == pytest.approx(5.0)
    assert found["largest roll or pitch"].simulated == pytest.approx(0.5, rel=1e-2)
    assert found["largest error of the heading"].simulated == 0
    assert found["range of the body's height"].simulated == pytest.approx(2.0, rel=1e-2)
    assert [p.name for p in pictures] == ["figure_08b", "figure_08b_body"]


def shorter(name: str) -> rb.Scenario:
    """A shipped walk of three seconds, without the rest after it."""
    (walk, *_) = rb.load_scenario(name).model_dump(mode="json")["command"]["pieces"]
    return rb.load_scenario(name, overrides={"duration": 3.0, "command.pieces": [{**walk, "duration": 3.0}]})


@pytest.mark.usefixtures("_planned_once", "undrawn")
def test_wheel_leg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole reproduction, with the first seconds of the walks as far as they are shipped."""
    paper = replace(PAPERS["wheel_leg"], scenarios=lambda: {name: shorter(name) for name in leg_walks.scenarios()})
    monkeypatch.setitem(PAPERS, "wheel_leg", paper)
    done = reproduce("wheel_leg", output=tmp_path / "wheel_leg", recordings=False)
    assert set(done.runs) == set(leg_walks.WALKS) & set(scenario_files())
    page = (tmp_path / "wheel_leg" / "report.html").read_text()
    names = {p.name for p in done.findings.pictures}
    assert {"figure_04", "figure_05", "figure_07", "section_2_2", "figure_08a", "figure_08b"} <= names
    for name in names:
        assert (tmp_path / "wheel_leg" / "figures" / f"{name}.svg").stat().st_size > 1000
        assert f'id="{name}"' in page
    for link in re.findall(r'href="(runs/[^"]+)"', page):
        assert (tmp_path / "wheel_leg" / link).exists()
    written = json.loads((tmp_path / "wheel_leg" / "results.json").read_text())
    assert [m["where"] for m in written["mistakes"]] == [
        *("Matrix (2.7), position", "Matrix (2.7), rotation", "Table 1 and matrix (2.7)"),
        *("Section 2, comparison", "Section 2.2, origin", "Section 2.2, position"),
    ]
    assert all(mistake["proof"] for mistake in written["mistakes"])
    for name, walk in leg_walks.WALKS.items():
        if name in done.runs:
            result = row(done.findings, f"Figure 8{walk.figure}", "way ahead of the simulated walk")
            assert result.simulated == pytest.approx(result.theory, rel=0.02)
