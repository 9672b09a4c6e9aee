"""Where the body is, from where its feet stand."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import finite, finite_number

Array = NDArray[np.float64]

SLIP = 0.01
"""A foot that stands so far from where the others put it has slipped [m]."""

COLLINEAR = 1e-6
"""Feet are on one line when their spread across it is less than this share of that along it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StancePose:
    """A pose of the body, and how well the feet agree with it.

    Attributes:
        X_WB: Pose (4, 4) of the body.
        residuals: Distance (k,) [m] of each foot from where the pose puts it.
        weights: Weight (k,) of each foot in the pose [-], 0 to 1.
        slipped: Which feet (k,) stand farther off than a slip.
    """

    X_WB: Array
    residuals: Array
    weights: Array
    slipped: NDArray[np.bool_]


def body_pose_from_stance(p_BF: ArrayLike, p_WF: ArrayLike, robust: bool = True, slip: float = SLIP) -> StancePose:
    """Pose that puts feet known in the body where they stand in the world: min sum w_i |p_WF_i - X_WB p_BF_i|^2.

    With four feet or more a robust pose follows the others where one slipped: the weights are those of Geman and
    McClure, (1 + (|r_i| / s)^2)^-2 with s half of a slip, starting from the best of the poses of all feet and of all
    but one. Feet that slipped lose all their weight, as long as three are left.

    Args:
        p_BF: Feet (k, 3) in the body [m].
        p_WF: The same feet in the world [m].
        robust: Whether to mistrust feet that disagree; if not, all weights are 1, and no foot slips.
        slip: Smallest slip to be found [m]; some five times the noise of the feet or more.

    Raises:
        KinematicsError: fewer than three feet, or feet on one line.

    Source: Kabsch (1976) with the determinant of Umeyama (1991); Geman and McClure (1987).
    """
    body, world = _feet("p_BF", p_BF), _feet("p_WF", p_WF)
    if body.shape != world.shape:
        raise KinematicsError(f"p_BF of shape {body.shape} and p_WF {world.shape}: accepted: the same feet in both")
    slip = finite_number("slip", slip, smallest=1e-9)
    count = len(body)
    weights, slipped = np.ones(count), np.zeros(count, dtype=np.bool_)
    if robust and count >= 4:
        weights = _robust_weights(body, world, 0.5 * slip)
        slipped = _residuals(least_squares_pose(body, world, weights), body, world) > slip
        kept = np.where(slipped, 0.0, weights)
        if _spread(body, kept > 0) > COLLINEAR:
            weights = kept
        else:
            slipped[:] = False
    pose = least_squares_pose(body, world, weights)
    residuals = _residuals(pose, body, world)
    return StancePose(X_WB=pose, residuals=residuals, weights=weights, slipped=slipped)


def _robust_weights(body: Array, world: Array, scale: float, iterations: int = 20) -> Array:
    """Weights (k,) of Geman and McClure, once they come to rest."""
    squares = (_residuals(least_squares_pose(body, world, np.ones(len(body))), body, world) / scale) ** 2
    if np.max(squares) > 1.0:
        others = [row for row in 1.0 - np.eye(len(body)) if _spread(body, row > 0) > COLLINEAR]
        starts = np.vstack([np.ones(len(body)), *others])
        each = (_residuals(least_squares_pose(body, world, starts), body, world) / scale) ** 2
        squares = each[np.argmin(np.sum(each / (1.0 + each), axis=1))]
    weights = 1.0 / (1.0 + squares) ** 2
    for _ in range(iterations):
        squares = (_residuals(least_squares_pose(body, world, weights), body, world) / scale) ** 2
        weights, last = 1.0 / (1.0 + squares) ** 2, weights
        if np.max(np.abs(weights - last)) < 1e-6:
            break
    return np.asarray(weights)


