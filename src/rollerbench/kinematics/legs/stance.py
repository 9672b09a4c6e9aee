"""Odometry of legs: where the body is, from the joints of the legs that stand."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs.body_pose import body_pose_from_stance
from rollerbench.kinematics.legs.group import LegGroup

Array = NDArray[np.float64]

SUSPECT = 0.003
"""A foot so far from where the others put it may have slipped [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StanceEstimate:
    """Where body and feet are believed to be.

    Attributes:
        X_WB: Pose (4, 4) of the body.
        centers_W: Centres (k, 3) of the feet's wheels [m].
        stood: Which feet (k,) stood at that moment.
        slipped: Which feet (k,) were found to have slipped.
    """

    X_WB: Array
    centers_W: Array
    stood: NDArray[np.bool_]
    slipped: NDArray[np.bool_]

    def __deepcopy__(self, memo: dict[int, object]) -> "StanceEstimate":
        """Itself: nobody changes it."""
        return self


def stance_start(group: LegGroup, q: Array, X_WB: Array) -> StanceEstimate:
    """The estimate of a robot whose pose is known, at joint angles q (k, n)."""
    centers = group.frames(q)[:, -1, :3, 3] @ X_WB[:3, :3].T + X_WB[:3, 3]
    every = np.ones(len(centers), dtype=bool)
    return StanceEstimate(X_WB=X_WB, centers_W=centers, stood=every, slipped=~every)


def stance_next(
    group: LegGroup,
    estimate: StanceEstimate,
    joints: tuple[Array, Array],
    wheel_speed: Array,
    stands: NDArray[np.bool_],
    dt: float,
    ground: Array | None = None,
) -> StanceEstimate:
    """The estimate a moment dt later [s].

    Feet that stand are where they were, but for what their wheels rolled since: with the angular velocity w of the
    wheel over the ground its centre moves at w x R z. The pose is the one that fits them best.

    Args:
        group: The legs.
        estimate: The estimate before.
        joints: Measured joint angles and rates (k, n) [rad, rad/s].
        wheel_speed: Measured wheel speeds (k,) [rad/s].
        stands: Which feet (k,) are on the ground.
        dt: Time since then [s].
        ground: Heights (k,) of the ground under the feet, where they are known [m]; they keep height and inclination
            from drifting.
    """
    q, rates = joints
    frames = group.frames(q)
    places = frames[:, -1, :3, 3]
    fit = stands & estimate.stood
    centers = estimate.centers_W
    if fit.sum() >= 3:
        centers = centers + dt * _rolling(group, frames, rates, wheel_speed, estimate, fit, dt)
        found = body_pose_from_stance(places[fit], centers[fit], robust=False)
        if fit.sum() >= 4 and found.residuals.max() > SUSPECT:
            found = body_pose_from_stance(places[fit], centers[fit])
        pose, slipped = found.X_WB, np.zeros(len(fit), dtype=bool)
        slipped[fit] = found.slipped
    else:
        pose, slipped = estimate.X_WB, np.zeros(len(fit), dtype=bool)
    seen = places @ pose[:3, :3].T + pose[:3, 3]
    if ground is not None:
        seen[:, 2] = ground + group.wheel_radius
    # A foot that slipped stands where it is now.
    keeps = (fit & ~slipped)[:, np.newaxis]
    return replace(estimate, X_WB=pose, centers_W=np.where(keeps, centers, seen), stood=stands, slipped=slipped)


def _rolling(
    group: LegGroup,
    frames: Array,
    rates: Array,
    wheel_speed: Array,
    estimate: StanceEstimate,
    fit: NDArray[np.bool_],
    dt: float,
) -> Array:
    """Velocities (k, 3) in W, in the middle of the period, at which standing wheels roll [m/s]; 0 for the others."""
    rotation = estimate.X_WB[:3, :3]
    body = _body_spin(group, frames, rates, estimate, fit)
    arm = (group.jacobian(frames)[:, :3] @ rates[..., np.newaxis])[..., 0] @ rotation.T
    spin = body + arm + wheel_speed[:, np.newaxis] * frames[:, -1, :3, 2] @ rotation.T
    # In between the body has turned by half of its turn, and the leg is half of its own turn behind.
    turn = 0.5 * dt * (body - arm)[:, 2]
    x, y = spin[:, 1], -spin[:, 0]
    rolled = np.column_stack([x - turn * y, y + turn * x, np.zeros(len(spin))])
    return rolled * (group.wheel_radius * fit)[:, np.newaxis]


def _body_spin(group: LegGroup, frames: Array, rates: Array, estimate: StanceEstimate, fit: NDArray[np.bool_]) -> Array:
    """Angular velocity (3,) of the body in W, at which standing feet move least: p' = -(w x p) - v in B."""
    places = frames[fit, -1, :3, 3]
    velocity = (group.jacobian(frames)[fit, 3:] @ rates[fit, :, np.newaxis])[..., 0]
    arms, flow = places - places.mean(axis=0), velocity - velocity.mean(axis=0)
    inertia = np.sum(arms**2) * np.eye(3) - arms.T @ arms
    spin: Array = np.linalg.solve(inertia, -np.cross(arms, flow).sum(axis=0))
    return estimate.X_WB[:3, :3] @ spin
