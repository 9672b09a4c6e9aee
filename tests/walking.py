"""Robots on ideal legs: a planner and what follows its plans, without Drake."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.kinematics.gaits import LegCommand, LegFeedback, LegMode, LegPlan, LegPlanner, Tracked, track
from rollerbench.kinematics.legs import static_margin

Array = NDArray[np.float64]

DT = 0.02


@dataclass
class Walk:
    """What a robot on ideal legs did.

    Attributes:
        planner: The planner.
        plans: Plans, a period apart, from the start on.
        q: Joint angles (k, n) that belong to them.
        wheel: Angles (k,) of the wheels.
        tracked: What led from each plan to the next.
    """

    planner: LegPlanner
    plans: list[LegPlan]
    q: list[Array]
    wheel: list[Array]
    tracked: list[Tracked] = field(default_factory=list)

    def fail(self, fault: str) -> "Walk":
        """Lets the next plan know that something went wrong."""
        self.tracked[-1] = replace(self.tracked[-1], fault=fault)
        return self

    def go(self, duration: float, command: LegCommand | Callable[[float], LegCommand], dt: float = DT) -> "Walk":
        """Goes on for a while [s], with one command or one that depends on the time."""
        group, plan, q, wheel = self.planner.group, self.plans[-1], self.q[-1], self.wheel[-1]
        done = self.tracked[-1] if self.tracked else None
        for _ in range(round(duration / dt)):
            asked = command(plan.time) if callable(command) else command
            feedback = LegFeedback(
                q=q,
                q_rate=0 * q if done is None else done.q_rate,
                roll_P=np.zeros((len(q), 3)) if done is None else done.roll_P,
                fault="" if done is None else done.fault,
            )
            following = self.planner.advance(plan, dt, asked, feedback)
            places = (self.planner.centers_B(plan), self.planner.centers_B(following))
            poses = (plan.X_PB, following.X_PB)
            done = track(group, q, wheel, poses, places, following.hold, following.swing < 0, dt)
            plan, (q, wheel) = following, done.next(dt)
            self.plans.append(plan)
            self.q.append(q)
            self.wheel.append(wheel)
            self.tracked.append(done)
        return self

    def array(self, name: str) -> Array:
        """A field of the plans (n, ...) over time."""
        return np.array([getattr(plan, name) for plan in self.plans])

    @property
    def time(self) -> Array:
        return self.array("time")

    @property
    def swing(self) -> Array:
        return self.array("swing")

    @property
    def feet(self) -> Array:
        """Lowest points (n, k, 3) of the feet in P [m]."""
        return self.array("feet_P")

    @property
    def twist(self) -> Array:
        """Twists (n, 3) of the body [m/s, m/s, rad/s]."""
        return np.array([plan.twist.value for plan in self.plans])

    @property
    def faults(self) -> set[str]:
        """What the legs or the plan complained of."""
        return ({done.fault for done in self.tracked} | {plan.status for plan in self.plans}) - {""}

    @property
    def margins(self) -> Array:
        """Static stability margins (n,) [m]."""
        return np.array([margin(self.planner, plan, q) for plan, q in zip(self.plans, self.q, strict=True)])

    @property
    def misses(self) -> Array:
        """How far the feet, by the joint angles, are from where the plans have them (n, k) [m]."""
        group = self.planner.group
        rows = []
        for plan, q in zip(self.plans, self.q, strict=True):
            off = group.frames(q)[:, -1, :3, 3] - self.planner.centers_B(plan)
            rows.append(np.linalg.norm(off, axis=1))
        return np.array(rows)


def margin(planner: LegPlanner, plan: LegPlan, q: Array) -> float:
    pose = plan.X_PB
    com = pose[:3, :3] @ planner.group.center_of_mass(planner.group.frames(q)) + pose[:3, 3]
    return static_margin(plan.feet_P[plan.swing < 0], com)


def standing(planner: LegPlanner, mode: LegMode | None = None) -> Walk:
    """A robot that stands in a mode's posture."""
    plan = planner.start(mode)
    q = planner.stances.joints(plan.posture.name)
    return Walk(planner=planner, plans=[plan], q=[q], wheel=[np.zeros(len(q))])


def asked(v_xyw_B: ArrayLike, mode: LegMode, offset: ArrayLike = (0.0,) * 6) -> LegCommand:
    """A command."""
    return LegCommand(v_xyw_B=np.array(v_xyw_B, dtype=float), offset=np.array(offset, dtype=float), mode=mode)


def pieces(course: Iterable[tuple[float, LegCommand]]) -> Callable[[float], LegCommand]:
    """Commands one after the other, each with its end [s]; the last one goes on."""
    course = list(course)

    def at(time: float) -> LegCommand:
        return next((command for end, command in course if time < end - 1e-9), course[-1][1])

    return at
