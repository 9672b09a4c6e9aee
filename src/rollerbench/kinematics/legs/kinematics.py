"""Kinematics of one leg: pose, Jacobian, inverse, singular poses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description.legs import Leg, chain_frames
from rollerbench.errors import KinematicsError, UnreachableTarget
from rollerbench.kinematics.legs.chain import jacobian, position
from rollerbench.kinematics.legs.families import FAMILIES, VERTICAL
from rollerbench.kinematics.legs.numeric import Search, spread
from rollerbench.kinematics.legs.singularity import Singularity, singularity
from rollerbench.kinematics.legs.song import SongLeg
from rollerbench.kinematics.limits.result import finite

Array = NDArray[np.float64]

AT_LIMIT = 1e-10
"""Joints beyond their limits by this angle [rad], which rounding may cause, are set to them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solutions:
    """Joint angles (..., k, n) within 2 pi of the limits, how far (..., k) [rad] beyond them, and feet (...) [m]."""

    q: Array
    beyond: Array
    excess: Array

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which branches (..., k) are solutions within the limits."""
        return np.isfinite(self.q).all(axis=-1) & (self.beyond <= AT_LIMIT)


class LegKinematics:
    """Kinematics of a leg in its base frame L: z up, x the direction in which it is mounted.

    Attributes:
        leg: The leg.
        song: Its lengths if it is built like that of Song et al. and has closed forms; else None.
    """

    def __init__(self, leg: Leg) -> None:
        self.leg = leg
        self._rows, self._limits = leg.rows, leg.limits
        self.song = SongLeg.of(self._rows)
        postures = [leg.posture(name) for name in leg.postures]
        self._seeds = np.vstack([self._limits.mean(axis=0), *postures, spread(self._limits)])

    def forward(self, q: ArrayLike) -> Array:
        """Pose X_LF (..., 4, 4) of the foot, its origin the wheel's centre and z the axle, at angles (..., n) [rad]."""
        return np.asarray(chain_frames(self._rows, self._angles("q", q))[..., -1, :, :])

    def position(self, q: ArrayLike) -> Array:
        """Wheel's centre p_LF (..., 3) [m] at joint angles (..., n) [rad]."""
        return position(self._rows, self._angles("q", q))

    def jacobian(self, q: ArrayLike) -> Array:
        """Geometric Jacobian of the foot in L: [w_LF; v_LF] = J @ v, v the joints' speeds.

        Args:
            q: Joint angles (..., n) [rad].

        Returns:
            (..., 6, n): three rows of angular velocity [-], then three of velocity [m].
        """
        return jacobian(self._rows, self._angles("q", q))

    def singularity(self, q: ArrayLike) -> Singularity:
        """How near joint angles (..., n) [rad] are to a singular pose.

        For the leg of Song et al., |det| = |r| l2 D |sin(th3 + beta)|: D = hypot(d4, l4 c4), beta = atan2(l4 c4, d4).
        """
        angles = self._angles("q", q)
        return singularity(self.song, jacobian(self._rows, angles), angles)

    def inverse(
        self,
        p_LF: ArrayLike,
        *,
        hold: str = "least",
        value: ArrayLike | None = None,
        near: ArrayLike | None = None,
        all_branches: bool = False,
    ) -> Array:
        """Joint angles that put the wheel's centre at p_LF.

        In closed form for the leg of Song et al., but for "least", "joint_2" and "joint_3"; for these and for other
        legs by iteration.

        Args:
            p_LF: Wheel centres (..., 3) in L [m].
            hold: What settles the joints that a position leaves free. "joint_k": this joint has the angle value;
                "inclination": th2 + th3 = value; "tibia": th2 + th3 = -90 deg, the tibia hangs down (these two only for
                the leg of Song et al.); "least": the joints stay as near to near as they can.
            value: Angles (...) [rad]; by default those that near has, and 0 for joint_4 of the leg of Song et al.
            near: Joint angles (..., n) [rad], to which the solution taken is the closest; by default the leg's first
                posture.
            all_branches: Whether to return all solutions instead.

        Returns:
            (..., n), each joint within its limits. With all_branches (..., k, n), NaN where there is no solution, or
            one beyond the limits: k = 4, 8 for "inclination", 1 where it was found by iteration.

        Raises:
            UnreachableTarget: there is no solution for a target; never with all_branches.
            KinematicsError: the leg cannot hold this, or an argument is not finite or of the wrong shape.
        """
        targets, held, wanted = self._arguments(p_LF, hold, value, near)
        found = self._solve(targets, hold, held, wanted)
        within = np.clip(found.q, *self._limits)
        valid = found.valid
        if all_branches:
            return np.where(valid[..., np.newaxis], within, np.nan)
        if not valid.any(axis=-1).all():
            raise self._unreachable(found, targets, hold, held)
        motion = np.linalg.norm(within - wanted[..., np.newaxis, :], axis=-1)
        best = np.argmin(np.where(valid, motion, np.inf), axis=-1)
        return np.asarray(np.take_along_axis(within, best[..., np.newaxis, np.newaxis], axis=-2)[..., 0, :])

    def reachable(
        self, p_LF: ArrayLike, *, hold: str = "least", value: ArrayLike | None = None, near: ArrayLike | None = None
    ) -> NDArray[np.bool_]:
        """Whether (...) `inverse` has a solution within the joints' limits; its arguments."""
        found = self._solve(*self._reordered(p_LF, hold, value, near))
        return np.asarray(found.valid.any(axis=-1))

    def reach_excess(
        self, p_LF: ArrayLike, *, hold: str = "least", value: ArrayLike | None = None, near: ArrayLike | None = None
    ) -> Array:
        """Distance (...) [m] of targets (..., 3) from the nearest point in reach, 0 in reach; arguments of `inverse`.

        The closed forms tell it without regard to the joints' limits, the iteration within them.
        """
        targets, hold, held, wanted = self._reordered(p_LF, hold, value, near)
        if self.song is not None and hold in FAMILIES:
            return FAMILIES[hold].excess(self.song, targets, held)
        return self._solve(targets, hold, held, wanted).excess

    def _reordered(
        self, p_LF: ArrayLike, hold: str, value: ArrayLike | None, near: ArrayLike | None
    ) -> tuple[Array, str, Array, Array]:
        targets, held, wanted = self._arguments(p_LF, hold, value, near)
        return targets, hold, held, wanted

    def _solve(self, targets: Array, hold: str, held: Array, wanted: Array) -> _Solutions:
        """Solutions for checked arguments."""
        if self.song is not None and hold in FAMILIES:
            return self._closed(self.song, targets, hold, held, wanted)
        joint = None if hold == "least" else int(hold.removeprefix("joint_")) - 1
        count = len(self._rows)
        search = Search(
            rows=self._rows,
            limits=self._limits,
            length=self.leg.length,
            seeds=self._seeds,
        )
        flat = targets.reshape(-1, 3), wanted.reshape(-1, count)
        inside = held if joint is None else np.clip(held, *self._limits[:, joint])
        q, excess = search.solve(*flat, joint, inside.reshape(-1))
        beyond = np.abs(held - inside) if joint is not None else np.zeros(held.shape)
        excess = excess.reshape(held.shape)
        q = np.where(excess[..., np.newaxis] > 0, np.nan, q.reshape(*held.shape, count))
        return _Solutions(q=q[..., np.newaxis, :], beyond=beyond[..., np.newaxis], excess=excess)

    def _closed(self, song: SongLeg, targets: Array, hold: str, held: Array, wanted: Array) -> _Solutions:
        """All branches of a closed form, by full turns as near to wanted as the limits let them."""
        family = FAMILIES[hold]
        q = family.branches(song, targets, held, wanted)
        center = np.clip(wanted, *self._limits)[..., np.newaxis, :]
        q = center + np.remainder(q - center + np.pi, 2 * np.pi) - np.pi
        turned = np.where(q > self._limits[1], q - 2 * np.pi, np.where(q < self._limits[0], q + 2 * np.pi, q))
        here, there = self._beyond(q), self._beyond(turned)
        q = np.where((here > AT_LIMIT) & (there < here), turned, q)
        missing = (
            np.isnan(q).any(axis=-1).all(axis=-1) if hold == "inclination" else np.ones(held.shape, dtype=np.bool_)
        )
        excess = np.zeros(held.shape)
        if missing.any():
            excess[missing] = family.excess(song, targets[missing], held[missing])
        q = np.where(excess[..., np.newaxis, np.newaxis] > 0, np.nan, q)
        return _Solutions(q=q, beyond=np.max(self._beyond(q), axis=-1), excess=excess)

    def _beyond(self, q: Array) -> Array:
        """How far (..., n) [rad] joints are beyond their limits."""
        return np.maximum(np.maximum(self._limits[0] - q, q - self._limits[1]), 0.0)

    def _unreachable(self, found: _Solutions, targets: Array, hold: str, held: Array) -> UnreachableTarget:
        """The error for the first target without a solution."""
        index = tuple(int(i) for i in np.argwhere(~found.valid.any(axis=-1))[0])
        target, distance, value = targets[index], float(found.excess[index]), float(held[index])
        numbers = ", ".join(f"{number:.4g}" for number in target)
        which = f"target {list(index)} of leg {self.leg.name}" if index else f"the target of leg {self.leg.name}"
        how = f"hold = {hold!r}" if hold in ("least", "tibia") else f"hold = {hold!r}, value = {value:.4g} rad"
        start = f"{which}: p_LF = [{numbers}] m with {how}"
        if distance > 0:
            if self.song is not None and hold in FAMILIES:
                accepted = FAMILIES[hold].accepted(self.song, value)
            else:
                accepted = "points that the leg reaches within its joints' limits"
            message = f"{start} is out of reach by {distance:.4g} m; accepted: {accepted}"
            return UnreachableTarget(message, index, distance, 0.0)
        beyond = np.where(np.isnan(found.beyond[index]), np.inf, found.beyond[index])
        branch = int(np.argmin(beyond))
        each = self._beyond(found.q[index][branch])
        if not each.any():
            each[int(hold.removeprefix("joint_")) - 1] = beyond[branch]
        joint = int(np.argmax(each))
        low, high = np.degrees(self._limits[:, joint])
        message = (
            f"{start} needs joint {joint + 1} {np.degrees(beyond[branch]):.4g} deg beyond its limits; accepted: "
            f"points that it reaches at {low:.4g} to {high:.4g} deg"
        )
        return UnreachableTarget(message, index, 0.0, float(beyond[branch]))

    def _arguments(
        self, p_LF: ArrayLike, hold: str, value: ArrayLike | None, near: ArrayLike | None
    ) -> tuple[Array, Array, Array]:
        """Targets (..., 3), held values (...) and angles to stay near (..., n), of one leading shape."""
        self._check(hold, value)
        targets = finite("p_LF", p_LF)
        if targets.ndim == 0 or targets.shape[-1] != 3:
            raise KinematicsError(f"p_LF of shape {targets.shape}: accepted: (..., 3)")
        wanted = self._default_near() if near is None else self._angles("near", near)
        held = self._default_value(hold, wanted) if value is None else finite("value", value)
        try:
            shape = np.broadcast_shapes(targets.shape[:-1], held.shape, wanted.shape[:-1])
        except ValueError:
            raise KinematicsError(
                f"p_LF of shape {targets.shape}, value {held.shape} and near {wanted.shape}: accepted: leading axes "
                "that broadcast"
            ) from None
        return (
            np.broadcast_to(targets, (*shape, 3)),
            np.broadcast_to(held, shape),
            np.broadcast_to(wanted, (*shape, len(self._rows))),
        )

    def _check(self, hold: str, value: ArrayLike | None) -> None:
        joints = [f"joint_{joint}" for joint in range(1, len(self._rows) + 1)]
        accepted = ["least", *joints, *(["tibia", "inclination"] if self.song is not None else [])]
        if hold not in accepted:
            raise KinematicsError(f"hold = {hold!r} of leg {self.leg.name}: accepted: {', '.join(accepted)}")
        if value is not None and hold in ("least", "tibia"):
            raise KinematicsError(
                f"value = {value!r} with hold = {hold!r}: accepted: None, for nothing is left to choose"
            )

    def _default_near(self) -> Array:
        names = list(self.leg.postures)
        return self.leg.posture(names[0]) if names else np.asarray(self._limits.mean(axis=0))

    def _default_value(self, hold: str, near: Array) -> Array:
        if hold == "tibia":
            return np.array(VERTICAL)
        if hold == "inclination":
            return np.asarray(near[..., 1] + near[..., 2])
        if hold == "least" or (hold == "joint_4" and self.song is not None):
            return np.array(0.0)
        return np.asarray(near[..., int(hold.removeprefix("joint_")) - 1])

    def _angles(self, name: str, q: ArrayLike) -> Array:
        angles = finite(name, q)
        if angles.ndim == 0 or angles.shape[-1] != len(self._rows):
            raise KinematicsError(
                f"{name} of shape {angles.shape}: accepted: (..., {len(self._rows)}), the leg's joints"
            )
        return angles
