"""Changes of posture, stage by stage."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.gaits import changes, wheeling
from rollerbench.kinematics.gaits.gait import schedule
from rollerbench.kinematics.gaits.plan import LegMode, LegPlan, mode_gait
from rollerbench.kinematics.gaits.plane import placed, seen_from
from rollerbench.kinematics.gaits.stances import Stances
from rollerbench.kinematics.legs.group import Hold

Array = NDArray[np.float64]

FROM_LIMIT = 0.01
"""Legs in the air keep this distance from the limits of their joints [rad]."""


def begin_change(stances: Stances, plan: LegPlan, mode: LegMode, q: Array) -> LegPlan:
    """The plan of a robot that starts to change to a mode's posture, at joint angles q (k, n)."""
    name, following = mode.posture, schedule(mode_gait(mode), stances.robot)
    change = changes.Change(
        posture=stances.postures[name],
        stages=(),
        height=plan.height,
        q_from=q,
        q_to=stances.joints(name),
        contact=seen_from(plan.q_xyt, plan.feet_P[:, :2]),
        heading=stances.group.headings(stances.group.frames(q)),
    )
    if mode.change == "rolling":
        stages = _rolling(stances, plan.posture.name, name)
    else:
        low = min(plan.height, stances.height(name))
        order = following.phases
        groups = [np.isclose(order, phase) for phase in np.unique(order)]
        stages = changes.stepping_stages(plan.height, low, stances.height(name), groups)
        change = replace(change, q_to=stances.lowered(name, low))
    change = prepared(stances, replace(change, stages=tuple(stages)), plan)
    return replace(plan, activity="change", change=change, wheeling=None, schedule=following)


def prepared(stances: Stances, change: changes.Change, plan: LegPlan) -> changes.Change:
    """The change with the path of the legs that step in its present stage."""
    if change.stages[0].kind != "step":
        return replace(change, steps=None)
    q_to = np.where(change.stages[0].legs[:, np.newaxis], change.q_to, change.q_from)
    steps = changes.stepping_path(stances.group, change.q_from, q_to, plan.X_PB, plan.schedule.gait.lift)
    return replace(change, steps=steps)


def change_posture(stances: Stances, plan: LegPlan, dt: float) -> LegPlan:
    """The plan a moment dt later [s] in a change."""
    change = plan.change
    assert change is not None
    stage = change.stages[0]
    change = replace(change, elapsed=change.elapsed + dt)
    s = change.progress
    height = change.height + s * (stage.height - change.height)
    plan = replace(plan, height=height, change=change)
    if stage.kind == "roll":
        plan = _rolled(stances, plan, change)
    elif stage.kind == "step":
        plan = _stepped(stances, plan, change, dt)
    return plan


def next_stage(stances: Stances, plan: LegPlan, q: Array) -> LegPlan:
    """The plan at the end of a stage of a change, or of the whole change."""
    change = plan.change
    assert change is not None
    hold = plan.hold
    if change.stages[0].kind == "roll":
        rows = stances.holds(change.posture.name).rows
        hold = Hold(rows=rows, values=np.sum(rows * q, axis=1), heading=np.zeros(len(q), dtype=bool), near=q)
    if len(change.stages) > 1:
        change = replace(
            change,
            stages=change.stages[1:],
            elapsed=0.0,
            height=plan.height,
            q_from=q,
            contact=seen_from(plan.q_xyt, plan.feet_P[:, :2]),
            heading=stances.group.headings(stances.group.frames(q)),
        )
        return replace(plan, change=prepared(stances, change, plan), hold=hold)
    return replace(plan, change=None, hold=hold, activity="walk", posture=change.posture)


def _rolling(stances: Stances, start: str, end: str) -> list[changes.Stage]:
    """Stages in which wheels roll from one posture to another, of which one has its feet under the hips."""
    under = [name for name in (start, end) if stances.under_hips(name)]
    if len(under) != 1:
        raise KinematicsError(
            f"from {start} to {end} no wheel can roll: accepted: rolling between a posture with the feet under the "
            "hips and one with the feet beside them, or stepping"
        )
    inner, outer = under[0], start if under[0] == end else end
    places = [(stances.home(name), stances.heading(name)) for name in (outer, inner)]
    heights = (stances.height(outer), stances.height(inner))
    frames = stances.group.frames(stances.joints(outer))
    axes = frames[range(len(frames)), stances.last]
    if np.abs(axes[:, 2, 2]).min() < wheeling.UPRIGHT:
        raise KinematicsError(
            f"from {start} to {end} no wheel can roll: accepted: a posture {outer} in which the last joints' axes are "
            "upright, or stepping"
        )
    stages = changes.rolling_stages(places[0], axes[:, :2, 3], places[1], stances.hips, heights)
    return stages if inner == end else changes.reversed_stages(stages, heights[0])


def _stepped(stances: Stances, plan: LegPlan, change: changes.Change, dt: float) -> LegPlan:
    legs, u, pose = change.stages[0].legs, change.linear, plan.X_PB
    assert change.steps is not None
    low, high = stances.group.limits
    q = np.clip(change.steps(change.progress), low + FROM_LIMIT, high - FROM_LIMIT)
    centers = stances.group.frames(q)[:, -1, :3, 3] @ pose[:3, :3].T + pose[:3, 3]
    centers[:, 2] -= stances.group.wheel_radius
    flying = legs[:, np.newaxis]
    target = stances.holds(change.posture.name)
    hold = Hold(
        rows=np.where(flying, target.rows, plan.hold.rows),
        values=np.where(legs, np.sum(target.rows * q, axis=1), plan.hold.values),
        heading=plan.hold.heading & ~legs,
        near=np.where(flying, q, plan.hold.near),
    )
    landed = u >= 1 - 1e-9
    return replace(
        plan,
        feet_P=np.where(flying, centers, plan.feet_P),
        hold=hold,
        swing=np.where(legs & (not landed), u, -1.0),
        load=np.where(legs & (not landed), 0.0, np.minimum(1.0, plan.load + dt / 0.05)),
    )


def _rolled(stances: Stances, plan: LegPlan, change: changes.Change) -> LegPlan:
    s, course = change.progress, change.stages[0].course
    assert course is not None
    # What the feet were off at the start fades away on the way.
    first, last = course.at(0.0), course.at(s)
    off = change.heading - first[1]
    contact = last[0] + (1 - s) * (change.contact - first[0])
    heading = last[1] + (1 - s) * np.arctan2(np.sin(off), np.cos(off))
    feet = np.column_stack([placed(plan.q_xyt, contact), plan.feet_P[:, 2]])
    rows, headings = np.zeros(stances.group.shape), np.full(len(feet), not change.stages[0].straight)
    if change.stages[0].straight:
        steering = (range(len(feet)), stances.last)
        rows[steering] = 1.0
        inner = next(name for name in (change.posture.name, plan.posture.name) if stances.under_hips(name))
        begun = change.q_from[steering]
        heading = begun + s * (stances.joints(inner)[steering] - begun)
    return replace(plan, feet_P=feet, hold=replace(plan.hold, rows=rows, values=heading, heading=headings))
