"""Driving on the feet's wheels, and stepping back into the posture before a joint is at its limit."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.kinematics.gaits import wheeling
from rollerbench.kinematics.gaits.plan import LegPlan
from rollerbench.kinematics.gaits.plane import placed, seen_from
from rollerbench.kinematics.gaits.stances import Stances

Array = NDArray[np.float64]

START_TIME, STOP_TIME = 1.0, 0.5
"""Times in which the body takes on a new twist on wheels, to more and to less speed [s]."""

WOUND_UP = 0.25
"""Joints this close to their limits end a drive, until the legs have stepped back into their posture [rad]."""

STEERING_ROOM = 1.0
"""Joints that a posture has closer to a limit do not steer [rad]."""


def begin_drive(stances: Stances, plan: LegPlan, q: Array) -> LegPlan:
    """The plan of a robot that starts to drive, at joint angles q (k, n)."""
    frames = stances.group.frames(q)
    joints = frames[range(len(frames)), stances.last]
    contact = seen_from(plan.q_xyt, plan.feet_P[:, :2])
    start = wheeling.wheeling_from(contact, stances.group.headings(frames), joints[:, :2, 3], joints[:, 2, 2])
    return replace(plan, activity="drive", wheeling=start, load=np.ones(len(contact)))


def drive(plan: LegPlan, dt: float, twist: Array, request: Array) -> LegPlan:
    """The plan a moment dt later [s], having moved at a twist (3,); at rest wheels steer for the requested one (3,)."""
    assert plan.wheeling is not None
    steer_to = plan.twist.value if plan.twist.value.any() else request
    now = wheeling.advanced(plan.wheeling, twist, steer_to, dt)
    feet = np.column_stack([placed(plan.q_xyt, now.contact), plan.feet_P[:, 2]])
    hold = replace(plan.hold, values=now.heading, heading=np.ones(len(feet), dtype=bool))
    return replace(plan, wheeling=now, feet_P=feet, hold=hold)


def wound_up(stances: Stances, now: wheeling.Wheeling, q: Array) -> bool:
    """Whether a joint has turned so far while driving that the legs have to step back into their posture."""
    low, high = stances.group.limits
    # A castor swings on while the robot comes to rest.
    margin = WOUND_UP + np.where(now.castor, 0.5 * STOP_TIME * np.abs(now.rate), 0.0)[:, np.newaxis]
    near = (q < low + margin) | (q > high - margin)
    return bool((near & _turning(stances)).any())


def trailing(stances: Stances, q: Array, v_xyw_B: Array) -> Array:
    """Joint angles (k, n) near others at which castors trail behind their axes at a twist (3,)."""
    frames = stances.group.frames(q)
    legs, joints = range(len(frames)), frames[range(len(frames)), stances.last]
    start = wheeling.wheeling_from(
        frames[:, -1, :2, 3], stances.group.headings(frames), joints[:, :2, 3], joints[:, 2, 2]
    )
    turn = wheeling.trailing_turn(start, v_xyw_B) * np.sign(joints[:, 2, 2])
    angle = q[legs, stances.last] + turn
    q_to = q.copy()
    q_to[legs, stances.last] = np.where(start.castor, np.arctan2(np.sin(angle), np.cos(angle)), angle)
    return q_to


def _turning(stances: Stances) -> NDArray[np.bool_]:
    """Which joints (k, n) may steer."""
    low, high = stances.group.limits
    angles = np.array([stances.joints(name) for name in stances.postures])
    free = (angles > low + STEERING_ROOM) & (angles < high - STEERING_ROOM)
    return free.all(axis=0) & stances.group.present
