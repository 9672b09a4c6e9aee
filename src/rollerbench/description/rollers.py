"""Geometry of the rollers of an omni or Mecanum wheel: one ellipsoid each.

Hub frame H: origin at the wheel's centre, y along the axle, z up when the wheel's angle is 0. Roller k sits at the
wheel angle phi_k = 2 pi k / count from the bottom; roller 0 touches level ground at wheel angle 0.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class RollerRing:
    """The rollers of one wheel.

    Attributes:
        wheel_radius: Radius R of the envelope [m].
        wheel_width: Width of the wheel along its axle [m].
        roller_radius: Largest radius r of a roller [m].
        roller_angle: Axis of the roller at the bottom, from the axle (+y), counter-clockwise from above [rad].
        count: Rollers of all rows together.
        rows: Rows side by side.
    """

    wheel_radius: float
    wheel_width: float
    roller_radius: float
    roller_angle: float
    count: int
    rows: int

    @property
    def pitch(self) -> float:
        """Wheel angle from one roller to the next [rad]."""
        return 2 * math.pi / self.count

    @property
    def semi_axis(self) -> float:
        """Half length a of the ellipsoid along the roller's axis [m].

        The ellipsoid (a, r, r) touches the plane at distance R below the wheel's centre twice: when its roller is at
        the bottom, and at the hand-off angle theta = pi/count, where the next roller takes over. There its centre is
        h = R - (R - r) cos(theta) above the plane and its axis rises by s = sin(roller_angle) sin(theta), so that
        h^2 = a^2 s^2 + r^2 (1 - s^2).
        """
        theta = 0.5 * self.pitch
        rise = abs(math.sin(self.roller_angle)) * math.sin(theta)
        height = self.wheel_radius - (self.wheel_radius - self.roller_radius) * math.cos(theta)
        return math.sqrt((height**2 - self.roller_radius**2) / rise**2 + self.roller_radius**2)

    @property
    def half_length(self) -> float:
        """Half length of the barrel that ever touches the ground [m], along the roller's axis from its middle."""
        theta = 0.5 * self.pitch
        rise = abs(math.sin(self.roller_angle)) * math.sin(theta)
        height = self.wheel_radius - (self.wheel_radius - self.roller_radius) * math.cos(theta)
        return self.semi_axis**2 * rise / height

    @property
    def angles(self) -> NDArray[np.float64]:
        """Wheel angles (count,) of the rollers about +y from the bottom [rad]."""
        return self.pitch * np.arange(self.count, dtype=np.float64)

    @property
    def axes_H(self) -> NDArray[np.float64]:
        """Unit vectors (count, 3) along the rollers' axes, in H."""
        bottom = np.array([-math.sin(self.roller_angle), math.cos(self.roller_angle), 0.0])
        return rotate_about_axle(self.angles, bottom)

    @property
    def centers_H(self) -> NDArray[np.float64]:
        """Centres (count, 3) of the rollers from the wheel's centre, in H [m]."""
        row = np.arange(self.count) % self.rows
        offset = (row - 0.5 * (self.rows - 1)) * self.wheel_width / self.rows
        bottom = np.array([0.0, 0.0, self.roller_radius - self.wheel_radius])
        return rotate_about_axle(self.angles, bottom) + offset[:, np.newaxis] * np.array([0.0, 1.0, 0.0])


def rotate_about_axle(angle: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotates vectors (..., 3) about +y by angles (...,) [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(np.broadcast_to(vector, (*np.shape(angle), 3)), -1, 0)
    return np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)


def roller_clearance(ring: RollerRing, samples: int = 101) -> float:
    """Smallest gap between two neighbouring rollers [m], negative where they overlap.

    The working barrel of a roller is the union of the spheres inscribed in its ellipsoid: centre at s on the axis,
    radius r sqrt(1 - s^2 / (a^2 - r^2)), for |s| up to half_length (1 - r^2/a^2). Two rollers are as far apart as the
    closest pair of such spheres.
    """
    a, r = ring.semi_axis, ring.roller_radius
    flattening = 1 - (r / a) ** 2
    s = np.linspace(-1, 1, samples) * ring.half_length * flattening
    radius = r * np.sqrt(np.maximum(0.0, 1 - s**2 / (a**2 * flattening)))
    centers = ring.centers_H[:, np.newaxis] + s[:, np.newaxis] * ring.axes_H[:, np.newaxis]
    first = centers[0][:, np.newaxis]
    # Rotation by two pitches maps the ring onto itself, so roller 0's neighbours stand for all.
    gaps = [
        np.linalg.norm(first - centers[k], axis=-1) - radius[:, np.newaxis] - radius
        for k in range(1, min(ring.rows, ring.count - 1) + 1)
    ]
    return float(min(gap.min() for gap in gaps))


def largest_count(ring: RollerRing) -> int | None:
    """Largest number of rollers of this radius that fit, or None."""
    for count in range(ring.count - ring.rows, 3, -ring.rows):
        if roller_clearance(replace(ring, count=count)) >= 0:
            return count
    return None


def largest_radius(ring: RollerRing) -> float | None:
    """Largest radius at which this number of rollers fits [m], rounded down to three digits, or None."""
    for fraction in np.arange(0.99, 0.05, -0.01):
        if roller_clearance(replace(ring, roller_radius=float(fraction) * ring.roller_radius)) >= 0:
            radius = float(fraction) * ring.roller_radius
            step = 10.0 ** (math.floor(math.log10(radius)) - 2)
            return math.floor(radius / step) * step
    return None
