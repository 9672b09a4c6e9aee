"""How well a planned twist keeps a robot's limits and leads along a leg, measured on the twist itself."""

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.profile import Profile, reference_poses

Array = NDArray[np.float64]

INSIDE = (0.05, 0.5, 0.95)
"""Where on a piece of steady acceleration the limits are checked [-]."""

SUBSTEPS = 16
"""Steps of constant twist in each piece, by which it is followed to its end."""

CREEP = 1e-3
"""Share of the largest speed below which the direction of a twist is not told [-]."""


def end_error(twist: Profile, start: Array, end: Array, scale: Array) -> float:
    """How far a twist from a pose (3,) misses another [m]; scale (3,) is 1, 1 and the radius where yaw counts [m]."""
    reached = reference_poses(twist, twist.breaks, SUBSTEPS, start=start)[-1]
    return float(np.linalg.norm((reached - end) * scale))


def samples(twist: Profile, scale: Array) -> tuple[Array, Array, Array, Array]:
    """Unit twists b (d, 3) in the metric of scale, changes c (d, 3), u (d,) and x (d,) of a twist over time.

    A twist v with the rate a has s' = |v|, u = s'' = v.a/|v|, b = v/s' and c = (a - b u)/s'^2. The twist's breaks come
    in pairs, between which the acceleration jumps; samples lie outside of these.
    """
    start, end = twist.breaks[:-1:2], twist.breaks[1::2]
    time = (start[:, np.newaxis] + (end - start)[:, np.newaxis] * np.array(INSIDE)).ravel()
    v, rate = twist(time), twist.rate(time)
    pace = np.linalg.norm(v * scale, axis=1)
    moving = pace > CREEP * pace.max()
    v, rate, pace = v[moving], rate[moving], pace[moving]
    b = v / pace[:, np.newaxis]
    u = np.sum(b * rate * scale**2, axis=1)
    return b, (rate - b * u[:, np.newaxis]) / pace[:, np.newaxis] ** 2, u, pace**2
