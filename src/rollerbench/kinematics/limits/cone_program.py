"""Many small second-order cone programs at once, by an interior-point method.

Each maximises c.z over the z with |v_j(z)| <= s_j(z), where s_j and v_j are affine. The central path of the barrier
-sum log(s_j^2 - |v_j|^2) is followed by Newton steps of length 1/(1 + lambda), with lambda the Newton decrement: they
stay inside, and converge from everywhere, for the barrier is self-concordant.

Source: Boyd and Vandenberghe (2004), Convex Optimization, sections 9.6 and 11.3 to 11.6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GROWTH = 10.0
"""Factor from one point of the central path to the next."""

GAP = 1e-11
"""Distance from the optimum at which the path ends, over the number of cones."""

INTERIOR = 1e-8
"""Sets thinner than this count as empty; the data are scaled to about 1."""

ROOMY = 1e-2
"""A point that is so far inside all cones is a good one to start from."""

SIGNS = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cones:
    """The maps w_j(z) = [s_j, v_j] = constant + slope @ z, for p programs of m cones in k variables.

    Attributes:
        constant: (p, m, 3).
        slope: (p, m, 3, k).
    """

    constant: Array
    slope: Array

    def at(self, z: Array) -> Array:
        """Values w (p, m, 3) at z (p, k)."""
        return self.constant + np.einsum("pmik,pk->pmi", self.slope, z)


def slack(w: Array) -> Array:
    """Slack s - |v| (...) of values w (..., 3): negative outside the cone."""
    return w[..., 0] - np.hypot(w[..., 1], w[..., 2])


def section(constant: Array, slope: Array) -> tuple[Array, Array]:
    """Where lines lie in cones: the t with |v(t)| <= s(t) for all w(t) = [s, v] = constant + slope t of a line.

    |v|^2 <= s^2 is a quadratic inequality, which also the cone of -s fulfils.

    Args:
        constant: (..., m, 3).
        slope: (..., m, 3).

    Returns:
        Smallest and largest t (...), infinite where nothing bounds it; the smallest is larger where there is no t.
    """
    signs = -SIGNS
    a, b = np.sum(signs * slope**2, axis=-1), np.sum(signs * slope * constant, axis=-1)
    c = np.sum(signs * constant**2, axis=-1)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    # The root that does not cancel first, then the other.
    q = -(b + np.where(b < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.stack([q / a, c / q]), axis=0)
        middle = constant[..., 0] + slope[..., 0] * 0.5 * (ends[0] + ends[1])
    s = slope[..., 0]
    low = np.where(a > 0, ends[0], np.where(s > 0, ends[1], -np.inf))
    high = np.where(a > 0, ends[1], np.where(s < 0, ends[0], np.inf))
    # Lines that pass the cone by, lines within the other one, and lines along which nothing changes.
    nowhere = (a > 0) & ((b * b < a * c) | (middle < 0))
    still = (a == 0) & (b == 0)
    nowhere |= still & ((c > 0) | (constant[..., 0] < 0))
    low = np.where(nowhere, np.inf, np.where(still, -np.inf, low))
    high = np.where(nowhere, -np.inf, np.where(still, np.inf, high))
    return low.max(axis=-1), high.min(axis=-1)


def maximize(objective: Array, cones: Cones) -> tuple[Array, NDArray[np.bool_]]:
    """Solves the programs.

    Args:
        objective: c (p, k).
        cones: The cones; together they must bound the feasible set.

    Returns:
        z: Optima (p, k); where there is no feasible point, the point that violates the cones least.
        feasible: Whether (p,) there is one, in whose neighbourhood all are feasible.
    """
    count, size = objective.shape
    # First the largest common slack, from 0 on; up to 1 is enough.
    lift = np.zeros((*cones.slope.shape[:2], 3, 1))
    lift[:, :, 0] = -1.0
    slope = np.concatenate([cones.slope, lift], axis=-1)
    bound = np.zeros((count, 1, 3, size + 1))
    bound[:, 0, 0, -1] = -1.0
    ceiling = np.tile([1.0, 0.0, 0.0], (count, 1, 1))
    lifted = Cones(
        constant=np.concatenate([cones.constant, ceiling], axis=1), slope=np.concatenate([slope, bound], axis=1)
    )
    start = np.zeros((count, size + 1))
    start[:, -1] = np.minimum(slack(cones.constant).min(axis=1), 0.0) - 1.0
    direction = np.zeros((count, size + 1))
    direction[:, -1] = 1.0
    z = _follow(direction, lifted, start, enough=ROOMY)
    feasible = z[:, -1] > INTERIOR
    z = z[:, :-1]
    inner = Cones(constant=cones.constant[feasible], slope=cones.slope[feasible])
    z[feasible] = _follow(objective[feasible], inner, z[feasible])
    return z, feasible


def _follow(objective: Array, cones: Cones, z: Array, enough: float = np.inf) -> Array:
    """Follows the central path from interior points z (p, k) to the optimum, or until objective.z is enough."""
    z = z.copy()
    weight, active = 1.0, np.arange(len(z))
    while len(active) and weight < GROWTH / GAP:
        _center(weight * objective, cones, z, active)
        active = active[np.sum(objective * z, axis=1)[active] < enough]
        weight *= GROWTH
    return z


def _center(objective: Array, cones: Cones, z: Array, active: NDArray[np.intp], iterations: int = 200) -> None:
    """Moves the active ones of the interior points z (p, k) to the minimum of -objective.z + barrier."""
    for _ in range(iterations):
        step, decrement = _newton_step(objective[active], cones, z[active], active)
        z[active] += step / np.where(decrement < 0.25, 1.0, 1.0 + decrement)[:, np.newaxis]
        active = active[decrement > 1e-6]
        if not len(active):
            break


def _newton_step(objective: Array, cones: Cones, z: Array, active: NDArray[np.intp]) -> tuple[Array, Array]:
    """Newton step (p, k) and decrement (p,) of the active programs."""
    slope = cones.slope[active]
    w = cones.constant[active] + np.einsum("pmik,pk->pmi", slope, z)
    size = np.hypot(w[..., 1], w[..., 2])
    inside = (w[..., 0] - size) * (w[..., 0] + size)
    outward = SIGNS * 2.0 / inside[..., np.newaxis]
    per_z = np.einsum("pmi,pmik->pmk", outward * w, slope)
    flat = slope.reshape(len(z), -1, z.shape[1])
    curved = np.swapaxes(flat * outward.reshape(len(z), -1, 1), 1, 2)
    hessian = np.swapaxes(per_z, 1, 2) @ per_z - curved @ flat
    gradient = -objective - per_z.sum(axis=1)
    # Directions that no cone feels stay where they are.
    trace = np.trace(hessian, axis1=1, axis2=2)
    hessian += 1e-15 * trace[:, np.newaxis, np.newaxis] * np.eye(z.shape[1])
    step = -np.linalg.solve(hessian, gradient[..., np.newaxis])[..., 0]
    return step, np.sqrt(np.maximum(-np.sum(gradient * step, axis=1), 0.0))
