"""Smooth courses from one value to another."""

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
    """A vector that goes to a target in a given time, on a cubic without a jump in its rate.

    Attributes:
        value: The vector.
        rate: Its time derivative.
        target: Where it goes.
        remaining: Time until it is there [s].
    """

    value: Array
    rate: Array
    target: Array
    remaining: float = 0.0

    @classmethod
    def resting(cls, value: Array) -> "Follower":
        """A vector that stays where it is."""
        return cls(value, 0 * value, value)

    def follow(self, target: Array, dt: float, duration: float) -> "Follower":
        """A moment dt later [s]; a new target is reached in the given duration [s]."""
        changed = not np.array_equal(target, self.target)
        left = duration if changed else self.remaining
        if not changed and left <= 0:
            return self
        if left <= dt * (1 + 1e-9):
            return Follower.resting(np.array(target, dtype=np.float64))
        # Cubic Hermite polynomial from here to the target at rest.
        h = dt / left
        away, slope = self.value - target, left * self.rate
        value = target + (1 - h) ** 2 * ((1 + 2 * h) * away + h * slope)
        rate = (1 - h) * (-6 * h * away + (1 - 3 * h) * slope) / left
        return Follower(value, rate, np.array(target, dtype=np.float64), left - dt)
