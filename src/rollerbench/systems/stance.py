"""Where a robot on legs is, by its own joints; and what brings it back to where it should be. As Drake Systems."""

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem, State
from scipy.spatial.transform import Rotation

from rollerbench.description import Robot
from rollerbench.kinematics.gaits import LegPlan, LegPlanner
from rollerbench.kinematics.legs.stance import StanceEstimate, stance_next, stance_start
from rollerbench.kinematics.odometry import rotate
from rollerbench.systems.legs import PERIOD

Array = NDArray[np.float64]

LARGEST_CORRECTION = np.array([0.05, 0.05, 0.2])
"""Fastest correction [m/s, m/s, rad/s]."""

LARGEST_LEVEL = np.array([0.02, 0.1, 0.1])
"""Largest correction of height, roll and pitch [m, rad, rad]."""

LEG_LAG = 0.2
"""A joint that lags by more does not follow [rad]."""


class StanceOdometry(LeafSystem):
    """Pose of the body from the joints of the legs that stand (`rollerbench.legs.stance_next`).

    Input ports:
        joint_state (2 n): measured angles, then rates, leg by leg, each leg's joints and then its wheel
            (`RobotModel.leg_state_matrix`) [rad, rad/s].
        plan: the `LegPlan`, which tells the legs that stand.
    Output ports:
        pose (6): x, y, z [m], roll, pitch, yaw of B in W [rad].
        q_xyt (3): pose of B in W, the yaw in (-pi, pi] [m, m, rad].
        slipped (n_legs): 1 for feet that were found to have slipped.
    """

    def __init__(self, robot: Robot, planner: LegPlanner, plan: LegPlan, period: float = PERIOD) -> None:
        """Makes the system for a robot that stands as a plan has it."""
        super().__init__()
        self._group, self._period = planner.group, period
        q = planner.stances.joints(plan.posture.name)
        start = stance_start(self._group, q, plan.X_PB)
        self._plan = self.DeclareAbstractInputPort("plan", Value(plan))
        size = len(self._group.to_vector(q, np.zeros(len(q))))
        self._state = self.DeclareVectorInputPort("joint_state", 2 * size)
        index = self.DeclareAbstractState(Value(start))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        own = {self.abstract_state_ticket(index)}
        self.DeclareVectorOutputPort("pose", 6, self._calc_pose, own)
        self.DeclareVectorOutputPort("q_xyt", 3, self._calc_planar, own)
        self.DeclareVectorOutputPort("slipped", len(q), self._calc_slipped, own)

    def estimate(self, context: Context) -> StanceEstimate:
        """The estimate in a context of this system."""
        return context.get_abstract_state(0).get_value()

    def _update(self, context: Context, state: State) -> None:
        if context.get_time() == 0.0:
            return
        angles, rates = np.split(np.asarray(self._state.Eval(context)), 2)
        (q, _), (q_rate, wheel) = self._group.from_vector(angles), self._group.from_vector(rates)
        plan: LegPlan = self._plan.Eval(context)
        stands, ground = plan.swing < 0, plan.feet_P[:, 2]
        estimate = self.estimate(context)
        following = stance_next(self._group, estimate, (q, q_rate), wheel, stands, self._period, ground)
        state.get_mutable_abstract_state(0).set_value(following)

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(_pose_vector(self.estimate(context).X_WB))

    def _calc_planar(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(_pose_vector(self.estimate(context).X_WB)[[0, 1, 5]])

    def _calc_slipped(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.estimate(context).slipped.astype(float))


class BodyPoseController(LeafSystem):
    """Brings the body back to its reference: in the plane by a twist, in height and inclination by its feet.

    correction = k e, with the planar error e in B; level' = k (desired - measured). Both are bounded.

    Input ports:
        desired (6): x, y, z [m], roll, pitch, yaw [rad] of the body.
        pose (6): the same as measured, from `StanceOdometry` or elsewhere.
    Output ports:
        correction (3): twist for `GaitPlanner` [m/s, m/s, rad/s].
        level (3): height [m], roll and pitch [rad] to add.
    """

    def __init__(self, period: float = PERIOD, gain: float = 1.0) -> None:
        """Makes the system.

        Args:
            period: Period of control [s].
            gain: k [1/s].
        """
        super().__init__()
        self._period, self._gain = period, gain
        self._desired = self.DeclareVectorInputPort("desired", 6)
        self._pose = self.DeclareVectorInputPort("pose", 6)
        index = self.DeclareDiscreteState(3)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        inputs = {self._desired.ticket(), self._pose.ticket()}
        self.DeclareVectorOutputPort("correction", 3, self._calc_correction, inputs)
        self.DeclareVectorOutputPort(
            "level",
            3,
            lambda c, out: out.SetFromVector(c.get_discrete_state(0).value()),
            {self.discrete_state_ticket(index)},
        )

    def _update(self, context: Context, state: DiscreteValues) -> None:
        error = (np.asarray(self._desired.Eval(context)) - self._pose.Eval(context))[2:5]
        level = context.get_discrete_state(0).value() + self._gain * self._period * error
        state.set_value(0, np.clip(level, -LARGEST_LEVEL, LARGEST_LEVEL))

    def _calc_correction(self, context: Context, output: BasicVector) -> None:
        pose = np.asarray(self._pose.Eval(context))
        error = (np.asarray(self._desired.Eval(context)) - pose)[[0, 1, 5]]
        turn = np.arctan2(np.sin(error[2]), np.cos(error[2]))
        twist = self._gain * np.array([*rotate(-pose[5], error[:2]), turn])
        output.SetFromVector(np.clip(twist, -LARGEST_CORRECTION, LARGEST_CORRECTION))


class LegWatch(LeafSystem):
    """Notices a leg that does not follow.

    Input ports:
        lag (n): desired minus true angles, from `LegServo` [rad].
    Output ports:
        fault (1): 0, or the number of the leg of which a joint lags too far behind, from 1.
    """

    def __init__(self, planner: LegPlanner) -> None:
        """Makes the system for a planner's robot."""
        super().__init__()
        group = planner.group
        # Wheels may slip.
        joints = group.to_vector(np.ones(group.shape), np.zeros(group.shape[0]))
        numbers = group.to_vector(*_numbers(group.shape))
        self._lag = self.DeclareVectorInputPort("lag", len(joints))

        def calc(context: Context, output: BasicVector) -> None:
            lag = np.abs(np.asarray(self._lag.Eval(context))) * joints
            worst = int(np.argmax(lag))
            output.SetFromVector([numbers[worst] if not lag[worst] <= LEG_LAG else 0.0])

        self.DeclareVectorOutputPort("fault", 1, calc, {self._lag.ticket()})


def _numbers(shape: tuple[int, int]) -> tuple[Array, Array]:
    """For each joint and wheel the number of its leg."""
    numbers = np.arange(1.0, shape[0] + 1.0)
    return np.repeat(numbers[:, np.newaxis], shape[1], axis=1), numbers


def _pose_vector(X_WB: Array) -> Array:
    return np.concatenate([X_WB[:3, 3], Rotation.from_matrix(X_WB[:3, :3]).as_euler("xyz")])
