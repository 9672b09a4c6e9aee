"""Commands over time: piecewise cubic vectors, and the poses that they lead to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline

from rollerbench.kinematics import odometry

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """A vector over time as cubic Hermite pieces: body twist, or wheel speeds.

    Before the first break it keeps the first value, after the last break the last one.

    Attributes:
        breaks: Times (k,), increasing [s].
        values: Values (k, n) at the breaks.
        slopes: Time derivatives (k, n) at the breaks.
    """

    breaks: Array
    values: Array
    slopes: Array

    def __call__(self, time: ArrayLike) -> Array:
        """Values (..., n) at times (...) [s]."""
        result: Array = self._spline(np.clip(time, self.breaks[0], self.breaks[-1]))
        return result

    def mapped(self, matrix: Array) -> "Profile":
        """The profile of matrix @ value, for a matrix (m, n)."""
        return Profile(breaks=self.breaks, values=self.values @ matrix.T, slopes=self.slopes @ matrix.T)

    def integral(self, time: Array) -> Array:
        """Integrals (k - 1, n) of the values between successive times (k,)."""
        inside = np.clip(time, self.breaks[0], self.breaks[-1])
        antiderivative = self._spline.antiderivative()(inside)
        outside = (time - inside)[:, np.newaxis] * self(time)
        total: Array = np.diff(antiderivative + outside, axis=0)
        return total

    @property
    def peak(self) -> Array:
        """Largest sizes (n,) at the breaks; Hermite pieces between equal or zero slopes do not exceed them."""
        peak: Array = np.abs(self.values).max(axis=0)
        return peak

    @property
    def _spline(self) -> CubicHermiteSpline:
        return CubicHermiteSpline(self.breaks, self.values, self.slopes)


def held_with_ramps(value: ArrayLike, duration: float, ramp: float) -> Profile:
    """From zero to a value (n,) and back at the end, each in the time ramp by the cubic step s^2 (3 - 2s).

    Args:
        value: What is held in between.
        duration: Whole time [s].
        ramp: Time of each ramp [s], positive and at most half of the duration.
    """
    held = np.asarray(value, dtype=np.float64)
    breaks, shape = [0.0, ramp, duration - ramp, duration], [0.0, 1.0, 1.0, 0.0]
    if duration - 2 * ramp <= 1e-9 * duration:
        breaks, shape = [0.0, 0.5 * duration, duration], [0.0, 1.0, 0.0]
    values = np.outer(shape, held)
    return Profile(breaks=np.array(breaks), values=values, slopes=np.zeros_like(values))


def reference_poses(twist: Profile, time: Array, substeps: int = 4) -> Array:
    """Poses (k, 3) that a twist profile leads to from the origin at times (k,).

    Each interval is cut into substeps whose mean twist is exact; where the twist keeps its direction so is the pose.
    """
    fine = np.interp(np.arange((len(time) - 1) * substeps + 1) / substeps, np.arange(len(time)), time)
    return odometry.accumulate(np.zeros(3), twist.integral(fine))[::substeps]
