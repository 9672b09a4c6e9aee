"""Where body and feet go next: walking, driving on the feet's wheels, posing the body, changing the posture."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import odometry
from rollerbench.kinematics.legs import changes, wheeling
from rollerbench.kinematics.legs.gaits import Gait, duty, gait_of, phases
from rollerbench.kinematics.legs.group import Hold, LegGroup
from rollerbench.kinematics.legs.plan import LegCommand, LegFeedback, LegMode, LegPlan
from rollerbench.kinematics.legs.smooth import Follower, bump, quintic

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TWIST_TIME = 0.2
"""Time constant with which the body's twist follows the command [s]."""

OFFSET_TIME = 0.25
"""Time constant with which the body's offset follows the command [s]."""

GROUND_TIME = 0.3
"""Time constant with which the body follows the ground's height [s]."""

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
        radius = self.group.wheel_radius
        self._height = {name: float(np.mean(radius - feet[:, 2])) for name, feet in centers.items()}
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

    def start(self, mode: LegMode | None = None) -> LegPlan:
        """A robot that stands at the origin, in a mode's posture, by default the first."""
        mode = mode or LegMode(posture=next(iter(self.postures)))
        self.require(mode)
        count, _ = self.group.shape
        feet = np.column_stack([self._home[mode.posture], np.zeros(count)])
        return LegPlan(
            time=0.0,
            q_xyt=np.zeros(3),
            twist=Follower(np.zeros(3), np.zeros(3)),
            offset=Follower(np.zeros(6), np.zeros(6)),
            height=self._height[mode.posture],
            ground=Follower(np.zeros(1), np.zeros(1)),
            feet_P=feet,
            swing=np.full(count, -1.0),
            lifted_P=feet,
            load=np.ones(count),
            phase=0.0,
            gait=_gait(mode),
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

    def centers_B(self, plan: LegPlan) -> Array:
        """Centres (k, 3) of the feet's wheels in B [m]."""
        pose = plan.X_PB
        centers = plan.feet_P - pose[:3, 3]
        centers[:, 2] += self.group.wheel_radius
        return centers @ pose[:3, :3]

    def advance(self, plan: LegPlan, dt: float, command: LegCommand, feedback: LegFeedback) -> LegPlan:
        """The plan a moment dt later [s]."""
        plan = self._moved(plan, feedback)
        plan = self._turned_to(plan, command, feedback)
        plan = self._accepting(plan, command)
        twist = plan.twist.follow(plan.accepted, dt, TWIST_TIME)
        mean = 0.5 * (plan.twist.value + twist.value)
        wanted = command.offset if plan.activity in ("walk", "drive") else 0.0 * command.offset
        plan = replace(
            plan,
            time=plan.time + dt,
            q_xyt=odometry.integrate(plan.q_xyt, mean, dt),
            twist=twist,
            offset=plan.offset.follow(wanted, dt, OFFSET_TIME),
        )
        match plan.activity:
            case "walk":
                plan = self._walk(plan, dt, feedback)
            case "drive":
                plan = self._drive(plan, dt, mean, command)
            case "change":
                plan = self._change(plan, dt)
            case "halt":
                plan = self._sink(plan, dt)
        on_ground = plan.swing < 0
        ground = plan.feet_P[on_ground, 2].mean(keepdims=True) if on_ground.any() else plan.ground.value
        return replace(plan, ground=plan.ground.follow(ground, dt, GROUND_TIME))

    def _moved(self, plan: LegPlan, feedback: LegFeedback) -> LegPlan:
        on_ground = (plan.swing < 0)[:, np.newaxis]
        return replace(plan, feet_P=np.where(on_ground, plan.feet_P + feedback.roll_P, plan.feet_P))

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
            if here and mode.motion == "drive":
                return plan
            return self._begin_change(plan, mode if not here else replace(mode, change="stepping"), feedback)
        if not here and not away and not plan.offset.value.any():
            return self._begin_change(plan, mode, feedback)
        if here and mode.motion == "drive":
            return self._begin_drive(plan, feedback)
        gait = _gait(mode)
        if here and gait != plan.gait and not away:
            return replace(plan, gait=gait, phase=0.0)
        return plan

    def _accepting(self, plan: LegPlan, command: LegCommand) -> LegPlan:
        """The plan with the twist that it may follow now."""
        mode, request = command.mode, command.v_xyw_B
        follows = plan.activity == mode.motion and mode.posture == plan.posture.name
        if plan.activity == "walk":
            follows &= _gait(mode) == plan.gait
        if not follows or not request.any():
            return replace(plan, accepted=np.zeros(3), request=np.zeros(3))
        if plan.activity == "drive":
            ready = plan.wheeling is not None and (not plan.at_rest or wheeling.aligned(plan.wheeling, request))
            return replace(plan, accepted=request if ready else np.zeros(3), request=request, status="")
        if np.array_equal(request, plan.request):
            return plan
        share = self.reachable_share(plan.posture.name, plan.gait, request, plan.offset.value)
        status = "" if share == 1 else f"the command is beyond the legs' reach; followed at {share:.0%}"
        return replace(plan, request=request, accepted=share * request, status=status)

    def reachable_share(self, posture: str, gait: Gait, v_xyw_B: Array, offset: Array | None = None) -> float:
        """The largest share, up to 1, of a twist (3,) at which all feet reach where a gait puts them."""
        if self._reaches(posture, gait, v_xyw_B, offset):
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(7):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._reaches(posture, gait, middle * v_xyw_B, offset) else (low, middle)
        return low

    def _reaches(self, posture: str, gait: Gait, v_xyw_B: Array, offset: Array | None) -> bool:
        """Whether feet reach both ends of their strides, and lift in the middle."""
        half = 0.5 * duty(gait, self.robot) * gait.period
        home, radius = self._home[posture], self.group.wheel_radius
        for time, lift in ((-half, 0.0), (-0.5 * half, 0.0), (0.0, gait.lift), (0.5 * half, 0.0), (half, 0.0)):
            x, y, yaw = odometry.integrate(np.zeros(3), -v_xyw_B, time)
            cos, sin = np.cos(yaw), np.sin(yaw)
            feet = home @ np.array([[cos, sin], [-sin, cos]]) + [x, y]
            centers = np.column_stack([feet, lift + radius - self._height[posture]])
            if offset is not None:
                still = replace(self.start(LegMode(posture=posture)), offset=Follower(offset, np.zeros(6)))
                centers = self.centers_B(replace(still, feet_P=np.column_stack([feet, np.full(len(feet), lift)])))
            if not self.solve(posture, centers)[1]:
                return False
        return True

    def solve(self, posture: str, centers_B: Array) -> tuple[Array, bool]:
        """Joint angles (k, n) of a posture with the feet's centres elsewhere (k, 3), and whether the legs reach."""
        q, _, missed = self.group.inverse(centers_B, self._holds[posture], self._q[posture], iterations=25)
        return q, bool(missed.max() < REACH_TOLERANCE and not self.group.beyond_limits(q).any())

    # Walking.

    def _away(self, plan: LegPlan) -> Flags:
        """Which feet are not where the posture has them."""
        place = _placed(plan.q_xyt, self._home[plan.posture.name])
        return np.hypot(*(plan.feet_P[:, :2] - place).T) > HOME_TOLERANCE

    def _walk(self, plan: LegPlan, dt: float, feedback: LegFeedback) -> LegPlan:
        gait, share = plan.gait, duty(plan.gait, self.robot)
        step = dt / gait.period
        away = self._away(plan)
        moving = bool(plan.twist.value.any() or plan.accepted.any())
        posture = self._settled_hold(plan, dt)
        if not moving and not away.any() and plan.at_rest:
            load = np.minimum(1.0, plan.load + step / LOAD_RAMP)
            return replace(plan, phase=share - LOAD_RAMP, load=load, hold=posture)
        local = (plan.phase + phases(gait, self.robot)) % 1.0
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
        share, period = duty(plan.gait, self.robot), plan.gait.period
        time = (1 - share) * period
        u = np.where(plan.swing >= 0, plan.swing + dt / time, -1.0)
        # In the middle of the next stance the foot is where the posture has it.
        ahead = np.maximum(0.0, 1 - u) * time + 0.5 * share * period
        body = odometry.integrate(plan.q_xyt, plan.twist.value * ahead[:, np.newaxis], 1.0)
        target = _placed(body, self._home[plan.posture.name])
        s = quintic(u)[:, np.newaxis]
        flat = (1 - s) * plan.lifted_P[:, :2] + s * target
        height = plan.lifted_P[:, 2] + plan.gait.lift * bump(u)
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
        if plan.hold is nominal:
            return nominal
        off = nominal.values - plan.hold.values
        if plan.hold.heading.any() or np.abs(off).max() < 1e-9:
            return nominal
        return replace(nominal, values=plan.hold.values + np.clip(off, -HOLD_RATE * dt, HOLD_RATE * dt))

    def _sink(self, plan: LegPlan, dt: float) -> LegPlan:
        """Feet in the air go down where they are, and the robot stands."""
        feet, flying = plan.feet_P.copy(), plan.swing >= 0
        feet[flying, 2] = np.maximum(plan.lifted_P[flying, 2], feet[flying, 2] - SINK_SPEED * dt)
        swing = np.where(flying & (feet[:, 2] <= plan.lifted_P[:, 2]), -1.0, plan.swing)
        load = np.where(swing < 0, np.minimum(1.0, plan.load + dt / (LOAD_RAMP * plan.gait.period)), 0.0)
        return replace(plan, feet_P=feet, swing=swing, load=load)

    # Driving.

    def _begin_drive(self, plan: LegPlan, feedback: LegFeedback) -> LegPlan:
        frames = self.group.frames(feedback.q)
        last = np.array([len(leg.links) - 1 for leg in self.robot.legs])
        joints = frames[range(len(last)), last]
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

    # Changing the posture.

    def _begin_change(self, plan: LegPlan, mode: LegMode, feedback: LegFeedback) -> LegPlan:
        name, q = mode.posture, feedback.q
        frames = self.group.frames(q)
        contact = _seen_from(plan.q_xyt, plan.feet_P[:, :2])
        end_height = self._height[name]
        change = changes.Change(
            posture=self.postures[name],
            stages=(),
            height=plan.height,
            q_from=q,
            q_to=self._q[name],
            paths=np.repeat(contact[:, np.newaxis], 4, axis=1),
            headings=self.group.headings(frames),
        )
        if mode.change == "rolling":
            turn = self._turn(q, self._q[name])
            ends = (change.headings, self.group.headings(self.group.frames(self._q[name])))
            paths = changes.rolling_paths(contact, self._home[name], ends, turn)
            every = np.ones(len(q), dtype=bool)
            stage = changes.Stage(kind="roll", duration=changes.rolling_time(paths), height=end_height, legs=every)
            change = replace(change, stages=(stage,), paths=paths)
        else:
            low = min(plan.height, end_height)
            order = phases(_gait(mode), self.robot)
            groups = [np.isclose(order, phase) for phase in np.unique(order)]
            stages = changes.stepping_stages(plan.height, low, end_height, groups)
            change = replace(change, stages=tuple(stages), q_to=self._lowered(name, low))
        return replace(plan, activity="change", change=change, wheeling=None, gait=_gait(mode))

    def _turn(self, q: Array, to: Array) -> Array:
        """By how much wheels turn (k,) as their joints go evenly from q to other angles (k, n) [rad]."""
        headings = [self.group.headings(self.group.frames(q + s * (to - q))) for s in np.linspace(0, 1, 61)]
        turned: Array = np.unwrap(headings, axis=0)
        return turned[-1] - turned[0]

    def _lowered(self, posture: str, height: float) -> Array:
        """Joint angles (k, n) of a posture with the body at another height [m], reached on the way there."""
        q, radius = self._q[posture], self.group.wheel_radius
        for h in np.linspace(self._height[posture], height, 25)[1:]:
            centers = np.column_stack([self._home[posture], radius - h])
            q, _, _ = self.group.inverse(centers, self._holds[posture], q, iterations=8)
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
            hold = Hold(rows=rows, values=np.sum(rows * q, axis=1), heading=np.zeros(len(q), dtype=bool))
        change = change.next_stage(q, plan.height)
        if change.stages:
            return replace(plan, change=change, hold=hold)
        return replace(plan, change=None, hold=hold, activity="walk", posture=change.posture)

    def _stepped(self, plan: LegPlan, change: changes.Change, dt: float) -> LegPlan:
        legs, u = change.stages[0].legs, change.linear
        q = change.q_from + change.progress * (change.q_to - change.q_from)
        pose = plan.X_PB
        centers = self.group.frames(q)[:, -1, :3, 3] @ pose[:3, :3].T + pose[:3, 3]
        centers[:, 2] += plan.gait.lift * bump(u) - self.group.wheel_radius
        flying = legs[:, np.newaxis]
        target = self._holds[change.posture.name]
        hold = Hold(
            rows=np.where(flying, target.rows, plan.hold.rows),
            values=np.where(legs, np.sum(target.rows * q, axis=1), plan.hold.values),
            heading=plan.hold.heading & ~legs,
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
        u = change.progress
        points, _ = changes.curve(change.paths, np.array([u]))
        heading = change.headings + changes.path_turn(change.paths, u)
        feet = np.column_stack([_placed(plan.q_xyt, points[:, 0]), plan.feet_P[:, 2]])
        hold = replace(plan.hold, values=heading, heading=np.ones(len(feet), dtype=bool))
        return replace(plan, feet_P=feet, hold=hold)


def _gait(mode: LegMode) -> Gait:
    return gait_of(mode.gait) if isinstance(mode.gait, str) else mode.gait


def _placed(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of B in P, at poses (3,) or (k, 3)."""
    x, y, yaw = np.moveaxis(q_xyt, -1, 0)
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack([x + cos * points[:, 0] - sin * points[:, 1], y + sin * points[:, 0] + cos * points[:, 1]], axis=-1)


def _seen_from(q_xyt: Array, points: Array) -> Array:
    """Points (k, 2) of P in B, at a pose (3,)."""
    x, y, yaw = q_xyt
    away = points - [x, y]
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([cos * away[:, 0] + sin * away[:, 1], cos * away[:, 1] - sin * away[:, 0]])
