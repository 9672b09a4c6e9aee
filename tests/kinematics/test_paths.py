"""Commands over time: step functions, and paths with a speed law."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import fresnel

from rollerbench.errors import KinematicsError
from rollerbench.kinematics import paths
from rollerbench.kinematics.odometry import rotate
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
    "clothoid": lambda tangent: [paths.clothoid([[1.0, 0.0], [1.5, 1.0], [0.0, 1.5]], tangent=tangent)],
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


turns = st.lists(st.floats(-2.5, 2.5), min_size=1, max_size=4)
sides = st.lists(st.floats(0.2, 3.0), min_size=5, max_size=5)


@given(turns, sides, st.floats(0.01, 1.0), st.floats(-3.0, 3.0))
@settings(max_examples=10, deadline=None)
def test_a_clothoid_path_rounds_its_corners_evenly(
    corners: list[float], lengths: list[float], deviation: float, start: float
) -> None:
    """Continuous curvature, linear in the way but for four kinks a corner; from the first line to the last point."""
    heading = start + np.concatenate([[0.0], np.cumsum(corners)])
    steps = np.array(lengths[: len(heading)])[:, np.newaxis] * np.column_stack([np.cos(heading), np.sin(heading)])
    points = np.cumsum(steps, axis=0)
    leg = paths.clothoid(points, deviation=deviation, tangent=True)
    x, y, yaw = leg.q_xyt.T
    assert leg.q_xyt[0] == pytest.approx(np.zeros(3), abs=1e-12)
    assert rotate(start, leg.q_xyt[-1, :2]) == pytest.approx(points[-1], abs=1e-9)
    assert yaw[-1] == pytest.approx(np.sum(corners), abs=1e-9)
    # Nodes are evenly spaced, and the path leads where the yaw points to.
    chords = np.hypot(np.diff(x), np.diff(y))
    step = chords.max()
    assert chords == pytest.approx(np.full(len(chords), step), rel=0.02)
    curvature = np.diff(yaw) / step
    kinks = np.abs(np.diff(curvature, 2)) > 1e-7 * max(1.0, np.abs(curvature).max())
    assert np.sum(np.diff(kinks.astype(int)) == 1) <= 4 * len(corners) + 1
    for corner in points[:-1]:
        nearest = np.hypot(*(leg.q_xyt[:, :2] - rotate(-start, corner)).T).min()
        assert nearest <= deviation + step
    straight = paths.clothoid(points, deviation=deviation)
    assert rotate(-start, straight.q_xyt[:, :2]) == pytest.approx(leg.q_xyt[:, :2], abs=1e-9)
    assert not straight.q_xyt[:, 2].any()


def test_a_clothoid_is_that_of_fresnel() -> None:
    """From its start a rounding lies on x = a sqrt(pi) C(s / (a sqrt(pi))), y likewise by S, with a^2 = R length."""
    leg = paths.clothoid([[1.0, 0.0], [1.0, 1.0]], tangent=True)
    s = np.linspace(0, leg.length, len(leg.q_xyt))
    # The room is used up: the rounding begins at the start. Its clothoids take a quarter of 90 deg each.
    quarter = math.radians(22.5)
    end = int(np.argmin(np.abs(leg.q_xyt[:, 2] - quarter)))
    scale = s[end] * math.sqrt(math.pi / (2 * leg.q_xyt[end, 2]))
    sine, cosine = fresnel(s[:end] / scale)
    assert leg.q_xyt[:end, 0] == pytest.approx(scale * cosine, abs=1e-6)
    assert leg.q_xyt[:end, 1] == pytest.approx(scale * sine, abs=1e-6)
    # Its middle lies on the bisector, as far from the corner as a smaller deviation would have it.
    middle = leg.q_xyt[len(s) // 2]
    assert middle[:2] == pytest.approx([middle[0], 1 - middle[0]], abs=1e-9)
    passed = math.hypot(1 - middle[0], middle[1])
    smaller = paths.clothoid([[1.0, 0.0], [1.0, 1.0]], deviation=0.5 * passed, tangent=True).q_xyt
    assert np.hypot(*(smaller[:, :2] - [1, 0]).T).min() == pytest.approx(0.5 * passed, abs=1e-6)


@pytest.mark.parametrize("curve", [paths.spline, paths.clothoid])
def test_a_free_yaw_passes_the_yaws_of_the_points(curve: Callable[..., paths.Leg]) -> None:
    points = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.5], [-1.0, 1.5]]
    leg = curve(points, yaw=[1.0, math.nan, -7.0, math.nan])
    fixed = curve(points)
    assert leg.q_xyt[:, :2] == pytest.approx(fixed.q_xyt[:, :2], abs=1e-12)
    for point, yaw in ((0, 1.0), (2, -7.0), (3, -7.0)):
        nearest = np.argmin(np.hypot(*(leg.q_xyt[:, :2] - points[point]).T))
        # Where a corner is rounded, its middle is close to the nearest point.
        assert leg.q_xyt[nearest, 2] == pytest.approx(yaw, abs=0.06)
    rate = np.diff(leg.q_xyt[:, 2])
    assert np.abs(np.diff(rate)).max() < 0.05 * np.abs(rate).max()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: paths.clothoid([[1, 0], [0, 0.01]]), "point 1, .*turns by 179.4 deg"),
        (lambda: paths.clothoid([[1, 0], [1, 0]]), "two in a row"),
        (lambda: paths.spline([[1, 0]], yaw=[1, 2]), "yaw = "),
        (lambda: paths.spline([[1, 0]], tangent=True, yaw=[1]), "without tangent heading"),
        (lambda: paths.spline([1, 0]), "points = "),
        (lambda: paths.spline([["a", 0]]), "points = "),
        (lambda: paths.clothoid([[math.nan, 0]]), "points holds NaN"),
        (lambda: paths.spline([[1, 0], [0, 0]], tangent=True), "turns back on itself"),
        (lambda: paths.clothoid([[1, 0], [1, 1]], deviation=0.0), "deviation = 0.0: accepted: more than 0"),
        (lambda: paths.clothoid([[1, 0], [1, 1]], deviation=math.nan), "deviation holds NaN"),
        (lambda: paths.line([0, 0], [1, 0, 0]), "start = "),
        (lambda: paths.line([0, 0, 0], [1, 0, math.nan]), "end holds NaN"),
        (lambda: paths.arc(0.0, 1.0, tangent=True), "radius = 0.0: accepted: more than 0"),
        (lambda: paths.arc(1.0, math.inf, tangent=True), "angle holds NaN or infinite"),
    ],
)
def test_what_is_no_path_is_said(make: Callable[[], paths.Leg], words: str) -> None:
    with pytest.raises(KinematicsError, match=words):
        make()
