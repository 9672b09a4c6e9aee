"""Smooth courses from one value to another."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def quintic(u: float | Array) -> Array:
    """From 0 at u = 0 to 1 at u = 1, at rest and without acceleration at both ends."""
    s = np.clip(u, 0.0, 1.0)
    return s**3 * (10 + s * (6 * s - 15))


def bump(u: float | Array) -> Array:
    """From 0 at u = 0 to 1 in the middle and back to 0 at u = 1, at rest and without acceleration at both ends."""
    s = np.clip(u, 0.0, 1.0)
    return 64 * s**3 * (1 - s) ** 3


@dataclass(frozen=True, slots=True, eq=False)
class Follower:
    """A vector that follows a target as a critically damped oscillator: no jump in its rate.

    Attributes:
        value: The vector.
        rate: Its time derivative.
    """

    value: Array
    rate: Array

    def follow(self, target: Array, dt: float, time_constant: float) -> "Follower":
        """A moment dt later [s]; the exact solution for a target that stays."""
        w = 1.0 / time_constant
        error, decay = self.value - target, math.exp(-w * dt)
        slope = self.rate + w * error
        value, rate = target + (error + slope * dt) * decay, (self.rate - w * slope * dt) * decay
        if np.abs(value - target).max() < 1e-7 and np.abs(rate).max() < 1e-6:
            return Follower(np.array(target, dtype=np.float64), np.zeros_like(rate))
        return Follower(value, rate)
