"""Planar poses from twists: the exponential of SE(2), and its inverse."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def integrate(q_xyt: ArrayLike, v_xyw_B: ArrayLike, dt: ArrayLike) -> Array:
    """Pose after moving at a constant body twist: q_xyt * exp(v_xyw_B dt), exact along the arc.

    The chord of the arc has the length |v| dt sinc(w dt/2) and points half of the turn beyond the start.

    Args:
        q_xyt: Poses (..., 3) [m, m, rad].
        v_xyw_B: Twists (..., 3) in B [m/s, m/s, rad/s].
        dt: Times (...) [s].

    Returns:
        Poses (..., 3); the yaw is not wrapped.

    Source: Lynch and Park (2017), Modern Robotics, section 13.4.
    """
    q, v = np.asarray(q_xyt, dtype=np.float64), np.asarray(v_xyw_B, dtype=np.float64)
    step = v * np.asarray(dt, dtype=np.float64)[..., np.newaxis]
    half = 0.5 * step[..., 2]
    chord = step[..., :2] * np.sinc(half / np.pi)[..., np.newaxis]
    moved = rotate(q[..., 2] + half, chord)
    yaw = q[..., 2] + step[..., 2]
    return np.concatenate([q[..., :2] + moved, np.broadcast_to(yaw, moved.shape[:-1])[..., np.newaxis]], axis=-1)


def accumulate(q_xyt: ArrayLike, steps_xyt_B: ArrayLike) -> Array:
    """Poses along a sequence of body displacements: each the integral of the twist over its interval.

    Args:
        q_xyt: Start pose (3,).
        steps_xyt_B: Displacements (n, 3), twist times duration, each taken as a constant twist [m, m, rad].

    Returns:
        Poses (n + 1, 3), the start included.
    """
    start, steps = np.asarray(q_xyt, dtype=np.float64), np.asarray(steps_xyt_B, dtype=np.float64)
    yaw = start[2] + np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    half = 0.5 * steps[:, 2]
    chords = rotate(yaw[:-1] + half, steps[:, :2] * np.sinc(half / np.pi)[:, np.newaxis])
    places = start[:2] + np.concatenate([np.zeros((1, 2)), np.cumsum(chords, axis=0)])
    return np.concatenate([places, yaw[:, np.newaxis]], axis=-1)


def displacement(from_q_xyt: ArrayLike, to_q_xyt: ArrayLike) -> Array:
    """Body displacement (..., 3) whose exponential leads from one pose (..., 3) to another: inverse of `integrate`.

    The turn is taken as it is, not wrapped; it must not be a non-zero multiple of a full turn.
    """
    start, end = np.asarray(from_q_xyt, dtype=np.float64), np.asarray(to_q_xyt, dtype=np.float64)
    turn = end[..., 2] - start[..., 2]
    chord = rotate(-(start[..., 2] + 0.5 * turn), end[..., :2] - start[..., :2])
    straight = chord / np.sinc(0.5 * turn / np.pi)[..., np.newaxis]
    return np.concatenate([straight, turn[..., np.newaxis]], axis=-1)


def rotate(angle: ArrayLike, vector: ArrayLike) -> Array:
    """Vectors (..., 2) turned counter-clockwise by angles (...) [rad]."""
    v = np.asarray(vector, dtype=np.float64)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * v[..., 0] - sin * v[..., 1], sin * v[..., 0] + cos * v[..., 1]], axis=-1)
