"""Robots on legs as Drake Systems: gait planner, leg inverse kinematics, servo, stance odometry, closed body pose.

Planner and odometry are Python systems that work once in a period of control; between periods only Drake's C++ runs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from rollerbench.description import Robot, load_robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.gaits.plan import LegCommand, LegFeedback, LegMode, LegPlan
from rollerbench.kinematics.gaits.planner import LegPlanner
from rollerbench.kinematics.gaits.tracker import Tracked, held, track
from rollerbench.kinematics.given import positive_time
from rollerbench.kinematics.legs.group import LegGroup

Array = NDArray[np.float64]

PERIOD = 0.02
"""Period of control [s]."""


class GaitPlanner(LeafSystem):
    """Plans body and feet from a twist command: walking, driving on the feet's wheels, changing the posture.

    Input ports:
        v_xyw_B (3): body twist [m/s, m/s, rad/s]; 0 if not connected.
        body_offset (6): pose of the body from where its posture has it: x, y, z [m], roll, pitch, yaw [rad]; 0 if not
            connected.
        mode: a `LegMode`; the one it was made with if not connected.
        correction (3): twist that brings the robot back to its reference while it moves; 0 if not connected.
        level (3): height [m], roll and pitch [rad] by which the legs shall overdo the pose; 0 if not connected.
        tracked: what the legs do, from `LegTracker`; as planned if not connected.
        foot_loads (n_legs): measured loads of the feet [N], with which it feels its way over uneven ground; if not
            connected the ground is level.
        fault (1): the number of a leg that does not follow, from 1, halts the robot; 0 if not connected.
    Output ports:
        plan: the `LegPlan` for the end of the present period.
        foot_positions (3 n_legs): centres of the feet's wheels in B then [m].
        q_xyt (3): where the accepted twists alone lead to: the reference [m, m, rad].
        v_xyw_B (3): the accepted twist, smoothed [m/s, m/s, rad/s].
        desired (6): x, y, z [m], roll, pitch, yaw [rad] of the body on its reference, offset included.
        stance (n_legs): 1 for feet that shall stand, 0 for those in the air.
    """

    def __init__(
        self, robot: Robot | str | Path | Mapping[str, Any], period: float = PERIOD, mode: LegMode | None = None
    ):
        """Makes the system for a robot.

        Args:
            robot: The robot.
            period: Period of control [s].
            mode: How it follows commands; by default in its first posture, walking with the tripod gait.

        Raises:
            KinematicsError: the robot has no legs, or not this mode.
        """
        super().__init__()
        positive_time("period", period)
        self.planner, self._period = LegPlanner(load_robot(robot)), period
        self._mode = mode or LegMode(posture=self.planner.robot.standing[0].name)
        start = self.planner.start(self._mode)
        count = len(start.load)
        self._inputs = {
            "v_xyw_B": self.DeclareVectorInputPort("v_xyw_B", 3),
            "body_offset": self.DeclareVectorInputPort("body_offset", 6),
            "mode": self.DeclareAbstractInputPort("mode", Value(self._mode)),
            "correction": self.DeclareVectorInputPort("correction", 3),
            "level": self.DeclareVectorInputPort("level", 3),
            "tracked": self.DeclareAbstractInputPort("tracked", Value(_standing(self.planner, start))),
            "foot_loads": self.DeclareVectorInputPort("foot_loads", count),
            "fault": self.DeclareVectorInputPort("fault", 1),
        }
        index = self.DeclareAbstractState(Value(start))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        own = {self.abstract_state_ticket(index)}
        self.DeclareStateOutputPort("plan", index)
        self.DeclareVectorOutputPort("foot_positions", 3 * count, self._calc_feet, own)
        self.DeclareVectorOutputPort("q_xyt", 3, lambda c, out: out.SetFromVector(self.plan(c).reference), own)
        self.DeclareVectorOutputPort("desired", 6, lambda c, out: out.SetFromVector(self.plan(c).desired), own)
        self.DeclareVectorOutputPort("stance", count, lambda c, out: out.SetFromVector(self.plan(c).swing < 0), own)
        self.DeclareVectorOutputPort("v_xyw_B", 3, lambda c, out: out.SetFromVector(self.plan(c).twist.value), own)

    def plan(self, context: Context) -> LegPlan:
        """The plan in a context of this system."""
        return context.get_abstract_state(0).get_value()

    def _eval(self, context: Context, name: str, default: Any) -> Any:
        port = self._inputs[name]
        return port.Eval(context) if port.HasValue(context) else default

    def _vector(self, context: Context, name: str) -> Array:
        """The value of a port; 0 where it is not connected, or not finite: then the robot stops."""
        port = self._inputs[name]
        if not port.HasValue(context):
            return np.zeros(port.size())
        value = np.array(port.Eval(context))
        return value if np.isfinite(value).all() else np.zeros(port.size())

    def _update(self, context: Context, state: State) -> None:
        plan = self.plan(context)
        command = LegCommand(
            v_xyw_B=self._vector(context, "v_xyw_B"),
            offset=self._vector(context, "body_offset"),
            mode=self._eval(context, "mode", self._mode),
            correction=self._vector(context, "correction"),
            level=self._vector(context, "level"),
        )
        tracked = self._eval(context, "tracked", None) or _planned(self.planner, plan)
        fault = tracked.fault
        try:
            self.planner.require(command.mode)
        except KinematicsError as error:
            command, fault = replace(command, mode=self._mode), fault or str(error)
        q, _ = tracked.next(self._period)
        number = int(self._eval(context, "fault", np.zeros(1))[0])
        if number:
            legs = self.planner.robot.legs
            fault = (
                f"leg {legs[number - 1].name} does not follow" if 0 < number <= len(legs) else "a leg does not follow"
            )
        feedback = LegFeedback(
            q=q,
            q_rate=tracked.q_rate,
            roll_P=tracked.roll_P,
            loads=self._eval(context, "foot_loads", None),
            fault=fault,
            held=bool(tracked.fault),
        )
        try:
            following = self.planner.advance(plan, self._period, command, feedback)
        except KinematicsError as error:
            # Such as wheels that shall roll between postures where none can.
            following = self.planner.advance(plan, self._period, command, replace(feedback, fault=str(error)))
        state.get_mutable_abstract_state(0).set_value(following)

    def _calc_feet(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.planner.centers_B(self.plan(context)).ravel())


class LegInverseKinematics(LeafSystem):
    """Joint angles that put the feet where they shall be, in a posture.

    It follows the branch on which it is, from the posture on; out of reach the legs stop, and say so.

    Input ports:
        foot_positions (3 n_legs): centres of the feet's wheels in B [m].
    Output ports:
        joint_angles (n): leg by leg, each leg's joints and then 0 for its wheel [rad].
        out_of_reach (1): 0, or how far the worst foot misses its place [m].
    """

    def __init__(
        self, robot: Robot | str | Path | Mapping[str, Any], posture: str | None = None, period: float = PERIOD
    ) -> None:
        """Makes the system for a robot.

        Args:
            robot: The robot.
            posture: The posture that the legs keep; by default the first.
            period: Period in which it remembers where the legs are [s].

        Raises:
            KinematicsError: the robot has no legs, or not this posture.
        """
        super().__init__()
        positive_time("period", period)
        planner = LegPlanner(load_robot(robot))
        mode = LegMode(posture=posture or planner.robot.standing[0].name)
        planner.require(mode)
        self._group, self._hold = planner.group, planner.stances.holds(mode.posture)
        self._feet = self.DeclareVectorInputPort("foot_positions", 3 * self._group.shape[0])
        q = self._hold.near
        index = self.DeclareDiscreteState(q.ravel())
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        sources = {self._feet.ticket(), self.discrete_state_ticket(index)}
        size = len(self._group.to_vector(q, np.zeros(len(q))))
        self.DeclareVectorOutputPort("joint_angles", size, self._calc_angles, sources)
        self.DeclareVectorOutputPort("out_of_reach", 1, self._calc_miss, sources)

    def _solved(self, context: Context) -> tuple[Array, Array]:
        q = context.get_discrete_state(0).value().reshape(self._group.shape)
        targets = np.asarray(self._feet.Eval(context)).reshape(-1, 3)
        solved, _, missed = self._group.inverse(targets, replace(self._hold, near=q), iterations=20)
        missed = np.nan_to_num(missed, nan=np.inf)
        bad = (missed > 1e-3) | self._group.beyond_limits(solved).any(axis=1)
        return np.where(bad[:, np.newaxis], q, solved), np.where(bad, np.maximum(missed, 1e-9), 0.0)

    def _update(self, context: Context, state: Any) -> None:
        state.set_value(0, self._solved(context)[0].ravel())

    def _calc_angles(self, context: Context, output: BasicVector) -> None:
        q, missed = self._solved(context)
        output.SetFromVector(self._group.to_vector(q, np.zeros(len(missed))))

    def _calc_miss(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._solved(context)[1].max()])


@dataclass(frozen=True, slots=True, eq=False)
class _Reached:
    """Where the legs are, and the plan that brought them there."""

    q: Array
    wheel: Array
    plan: LegPlan
    pose: Array
    centers: Array

    def __deepcopy__(self, memo: dict[int, Any]) -> "_Reached":
        return self


class LegTracker(LeafSystem):
    """Joint and wheel speeds that carry out a plan, and the torques that bear the robot meanwhile.

    The wheels of standing feet roll as their legs lean and move; the others rest.

    Input ports:
        plan: the `LegPlan` for the end of the present period, from `GaitPlanner`.
    Output ports:
        tracked: the `Tracked` of the present period.
        joint_rates (n): mean speeds until the end of the period, leg by leg, each leg's joints and then its wheel
            [rad/s].
        joint_efforts (n): torques against gravity and for the load of the feet, in the same order [N m].
    """

    def __init__(
        self,
        robot: Robot | str | Path | Mapping[str, Any],
        period: float = PERIOD,
        mode: LegMode | None = None,
        up_W: ArrayLike = (0.0, 0.0, 1.0),
    ):
        """Makes the system for a robot; arguments as of `GaitPlanner`, and the unit vector (3,) against gravity."""
        super().__init__()
        positive_time("period", period)
        self._planner, self._period = LegPlanner(load_robot(robot)), period
        start = self._planner.start(mode)
        self._group: LegGroup = self._planner.group
        self._start, self._up = start, np.asarray(up_W, dtype=np.float64)
        self._plan = self.DeclareAbstractInputPort("plan", Value(start))
        first = _standing(self._planner, start)
        index = self.DeclareAbstractState(Value(self._reached(first.q, first.wheel, start)))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        sources = {self._plan.ticket(), self.abstract_state_ticket(index)}
        size = len(self._group.to_vector(first.q, first.wheel))
        self._tracked = self.DeclareAbstractOutputPort("tracked", lambda: Value(first), self._calc_tracked, sources)
        self.DeclareVectorOutputPort("joint_rates", size, self._calc_rates, sources)
        self.DeclareVectorOutputPort("joint_efforts", size, self._calc_efforts, sources)

    @property
    def angles(self) -> Array:
        """Angles (n) at the start, in the order of the ports [rad]."""
        start = self._start
        return self._group.to_vector(self._planner.stances.joints(start.posture.name), np.zeros(len(start.load)))

    def _reached(self, q: Array, wheel: Array, plan: LegPlan) -> _Reached:
        pose = plan.X_PB
        return _Reached(q, wheel, plan, pose, self._planner.centers_B(plan, pose))

    def _calc_tracked(self, context: Context, output: Any) -> None:
        plan: LegPlan = self._plan.Eval(context)
        reached: _Reached = context.get_abstract_state(0).get_value()
        q, wheel, before = reached.q, reached.wheel, reached.plan
        if plan is before:
            output.set_value(held(q, wheel))
            return
        following = self._reached(q, wheel, plan)
        poses, places = (reached.pose, following.pose), (reached.centers, following.centers)
        output.set_value(track(self._group, q, wheel, poses, places, plan.hold, plan.swing < 0, self._period))

    def _update(self, context: Context, state: State) -> None:
        tracked: Tracked = self._tracked.Eval(context)
        q, wheel = tracked.next(self._period)
        state.get_mutable_abstract_state(0).set_value(self._reached(q, wheel, self._plan.Eval(context)))

    def _calc_rates(self, context: Context, output: BasicVector) -> None:
        tracked: Tracked = self._tracked.Eval(context)
        output.SetFromVector(self._group.to_vector(tracked.q_rate, tracked.wheel_rate))

    def _calc_efforts(self, context: Context, output: BasicVector) -> None:
        plan: LegPlan = self._plan.Eval(context)
        tracked: Tracked = self._tracked.Eval(context)
        pose, (q, _) = plan.X_PB, tracked.next(self._period)
        frames = self._group.frames(q) if tracked.frames is None else tracked.frames
        normal_B, up_B = pose[2, :3], pose[:3, :3].T @ self._up
        ahead = np.array([*plan.twist.rate[:2], 0.0])
        forces = self._group.shared_load(frames, plan.load, GRAVITY * up_B + ahead)
        joints, wheels = self._group.contact_efforts(frames, forces, normal_B)
        output.SetFromVector(self._group.to_vector(joints + self._group.gravity_efforts(frames, up_B), wheels))


def _standing(planner: LegPlanner, plan: LegPlan) -> Tracked:
    return held(planner.stances.joints(plan.posture.name), np.zeros(len(plan.load)))


def _planned(planner: LegPlanner, plan: LegPlan) -> Tracked:
    """Legs that are where the plan has them."""
    q, _, _ = planner.group.inverse(planner.centers_B(plan), plan.hold, iterations=10)
    return held(q, np.zeros(len(q)))
