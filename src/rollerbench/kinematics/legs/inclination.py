"""Inverse kinematics of the wheel-leg of Song et al. with the tibia's inclination th2 + th3 given: a quartic."""

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs.reach import TOLERANCE
from rollerbench.kinematics.legs.roots import evaluate, real_roots
from rollerbench.kinematics.legs.song import SongLeg, stacked, turn

Array = NDArray[np.float64]


def branches(leg: SongLeg, p: Array, value: Array, near: Array) -> Array:
    """Branches from the quartic in x = c4 that is left of (rho^2 - X)^2 = (2 l2 c2 k)^2, k the share of r beside l2 c2.

    With g = l2 s2 and k both linear in x: X(x) = rho^2 - l2^2 + g^2 - k^2 - l4^2 (1 - x^2), X = 2 l2 c2 k.
    """
    rho = np.hypot(p[..., 0], p[..., 1])
    c, s = np.cos(value), np.sin(value)
    scale = leg.length
    thigh, tibia, foot, z = leg.thigh / scale, leg.tibia / scale, leg.foot / scale, p[..., 2] / scale
    g = np.stack([z - tibia * s, -foot * c], axis=-1)
    k = np.stack([tibia * c, -foot * s], axis=-1)
    gg, kk = _product(g, g), _product(k, k)
    one = np.zeros(3)
    one[0] = 1.0
    x_polynomial = gg - kk + foot**2 * np.array([-1.0, 0.0, 1.0])
    x_polynomial = x_polynomial + ((rho / scale) ** 2 - thigh**2)[..., np.newaxis] * one
    quartic = _product(x_polynomial, x_polynomial) - 4 * _product(thigh**2 * one - gg, kk)
    roots = np.clip(real_roots(quartic, -1.0 - 1e-7, 1.0 + 1e-7), -1.0, 1.0)
    # On the hip's axis w = 0, where w^2 is known only to rounding.
    roots = np.where(rho[..., np.newaxis] <= TOLERANCE * scale, np.sign(roots), roots)
    sine = np.clip(evaluate(g, roots) / thigh, -1.0, 1.0)
    side = np.where(evaluate(x_polynomial, roots) * evaluate(k, roots) < 0, -1.0, 1.0)
    # Two equal roots are those of either side.
    side[..., 1:] = np.where(roots[..., 1:] == roots[..., :-1], -side[..., :-1], side[..., 1:])
    joint_2 = np.arctan2(sine, side * np.sqrt(1.0 - sine**2))
    joint_4 = np.arccos(roots)
    joint_2, joint_4 = _polished(leg, rho, p[..., 2], value, joint_2, joint_4)
    joint_2, joint_4 = np.concatenate([joint_2, joint_2], axis=-1), np.concatenate([joint_4, -joint_4], axis=-1)
    q = stacked(np.zeros_like(joint_2), joint_2, value[..., np.newaxis] - joint_2, joint_4)
    r, w, _ = leg.coordinates(q)
    q[..., 0] = turn(p, r, w, near)
    return q


def _product(first: Array, second: Array) -> Array:
    """Products of polynomials (..., m) and (..., n)."""
    out = np.zeros((*np.broadcast_shapes(first.shape[:-1], second.shape[:-1]), first.shape[-1] + second.shape[-1] - 1))
    for power in range(first.shape[-1]):
        out[..., power : power + second.shape[-1]] += first[..., power, np.newaxis] * second
    return out


def _polished(leg: SongLeg, rho: Array, z: Array, value: Array, joint_2: Array, joint_4: Array) -> tuple[Array, Array]:
    """Newton's steps on (rho^2, z) as functions of th2 and th4 (..., k), where they help; NaN where they fail."""
    rho, z, value = rho[..., np.newaxis], z[..., np.newaxis], value[..., np.newaxis]
    c, s = np.cos(value), np.sin(value)

    def errors(joint_2: Array, joint_4: Array) -> tuple[Array, Array, Array, Array]:
        q = stacked(np.zeros_like(joint_2), joint_2, value - joint_2, joint_4)
        r, w, h = leg.coordinates(q)
        return r, w, r**2 + w**2 - rho**2, h - z

    r, w, along, up = errors(joint_2, joint_4)
    size = np.abs(along) / leg.length + np.abs(up)
    for _ in range(3):
        a, b = -2 * r * leg.thigh * np.sin(joint_2), 2 * leg.foot * (r * s * np.sin(joint_4) + w * np.cos(joint_4))
        d, e = leg.thigh * np.cos(joint_2), -leg.foot * c * np.sin(joint_4)
        determinant = a * e - b * d
        determinant = np.where(determinant == 0, np.inf, determinant)
        new_2, new_4 = joint_2 - (e * along - b * up) / determinant, joint_4 - (a * up - d * along) / determinant
        new = errors(new_2, new_4)
        new_size = np.abs(new[2]) / leg.length + np.abs(new[3])
        better = new_size < size
        joint_2, joint_4, size = (
            np.where(better, n, o) for n, o in ((new_2, joint_2), (new_4, joint_4), (new_size, size))
        )
        r, w, along, up = (np.where(better, n, o) for n, o in zip(new, (r, w, along, up), strict=True))
    missed = np.abs(np.hypot(r, w) - rho) + np.abs(up) > 10 * TOLERANCE * leg.length
    return np.where(missed, np.nan, joint_2), np.where(missed, np.nan, joint_4)


def excess(leg: SongLeg, p: Array, value: Array) -> Array:
    """Distance (...) [m] of feet (..., 3) from the points in reach at inclinations (...), 0 in reach; by a search."""
    found = branches(leg, p, value, np.zeros((*p.shape[:-1], 4)))
    out = np.isnan(found).any(axis=-1).all(axis=-1)
    distance = np.zeros(out.shape)
    for index in np.argwhere(out):
        at = tuple(index)
        distance[at] = _searched_excess(leg, p[at], float(value[at]))
    return distance


def _searched_excess(leg: SongLeg, p: Array, inclination: float) -> float:
    """Distance of one foot (3,) out of reach from the points in reach, on grids of th2 and th4 ever finer."""
    rho, z = float(np.hypot(p[0], p[1])), float(p[2])

    def distances(joint_2: Array, joint_4: Array) -> Array:
        q = stacked(0.0 * joint_2, joint_2, inclination - joint_2, joint_4)
        r, w, h = leg.coordinates(q)
        return np.hypot(np.hypot(r, w) - rho, h - z)

    joint_2, joint_4 = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-np.pi, np.pi, 73)] * 2))
    # Several valleys are followed, for the lowest point of a coarse grid may lie in a higher one.
    starts = np.argsort(distances(joint_2, joint_4))[:24]
    joint_2, joint_4 = joint_2[starts, np.newaxis], joint_4[starts, np.newaxis]
    grid = np.linspace(-1.0, 1.0, 9)
    steps = [axis.ravel()[np.newaxis] for axis in np.meshgrid(grid, grid)]
    width = np.pi / 18
    while width > 1e-8:
        around = joint_2 + width * steps[0], joint_4 + width * steps[1]
        best = np.argmin(distances(*around), axis=1)[:, np.newaxis]
        joint_2, joint_4 = (np.take_along_axis(axis, best, axis=1) for axis in around)
        width *= 0.5
    return float(np.min(distances(joint_2, joint_4)))


def accepted(leg: SongLeg, value: float) -> str:
    """The points in reach, in words."""
    return f"feet of a tibia inclined by {value:.4g} rad, which `reach_excess` tells"
