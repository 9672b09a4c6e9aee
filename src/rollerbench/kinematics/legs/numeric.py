"""Inverse kinematics of any leg, by steps of least motion within the joints' limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rollerbench.kinematics.legs.chain import jacobian, position

Array = NDArray[np.float64]

REACHED = 1e-12
"""A foot so near to its target, over the leg's length, has reached it."""

LONGEST_STEP = 0.5
"""Largest change of the joint angles in one step [rad], for the Jacobian holds only nearby."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Search:
    """A leg whose joints are sought by iteration.

    Attributes:
        rows: Denavit-Hartenberg rows (n, 4).
        limits: Least and largest joint angles (2, n) [rad].
        length: Length of the leg [m].
        seeds: Joint angles (m, n) from which to start, besides those near which a solution is wanted [rad].
    """

    rows: Array
    limits: Array
    length: float
    seeds: Array

    def solve(self, p: Array, near: Array, held: int | None, value: Array) -> tuple[Array, Array]:
        """Joint angles (N, n) that put feet at p (N, 3), and the distances (N,) [m] that are left.

        Of the solutions found, the one with the least |q - near|; a joint may be held at values (N,).
        """
        count, joints = near.shape
        limits = np.repeat(self.limits[:, np.newaxis], count, axis=1)
        if held is not None:
            limits[:, :, held] = value
        seeds = np.concatenate([near[:, np.newaxis], np.broadcast_to(self.seeds, (count, *self.seeds.shape))], axis=1)
        starts = np.clip(seeds, *limits[:, :, np.newaxis])
        targets, wanted = (np.repeat(array, starts.shape[1], axis=0) for array in (p, near))
        boxes = np.repeat(limits, starts.shape[1], axis=1)
        q = self._settled(targets, wanted, starts.reshape(-1, joints), boxes).reshape(starts.shape)
        left = np.linalg.norm(p[:, np.newaxis] - position(self.rows, q), axis=-1)
        motion = np.linalg.norm(q - near[:, np.newaxis], axis=-1)
        # Those that arrived are compared by their motion, the others by what is left.
        best = np.argmin(np.where(left <= REACHED * self.length, motion, 1e9 * (1.0 + left)), axis=1)
        q, left = q[np.arange(count), best], left[np.arange(count), best]
        for index in np.flatnonzero(left > REACHED * self.length):
            q[index] = self._fitted(p[index], np.vstack([q[index], starts[index]]), limits[:, index])
            box = limits[:, index : index + 1]
            finer = self._settled(p[index : index + 1], near[index : index + 1], q[index : index + 1], box)[0]
            before, after = (np.linalg.norm(p[index] - position(self.rows, each)) for each in (q[index], finer))
            q[index], left[index] = (finer, after) if after < before else (q[index], before)
        return q, np.where(left > REACHED * self.length, left, 0.0)

    def _settled(self, p: Array, near: Array, q: Array, limits: Array, iterations: int = 100) -> Array:
        """Joint angles (N, n) after steps from q towards p (N, 3), and as near to near (N, n) as this leaves."""
        q, active = q.copy(), np.arange(len(q))
        for _ in range(iterations):
            low, high = limits[:, active]
            now = q[active]
            step, error = self._step(p[active], near[active], now, low, high)
            q[active] = np.clip(now + step, low, high)
            moved = np.max(np.abs(q[active] - now), axis=-1)
            active = active[(moved > 1e-12) | ((error > REACHED * self.length) & (moved > 1e-15))]
            if not len(active):
                break
        return q

    def _step(self, p: Array, near: Array, q: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Damped step (N, n) of least motion from near: d + J^T (J J^T + damping)^-1 (e - J d), d = near - q."""
        matrix = jacobian(self.rows, q)[..., 3:, :]
        error = p - position(self.rows, q)
        size = np.linalg.norm(error, axis=-1)
        free = np.ones_like(q)
        for _ in range(2):
            # Joints that would leave their limits stay at them, and the others do their share.
            j, d = matrix * free[:, np.newaxis], (near - q) * free
            gram = j @ np.swapaxes(j, 1, 2)
            gram += (1e-3 * size**2 + 1e-14 * self.length**2)[:, np.newaxis, np.newaxis] * np.eye(3)
            lacking = error[..., np.newaxis] - j @ d[..., np.newaxis]
            step = d + (np.swapaxes(j, 1, 2) @ np.linalg.solve(gram, lacking))[..., 0]
            free = np.where(((q <= low) & (step < 0)) | ((q >= high) & (step > 0)), 0.0, free)
        longest = np.linalg.norm(step, axis=-1, keepdims=True)
        return step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP)), size

    def _fitted(self, p: Array, starts: Array, limits: Array) -> Array:
        """Joint angles (n,) within limits (2, n) whose foot is the nearest to p (3,) that starts (m, n) lead to."""
        free = limits[0] < limits[1]

        def whole(angles: Array) -> Array:
            q = limits[0].copy()
            q[free] = angles
            return q

        def error(angles: Array) -> Array:
            return position(self.rows, whole(angles)) - p

        def slope(angles: Array) -> Array:
            return jacobian(self.rows, whole(angles))[3:, free]

        fits = [
            least_squares(
                error,
                np.clip(start, *limits)[free],
                slope,
                bounds=(limits[0, free], limits[1, free]),
                xtol=1e-15,
                ftol=1e-15,
                gtol=1e-15,
                x_scale=1.0,
            )
            for start in starts
        ]
        best = min(fits, key=lambda fit: float(fit.cost))
        return whole(np.asarray(best.x, dtype=np.float64))
