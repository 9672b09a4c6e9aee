"""Commands over time: piecewise cubic vectors, and the poses that they lead to."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline

from rollerbench.kinematics import odometry

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
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

    def rate(self, time: ArrayLike) -> Array:
        """Time derivatives (..., n) at times (...) [s]; 0 before the first break and after the last one."""
        t = np.asarray(time, dtype=np.float64)
        inside = (t >= self.breaks[0]) & (t <= self.breaks[-1])
        result: Array = self._spline(np.clip(t, self.breaks[0], self.breaks[-1]), 1) * inside[..., np.newaxis]
        return result

    @property
    def peak(self) -> Array:
        """Largest sizes (n,), from 16 samples a piece."""
        peak: Array = np.abs(self(self._fine)).max(axis=0)
        return peak

    @property
    def peak_rate(self) -> Array:
        """Largest sizes (n,) of the time derivative, from 16 samples a piece."""
        rate: Array = np.abs(self._spline(self._fine, 1)).max(axis=0)
        return rate

    @property
    def _fine(self) -> Array:
        """Times of 16 samples a piece [s]."""
        pieces = len(self.breaks) - 1
        return np.interp(np.arange(16 * pieces + 1) / 16, np.arange(pieces + 1), self.breaks)

    @property
    def _spline(self) -> CubicHermiteSpline:
        return CubicHermiteSpline(self.breaks, self.values, self.slopes)


def sum_of_steps(starts: ArrayLike, stops: ArrayLike, heights: ArrayLike) -> Profile:
    """Sum of cubic steps h s^2 (3 - 2s), s = (t - start) / (stop - start) from 0 to 1: the STEP function of ADAMS.

    Args:
        starts: Times (k,) at which the steps begin [s].
        stops: Times (k,) at which they end, later than they begin [s].
        heights: Heights (k, n).
    """
    # To the nanosecond: 0.1 + 0.2 and 0.3 are one break.
    start, stop = np.round(np.asarray(starts, np.float64), 9), np.round(np.asarray(stops, np.float64), 9)
    height = np.asarray(heights, dtype=np.float64)
    breaks = np.unique(np.concatenate([start, stop]))
    s = np.clip((breaks[:, np.newaxis] - start) / (stop - start), 0.0, 1.0)
    return Profile(
        breaks=breaks,
        values=(s**2 * (3 - 2 * s)) @ height,
        slopes=(6 * s * (1 - s) / (stop - start)) @ height,
    )


def held_with_ramps(value: ArrayLike, duration: float, ramp: float) -> Profile:
    """From zero to a value (n,) and back at the end, each in the time ramp by a cubic step.

    Args:
        value: What is held in between.
        duration: Whole time [s].
        ramp: Time of each ramp [s], positive and at most half of the duration.
    """
    held = np.asarray(value, dtype=np.float64)
    return sum_of_steps([0.0, duration - ramp], [ramp, duration], [held, -held])


def reference_poses(twist: Profile, time: Array, substeps: int = 4, *, start: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Poses (k, 3) that a twist profile leads to from a start (3,), the origin by default, at times (k,).

    Each interval is cut into substeps whose mean twist is exact; where the twist keeps its direction so is the pose.
    """
    fine = np.interp(np.arange((len(time) - 1) * substeps + 1) / substeps, np.arange(len(time)), time)
    return odometry.accumulate(start, twist.integral(fine))[::substeps]
