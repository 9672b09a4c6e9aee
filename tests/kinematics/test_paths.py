"""Commands over time: step functions, and paths with a speed law."""

import itertools
import math

import numpy as np
import pytest

from rollerbench.kinematics import paths
from rollerbench.kinematics.profile import reference_poses, sum_of_steps

LAWS = ("minimum_jerk", "trapezoidal")


def test_steps_are_the_cubic_of_adams() -> None:
    """STEP(t, t0, h0, t1, h1) = h0 + (h1 - h0) s^2 (3 - 2s), summed over overlapping intervals."""
    terms = [(0.0, 1.0, 2.0), (0.5, 1.5, -0.7), (1.2, 3.0, 0.4)]
    profile = sum_of_steps([t[0] for t in terms], [t[1] for t in terms], [[t[2]] for t in terms])
    time = np.linspace(-0.5, 3.5, 201)
    expected = np.zeros_like(time)
    for start, stop, height in terms:
        s = np.clip((time - start) / (stop - start), 0, 1)
        expected += height * s**2 * (3 - 2 * s)
    assert profile(time)[:, 0] == pytest.approx(expected, abs=1e-14)


def test_straight_run_of_wang() -> None:
    """Wang et al. (2016): 0.1051, 0.3152 and 0.4202 m after 1, 2 and 3 s, with wheels of radius 0.1 m."""
    height = math.radians(120.38)
    wheel = sum_of_steps([0.0, 2.0], [1.0, 3.0], [[height], [-height]])
    way = 0.1 * np.cumsum(wheel.integral(np.arange(4.0)))
    assert way == pytest.approx([0.1051, 0.3152, 0.4202], abs=1e-4)
    assert 0.1 * wheel.peak[0] == pytest.approx(0.2101, abs=1e-4)


CASES = {
    "line": lambda tangent: [paths.line([0, 0, 0], [1.0, 0.0, 0.0])],
    "arc": lambda tangent: [paths.arc(0.7, -2.0, tangent=tangent)],
    "circle": lambda tangent: [paths.arc(0.5, 2 * math.pi, tangent=tangent)],
    "square": lambda tangent: paths.square(0.8, tangent=tangent),
    "figure_eight": lambda tangent: [paths.figure_eight(2.0, tangent=tangent)],
    "spline": lambda tangent: [paths.spline([[1.0, 0.0], [1.0, 1.0], [0.0, 1.5]], tangent=tangent)],
    "waypoints": lambda tangent: paths.through_waypoints([[1, 0], [1, 1, 1.0], [0, 0]], tangent=tangent),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("tangent", [True, False])
@pytest.mark.parametrize("name", CASES)
def test_the_twist_leads_along_the_path(name: str, tangent: bool, law: paths.SpeedLaw) -> None:
    legs = CASES[name](tangent)
    profile = paths.twist_along(legs, 12.0, law, radius=0.3)
    time = np.linspace(0, 12, 2401)
    poses = reference_poses(profile, time)
    for before, after in itertools.pairwise(legs):
        assert after.q_xyt[0] == pytest.approx(before.q_xyt[-1], abs=1e-12)
    # 0.05 mm: the path and its twist are splines through samples.
    assert poses[-1] == pytest.approx(legs[-1].q_xyt[-1], abs=5e-5)
    drawn = np.vstack([leg.q_xyt[:, :2] for leg in legs])
    distance = [np.hypot(*(drawn - pose[:2]).T).min() for pose in poses[::20]]
    assert max(distance) < 0.01
    v = profile(time)
    assert v[[0, -1]] == pytest.approx(np.zeros((2, 3)), abs=1e-12)
    if tangent:
        assert v[:, 1] == pytest.approx(np.zeros(len(time)), abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", CASES)
def test_the_speed_limit_is_kept_and_reached(name: str, law: paths.SpeedLaw) -> None:
    legs = CASES[name](True)
    duration = paths.fastest_duration(legs, 0.5, law, radius=0.3)
    v = paths.twist_along(legs, duration, law, radius=0.3)(np.linspace(0, duration, 4001))
    fastest = np.max(np.hypot(v[:, 0], v[:, 1]) + 0.3 * np.abs(v[:, 2]))
    assert fastest <= 0.5 * 1.001
    if len(legs) == 1 and name in ("line", "arc", "circle"):
        assert fastest == pytest.approx(0.5, rel=1e-3)


def test_a_circle_is_a_circle() -> None:
    poses = reference_poses(
        paths.twist_along([paths.arc(0.5, 2 * math.pi, tangent=True)], 6.0, "minimum_jerk", 0.3), np.linspace(0, 6, 601)
    )
    assert np.hypot(poses[:, 0], poses[:, 1] - 0.5) == pytest.approx(np.full(601, 0.5), abs=1e-7)
    assert poses[-1] == pytest.approx([0, 0, 2 * math.pi], abs=1e-7)


def test_waypoints_turn_the_shorter_way() -> None:
    legs = paths.through_waypoints([[-1.0, -0.1], [-2.0, -0.1, math.pi]], tangent=True)
    assert legs[0].turn == pytest.approx(math.pi - math.atan2(0.1, 1.0))
    assert all(leg.turn <= math.pi + 1e-9 for leg in legs)
