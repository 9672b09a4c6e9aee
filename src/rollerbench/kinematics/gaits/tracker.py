"""Joint angles and wheel speeds that follow a plan of the feet."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.legs.group import Hold, LegGroup

Array = NDArray[np.float64]

MISSED = 1e-3
"""A foot that misses its target by more is out of reach [m]."""


BEYOND = 1e-3
"""A joint beyond its limit by more would be damaged [rad]."""

CLOSE = 1e-5
"""Feet this close to their targets need no further iteration [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tracked:
    """Where the legs are, and how they move until the next period.

    Attributes:
        q: Joint angles (k, n) now [rad].
        wheel: Angles (k,) of the wheels now [rad].
        q_rate: Mean joint speeds (k, n) until the next period [rad/s].
        wheel_rate: Mean wheel speeds (k,) until then [rad/s].
        roll_P: Displacements (k, 3) by which leaning rolls the feet sideways until then, in P [m].
        frames: The legs' frames (k, n + 1, 4, 4) after the period (`LegGroup.frames`); None if they stay.
        fault: Why the legs stay where they are, in words; else empty.
    """

    q: Array
    wheel: Array
    q_rate: Array
    wheel_rate: Array
    roll_P: Array
    frames: Array | None = None
    fault: str = ""

    def __deepcopy__(self, memo: dict[int, Any]) -> "Tracked":
        """Itself (see `LegPlan`)."""
        return self

    def next(self, dt: float) -> tuple[Array, Array]:
        """Joint angles (k, n) and wheel angles (k,) after the period dt [s]."""
        return self.q + dt * self.q_rate, self.wheel + dt * self.wheel_rate


def track(
    group: LegGroup,
    q: Array,
    wheel: Array,
    poses: tuple[Array, Array],
    places: tuple[Array, Array],
    hold: Hold,
    stance: NDArray[np.bool_],
    dt: float,
) -> Tracked:
    """Moves legs so that the feet reach their places in one period.

    A target out of reach, or beyond a joint's limit, stops all legs where they are.

    Args:
        group: The legs.
        q: Joint angles (k, n) now [rad].
        wheel: Angles (k,) of the wheels now [rad].
        poses: Poses (4, 4) of the body in P now and a period later.
        places: Places (k, 3) of the feet's centres in B now and a period later [m].
        hold: What settles the joints that the feet leave free, a period later.
        stance: Which feet (k,) are on the ground, and roll; the other wheels stand still.
        dt: The period [s].
    """
    target, frames, missed = group.inverse(places[1], hold, tolerance=CLOSE)
    fault = _fault(group, target, missed)
    if fault:
        return held(q, wheel, fault)
    rate = (target - q) / dt
    before, after = poses
    # For the small turns of one period, half of the skew part is the rotation vector.
    turned = before[:3, :3].T @ after[:3, :3]
    skew = turned - turned.T
    spin = (
        np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (2 * dt)
        + (group.jacobian(frames)[:, :3] @ rate[..., np.newaxis])[..., 0]
    )
    previous, centers = (place @ pose[:3, :3].T + pose[:3, 3] for place, pose in zip(places, poses, strict=True))
    velocity = (centers - previous) @ after[:3, :3] / dt
    speed, across = group.rolling(frames, spin, velocity, after[2, :3])
    roll = dt * across @ after[:3, :3].T * stance[:, np.newaxis]
    wheel_rate = np.where(stance, speed, 0.0)
    fault = _too_fast(group, rate, wheel_rate)
    if fault:
        return held(q, wheel, fault)
    return Tracked(q=q, wheel=wheel, q_rate=rate, wheel_rate=wheel_rate, roll_P=roll, frames=frames)


def held(q: Array, wheel: Array, fault: str = "") -> Tracked:
    """Legs that stay where they are."""
    return Tracked(q=q, wheel=wheel, q_rate=0 * q, wheel_rate=0 * wheel, roll_P=np.zeros((len(q), 3)), fault=fault)


def _too_fast(group: LegGroup, rate: Array, wheel_rate: Array) -> str:
    """Which joint or wheel would turn faster than it can, in words."""
    joints, wheels = group.max_speeds
    over = np.abs(rate) - joints
    if over.max() > 0:
        leg, joint = np.unravel_index(int(np.argmax(over)), over.shape)
        return (
            f"joint {joint + 1} of leg {group.robot.legs[leg].name} would turn at {abs(rate[leg, joint]):.3g} rad/s, "
            f"faster than {joints[leg, joint]:.3g}"
        )
    over = np.abs(wheel_rate) - wheels
    if over.max() > 0:
        worst = int(np.argmax(over))
        return (
            f"the wheel of leg {group.robot.legs[worst].name} would turn at {abs(wheel_rate[worst]):.3g} rad/s, "
            f"faster than its max_speed = {wheels[worst]:g}"
        )
    return ""


def _fault(group: LegGroup, q: Array, missed: Array) -> str:
    legs = group.robot.legs
    if not np.isfinite(q).all() or not missed.max() <= MISSED:
        worst = int(np.argmax(np.nan_to_num(missed, nan=np.inf)))
        return f"the foot of leg {legs[worst].name} misses its place by {1e3 * missed[worst]:.3g} mm"
    excess = group.beyond_limits(q)
    if excess.max() > BEYOND:
        leg, joint = np.unravel_index(int(np.argmax(excess)), excess.shape)
        link = legs[leg].links[joint]
        return (
            f"joint {joint + 1} of leg {legs[leg].name} would turn to {np.degrees(q[leg, joint]):.1f} deg; "
            f"its limits are {link.min_deg:g} to {link.max_deg:g}"
        )
    return ""
