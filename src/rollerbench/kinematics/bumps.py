"""Uneven ground: spherical caps on a plane, and how deep they press into ellipsoids of revolution."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


STEP_WIDTH = 20.0
"""Width of steps across the way, which are bumps for legs [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bumps:
    """Spheres whose tops rise above level ground at z = 0.

    Attributes:
        centers_W: Centres (k, 3) in W [m], below the ground.
        radii: Radii (k,) [m].
    """

    centers_W: Array
    radii: Array

    @property
    def heights(self) -> Array:
        """Heights (k,) of the caps [m]."""
        return self.centers_W[:, 2] + self.radii

    @property
    def half_widths(self) -> Array:
        """Radii (k,) of the caps' bases [m]."""
        half_widths: Array = np.sqrt(self.radii**2 - self.centers_W[:, 2] ** 2)
        return half_widths


def caps(places: ArrayLike, heights: ArrayLike, width: float) -> Bumps:
    """Bumps at places (k, 2), of heights (k,) and one base width w [m]: radius (w^2/4 + h^2) / (2h)."""
    h, xy = np.asarray(heights, np.float64), np.asarray(places, np.float64).reshape(-1, 2)
    radii = (0.25 * width**2 + h**2) / (2 * h)
    return Bumps(centers_W=np.column_stack([xy, h - radii]), radii=radii)


def scattered_caps(
    low: Array, high: Array, *, count: int, height: float, width: float, clear_of: Array, seed: int
) -> Bumps:
    """Caps at random places in a rectangle, with heights uniform in (0, height].

    Args:
        low: Corner (2,) of the rectangle with the smallest x and y [m].
        high: The opposite corner [m].
        count: How many are drawn.
        height: Largest height [m].
        width: Width of all bases [m].
        clear_of: Points (n, 2) that have no cap within a width: caps drawn there are left out [m].
        seed: Seed of the random numbers.
    """
    random = np.random.default_rng(seed)
    places = random.uniform(low, high, (count, 2))
    heights = height * (1.0 - random.random(count))
    away = np.linalg.norm(places[:, np.newaxis] - clear_of, axis=-1).min(axis=1) > width
    return caps(places[away], heights[away], width)


def nearest_on_ellipsoid(a: float, r: float, along: Array, across: Array) -> tuple[Array, Array]:
    """The points of an ellipsoid of revolution that are nearest to outer points, in its meridian plane.

    With the point at (s, p), the nearest one is (a^2 s / (t + a^2), r^2 p / (t + r^2)), where t > 0 is the root of
    (a s / (t + a^2))^2 + (r p / (t + r^2))^2 = 1. The left side is convex and falls with t, so that Newton's method
    from below never overshoots.

    Args:
        a: Semi-axis along the axis of revolution [m].
        r: Semi-axis across [m].
        along: Coordinates (n,) of the points along the axis [m].
        across: Distances (n,) of the points from the axis [m].

    Returns:
        Coordinates along and across (n,) of the nearest points [m].

    Source: Eberly (2013), Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid, section 2.
    """
    # One of the two squares alone is 1 here, so the root is not below.
    t = np.maximum(0.0, np.maximum(a * np.abs(along) - a**2, r * across - r**2))
    for _ in range(100):
        first, second = (a * along / (t + a**2)) ** 2, (r * across / (t + r**2)) ** 2
        step = 0.5 * (first + second - 1) / (first / (t + a**2) + second / (t + r**2))
        t = np.maximum(0.0, t + step)
        if np.all(np.abs(step) <= 1e-15 * (t + r**2)):
            break
    return a**2 * along / (t + a**2), r**2 * across / (t + r**2)
