"""Mass, centre of mass and inertia of the parts, and of the whole robot.

Formulas of the homogeneous solids: Goldstein, Poole, Safko (2002), chapter 5; composition by the parallel axis theorem.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GRAVITY = 9.81
"""Standard value used for loads and derived parameters; Drake's default too [m/s2]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RigidInertia:
    """Mass distribution of a rigid part, in some frame P.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass (3,) from Po, in P [m].
        moment: Rotational inertia (3, 3) about the centre of mass, in P [kg m2].
    """

    mass: float
    com: NDArray[np.float64]
    moment: NDArray[np.float64]

    def moved(self, rotation: NDArray[np.float64], translation: NDArray[np.float64]) -> "RigidInertia":
        """The same part seen from frame Q, with P's rotation (3, 3) and origin (3,) in Q."""
        return RigidInertia(
            mass=self.mass,
            com=translation + rotation @ self.com,
            moment=rotation @ self.moment @ rotation.T,
        )


def at_origin(mass: float, moments: tuple[float, float, float]) -> RigidInertia:
    """A part whose centre of mass is the frame's origin, from its principal moments along the axes [kg m2]."""
    return RigidInertia(mass=mass, com=np.zeros(3), moment=np.diag(moments))


def solid_box(mass: float, size: tuple[float, float, float]) -> RigidInertia:
    """Homogeneous box of extent size along x, y, z [m]."""
    x, y, z = np.square(size) / 12
    return at_origin(mass, (mass * (y + z), mass * (z + x), mass * (x + y)))


def solid_cylinder(mass: float, radius: float, length: float) -> RigidInertia:
    """Homogeneous cylinder about the y axis [m]."""
    across = mass * (3 * radius**2 + length**2) / 12
    return at_origin(mass, (across, 0.5 * mass * radius**2, across))


def solid_rod(mass: float, radius: float, length: float) -> RigidInertia:
    """Homogeneous cylinder about the z axis [m]."""
    across = mass * (3 * radius**2 + length**2) / 12
    return at_origin(mass, (across, across, 0.5 * mass * radius**2))


def solid_ball(mass: float, radius: float) -> RigidInertia:
    """Homogeneous ball [m]."""
    moment = 0.4 * mass * radius**2
    return at_origin(mass, (moment, moment, moment))


def barrel_volume(semi_axis: float, radius: float, half_length: float) -> float:
    """Volume [m3] of an ellipsoid (semi_axis, radius, radius) cut at +-half_length along its long axis."""
    return 2 * np.pi * radius**2 * half_length * (1 - (half_length / semi_axis) ** 2 / 3)


def solid_barrel(mass: float, semi_axis: float, radius: float, half_length: float) -> RigidInertia:
    """Homogeneous ellipsoid of revolution about x, cut at +-half_length [m].

    With the cross-section rho(x)^2 = r^2 (1 - x^2/a^2): I_axial = 1/2 <rho^2>, I_across = <rho^2/4 + x^2>, where <> is
    the mean over the volume, that is weighted by rho^2.
    """
    c = (half_length / semi_axis) ** 2
    weight = 1 - c / 3
    mean_rho2 = radius**2 * (1 - 2 * c / 3 + c**2 / 5) / weight
    mean_x2 = half_length**2 * (1 / 3 - c / 5) / weight
    across = mass * (mean_rho2 / 4 + mean_x2)
    return at_origin(mass, (0.5 * mass * mean_rho2, across, across))


def combined(parts: list[RigidInertia]) -> RigidInertia:
    """Several parts, given in one frame, as one rigid part."""
    mass = sum(part.mass for part in parts)
    com = np.sum([part.mass * part.com for part in parts], axis=0) / mass
    moment = np.zeros((3, 3))
    for part in parts:
        r = part.com - com
        moment += part.moment + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return RigidInertia(mass=mass, com=com, moment=moment)
