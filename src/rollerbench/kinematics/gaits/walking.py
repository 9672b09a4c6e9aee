"""Walking: legs lift, swing to where their posture will have them, and stand."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.description.inertia import GRAVITY
from rollerbench.kinematics import odometry
from rollerbench.kinematics.gaits.plan import LegFeedback, LegPlan
from rollerbench.kinematics.gaits.plane import placed
from rollerbench.kinematics.gaits.smooth import bump, quintic
from rollerbench.kinematics.gaits.stances import Stances
from rollerbench.kinematics.legs.group import Hold

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

HOME_TOLERANCE = 0.002
"""Feet closer to where their posture has them need no step [m]."""

LOAD_RAMP = 0.05
"""Share of a period in which a foot takes over its load, and gives it away [-]."""

HOLD_RATE = 0.5
"""Rate at which what a posture holds returns to its value [rad/s]."""

EARLY = 0.005
"""Ground higher than expected by this ends a foot's swing [m]."""

CONTACT_SHARE = 0.1
"""A foot that bears this share of its part of the robot's weight stands on the ground [-]."""

SINK_SPEED = 0.1
"""Speed at which feet that find no ground, and those of a robot that halts, sink [m/s]."""

SINK_DEPTH = 0.06
"""How far below the expected ground feet look for it [m]."""


def feet_away(stances: Stances, plan: LegPlan) -> Flags:
    """Which feet are not where the posture has them; while the body is posed, all may have rolled a little."""
    if plan.offset.value.any() or plan.offset.remaining > 0:
        return np.zeros(len(plan.load), dtype=bool)
    place = placed(plan.q_xyt, stances.home(plan.posture.name))
    return np.hypot(*(plan.feet_P[:, :2] - place).T) > HOME_TOLERANCE


def walk(stances: Stances, plan: LegPlan, dt: float, feedback: LegFeedback) -> LegPlan:
    """The plan a moment dt later [s], its twist and pose already being of then: legs step as the gait has it."""
    gait, share = plan.schedule.gait, plan.schedule.duty
    step = dt / gait.period
    away = feet_away(stances, plan)
    moving = bool(plan.twist.value.any() or plan.accepted.any())
    posture = _settled_hold(stances, plan, dt)
    if not moving and not away.any() and plan.at_rest:
        load = np.minimum(1.0, plan.load + step / LOAD_RAMP)
        return replace(plan, phase=share - LOAD_RAMP, load=load, hold=posture)
    local = (plan.phase + plan.schedule.phases) % 1.0
    lifts = (plan.swing < 0) & (local < share) & (local + step >= share) & (moving | away)
    on_ground = (plan.swing < 0) & ~lifts
    swing = np.where(lifts, 0.0, plan.swing)
    lifted = np.where(lifts[:, np.newaxis], plan.feet_P, plan.lifted_P)
    feet, swing = _swung(stances, replace(plan, swing=swing, lifted_P=lifted), dt, feedback)
    wanted = (on_ground & ~((local + LOAD_RAMP >= share) & (local < share) & (moving | away))).astype(float)
    load = np.clip(wanted, plan.load - step / LOAD_RAMP, plan.load + step / LOAD_RAMP)
    return replace(
        plan,
        phase=(plan.phase + step) % 1.0,
        feet_P=feet,
        swing=swing,
        lifted_P=lifted,
        load=np.where(swing >= 0, 0.0, load),
        hold=posture,
    )


def sink(plan: LegPlan, dt: float) -> LegPlan:
    """Feet in the air go down where they are, and the robot stands."""
    feet, flying = plan.feet_P.copy(), plan.swing >= 0
    feet[flying, 2] = np.maximum(plan.lifted_P[flying, 2], feet[flying, 2] - SINK_SPEED * dt)
    swing = np.where(flying & (feet[:, 2] <= plan.lifted_P[:, 2]), -1.0, plan.swing)
    load = np.where(swing < 0, np.minimum(1.0, plan.load + dt / (LOAD_RAMP * plan.schedule.gait.period)), 0.0)
    return replace(plan, feet_P=feet, swing=swing, load=load)


def _swung(stances: Stances, plan: LegPlan, dt: float, feedback: LegFeedback) -> tuple[Array, Array]:
    """Feet (k, 3) and progress (k,) of the swing a moment later."""
    gait, share = plan.schedule.gait, plan.schedule.duty
    time = (1 - share) * gait.period
    if (plan.swing < 0).all():
        return plan.feet_P, plan.swing
    u = np.where(plan.swing >= 0, plan.swing + dt / time, -1.0)
    # In the middle of the next stance the foot is where the posture has it.
    ahead = np.maximum(0.0, 1 - u) * time + 0.5 * share * gait.period
    body = odometry.integrate(plan.q_xyt, plan.twist.value * ahead[:, np.newaxis], 1.0)
    target = placed(body, stances.home(plan.posture.name))
    s = quintic(u)[:, np.newaxis]
    flat = (1 - s) * plan.lifted_P[:, :2] + s * target
    height = plan.lifted_P[:, 2] + gait.lift * bump(u)
    landed = u >= 1 - 1e-9
    if feedback.loads is not None:
        touches = (feedback.loads > _contact_load(stances)) & (u > 0.5)
        early = touches & (plan.feet_P[:, 2] > plan.lifted_P[:, 2] + EARLY)
        searches = landed & ~touches & (plan.feet_P[:, 2] > plan.lifted_P[:, 2] - SINK_DEPTH)
        height = np.where(landed, np.minimum(height, plan.feet_P[:, 2] - SINK_SPEED * dt), height)
        height = np.where(landed & touches, plan.feet_P[:, 2], height)
        flat = np.where(early[:, np.newaxis], plan.feet_P[:, :2], flat)
        height = np.where(early, plan.feet_P[:, 2], height)
        landed = early | (landed & ~searches)
    feet = np.where((u >= 0)[:, np.newaxis], np.column_stack([flat, height]), plan.feet_P)
    return feet, np.where(landed, -1.0, u)


def _contact_load(stances: Stances) -> float:
    """Load of a foot from which on it stands on the ground [N]."""
    return CONTACT_SHARE * stances.robot.mass * GRAVITY / len(stances.robot.legs)


def _settled_hold(stances: Stances, plan: LegPlan, dt: float) -> Hold:
    """What the posture holds, on its way back to its value."""
    nominal = stances.holds(plan.posture.name)
    off = nominal.values - plan.hold.values
    values = plan.hold.values + np.clip(off, -HOLD_RATE * dt, HOLD_RATE * dt)
    return replace(nominal, values=values, near=plan.hold.near)
