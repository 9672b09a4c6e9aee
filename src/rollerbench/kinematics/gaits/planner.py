"""Where body and feet go next: walking, driving on the feet's wheels, posing the body, changing the posture."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import odometry
from rollerbench.kinematics.gaits import changes, wheeling
from rollerbench.kinematics.gaits.gait import Gait, Schedule, gait_of, schedule
from rollerbench.kinematics.gaits.plan import LegCommand, LegFeedback, LegMode, LegPlan
from rollerbench.kinematics.gaits.smooth import Follower, bump, quintic
from rollerbench.kinematics.legs.group import Hold, LegGroup

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

START_TIME, STOP_TIME = 1.0, 0.5
"""Times in which the body takes on a new twist on wheels, to more and to less speed [s]."""

START_SHARE, STOP_SHARE = 1.45, 0.8
"""The same on foot, over the gait's period, to more and to less speed [-].

With the first, 2 - duty or more, no foot is left behind by more than half a stride before it first lifts.
"""

OFFSET_TIME = 0.8
"""Time in which the body takes on a new offset [s]."""

GROUND_TIME = 0.8
"""Time in which the body takes on a new height of the ground [s]."""

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

WOUND_UP = 0.25
"""Joints this close to their limits end a drive, until the legs have stepped back into their posture [rad]."""

REACH_TOLERANCE = 1e-4
"""Feet this close to their targets count as there [m]."""


class LegPlanner:
    """Plans body and feet one period of control after the other. Plans are values: it keeps no state of its own.

    A robot walks and drives as its twist commands say, within its legs' reach. Before it changes gait, posture, or from
    walking to driving, it comes to rest by itself.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.group = robot, LegGroup(robot)
        self.postures = {posture.name: posture for posture in robot.standing}
        self._q = {name: self.group.posture(name) for name in self.postures}
        self._holds = {name: self.group.hold(posture, self._q[name]) for name, posture in self.postures.items()}
        centers = {name: robot.feet_B(name) for name in self.postures}
        self._home = {name: feet[:, :2] for name, feet in centers.items()}
        self._heading = {name: self.group.headings(self.group.frames(q)) for name, q in self._q.items()}
        radius = self.group.wheel_radius
        self._height = {name: float(np.mean(radius - feet[:, 2])) for name, feet in centers.items()}
        self._last = [len(leg.links) - 1 for leg in robot.legs]
        # Joints that a posture has near a limit do not steer.
        low, high = self.group.limits
        angles = np.array(list(self._q.values()))
        self._turning = ((angles > low + 1.0) & (angles < high - 1.0)).all(axis=0)
        self._contact_load = CONTACT_SHARE * robot.mass * 9.81 / len(robot.legs)

    def home(self, posture: str) -> Array:
        """Where the feet of a posture stand (k, 2), in B [m]."""
        return self._home[posture]

    def height(self, posture: str) -> float:
        """Height of Bo over the ground in a posture [m]."""
        return self._height[posture]

    def joints(self, posture: str) -> Array:
        """Joint angles (k, n) of a posture [rad]."""
        return self._q[posture]

    def holds(self, posture: str) -> Hold:
        """What a posture holds."""
        return self._holds[posture]

    def start(self, mode: LegMode | None = None) -> LegPlan:
        """A robot that stands at the origin, in a mode's posture, by default the first."""
        mode = mode or LegMode(posture=next(iter(self.postures)))
        self.require(mode)
        count, _ = self.group.shape
        feet = np.column_stack([self._home[mode.posture], np.zeros(count)])
        return LegPlan(
            time=0.0,
            q_xyt=(origin := np.zeros(3)),
            reference=origin,
            twist=Follower.resting(np.zeros(3)),
            offset=Follower.resting(np.zeros(6)),
            level=np.zeros(3),
            height=self._height[mode.posture],
            ground=Follower.resting(np.zeros(1)),
            feet_P=feet,
            swing=np.full(count, -1.0),
            lifted_P=feet,
            load=np.ones(count),
            phase=0.0,
            schedule=schedule(_gait(mode), self.robot),
            posture=self.postures[mode.posture],
            hold=self._holds[mode.posture],
            request=np.zeros(3),
            accepted=np.zeros(3),
        )

    def require(self, mode: LegMode) -> None:
        """Checks a mode.

        Raises:
            KinematicsError: an unknown posture or gait, or driving on wheels that no motor turns.
        """
        if mode.posture not in self.postures:
            raise KinematicsError(f"posture = {mode.posture!r}: accepted: {', '.join(self.postures)}")
        _gait(mode)
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
        wanted = command.offset if plan.activity in ("walk", "drive") else np.zeros(6)
        plan = replace(
            plan,
            time=plan.time + dt,
            q_xyt=q_xyt,
            reference=reference,
            twist=twist,
            offset=plan.offset.follow(wanted, dt, OFFSET_TIME),
        )
        match plan.activity:
            case "walk":
                plan = self._walk(plan, dt, feedback)
            case "drive":
                plan = self._drive(plan, dt, moved, command)
            case "change":
                plan = self._change(plan, dt)
            case "halt":
                plan = self._sink(plan, dt)
        on_ground = plan.swing < 0
        ground = plan.feet_P[on_ground, 2].mean(keepdims=True) if on_ground.any() else plan.ground.value
        following = plan.ground.follow(ground, dt, GROUND_TIME)
        return plan if following is plan.ground else replace(plan, ground=following)

    def _twist_time(self, plan: LegPlan) -> float:
        """Time in which the accepted twist is taken on [s]."""
        faster = np.linalg.norm(plan.accepted) >= np.linalg.norm(plan.twist.value)
        if plan.activity != "walk":
            return START_TIME if faster else STOP_TIME
        return (START_SHARE if faster else STOP_SHARE) * plan.schedule.gait.period

    # What to do.

    def _turned_to(self, plan: LegPlan, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan with another activity, where it is time for one."""
        mode = command.mode
        if feedback.fault and plan.activity != "halt":
            return replace(plan, activity="halt", status=feedback.fault, change=None, wheeling=None)
        if plan.change is not None and plan.change.elapsed >= plan.change.stages[0].duration - 1e-9:
            plan = self._next_stage(plan, feedback.q)
        if plan.activity not in ("walk", "drive") or not plan.at_rest or plan.offset.rate.any():
            return plan
        away = self._away(plan).any()
        here = mode.posture == plan.posture.name
        if plan.activity == "drive":
            if here and mode.motion == "drive" and not (plan.wheeling and plan.wheeling.wound_up):
                return plan
            if not here:
                return self._begin_change(plan, mode, feedback)
            # Back into the posture by stepping; to drive on, with the castors behind their axes.
            back = self._begin_change(plan, replace(mode, change="stepping"), feedback)
            return self._trailing(back, command.v_xyw_B) if mode.motion == "drive" else back
        if not here and not away and not plan.offset.value.any():
            return self._begin_change(plan, mode, feedback)
        if here and mode.motion == "drive":
            return self._begin_drive(plan, feedback)
        gait = _gait(mode)
        if here and gait != plan.schedule.gait and not away:
            following = schedule(gait, self.robot)
            return replace(plan, schedule=following, phase=following.duty - LOAD_RAMP)
        return plan

    def _accepting(self, plan: LegPlan, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan with the twist that it may follow now."""
        mode, request = command.mode, command.v_xyw_B
        follows = plan.activity == mode.motion and mode.posture == plan.posture.name
        if plan.activity == "walk":
            follows &= _gait(mode) == plan.schedule.gait
        if not follows or not request.any():
            return replace(plan, accepted=np.zeros(3), request=np.zeros(3)) if plan.request.any() else plan
        if plan.activity == "drive":
            assert plan.wheeling is not None
            wound_up = plan.wheeling.wound_up or self._wound_up(plan.wheeling, feedback.q)
            ready = not wound_up and (not plan.at_rest or wheeling.aligned(plan.wheeling, request))
            plan = replace(plan, wheeling=replace(plan.wheeling, wound_up=wound_up))
            return replace(plan, accepted=request if ready else np.zeros(3), request=request, status="")
        if np.array_equal(request, plan.request):
            return plan
        share = self.reachable_share(plan.posture.name, plan.schedule, request, plan.offset.value)
        status = "" if share == 1 else f"the command is beyond the legs' reach; followed at {share:.0%}"
        return replace(plan, request=request, accepted=share * request, status=status)

    def reachable_share(self, posture: str, gait: Schedule, v_xyw_B: Array, offset: Array | None = None) -> float:
        """The largest share, up to 1, of a twist (3,) at which all feet reach where a gait puts them."""
        if self._reaches(posture, gait, v_xyw_B, offset):
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(7):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._reaches(posture, gait, middle * v_xyw_B, offset) else (low, middle)
        return low

    def _reaches(self, posture: str, gait: Schedule, v_xyw_B: Array, offset: Array | None) -> bool:
        """Whether feet reach both ends of their strides, and lift in the middle."""
        half = 0.5 * gait.duty * gait.gait.period
        home, radius = self._home[posture], self.group.wheel_radius
        for time, lift in ((-half, 0.0), (-0.5 * half, 0.0), (0.0, gait.gait.lift), (0.5 * half, 0.0), (half, 0.0)):
            x, y, yaw = odometry.integrate(np.zeros(3), -v_xyw_B, time)
            cos, sin = np.cos(yaw), np.sin(yaw)
            feet = home @ np.array([[cos, sin], [-sin, cos]]) + [x, y]
            centers = np.column_stack([feet, lift + radius - self._height[posture]])
            if offset is not None:
                still = replace(self.start(LegMode(posture=posture)), offset=Follower.resting(offset))
                centers = self.centers_B(replace(still, feet_P=np.column_stack([feet, np.full(len(feet), lift)])))
            if not self.solve(posture, centers)[1]:
                return False
        return True

    def solve(self, posture: str, centers_B: Array) -> tuple[Array, bool]:
        """Joint angles (k, n) of a posture with the feet's centres elsewhere (k, 3), and whether the legs reach."""
        q, _, missed = self.group.inverse(centers_B, self._holds[posture], iterations=25)
        return q, bool(missed.max() < REACH_TOLERANCE and not self.group.beyond_limits(q).any())

    # Walking.

    def _away(self, plan: LegPlan) -> Flags:
        """Which feet are not where the posture has them; while the body is posed, all may have rolled a little."""
        if plan.offset.value.any() or plan.offset.remaining > 0:
            return np.zeros(len(plan.load), dtype=bool)
        place = _placed(plan.q_xyt, self._home[plan.posture.name])
        return np.hypot(*(plan.feet_P[:, :2] - place).T) > HOME_TOLERANCE

    def _walk(self, plan: LegPlan, dt: float, feedback: LegFeedback) -> LegPlan:
        gait, share = plan.schedule.gait, plan.schedule.duty
        step = dt / gait.period
        away = self._away(plan)
        moving = bool(plan.twist.value.any() or plan.accepted.any())
        posture = self._settled_hold(plan, dt)
        if not moving and not away.any() and plan.at_rest:
            load = np.minimum(1.0, plan.load + step / LOAD_RAMP)
            return replace(plan, phase=share - LOAD_RAMP, load=load, hold=posture)
        local = (plan.phase + plan.schedule.phases) % 1.0
        lifts = (plan.swing < 0) & (local < share) & (local + step >= share) & (moving | away)
        on_ground = (plan.swing < 0) & ~lifts
        swing = np.where(lifts, 0.0, plan.swing)
        lifted = np.where(lifts[:, np.newaxis], plan.feet_P, plan.lifted_P)
        feet, swing = self._swung(replace(plan, swing=swing, lifted_P=lifted), dt, feedback)
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

    def _swung(self, plan: LegPlan, dt: float, feedback: LegFeedback) -> tuple[Array, Array]:
        """Feet (k, 3) and progress (k,) of the swing a moment later."""
        gait, share = plan.schedule.gait, plan.schedule.duty
        time = (1 - share) * gait.period
        if (plan.swing < 0).all():
            return plan.feet_P, plan.swing
        u = np.where(plan.swing >= 0, plan.swing + dt / time, -1.0)
        # In the middle of the next stance the foot is where the posture has it.
        ahead = np.maximum(0.0, 1 - u) * time + 0.5 * share * gait.period
        body = odometry.integrate(plan.q_xyt, plan.twist.value * ahead[:, np.newaxis], 1.0)
        target = _placed(body, self._home[plan.posture.name])
        s = quintic(u)[:, np.newaxis]
        flat = (1 - s) * plan.lifted_P[:, :2] + s * target
        height = plan.lifted_P[:, 2] + gait.lift * bump(u)
        landed = u >= 1 - 1e-9
        if feedback.loads is not None:
            touches = (feedback.loads > self._contact_load) & (u > 0.5)
            early = touches & (plan.feet_P[:, 2] > plan.lifted_P[:, 2] + EARLY)
            searches = landed & ~touches & (plan.feet_P[:, 2] > plan.lifted_P[:, 2] - SINK_DEPTH)
            height = np.where(landed, np.minimum(height, plan.feet_P[:, 2] - SINK_SPEED * dt), height)
            height = np.where(landed & touches, plan.feet_P[:, 2], height)
            flat = np.where(early[:, np.newaxis], plan.feet_P[:, :2], flat)
            height = np.where(early, plan.feet_P[:, 2], height)
            landed = early | (landed & ~searches)
        feet = np.where((u >= 0)[:, np.newaxis], np.column_stack([flat, height]), plan.feet_P)
        return feet, np.where(landed, -1.0, u)

    def _settled_hold(self, plan: LegPlan, dt: float) -> Hold:
        """What the posture holds, on its way back to its value."""
        nominal = self._holds[plan.posture.name]
        off = nominal.values - plan.hold.values
        values = plan.hold.values + np.clip(off, -HOLD_RATE * dt, HOLD_RATE * dt)
        return replace(nominal, values=values, near=plan.hold.near)

    def _sink(self, plan: LegPlan, dt: float) -> LegPlan:
        """Feet in the air go down where they are, and the robot stands."""
        feet, flying = plan.feet_P.copy(), plan.swing >= 0
        feet[flying, 2] = np.maximum(plan.lifted_P[flying, 2], feet[flying, 2] - SINK_SPEED * dt)
        swing = np.where(flying & (feet[:, 2] <= plan.lifted_P[:, 2]), -1.0, plan.swing)
        load = np.where(swing < 0, np.minimum(1.0, plan.load + dt / (LOAD_RAMP * plan.schedule.gait.period)), 0.0)
        return replace(plan, feet_P=feet, swing=swing, load=load)

    # Driving.

    def _begin_drive(self, plan: LegPlan, feedback: LegFeedback) -> LegPlan:
        frames = self.group.frames(feedback.q)
        joints = frames[range(len(frames)), self._last]
        contact = _seen_from(plan.q_xyt, plan.feet_P[:, :2])
        start = wheeling.wheeling_from(contact, self.group.headings(frames), joints[:, :2, 3], joints[:, 2, 2])
        return replace(plan, activity="drive", wheeling=start, load=np.ones(len(contact)))

    def _drive(self, plan: LegPlan, dt: float, twist: Array, command: LegCommand) -> LegPlan:
        assert plan.wheeling is not None
        steer_to = plan.twist.value if plan.twist.value.any() else command.v_xyw_B
        now = wheeling.advanced(plan.wheeling, twist, steer_to, dt)
        feet = np.column_stack([_placed(plan.q_xyt, now.contact), plan.feet_P[:, 2]])
        hold = replace(plan.hold, values=now.heading, heading=np.ones(len(feet), dtype=bool))
        return replace(plan, wheeling=now, feet_P=feet, hold=hold)

    def _wound_up(self, now: wheeling.Wheeling, q: Array) -> bool:
        """Whether a joint has turned so far while driving that the legs have to step back into their posture."""
        low, high = self.group.limits
        # A castor swings on while the robot comes to rest.
        margin = WOUND_UP + np.where(now.castor, 0.5 * STOP_TIME * np.abs(now.rate), 0.0)[:, np.newaxis]
        near = (q < low + margin) | (q > high - margin)
        return bool((near & (self._turning & self.group.present)).any())

    def _trailing(self, plan: LegPlan, v_xyw_B: Array) -> LegPlan:
        """A change back into a posture that leaves castors where they trail at a twist (3,)."""
        change = plan.change
        assert change is not None
        frames = self.group.frames(change.q_to)
        legs, joints = range(len(frames)), frames[range(len(frames)), self._last]
        start = wheeling.wheeling_from(
            frames[:, -1, :2, 3], self.group.headings(frames), joints[:, :2, 3], joints[:, 2, 2]
        )
        turn = wheeling.trailing_turn(start, v_xyw_B) * np.sign(joints[:, 2, 2])
        angle = change.q_to[legs, self._last] + turn
        q_to = change.q_to.copy()
        q_to[legs, self._last] = np.where(start.castor, np.arctan2(np.sin(angle), np.cos(angle)), angle)
        change = self._prepared(replace(change, q_to=q_to), plan)
        return replace(plan, change=change)

    # Changing the posture.

    def _begin_change(self, plan: LegPlan, mode: LegMode, feedback: LegFeedback) -> LegPlan:
        name, q = mode.posture, feedback.q
        change = changes.Change(
            posture=self.postures[name],
            stages=(),
            height=plan.height,
            q_from=q,
            q_to=self._q[name],
            contact=_seen_from(plan.q_xyt, plan.feet_P[:, :2]),
            heading=self.group.headings(self.group.frames(q)),
        )
        if mode.change == "rolling":
            stages = self._rolling(plan.posture.name, name)
        else:
            low = min(plan.height, self._height[name])
            order = schedule(_gait(mode), self.robot).phases
            groups = [np.isclose(order, phase) for phase in np.unique(order)]
            stages = changes.stepping_stages(plan.height, low, self._height[name], groups)
            change = replace(change, q_to=self._lowered(name, low))
        change = self._prepared(replace(change, stages=tuple(stages)), plan)
        return replace(
            plan, activity="change", change=change, wheeling=None, schedule=schedule(_gait(mode), self.robot)
        )

    def _prepared(self, change: changes.Change, plan: LegPlan) -> changes.Change:
        """The change with the path of the legs that step in its present stage."""
        if change.stages[0].kind != "step":
            return replace(change, steps=None)
        q_to = np.where(change.stages[0].legs[:, np.newaxis], change.q_to, change.q_from)
        steps = changes.stepping_path(self.group, change.q_from, q_to, plan.X_PB, plan.schedule.gait.lift)
        return replace(change, steps=steps)

    def _rolling(self, start: str, end: str) -> list[changes.Stage]:
        """Stages in which wheels roll from one posture to another, of which one has its feet under the hips."""
        hips = np.array([leg.hip[:2] for leg in self.robot.legs])
        under = [name for name in (start, end) if self._under_hips(name)]
        if len(under) != 1:
            raise KinematicsError(
                f"from {start} to {end} no wheel can roll: accepted: rolling between a posture with the feet under the "
                "hips and one with the feet beside them, or stepping"
            )
        inner, outer = under[0], start if under[0] == end else end
        places = [(self._home[name], self._heading[name]) for name in (outer, inner)]
        heights = (self._height[outer], self._height[inner])
        stages = changes.rolling_stages(places[0], places[1], hips, heights)
        return stages if inner == end else changes.reversed_stages(stages, heights[0])

    def _under_hips(self, posture: str) -> bool:
        away = self._home[posture] - [leg.hip[:2] for leg in self.robot.legs]
        return bool((np.hypot(*away.T) < changes.UNDER_HIP).all())

    def _lowered(self, posture: str, height: float) -> Array:
        """Joint angles (k, n) of a posture with the body at another height [m], reached on the way there."""
        q, radius = self._q[posture], self.group.wheel_radius
        for h in np.linspace(self._height[posture], height, 25)[1:]:
            centers = np.column_stack([self._home[posture], radius - h])
            q, _, _ = self.group.inverse(centers, replace(self._holds[posture], near=q), iterations=8)
        return q

    def _change(self, plan: LegPlan, dt: float) -> LegPlan:
        change = plan.change
        assert change is not None
        stage = change.stages[0]
        change = replace(change, elapsed=change.elapsed + dt)
        s = change.progress
        height = change.height + s * (stage.height - change.height)
        plan = replace(plan, height=height, change=change)
        if stage.kind == "roll":
            plan = self._rolled(plan, change)
        elif stage.kind == "step":
            plan = self._stepped(plan, change, dt)
        return plan

    def _next_stage(self, plan: LegPlan, q: Array) -> LegPlan:
        """The plan at the end of a stage of a change, or of the whole change."""
        change = plan.change
        assert change is not None
        hold = plan.hold
        if change.stages[0].kind == "roll":
            rows = self._holds[change.posture.name].rows
            hold = Hold(rows=rows, values=np.sum(rows * q, axis=1), heading=np.zeros(len(q), dtype=bool), near=q)
        if len(change.stages) > 1:
            change = replace(
                change,
                stages=change.stages[1:],
                elapsed=0.0,
                height=plan.height,
                q_from=q,
                contact=_seen_from(plan.q_xyt, plan.feet_P[:, :2]),
                heading=self.group.headings(self.group.frames(q)),
            )
            return replace(plan, change=self._prepared(change, plan), hold=hold)
        return replace(plan, change=None, hold=hold, activity="walk", posture=change.posture)

    def _stepped(self, plan: LegPlan, change: changes.Change, dt: float) -> LegPlan:
        legs, u, pose = change.stages[0].legs, change.linear, plan.X_PB
        assert change.steps is not None
        q = np.clip(change.steps(change.progress), *self.group.limits)
        centers = self.group.frames(q)[:, -1, :3, 3] @ pose[:3, :3].T + pose[:3, 3]
        centers[:, 2] -= self.group.wheel_radius
        flying = legs[:, np.newaxis]
        target = self._holds[change.posture.name]
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

    def _rolled(self, plan: LegPlan, change: changes.Change) -> LegPlan:
        s, course = change.progress, change.stages[0].course
        assert course is not None
        # What the feet were off at the start fades away on the way.
        first, last = course.at(0.0), course.at(s)
        off = change.heading - first[1]
        contact = last[0] + (1 - s) * (change.contact - first[0])
        heading = last[1] + (1 - s) * np.arctan2(np.sin(off), np.cos(off))
        feet = np.column_stack([_placed(plan.q_xyt, contact), plan.feet_P[:, 2]])
        rows, headings = np.zeros(self.group.shape), np.full(len(feet), not change.stages[0].straight)
        if change.stages[0].straight:
            steering = (range(len(feet)), self._last)
            rows[steering] = 1.0
            inner = next(name for name in (change.posture.name, plan.posture.name) if self._under_hips(name))
            begun = change.q_from[steering]
            heading = begun + s * (self._q[inner][steering] - begun)
        return replace(plan, feet_P=feet, hold=replace(plan.hold, rows=rows, values=heading, heading=headings))


def _gait(mode: LegMode) -> Gait:
    return gait_of(mode.gait) if isinstance(mode.gait, str) else mode.gait


def _placed(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of B in P, at poses (3,) or (k, 3)."""
    x, y, yaw = q_xyt[..., 0], q_xyt[..., 1], q_xyt[..., 2]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack([x + cos * points[:, 0] - sin * points[:, 1], y + sin * points[:, 0] + cos * points[:, 1]], axis=-1)


def _seen_from(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of P in B, at a pose (3,)."""
    x, y, yaw = q_xyt
    away = points - [x, y]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]])
