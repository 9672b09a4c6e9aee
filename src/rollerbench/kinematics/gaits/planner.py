"""Where body and feet go next: walking, driving on the feet's wheels, posing the body, changing the posture."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import odometry
from rollerbench.kinematics.gaits import driving, posing, walking, wheeling
from rollerbench.kinematics.gaits.gait import schedule
from rollerbench.kinematics.gaits.plan import LegCommand, LegFeedback, LegMode, LegPlan, mode_gait
from rollerbench.kinematics.gaits.smooth import Follower
from rollerbench.kinematics.gaits.stances import Stances

Array = NDArray[np.float64]

START_SHARE, STOP_SHARE = 1.45, 0.8
"""Times in which the body takes on a new twist on foot, over the gait's period, to more and to less speed [-].

With the first, 2 - duty or more, no foot is left behind by more than half a stride before it first lifts.
"""

OFFSET_TIME = 0.8
"""Time in which the body takes on a new offset [s]."""

GROUND_TIME = 0.8
"""Time in which the body takes on a new height of the ground [s]."""


class LegPlanner:
    """Plans body and feet one period of control after the other. Plans are values: it keeps no state of its own.

    A robot walks and drives as its twist commands say, within its legs' reach. Before it changes gait, posture, or from
    walking to driving, it comes to rest by itself.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.stances = robot, Stances(robot)
        self.group = self.stances.group

    def start(self, mode: LegMode | None = None) -> LegPlan:
        """A robot that stands at the origin, in a mode's posture, by default the first."""
        mode = mode or LegMode(posture=self.robot.standing[0].name)
        self.require(mode)
        count, _ = self.group.shape
        feet = np.column_stack([self.stances.home(mode.posture), np.zeros(count)])
        return LegPlan(
            time=0.0,
            q_xyt=(origin := np.zeros(3)),
            reference=origin,
            twist=Follower.resting(np.zeros(3)),
            offset=Follower.resting(np.zeros(6)),
            level=np.zeros(3),
            height=self.stances.height(mode.posture),
            ground=Follower.resting(np.zeros(1)),
            feet_P=feet,
            swing=np.full(count, -1.0),
            lifted_P=feet,
            load=np.ones(count),
            phase=0.0,
            schedule=schedule(mode_gait(mode), self.robot),
            posture=self.stances.postures[mode.posture],
            hold=self.stances.holds(mode.posture),
            request=np.zeros(3),
            accepted=np.zeros(3),
            posed=np.zeros(6),
        )

    def require(self, mode: LegMode) -> None:
        """Checks a mode.

        Raises:
            KinematicsError: an unknown posture or gait, or driving on wheels that no motor turns.
        """
        if mode.posture not in self.stances.postures:
            raise KinematicsError(f"posture = {mode.posture!r}: accepted: {', '.join(self.stances.postures)}")
        for name, value, accepted in (
            ("motion", mode.motion, ("walk", "drive")),
            ("change", mode.change, ("stepping", "rolling")),
        ):
            if value not in accepted:
                raise KinematicsError(f"{name} = {value!r}: accepted: {', '.join(accepted)}")
        mode_gait(mode)
        locked = [leg.name for leg in self.robot.legs if not leg.wheel.driven]
        if locked and (mode.motion == "drive" or mode.change == "rolling"):
            raise KinematicsError(
                f"{self.robot.name} cannot drive: the wheels of {', '.join(locked)} have no motor; accepted: walk, and "
                "changes by stepping"
            )

    def centers_B(self, plan: LegPlan, X_PB: Array | None = None) -> Array:
        """Centres (k, 3) of the feet's wheels in B [m]; the plan's own pose (4, 4) saves computing it again."""
        pose = plan.X_PB if X_PB is None else X_PB
        centers = plan.feet_P - pose[:3, 3]
        centers[:, 2] += self.group.wheel_radius
        return centers @ pose[:3, :3]

    def advance(self, plan: LegPlan, dt: float, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan a moment dt later [s]."""
        if feedback.held and plan.before is not None:
            plan = _resting(plan.before)
        start = replace(plan, before=None)
        near = feedback.q + dt * feedback.q_rate
        feet = np.where((plan.swing < 0)[:, np.newaxis], plan.feet_P + feedback.roll_P, plan.feet_P)
        plan = replace(plan, feet_P=feet, hold=replace(plan.hold, near=near), level=command.level)
        plan = self._turned_to(plan, command, feedback)
        plan = self._accepting(plan, command, feedback)
        twist = plan.twist.follow(plan.accepted, dt, self._twist_time(plan))
        mean = 0.5 * (plan.twist.value + twist.value)
        moving = bool(mean.any())
        # A robot that stands is not corrected: its feet are where they are.
        moved = mean + command.correction if moving else mean
        q_xyt = odometry.integrate(plan.q_xyt, moved, dt) if moving else plan.q_xyt
        together = plan.reference is plan.q_xyt and not (moving and command.correction.any())
        reference = q_xyt if together else odometry.integrate(plan.reference, mean, dt)
        plan = self._posing(plan, command)
        plan = replace(
            plan,
            time=plan.time + dt,
            q_xyt=q_xyt,
            reference=reference,
            twist=twist,
            offset=plan.offset.follow(self._offset(plan, command), dt, OFFSET_TIME),
            before=start,
        )
        match plan.activity:
            case "walk":
                plan = walking.walk(self.stances, plan, dt, feedback)
            case "drive":
                plan = driving.drive(plan, dt, moved, command.v_xyw_B)
            case "change":
                plan = posing.change_posture(self.stances, plan, dt)
            case "halt":
                plan = walking.sink(plan, dt)
        on_ground = plan.swing < 0
        ground = plan.feet_P[on_ground, 2].mean(keepdims=True) if on_ground.any() else plan.ground.value
        following = plan.ground.follow(ground, dt, GROUND_TIME)
        return plan if following is plan.ground else replace(plan, ground=following)

    def _posing(self, plan: LegPlan, command: LegCommand) -> LegPlan:
        """The plan with a status if the legs do not reach from the offset that is asked for now."""
        if np.array_equal(command.offset, plan.posed):
            return plan
        share = self.stances.offset_share(plan.posture.name, command.offset)
        status = plan.status if share == 1 else f"the body's pose is beyond the legs' reach; taken at {share:.0%}"
        return replace(plan, posed=command.offset, offset_share=share, status=status)

    def _offset(self, plan: LegPlan, command: LegCommand) -> Array:
        """The offset that the body shall take on now: none before and in a change."""
        if plan.activity == "halt":
            return plan.offset.target
        stays = plan.activity in ("walk", "drive") and command.mode.posture == plan.posture.name
        return plan.offset_share * command.offset if stays else np.zeros(6)

    def _twist_time(self, plan: LegPlan) -> float:
        """Time in which the accepted twist is taken on [s]."""
        faster = np.linalg.norm(plan.accepted) >= np.linalg.norm(plan.twist.value)
        if plan.activity != "walk":
            return driving.START_TIME if faster else driving.STOP_TIME
        return (START_SHARE if faster else STOP_SHARE) * plan.schedule.gait.period

    # What to do.

    def _turned_to(self, plan: LegPlan, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan with another activity, where it is time for one."""
        mode = command.mode
        if feedback.fault and plan.activity != "halt":
            return replace(plan, activity="halt", status=feedback.fault, change=None, wheeling=None)
        if plan.change is not None and plan.change.elapsed >= plan.change.stages[0].duration - 1e-9:
            plan = posing.next_stage(self.stances, plan, feedback.q)
        if plan.activity not in ("walk", "drive") or not plan.at_rest or plan.offset.rate.any():
            return plan
        away = walking.feet_away(self.stances, plan).any()
        here = mode.posture == plan.posture.name
        if plan.activity == "drive":
            if here and mode.motion == "drive" and not (plan.wheeling and plan.wheeling.wound_up):
                return plan
            if not here and plan.offset.value.any():
                return plan
            if not here:
                return posing.begin_change(self.stances, plan, mode, feedback.q)
            # Back into the posture by stepping; to drive on, with the castors behind their axes.
            back = posing.begin_change(self.stances, plan, replace(mode, change="stepping"), feedback.q)
            return self._with_trailing_castors(back, command.v_xyw_B) if mode.motion == "drive" else back
        if not here and not away and not plan.offset.value.any():
            return posing.begin_change(self.stances, plan, mode, feedback.q)
        if here and mode.motion == "drive":
            return driving.begin_drive(self.stances, plan, feedback.q)
        gait = mode_gait(mode)
        if here and gait != plan.schedule.gait and not away:
            following = schedule(gait, self.robot)
            return replace(plan, schedule=following, phase=following.duty - walking.LOAD_RAMP)
        return plan

    def _accepting(self, plan: LegPlan, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan with the twist that it may follow now."""
        mode, request = command.mode, command.v_xyw_B
        follows = plan.activity == mode.motion and mode.posture == plan.posture.name
        if plan.activity == "walk":
            follows &= mode_gait(mode) == plan.schedule.gait
        if not follows or not request.any():
            if not plan.request.any():
                return plan
            status = plan.status if plan.activity == "halt" else ""
            return replace(plan, accepted=np.zeros(3), request=np.zeros(3), status=status)
        if plan.activity == "drive":
            assert plan.wheeling is not None
            wound_up = plan.wheeling.wound_up or driving.wound_up(self.stances, plan.wheeling, feedback.q)
            ready = not wound_up and (not plan.at_rest or wheeling.aligned(plan.wheeling, request))
            plan = replace(plan, wheeling=replace(plan.wheeling, wound_up=wound_up))
            return replace(plan, accepted=request if ready else np.zeros(3), request=request, status="")
        if np.array_equal(request, plan.request) and np.array_equal(command.offset, plan.posed):
            return plan
        share = self.stances.reachable_share(plan.posture.name, plan.schedule, request, self._offset(plan, command))
        status = "" if share == 1 else f"the command is beyond the legs' reach; followed at {share:.0%}"
        return replace(plan, request=request, accepted=share * request, status=status)

    def _with_trailing_castors(self, plan: LegPlan, v_xyw_B: Array) -> LegPlan:
        """A change back into a posture that leaves castors where they trail at a twist (3,)."""
        assert plan.change is not None
        q_to = driving.trailing(self.stances, plan.change.q_to, v_xyw_B)
        return replace(plan, change=posing.prepared(self.stances, replace(plan.change, q_to=q_to), plan))


def _resting(plan: LegPlan) -> LegPlan:
    """The plan without any motion."""
    return replace(plan, twist=Follower.resting(np.zeros(3)), offset=Follower.resting(plan.offset.value))
