"""Bumps: the nearest point of an ellipsoid, by its laws; where they lie."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rollerbench.kinematics.bumps import caps, nearest_on_ellipsoid, scattered_caps

LENGTH = st.floats(1e-3, 1.0)


@given(a=LENGTH, r=LENGTH, angle=st.floats(0.0, np.pi), distance=st.floats(1e-6, 50.0))
def test_the_nearest_point_is_the_foot_of_the_normal(a: float, r: float, angle: float, distance: float) -> None:
    """Walking along the outer normal from a point of the ellipse and back again."""
    s, p = a * np.cos(angle), r * np.sin(angle)
    normal = np.array([s / a**2, p / r**2]) / np.hypot(s / a**2, p / r**2)
    outer = np.array([s, p]) + distance * normal
    near = np.array(nearest_on_ellipsoid(a, r, outer[:1], outer[1:])).ravel()
    # The foot of a far point is as uncertain as its own rounding, over the distance.
    assert near == pytest.approx([s, p], abs=1e-10)
    assert np.hypot(*(outer - near)) == pytest.approx(distance, abs=1e-12)


def test_caps_have_their_heights_and_widths() -> None:
    bumps = caps([[1.0, 2.0], [0.0, 0.0]], [0.002, 0.0005], 0.06)
    assert bumps.heights == pytest.approx([0.002, 0.0005], abs=1e-12)
    assert bumps.half_widths == pytest.approx([0.03, 0.03], abs=1e-12)


def test_bumps_are_scattered_evenly_but_for_where_the_robot_stands() -> None:
    low, high, standing = np.array([-1.0, -2.0]), np.array([3.0, 1.0]), np.array([[0.0, 0.0], [0.5, 0.0]])
    count = 3000
    bumps = scattered_caps(low, high, count=count, height=0.004, width=0.2, clear_of=standing, seed=3)
    places = bumps.centers_W[:, :2]
    assert np.linalg.norm(places[:, np.newaxis] - standing, axis=-1).min() > 0.2
    free = 1 - 2 * np.pi * 0.2**2 / 12
    # Five standard deviations of the counts and means.
    assert len(places) == pytest.approx(count * free, abs=5 * np.sqrt(count * free * (1 - free)))
    assert places.mean(axis=0) == pytest.approx([1.0, -0.5], abs=5 * 4 / np.sqrt(12 * count))
    assert bumps.heights.mean() == pytest.approx(0.002, abs=5 * 0.004 / np.sqrt(12 * count))
    assert 0 < bumps.heights.min() < bumps.heights.max() <= 0.004 * (1 + 1e-9)
