"""The theoretical half of the reproduction of Leng and Cao (2007)."""

import math

import numpy as np
import pytest

import rollerbench as rb
from rollerbench.studies import leng_cao, omni_anisotropy
from rollerbench.studies.omni_anisotropy import EQUAL_LOADS, paper_robot

FINDINGS = omni_anisotropy.theory()


def theory(item: str, quantity: str) -> float:
    (found,) = (r for r in FINDINGS.results if r.item == item and r.quantity.startswith(quantity))
    assert found.theory is not None
    return found.theory


def proof(where: str) -> list[float]:
    (mistake,) = (m for m in FINDINGS.mistakes if m.where == where)
    return [value for value, _ in mistake.proof.values()]


def test_figure_4() -> None:
    for delta in (90.0, 60.0, 30.0):
        half = math.radians(delta / 2)
        item = f"Figure 4, {delta:g} deg"
        assert theory(item, "largest speed at 0 deg") == pytest.approx(1 / math.sin(half), abs=1e-12)
        assert theory(item, "largest speed at 90 deg") == pytest.approx(1 / math.cos(half), abs=1e-12)
        assert theory(item, "interior angle") == pytest.approx(delta, abs=1e-11)
        assert theory(item, "radius") == pytest.approx(1.0, abs=1e-12)


def test_section_3_3() -> None:
    for angle, value in ((0, 3.20), (30, 2.77), (90, 7.51)):
        assert theory("Section 3.3", f"largest acceleration at {angle} deg, adhesion") == pytest.approx(
            value, abs=0.005
        )
    # Rollers would slip at thousands of times the acceleration at which wheels do.
    assert theory("Equation (20)", "acceleration") > 1e3 * 7.51


def test_figures_7_and_8() -> None:
    assert theory("Figure 7", "effort of wheels 1 and 3 at 45 deg") == pytest.approx(0.904, abs=5e-4)
    assert theory("Figure 8", "effort of wheels 2 and 4 at 45 deg") == pytest.approx(3.453, abs=5e-4)
    assert theory("Figure 7", "drop") == pytest.approx(1.764, abs=1e-4)


def test_the_mended_formulas_are_those_of_the_rigid_body() -> None:
    """Two derivations of the same: the paper's by symmetry, and that of any robot."""
    robot, beta = paper_robot(60.0), np.radians(np.arange(0.0, 90.1, 2.5))
    limit = rb.limits.max_acceleration(
        robot, beta, roll_resistance=0.2, adhesion="independent", loads=EQUAL_LOADS
    ).value
    assert leng_cao.max_acceleration(beta, mended=True) == pytest.approx(limit, rel=1e-8)
    for acceleration in (0.0, 1.0, 2.5):
        efforts = rb.limits.wheel_efforts(robot, beta, acceleration, roll_resistance=0.2, loads=EQUAL_LOADS)
        t_13, t_24 = leng_cao.efforts(beta, acceleration, mended=True)
        assert efforts[:, 2] == pytest.approx(t_13, abs=1e-12)
        assert efforts[:, 3] == pytest.approx(t_24, abs=1e-12)


def test_the_mistakes_are_proven() -> None:
    by_9, by_10 = proof("Equation (10)")
    assert by_9 == pytest.approx(-by_10)
    assert abs(by_9) > 0.5
    count, slow, fast, too_fast, right = proof("Equation (11)")
    assert count == 4
    assert slow > 1.2 * fast
    assert too_fast > 1.2
    assert right == pytest.approx(1.0)
    power, by_roller, by_wheel = proof("Equation (12)")
    assert by_wheel == pytest.approx(power)
    assert by_roller < 0.2 * power
    _, printed, mended, truth, percent = proof("Equation (18), rollers")
    assert mended == pytest.approx(truth, rel=1e-8)
    assert percent == pytest.approx(26.1, abs=0.05)
    assert printed < truth
    doubled, both = proof("Equation (18), forces")
    assert doubled > 1.1 * both
    apart, resultant, circle = proof("Section 3.3")
    assert resultant > 1.0
    assert 1 - circle / apart == pytest.approx(0.031, abs=0.001)
    lacking, none = proof("Equations (22) and (23)")
    assert abs(lacking) > 10.0
    assert none == pytest.approx(0.0, abs=1e-12)
    metres, millimetres, mended = proof("Equations (24) and (25)")
    assert metres > 5 * millimetres
    assert mended == pytest.approx(theory("Figure 7", "effort of wheels 1 and 3 at 15 deg"), abs=1e-12)
