"""Leng and Cao's formulas as printed, and with their mistakes mended; wheels i at azimuths gamma_i, delta = 2 alpha.

The loads are P/4 each, beta is the direction of travel, and by symmetry wheels 1 and 3 do the same, as do 2 and 4. The
paper prints the formulas for 0 <= beta < alpha, where wheels 2 and 4 push hardest, and says that others follow
likewise; mended, they hold up to 90 deg.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """Section 3.4, as printed.

    Attributes:
        alpha: Half of the angle between two neighbouring wheels [rad].
        weight: P [N].
        gravity: With which the weight is a mass of 20 kg [m/s2].
        wheel_radius: R [m].
        roller_radius: r [m].
        roll_resistance: f_R [-].
        adhesion: phi [-].
        roller_inertia: J_p [kg m2].
        wheel_inertia: J_d [kg m2].
    """

    alpha: float = np.pi / 6
    weight: float = 196.0
    gravity: float = 9.8
    wheel_radius: float = 0.09
    roller_radius: float = 0.0125
    roll_resistance: float = 0.2
    adhesion: float = 1.0
    roller_inertia: float = 5.235e-7
    wheel_inertia: float = 3.669e-3

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.weight / self.gravity

    @property
    def drag(self) -> float:
        """F_f = f_R P/4 [N]."""
        return self.roll_resistance * self.weight / 4

    @property
    def grip(self) -> float:
        """F_phi = phi P/4 [N]."""
        return self.adhesion * self.weight / 4


PRINTED = Parameters()


def max_acceleration(beta: ArrayLike, p: Parameters = PRINTED, *, mended: bool = False) -> Array:
    """Equation (18) [m/s2]; mended, the drag of rollers 2 and 4 has the sign of their speed.

    Args:
        beta: Directions (...) [rad].
        p: Parameters.
        mended: Whether to mend it.
    """
    b = np.asarray(beta, dtype=np.float64)
    sense = np.sign(_clean(np.cos(p.alpha + b))) if mended else 1.0
    push = 2 * p.grip * np.sin(2 * p.alpha) - 2 * np.cos(2 * p.alpha) * sense * p.drag - 2 * p.drag
    spin = 2 * np.cos(2 * p.alpha) * np.cos(p.alpha + b) + 2 * np.cos(p.alpha - b)
    return push / (p.mass * np.cos(p.alpha - b) + spin * p.roller_inertia / p.roller_radius**2)


def roller_slip_acceleration(beta: ArrayLike, p: Parameters = PRINTED) -> Array:
    """Equations (19) and (20): the acceleration at which rollers would slip across their axes [m/s2]."""
    b = np.asarray(beta, dtype=np.float64)
    spin = (p.grip - p.drag) * p.roller_radius / p.roller_inertia
    return spin * p.roller_radius / np.cos(p.alpha - b)


def efforts(
    beta: ArrayLike, acceleration: ArrayLike, p: Parameters = PRINTED, *, mended: bool = False
) -> tuple[Array, Array]:
    """Efforts T_13 and T_24 by equations (13) and (22) to (25) [N m].

    Mended, the drag of both rollers of a pair counts in (22) and (23), the drag of a wheel has the lever R in (24) and
    (25), and drags have the signs of the speeds.

    Args:
        beta: Directions (...) [rad].
        acceleration: Accelerations (...) [m/s2].
        p: Parameters.
        mended: Whether to mend them.
    """
    b, a = np.asarray(beta, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    double, pair = 2 * p.alpha, 2.0 if mended else 1.0
    first, second = roller_forces(b, a, p, mended=mended)
    push_13 = (pair * (second + first * np.cos(double)) + p.mass * a * np.cos(p.alpha + b)) / np.sin(double)
    push_24 = (pair * (second * np.cos(double) + first) + p.mass * a * np.cos(p.alpha - b)) / np.sin(double)
    drag = p.drag * p.wheel_radius if mended else p.drag
    turns = np.sin(p.alpha - b), np.sin(p.alpha + b)
    senses = [np.sign(_clean(turn)) if mended else 1.0 for turn in turns]
    t_13, t_24 = (
        p.wheel_inertia * a * turn / p.wheel_radius + push * p.wheel_radius / 2 + sense * drag
        for turn, push, sense in zip(turns, (push_13, push_24), senses, strict=True)
    )
    return t_13, t_24


def roller_forces(
    beta: ArrayLike, acceleration: ArrayLike, p: Parameters = PRINTED, *, mended: bool = False
) -> tuple[Array, Array]:
    """Forces of the ground on rollers 1 and 2 against the travel, by equation (13) [N]; mended, with signs."""
    b, a = np.asarray(beta, dtype=np.float64), np.asarray(acceleration, dtype=np.float64)
    speeds = np.cos(p.alpha - b), np.cos(p.alpha + b)
    first, second = (
        (np.sign(_clean(speed)) if mended else 1.0) * p.drag + p.roller_inertia * a * speed / p.roller_radius**2
        for speed in speeds
    )
    return first, second


def candidates(beta: float, delta: float) -> list[int]:
    """Wheels (0 to 3) that meet condition (11), at azimuths delta/2, 180 deg -+ delta/2 and -delta/2 [rad]."""
    azimuths = np.array([0.5 * delta, np.pi - 0.5 * delta, np.pi + 0.5 * delta, -0.5 * delta])
    away = beta - azimuths + np.array([[0.5 * np.pi], [1.5 * np.pi]])
    away = np.abs((away + np.pi) % (2 * np.pi) - np.pi)
    return np.flatnonzero((away <= 0.5 * (np.pi - delta) + 1e-12).any(axis=0)).tolist()


def _clean(speed: Array) -> Array:
    """Speeds with rounding errors set to 0."""
    return np.where(np.abs(speed) < 1e-9, 0.0, speed)