def least_squares_pose(body: Array, world: Array, weights: Array) -> Array:
    """Poses (..., 4, 4) of least squares, from feet (..., k, 3) in the body and in the world, with weights (..., k)."""
    shares = (weights / np.sum(weights, axis=-1, keepdims=True))[..., np.newaxis, :]
    body_mean, world_mean = shares @ body, shares @ world
    u, _, vt = np.linalg.svd(
        np.swapaxes((world - world_mean) * np.swapaxes(shares, -1, -2), -1, -2) @ (body - body_mean)
    )
    # The nearest proper rotation: three feet lie in a plane, and a mirror image would fit them as well.
    u[..., :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[..., np.newaxis]
    rotation = u @ vt
    pose = np.zeros((*weights.shape[:-1], 4, 4))
    pose[..., :3, :3] = rotation
    pose[..., :3, 3] = (world_mean - body_mean @ np.swapaxes(rotation, -1, -2))[..., 0, :]
    pose[..., 3, 3] = 1.0
    return pose


def _residuals(pose: Array, body: Array, world: Array) -> Array:
    """Distances (..., k) of the feet from where poses (..., 4, 4) put them."""
    placed = body @ np.swapaxes(pose[..., :3, :3], -1, -2) + pose[..., np.newaxis, :3, 3]
    return np.asarray(np.linalg.norm(world - placed, axis=-1))


def _spread(feet: Array, kept: NDArray[np.bool_]) -> float:
    """Spread of the kept feet across their line, over that along it; 0 of fewer than three."""
    if np.sum(kept) < 3:
        return 0.0
    chosen = feet[kept]
    values = np.linalg.svd(chosen - chosen.mean(axis=0), compute_uv=False)
    return float(values[1] / values[0]) if values[0] > 0 else 0.0


def _feet(name: str, feet: ArrayLike) -> Array:
    """Feet (k, 3), as long as they fix a pose."""
    array = finite(name, feet)
    if array.ndim != 2 or array.shape[1] != 3:
        raise KinematicsError(f"{name} of shape {array.shape}: accepted: (k, 3)")
    if len(array) < 3:
        raise KinematicsError(f"{name} has {len(array)} feet: accepted: 3 or more, which fix the pose of the body")
    if _spread(array, np.ones(len(array), dtype=np.bool_)) <= COLLINEAR:
        raise KinematicsError(f"{name}: the feet are on one line: accepted: feet that are not, which fix the pose")
    return array


def body_pose_from_circumcenter(p_BF: ArrayLike, p_WF: ArrayLike) -> Array:
    """Pose X_WB (4, 4) from three feet, by the frame at the centre of the circle through them, in B and in W.

    The centre is where the plane of the feet meets those that bisect two of its sides, by Cramer's rule. Exact for
    exact feet; but the centre of an obtuse triangle is far off, and with it errors of the feet grow. For comparison:
    `body_pose_from_stance` is better.

    Args:
        p_BF: The feet (3, 3), one a row, in the body [m].
        p_WF: The same feet in the world [m].

    Raises:
        KinematicsError: other than three feet, or feet on one line.

    Source: Song et al. (2012), three-leg support mechanism.
    """
    body, world = _feet("p_BF", p_BF), _feet("p_WF", p_WF)
    if len(body) != 3 or len(world) != 3:
        raise KinematicsError(f"{len(body)} and {len(world)} feet: accepted: exactly 3")
    return circumcenter_pose(body, world)


def circumcenter_pose(body: Array, world: Array) -> Array:
    """Poses (..., 4, 4) by the circle's centre, from three feet (..., 3, 3) in the body and in the world."""
    return np.asarray(_circle_frame(world) @ np.linalg.inv(_circle_frame(body)))


def _circle_frame(feet: Array) -> Array:
    """Frames (..., 4, 4) at the centre of the circle through three feet: z its normal, x towards the first foot."""
    first, second, third = np.moveaxis(feet, -2, 0)
    normal = np.cross(second - first, third - first)
    planes = np.stack([normal, second - first, third - first], axis=-2)
    squares = 0.5 * np.sum(feet**2, axis=-1)
    offsets = np.stack(
        [np.sum(normal * first, axis=-1), squares[..., 1] - squares[..., 0], squares[..., 2] - squares[..., 0]], axis=-1
    )
    center = np.empty_like(first)
    for column in range(3):
        replaced = planes.copy()
        replaced[..., column] = offsets
        center[..., column] = np.linalg.det(replaced) / np.linalg.det(planes)
    z, x = (vector / np.linalg.norm(vector, axis=-1, keepdims=True) for vector in (normal, first - center))
    frame = np.zeros((*feet.shape[:-2], 4, 4))
    frame[..., :3, :3] = np.stack([x, np.cross(z, x), z], axis=-1)
    frame[..., :3, 3] = center
    frame[..., 3, 3] = 1.0
    return frame
