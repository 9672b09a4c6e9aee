"""The reproductions of the source papers: each regenerated once, its numbers held against those asked for."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rollerbench as rb
from budgets import assert_parts_add_up
from motions import assert_translation, assert_turn
from rollerbench.studies import Reproduction, paper_names, reproduce
from rollerbench.studies.differential_drive import gear_path, half_track, offset, with_gamma
from rollerbench.studies.mecanum import TABLE_1, WHEELS, body_twist
from rollerbench.studies.six_wheel import TABLE_1_ERRORS, TABLE_1_POINTS

pytestmark = pytest.mark.usefixtures("undrawn")


def reproduced(name: str, folder: Path) -> Reproduction:
    """The reproduction, after a look at what it wrote."""
    seen: list[tuple[float, float]] = []
    done = reproduce(
        name, output=folder / name, recordings=False, progress=lambda now, _, total: seen.append((now, total))
    )
    assert seen[-1][0] == pytest.approx(seen[-1][1], abs=0.01)
    assert {path.name for path in (folder / name).iterdir()} == {"figures", "results.json", "report.html", "runs"}
    written = json.loads((folder / name / "results.json").read_text())
    assert {row["item"] for row in written["results"]} == {result.item for result in done.findings.results}
    assert all(
        {"quantity", "printed", "theory", "simulated", "difference", "unit"} <= row.keys() for row in written["results"]
    )
    assert all(mistake["proof"] for mistake in written["mistakes"])
    page = (folder / name / "report.html").read_text()
    for picture in done.findings.pictures:
        assert (folder / name / "figures" / f"{picture.name}.svg").stat().st_size > 1000
        assert f'id="{picture.name}"' in page
    for run in done.runs.values():
        assert_parts_add_up(run.recording)
    for link in re.findall(r'href="(runs/[^"]+)"', page):
        assert (folder / name / link).exists()
    return done


def rows(done: Reproduction, item: str, quantity: str = "") -> list[Any]:
    found = [r for r in done.findings.results if r.item.startswith(item) and quantity in r.quantity]
    assert found
    return found


def row(done: Reproduction, item: str, quantity: str) -> Any:
    (only,) = rows(done, item, quantity)
    return only


def proof(done: Reproduction, where: str) -> list[float]:
    (mistake,) = (m for m in done.findings.mistakes if m.where == where)
    return [value for value, _ in mistake.proof.values()]


def test_six_wheel(tmp_path: Path) -> None:
    """Wang et al. (2016): figures 9 to 15 and 17, table 1."""
    done = reproduced("six_wheel", tmp_path)
    numbers = {9, 10, 11, 12, 13, 14, 15, 17}
    assert {p.name for p in done.findings.pictures} == {f"figure_{n:02d}" for n in numbers}
    end = row(done, "Figure 10", "x at 3 s")
    assert end.theory == pytest.approx(0.420205, abs=1e-6)
    assert end.simulated == pytest.approx(0.4202, abs=2e-4)
    assert row(done, "Figure 10", "x at 1 s").theory == pytest.approx(0.1051, abs=5e-5)
    assert row(done, "Figure 10", "x at 2 s").theory == pytest.approx(0.3152, abs=5e-5)
    assert row(done, "Figure 10", "sideways").simulated < 0.1
    assert row(done, "Figure 10", "yaw").simulated < 0.01
    assert row(done, "Figure 11", "acceleration").theory == pytest.approx(0.3152, abs=1e-4)
    # The rollers' ripple is in the simulated acceleration.
    assert row(done, "Figure 11", "acceleration").simulated == pytest.approx(0.3152, rel=0.05)
    assert row(done, "Figure 12", "turn").simulated == pytest.approx(136.521, rel=1e-3)
    assert row(done, "Section 2.2", "yaw").simulated == pytest.approx(-65.01, rel=0.005)
    assert row(done, "Section 2.2", "mass centred").simulated < 1.0
    for item, printed in (("Figure 14", 3.0), ("Figure 15", 2.5)):
        result = row(done, item, "range")
        assert result.theory == pytest.approx(printed, rel=0.02)
        assert result.simulated == pytest.approx(printed, rel=0.2)
    assert [result.printed for result in rows(done, "Table 1", "error of turn")] == TABLE_1_ERRORS.tolist()
    means = rows(done, "Table 1", "mean")
    assert means[0].printed == pytest.approx(15.167, abs=5e-4)
    # An uneven floor makes errors of the measured size, but for two leaps; the measured drift it does not explain.
    assert means[1].simulated == pytest.approx(means[1].printed, rel=0.5)
    assert row(done, "Table 1", "drift").printed == pytest.approx(125.2, abs=0.05)
    assert row(done, "Figure 12", "turn").theory == pytest.approx(136.521, abs=5e-4)
    assert row(done, "Figure 13", "turn").theory == pytest.approx(-136.521, abs=5e-4)
    assert [m.where for m in done.findings.mistakes] == [
        *("Equations (8) and (9)", "Equation (19)", "Equations (24) and (25)", "Equation (27)"),
        *("Equation (21)", "Equation (17)", "Section 1.2"),
    ]
    spread, expected, _ = proof(done, "Equations (8) and (9)")
    assert spread == pytest.approx(expected) == pytest.approx(4.2)
    w5, w6, printed, corrected = proof(done, "Equation (19)")
    assert w5 == -w6
    assert printed > 1.0 > 1e-9 > corrected
    assert proof(done, "Equations (24) and (25)") == pytest.approx([1.0, 0.0], abs=1e-8)
    printed, corrected, expected = proof(done, "Equation (27)")
    assert corrected == pytest.approx(expected)
    assert printed == pytest.approx(0.5 * expected)
    assert proof(done, "Equation (21)") == pytest.approx([0.1, 2])
    assert proof(done, "Equation (17)") == [2, 3]
    assert proof(done, "Section 1.2") == pytest.approx([1.0, 3, 2])


def test_differential_drive(tmp_path: Path) -> None:
    """Xu et al.: arcs, the smallest radius, gear errors, radius inequality, slip, play."""
    done = reproduced("differential_drive", tmp_path)
    assert {"figure_06", "figure_07", "figure_08"} <= {p.name for p in done.findings.pictures}
    for result in rows(done, "Equation"):
        assert result.theory < 1e-12
    for result in rows(done, "Figure 6", "position error"):
        assert result.simulated < 0.2
    for result in rows(done, "Figure 6", "yaw error"):
        assert abs(result.simulated) < 0.3
    for result in rows(done, "Figure 6", "turn of the right"):
        assert result.simulated == pytest.approx(result.theory, rel=2e-3)
    for result in rows(done, "Section 3.3"):
        gamma = math.radians(float(re.findall(r"(\d+) deg", result.quantity)[0]))
        assert result.theory == pytest.approx(0.2 * math.tan(gamma), rel=1e-9, abs=1e-12)
        # A turn about C leaves it within a tenth of a millimetre.
        assert result.simulated == pytest.approx(result.theory, rel=0.01, abs=1e-4)
    for result in (*rows(done, "Figure 7", "wave"), *rows(done, "Figure 8", "wave")):
        assert result.theory == pytest.approx(2e3 * 0.03 / (0.4 * 10**2), rel=1e-3)
    assert row(done, "Figure 8", "drift").theory == pytest.approx(57.0, abs=0.1)
    for item in ("Figure 7", "Figure 8"):
        for result in rows(done, item):
            assert result.simulated == pytest.approx(result.theory, rel=0.02)
    for quantity, tolerance in (("radius of the path", 0.01), ("wet patch", 0.05), ("play", 0.02)):
        result = row(done, "Section 4", quantity)
        assert result.simulated == pytest.approx(result.theory, rel=tolerance)
    common, alone = proof(done, "Equation (17), figure 7")
    assert common < 1e-3 < 10 < alone
    drift, simulated = proof(done, "Section 4")
    assert simulated == pytest.approx(drift, rel=0.02)
    assert [m.where for m in done.findings.mistakes] == [
        *("Equation (12)", "Equation (14)", "Equation (17)", "Equation (17), figure 7", "Section 4"),
    ]
    skid, none = proof(done, "Equation (12)")
    assert skid > 0.05
    assert none == pytest.approx(0.0, abs=1e-12)
    printed, corrected, general = proof(done, "Equation (14)")
    assert corrected == pytest.approx(general)
    assert abs(printed - general) > 0.1
    printed, added, mended = proof(done, "Equation (17)")
    assert mended == pytest.approx(added)
    assert printed == pytest.approx(added / 0.1)


def test_mecanum(tmp_path: Path) -> None:
    """Huai and Jin (2022): table 1, ten motions, closed trajectory of 100 s."""
    done = reproduced("mecanum", tmp_path)
    assert {"figure_06", "figure_07"} <= {p.name for p in done.findings.pictures}
    motions = {name: run for name, run in done.runs.items() if name.startswith("mecanum_")}
    assert len(motions) == 10
    for name, run in motions.items():
        (assert_turn if "turn" in name else assert_translation)(run)
    table = rows(done, "Table 1")
    assert len(table) == 40
    for result in table:
        assert result.theory == pytest.approx(result.printed, abs=1e-12)
        assert result.simulated == pytest.approx(result.printed, abs=0.005)
    for motion, distance in (
        ("+X", 2.5),
        ("-Y", 2.5),
        ("45 deg", 2.5 * math.sqrt(2)),
        ("-135 deg", 2.5 * math.sqrt(2)),
    ):
        result = row(done, f"Figure 6, {motion}", "along")
        assert result.theory == pytest.approx(distance, abs=1e-12)
        assert result.simulated == pytest.approx(distance, rel=0.013)
    for motion, sign in (("clockwise", -1), ("counter-clockwise", 1)):
        result = next(r for r in done.findings.results if r.item == f"Figure 6, {motion}")
        assert result.theory == pytest.approx(math.degrees(sign * 2.5))
        assert result.simulated == pytest.approx(result.theory, rel=0.02)
    assert row(done, "Figure 7", "gap over").simulated < 0.1
    assert row(done, "Figure 7", "heading").simulated < 0.02
    assert row(done, "Figure 7", "largest yaw rate").simulated < 2e-3
    assert [m.where for m in done.findings.mistakes] == [
        *("Section 4.1", "Equation (2)", "Equations (8) and (11)", "Equation (10)"),
    ]
    _, right, table, _, turn, printed = proof(done, "Section 4.1")
    assert right == pytest.approx(table)
    assert turn == pytest.approx(printed)
    assert proof(done, "Equation (2)") == pytest.approx([1 + 0.7 * math.sqrt(2), math.hypot(0.3, 0.7)])
    violation, none = proof(done, "Equation (10)")
    assert violation > 0.1 > 1e-12 > none


def test_omni_anisotropy(tmp_path: Path) -> None:
    """Leng and Cao (2007): what takes simulation, figures 11 and 12; test_omni_anisotropy.py has the theory."""
    done = reproduced("omni_anisotropy", tmp_path)
    numbers = ("04", "07", "08", "11", "12")
    assert {p.name for p in done.findings.pictures} == {"section_3_3", *(f"figure_{n}" for n in numbers)}
    # Of all 36 directions and three angles between the wheels, the worst: asked for is half a percent.
    worst = rows(done, "Figure 11", "worst direction")
    assert len(worst) == 4
    for result in rows(done, "Figure 11"):
        assert result.simulated == pytest.approx(result.theory, rel=0.005)
    way = 0.7 * math.sqrt(2)
    assert row(done, "Figure 12", "time").theory == pytest.approx(1.407, abs=5e-4)
    assert row(done, "Figure 12", "time").simulated == pytest.approx(1.407, rel=0.02)
    assert row(done, "Figure 12", "straight line").simulated < 0.03 * way
    # A wheel that slid would do so at a decimetre a second and more.
    assert row(done, "Figure 12", "slip").simulated < 5e-3


def test_the_printed_coordinates_give_the_printed_errors() -> None:
    assert np.hypot(*np.diff(TABLE_1_POINTS, axis=0).T) == pytest.approx(TABLE_1_ERRORS, abs=0.0015)


def test_the_paper_of_huai_and_jin_counts_wheels_from_the_front_left() -> None:
    kinematics = rb.WheelKinematics("mecanum_platform")
    order = [kinematics.robot.wheel_names.index(wheel) for wheel in WHEELS]
    for scenario, velocity, printed in TABLE_1.values():
        assert kinematics.inverse(body_twist(velocity))[order] == pytest.approx(printed, abs=1e-12)
        assert rb.load_scenario(scenario).command.v_xyw_B == pytest.approx(body_twist(velocity))


def test_gear_path_is_the_double_integral_of_the_gear_error() -> None:
    x, track = np.linspace(0.0, 3.0, 30001), 0.4
    error = {"constant": 0.004, "amplitude": 0.02, "wave_number": 12.0, "phase": 0.7}
    eps = error["constant"] + error["amplitude"] * np.sin(error["wave_number"] * x + error["phase"])
    step = x[1]
    yaw = np.concatenate([[0.0], np.cumsum(0.5 * (eps[1:] + eps[:-1]))]) * step / track
    y = np.concatenate([[0.0], np.cumsum(0.5 * (yaw[1:] + yaw[:-1]))]) * step
    # 1e-8: the trapezoids of a wave of 5000 samples.
    assert gear_path(x, **error, track=track) == pytest.approx(y, abs=1e-8)


@pytest.mark.parametrize("gamma_deg", [0, 5, 20, 30])
def test_the_mass_is_where_gamma_says(gamma_deg: float) -> None:
    robot = with_gamma(rb.load_robot("differential_cart"), math.radians(gamma_deg))
    assert offset(robot) == pytest.approx(half_track(robot) * math.tan(math.radians(gamma_deg)), abs=1e-12)


def test_refusals(tmp_path: Path) -> None:
    assert paper_names() == ["six_wheel", "differential_drive", "mecanum", "omni_anisotropy", "wheel_leg"]
    with pytest.raises(rb.ResourceError, match=r"no paper 'tricycle'; accepted: six_wheel, differential_drive"):
        reproduce("tricycle", output=tmp_path)
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(rb.ResourceError, match=r"holds something else \(thesis.tex\)"):
        reproduce("mecanum", output=tmp_path)
    with pytest.raises(rb.ResourceError, match="is a file"):
        reproduce("mecanum", output=tmp_path / "thesis.tex")
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "figures").write_text("")
    with pytest.raises(rb.ResourceError, match=r"figures: is a file; accepted: a new folder"):
        reproduce("mecanum", output=tmp_path / "odd")


def test_foreign_figures_are_kept_and_an_interrupted_repeat_leaves_no_old_page(tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "mine.svg").write_text("<svg/>")
    (tmp_path / "report.html").write_text("of an earlier one")

    def stop(now: float, name: str, total: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(rb.SimulationError, match="interrupted"):
        reproduce("differential_drive", output=tmp_path, recordings=False, progress=stop)
    assert (tmp_path / "figures" / "mine.svg").exists()
    assert not (tmp_path / "report.html").exists()
    assert (tmp_path / "runs" / "cart_straight" / "recording.parquet").exists()
