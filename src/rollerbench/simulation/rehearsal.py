"""A gait command carried out by ideal legs, before anything is simulated: can they, and where does it lead?"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import DescriptionError, KinematicsError
from rollerbench.kinematics.gaits import LegCommand, LegFeedback, LegPlan, LegPlanner, track
from rollerbench.kinematics.gaits.plan import mode_gait
from rollerbench.kinematics.legs import static_margin
from rollerbench.simulation.leg_command import command_at, piece_at

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rehearsal:
    """What ideal legs made of a command.

    Attributes:
        plans: The plans, a period of control apart, from time 0 on.
        margins: Static stability margins (n,) [m].
        q_rates: Joint speeds (n, k, m) with which the legs came there [rad/s].
    """

    plans: list[LegPlan]
    margins: Array
    q_rates: Array

    @property
    def time(self) -> Array:
        """Times (n,) [s]."""
        return np.array([plan.time for plan in self.plans])

    @property
    def reference(self) -> Array:
        """Poses (n, 3) to which the command leads [m, m, rad]."""
        return np.array([plan.reference for plan in self.plans])

    @property
    def twist(self) -> Array:
        """Its twists (n, 3) [m/s, m/s, rad/s]."""
        return np.array([plan.twist.value for plan in self.plans])


def rehearse(
    robot: Robot, course: list[tuple[float, LegCommand]], duration: float, period: float, gravity: Array, name: str
) -> Rehearsal:
    """Carries out a course of commands with ideal legs on level ground.

    Args:
        robot: The robot.
        course: See `GaitCommand.course`.
        duration: For how long [s].
        period: Period of control [s].
        gravity: Acceleration (3,) in W [m/s2].
        name: Name of the scenario, for messages.

    Raises:
        DescriptionError: a command is beyond the legs' reach or a joint's limits, or lets the robot tip over.
    """
    planner = LegPlanner(robot)
    plan = planner.start(course[0][1].mode)
    q, wheel = planner.stances.joints(plan.posture.name), np.zeros(len(plan.load))
    feedback = LegFeedback(q=q, q_rate=0 * q, roll_P=np.zeros((len(q), 3)))
    plans, margins = [plan], [_margin(planner, plan, q, gravity)]
    rates, entered = [0 * q], [False] * len(course)
    for _ in range(round(duration / period)):
        try:
            following = planner.advance(plan, period, command_at(course, plan.time), feedback)
        except KinematicsError as error:
            raise DescriptionError(f"{name}: {error}") from error
        poses, places = (plan.X_PB, following.X_PB), (planner.centers_B(plan), planner.centers_B(following))
        done = track(planner.group, q, wheel, poses, places, following.hold, following.swing < 0, period)
        plan = following
        if done.fault or plan.status:
            why = done.fault or plan.status
            raise DescriptionError(f"{name}: at t = {plan.time:.2f} s {why}; {_advice(plan)}")
        q, wheel = done.next(period)
        margins.append(_margin(planner, plan, q, gravity))
        piece = piece_at(course, plans[-1].time)
        entered[piece] |= _does(plan, course[piece][1])
        if margins[-1] < 0:
            raise DescriptionError(f"{name}: at t = {plan.time:.2f} s {_tipping(robot, plan, margins[-1])}")
        feedback = LegFeedback(q=q, q_rate=done.q_rate, roll_P=done.roll_P)
        plans.append(plan)
        rates.append(done.q_rate)
    for (end, command), done_so in zip(course[:-1], entered, strict=False):
        if not done_so:
            mode = command.mode
            what = "drive" if mode.motion == "drive" else f"walk in its gait {mode_gait(mode).name}"
            raise DescriptionError(
                f"{name}: at t = {end:g} s the piece ends before the robot can {what} in the posture {mode.posture}; "
                "accepted: a longer duration of this piece, or of the one before"
            )
    return Rehearsal(plans=plans, margins=np.array(margins), q_rates=np.array(rates))


def _does(plan: LegPlan, command: LegCommand) -> bool:
    """Whether the robot does what a command asks for, or may."""
    mode = command.mode
    gait = mode.motion == "drive" or not command.v_xyw_B.any() or plan.schedule.gait == mode_gait(mode)
    return plan.activity == mode.motion and plan.posture.name == mode.posture and gait


def _tipping(robot: Robot, plan: LegPlan, margin: float) -> str:
    flying = [leg.name for leg, swing in zip(robot.legs, plan.swing, strict=True) if swing >= 0]
    if not flying:
        return "the robot would tip over where it stands; accepted: less slope, or another posture"
    air = f"the robot would tip over: with {', '.join(flying)} in the air "
    if not np.isfinite(margin):
        return air + "too few feet stand to carry it; accepted: a gait with more feet on the ground (wave)"
    other = "" if plan.schedule.gait.name == "wave" else "the gait wave, "
    return (
        f"{air}its centre of mass is {-1e3 * margin:.1f} mm outside the support polygon; accepted: {other}a smaller "
        "stride, or a body that leans away from these legs (body: x, y)"
    )


def _advice(plan: LegPlan) -> str:
    share = np.abs(plan.accepted).max() / max(np.abs(plan.request).max(), 1e-12)
    if 0 < share < 1:
        slower = ", ".join(f"{value:.3g}" for value in plan.accepted)
        return f"accepted: up to v_xyw_B = [{slower}], or a shorter period"
    if plan.request.any() and share == 0:
        return "accepted: another posture or pose of the body, in which the legs can step"
    return "accepted: a slower or smaller motion"


def _margin(planner: LegPlanner, plan: LegPlan, q: Array, gravity: Array) -> float:
    pose = plan.X_PB
    com = pose[:3, :3] @ planner.group.center_of_mass(planner.group.frames(q)) + pose[:3, 3]
    return static_margin(plan.feet_P[plan.swing < 0], com, gravity)
