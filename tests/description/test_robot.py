"""A description says what the robot is: files round, masses add up, rollers fit."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML
from scipy.integrate import quad

import robots
import rollerbench as rb
from rollerbench.description.files import to_yaml
from rollerbench.description.inertia import barrel_volume, solid_barrel
from rollerbench.description.layout import support_margin
from rollerbench.description.rollers import RollerRing, roller_clearance
from rollerbench.resources import robot_names


@pytest.mark.parametrize("name", robot_names())
def test_yaml_there_and_back(name: str) -> None:
    robot = rb.load_robot(name)
    assert rb.load_robot(YAML(typ="safe").load(to_yaml(robot))) == robot


@pytest.mark.parametrize("make", robots.ALL.values(), ids=robots.ALL)
def test_masses_add_up(make) -> None:
    data = make()
    robot = rb.load_robot(data)
    expected = data["body"]["mass"] + sum(wheel["mass"] for wheel in data["wheels"])
    assert robot.mass == pytest.approx(expected, rel=1e-12)


def test_published_dimensions() -> None:
    platform, youbot = rb.load_robot("mecanum_platform"), rb.load_robot("youbot_base")
    for wheel in platform.wheels:
        assert wheel.radius == 0.4
        assert sum(abs(x) for x in wheel.position) == pytest.approx(1.4, abs=1e-15)
    for wheel in youbot.wheels:
        assert wheel.radius == 0.0475
        assert [abs(x) for x in wheel.position] == [0.235, 0.15]


@given(st.floats(0.02, 0.5), st.floats(0.05, 0.4), st.floats(30, 90), st.integers(6, 32), st.sampled_from([1, 2]))
def test_rollers_touch_the_ground_at_the_bottom_and_where_they_hand_over(
    radius: float, share: float, angle_deg: float, count: int, rows: int
) -> None:
    gamma, r = math.radians(angle_deg), share * radius
    ring = RollerRing(
        wheel_radius=radius, wheel_width=radius, roller_radius=r, roller_angle=gamma, count=rows * count, rows=rows
    )
    for theta in (0.0, math.pi / ring.count):
        rise = math.sin(gamma) * math.sin(theta)
        depth = math.sqrt(ring.semi_axis**2 * rise**2 + r**2 * (1 - rise**2))
        # 1e-9 of the radius: the square root of a difference that nearly cancels.
        assert (radius - r) * math.cos(theta) + depth == pytest.approx(radius, rel=1e-9)


def test_clearance_is_the_gap_between_the_barrels() -> None:
    """Spheres far from round the ellipsoid's tips: a brute-force search over the surfaces agrees."""
    ring = rb.load_robot("mecanum_platform").wheels[0].ring
    assert ring is not None
    x = np.linspace(-ring.half_length, ring.half_length, 61)
    phi = np.linspace(0, 2 * np.pi, 90)
    rho = ring.roller_radius * np.sqrt(1 - (x / ring.semi_axis) ** 2)
    surfaces = []
    for k in (0, 1):
        u, center = ring.axes_H[k], ring.centers_H[k]
        a = np.cross(u, [0.0, 0.0, 1.0])
        a /= np.linalg.norm(a)
        b = np.cross(u, a)
        circle = np.cos(phi)[:, None] * a + np.sin(phi)[:, None] * b
        points = center + x[:, None, None] * u + rho[:, None, None] * circle
        surfaces.append(points.reshape(-1, 3))
    gap = min(np.linalg.norm(surfaces[1] - point, axis=1).min() for point in surfaces[0])
    # 1 mm: the search steps by 4 mm over the surface of a 0.4 m wheel.
    assert roller_clearance(ring) == pytest.approx(gap, abs=1e-3)
    assert roller_clearance(dataclasses.replace(ring, count=24)) < 0


@given(st.floats(0.5, 5.0), st.floats(0.1, 0.99))
def test_barrel_formulas_equal_integrals(slenderness: float, cut: float) -> None:
    r, a = 0.1, 0.1 * (1 + slenderness)
    half = cut * a
    rho2 = lambda x: r**2 * (1 - (x / a) ** 2)  # noqa: E731  # the profile, as in the formula
    area = quad(rho2, -half, half)[0]
    axial = quad(lambda x: 0.5 * rho2(x) ** 2, -half, half)[0] / area
    across = quad(lambda x: 0.25 * rho2(x) ** 2 + x**2 * rho2(x), -half, half)[0] / area
    inertia = solid_barrel(2.0, a, r, half)
    assert barrel_volume(a, r, half) == pytest.approx(np.pi * area, rel=1e-9)
    assert np.diag(inertia.moment) == pytest.approx([2 * axial, 2 * across, 2 * across], rel=1e-9)


def test_support_margin() -> None:
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    assert support_margin(square, np.array([0.25, 0.0])) == pytest.approx(0.75)
    assert support_margin(square, np.array([1.5, 0.0])) == pytest.approx(-0.5)
    assert support_margin(square[:2], np.zeros(2)) == -math.inf
    assert support_margin(np.array([[0.0, 0], [1, 0], [2, 0]]), np.zeros(2)) == -math.inf


def test_wheels_in_tandem_may_nest_as_round_wheels_do() -> None:
    """A small wheel beside a large one: their boxes overlap, the wheels do not."""
    data = robots.mecanum()
    small = {**robots.TYRE, "radius": 0.02, "width": 0.04}
    data["wheels"].append({**small, "name": "small", "position": [0.2 + 2 * math.sqrt(0.05 * 0.02) + 1e-3, 0.2, -0.03]})
    assert len(rb.load_robot(data).wheels) == 5
    data["wheels"][-1]["position"][0] -= 2e-3
    with pytest.raises(rb.DescriptionError, match="overlaps"):
        rb.load_robot(data)
