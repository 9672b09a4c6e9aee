"""Inverse kinematics of any leg, by steps of least motion within the joints' limits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rollerbench.kinematics.legs.chain import jacobian, position

Array = NDArray[np.float64]

REACHED = 1e-11
"""A foot so near to its target, over the leg's length, has reached it."""

SETTLED = 1e-9
"""A step of joints [rad] after which they have come to rest."""

FEW = 6
"""Seeds from which the nearest point to a target out of reach is sought."""

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

        The solution to which steps from near (N, n) lead; else, from the seeds, that with the least |q - near|.
        A joint may be held at values (N,).
        """
        limits = np.repeat(self.limits[:, np.newaxis], len(near), axis=1)
        if held is not None:
            limits[:, :, held] = value
        q = self._settled(p, near, np.clip(near, *limits), limits)
        missed = np.flatnonzero(self._left(p, q) > REACHED * self.length)
        if len(missed):
            sown = self._sown(p[missed], near[missed], limits[:, missed])
            q[missed] = sown[0]
            for index, starts in zip(missed, np.swapaxes(sown, 0, 1), strict=True):
                if self._left(p[index], q[index]) > REACHED * self.length:
                    q[index] = self._fitted(p[index], near[index], starts[:FEW], limits[:, index])
        left = self._left(p, q)
        return q, np.where(left > REACHED * self.length, left, 0.0)

    def _left(self, p: Array, q: Array) -> Array:
        """Distances (N,) [m] of the feet from p (N, 3)."""
        return np.asarray(np.linalg.norm(p - position(self.rows, q), axis=-1))

    def _sown(self, p: Array, near: Array, limits: Array) -> Array:
        """What steps from the seeds lead to (m, N, n): arrivals by their motion from near, then misses."""
        shape = (len(self.seeds), *near.shape)
        starts = np.clip(np.broadcast_to(self.seeds[:, np.newaxis], shape), *limits[:, np.newaxis])
        targets, wanted = (np.tile(array, (len(self.seeds), 1)) for array in (p, near))
        boxes = np.tile(limits, (1, len(self.seeds), 1))
        flat = self._settled(targets, wanted, starts.reshape(-1, shape[-1]), boxes)
        q, left = flat.reshape(shape), self._left(targets, flat).reshape(shape[:2])
        motion = np.linalg.norm(q - near, axis=-1)
        order = np.argsort(np.where(left <= REACHED * self.length, motion, 1e9 * (1.0 + left)), axis=0)
        return np.take_along_axis(q, order[..., np.newaxis], axis=0)

    def _settled(self, p: Array, near: Array, q: Array, limits: Array, iterations: int = 100) -> Array:
        """Joint angles (N, n) after steps from q towards p (N, 3), and as near to near (N, n) as this leaves."""
        q, active = q.copy(), np.arange(len(q))
        for iteration in range(iterations):
            # Full steps towards near may overshoot for ever where the leg is nearly outstretched.
            gain = min(1.0, 0.8 ** (iteration - 10))
            low, high = limits[:, active]
            now = q[active]
            step, error = self._step(p[active], gain * (near[active] - now), now, low, high)
            q[active] = np.clip(now + step, low, high)
            moved = np.max(np.abs(q[active] - now), axis=-1)
            active = active[(moved > SETTLED) | ((error > REACHED * self.length) & (moved > 1e-15))]
            if not len(active):
                break
        return q

    def _step(self, p: Array, wish: Array, q: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Damped step (N, n) closest to a wish d (N, n), d + J^T (J J^T + damping)^-1 (e - J d), and |e| (N,) [m]."""
        matrix = jacobian(self.rows, q)[..., 3:, :]
        error = p - position(self.rows, q)
        size = np.linalg.norm(error, axis=-1)
        free = np.ones_like(q)
        for _ in range(2):
            # Joints that would leave their limits stay at them, and the others do their share.
            j, d = matrix * free[:, np.newaxis], wish * free
            gram = j @ np.swapaxes(j, 1, 2)
            gram += (1e-3 * size**2 + 1e-14 * self.length**2)[:, np.newaxis, np.newaxis] * np.eye(3)
            lacking = error[..., np.newaxis] - j @ d[..., np.newaxis]
            step = d + (np.swapaxes(j, 1, 2) @ np.linalg.solve(gram, lacking))[..., 0]
            free = np.where(((q <= low) & (step < 0)) | ((q >= high) & (step > 0)), 0.0, free)
        longest = np.linalg.norm(step, axis=-1, keepdims=True)
        return step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP)), size

    def _fitted(self, p: Array, near: Array, starts: Array, limits: Array) -> Array:
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
        found = whole(np.asarray(best.x, dtype=np.float64))[np.newaxis]
        both = np.vstack([found, self._settled(p[np.newaxis], near[np.newaxis], found, limits[:, np.newaxis])])
        return np.asarray(both[np.argmin(self._left(p, both))])


def spread(limits: Array, count: int = 32) -> Array:
    """Joint angles (count, n) spread evenly over the limits (2, n): multiples of powers of 1/g, with g^(n+1) = g + 1.

    Source: Roberts (2018), The unreasonable effectiveness of quasirandom sequences.
    """
    joints = limits.shape[1]
    golden = 2.0
    for _ in range(50):
        golden = (1.0 + golden) ** (1.0 / (joints + 1))
    fractions = np.arange(1, count + 1)[:, np.newaxis] * golden ** -np.arange(1.0, joints + 1) % 1.0
    return np.asarray(limits[0] + fractions * (limits[1] - limits[0]))
