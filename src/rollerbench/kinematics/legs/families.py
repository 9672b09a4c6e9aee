"""Ways to settle the leg of Song et al., which has a joint more than a foot's position takes, in closed form."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs import inclination
from rollerbench.kinematics.legs.reach import TOLERANCE, Section
from rollerbench.kinematics.legs.song import SongLeg, stacked, turn

Array = NDArray[np.float64]

VERTICAL = -np.pi / 2
"""Inclination of a tibia that hangs straight down [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """A closed form of the inverse kinematics.

    Attributes:
        branches: Joint angles (..., k, 4) for feet (..., 3), held values (...) and angles (..., 4) to take where any
            will do; wrong or NaN where the foot is out of reach.
        excess: Distance (...) [m] of feet (..., 3) from the points in reach with values (...) held, 0 within.
        accepted: The points in reach, in words, for a value.
    """

    branches: Callable[[SongLeg, Array, Array, Array], Array]
    excess: Callable[[SongLeg, Array, Array], Array]
    accepted: Callable[[SongLeg, float], str]


def _joint_4(leg: SongLeg, p: Array, value: Array, near: Array) -> Array:
    w = leg.foot * np.sin(value)
    r = np.sqrt(np.maximum(p[..., 0] ** 2 + p[..., 1] ** 2 - w**2, 0.0))
    r = np.stack([r, r, -r, -r], axis=-1)
    hips = [leg.bend(r[..., side], p[..., 2], value) for side in (0, 2)]
    thigh, knee = (np.concatenate(angles, axis=-1) for angles in zip(*hips, strict=True))
    return stacked(turn(p, r, w[..., np.newaxis], near), thigh, knee, value[..., np.newaxis])


def _joint_4_excess(leg: SongLeg, p: Array, value: Array) -> Array:
    w, (reach, _) = leg.foot * np.sin(value), leg.shank(value)
    section = Section(
        center=0.0,
        outer=np.hypot(w, leg.thigh + reach),
        hole_center=0.0,
        hole=np.hypot(w, leg.thigh - reach),
        least_u=np.abs(w),
    )
    return section.excess(np.hypot(p[..., 0], p[..., 1]), p[..., 2])


def _joint_4_accepted(leg: SongLeg, value: float) -> str:
    w, (reach, _) = leg.foot * np.sin(value), leg.shank(np.asarray(value))
    least, most = np.hypot(w, leg.thigh - reach), np.hypot(w, leg.thigh + reach)
    return f"points {least:.4g} to {most:.4g} m from the hip and at least {abs(w):.4g} m from its axis"


def _tibia(leg: SongLeg, p: Array, value: Array, near: Array) -> Array:
    sine = np.clip((p[..., 2] + leg.tibia) / leg.thigh, -1.0, 1.0)
    thigh = np.arcsin(sine)[..., np.newaxis] * np.array([1.0, -1.0, 1.0, -1.0]) + np.pi * np.array([0, 1, 0, 1])
    out = leg.thigh * np.cos(thigh)
    square = (p[..., 0] ** 2 + p[..., 1] ** 2)[..., np.newaxis]
    product = 2 * out * leg.foot
    free = np.abs(product) < TOLERANCE * leg.thigh * leg.foot
    cosine = (square - out**2 - leg.foot**2) / np.where(free, np.inf, product)
    joint_4 = np.arccos(np.clip(cosine, -1.0, 1.0)) * np.array([1.0, 1.0, -1.0, -1.0])
    joint_4 = np.where(free, near[..., 3:], joint_4)
    hip = turn(p, out + leg.foot * np.cos(joint_4), leg.foot * np.sin(joint_4), near)
    return stacked(hip, thigh, VERTICAL - thigh, joint_4)


def _tibia_excess(leg: SongLeg, p: Array, value: Array) -> Array:
    section = Section(center=leg.foot, outer=leg.thigh, hole_center=-leg.foot, hole=leg.thigh)
    return section.excess(np.hypot(p[..., 0], p[..., 1]), p[..., 2] + leg.tibia)


def _tibia_accepted(leg: SongLeg, value: float) -> str:
    low, high = -leg.tibia - leg.thigh, leg.thigh - leg.tibia
    return (
        f"z from {low:.4g} to {high:.4g} m, and a distance from the hip's axis that makes a triangle with "
        f"{leg.foot:.4g} and sqrt({leg.thigh**2:.4g} - (z + {leg.tibia:.4g})^2) m"
    )


def _joint_1(leg: SongLeg, p: Array, value: Array, near: Array) -> Array:
    r, w = _unturned(p, value)
    joint_4 = np.arcsin(np.clip(w / leg.foot, -1.0, 1.0))
    joint_4 = np.stack([joint_4, np.pi - joint_4], axis=-1)
    thigh, knee = leg.bend(r[..., np.newaxis], p[..., 2, np.newaxis], joint_4)
    pairs = stacked(value[..., np.newaxis, np.newaxis], thigh, knee, joint_4[..., np.newaxis])
    return pairs.reshape(*pairs.shape[:-3], 4, 4)


def _unturned(p: Array, joint_1: Array) -> tuple[Array, Array]:
    """Coordinates r, w (...) of a foot in the frame that turns with joint 1."""
    c, s = np.cos(joint_1), np.sin(joint_1)
    return c * p[..., 0] + s * p[..., 1], c * p[..., 1] - s * p[..., 0]


def _joint_1_excess(leg: SongLeg, p: Array, value: Array) -> Array:
    r, w = _unturned(p, value)
    reach = float(np.hypot(leg.tibia, leg.foot))
    section = Section(center=leg.thigh, outer=reach, hole_center=-leg.thigh, hole=reach, most_v=leg.foot)
    return section.excess(np.hypot(r, p[..., 2]), w)


def _joint_1_accepted(leg: SongLeg, value: float) -> str:
    square = leg.tibia**2 + leg.foot**2
    return (
        f"points up to {leg.foot:.4g} m beside the plane of the thigh, whose distance from the hip within it makes a "
        f"triangle with {leg.thigh:.4g} and sqrt({square:.4g} - (distance beside)^2) m"
    )


FAMILIES = {
    "joint_4": Family(branches=_joint_4, excess=_joint_4_excess, accepted=_joint_4_accepted),
    "tibia": Family(branches=_tibia, excess=_tibia_excess, accepted=_tibia_accepted),
    "joint_1": Family(branches=_joint_1, excess=_joint_1_excess, accepted=_joint_1_accepted),
    "inclination": Family(branches=inclination.branches, excess=inclination.excess, accepted=inclination.accepted),
}
"""Closed forms by what is held."""
