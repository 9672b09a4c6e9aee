"""Kinematics of bases with steered wheels as Drake Systems, at a period of control."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from rollerbench.errors import KinematicsError
from rollerbench.kinematics import odometry
from rollerbench.kinematics.given import AnyRobot, kinematics_of, planar_pose, positive_time
from rollerbench.kinematics.steering import steering_step


class SteeringKinematics(LeafSystem):
    """Wheel speeds and steering angles that follow a twist, once a period (`steering_step`).

    Input ports:
        v_xyw_B (3): body twist [m/s, m/s, rad/s].
    Output ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s].
        steering (2 n_steered): angles of the steered wheels from heading_deg, then their rates [rad, rad/s].

    Both are those of the last update. Like the wheels of the robot, it remembers where it has steered.
    """

    def __init__(
        self,
        robot: AnyRobot,
        period: float,
        start: ArrayLike | None = None,
    ) -> None:
        """Makes the system.

        Args:
            robot: The robot, or its kinematics.
            period: Period of the updates [s].
            start: Angles (n_steered,) at the start [rad]; by default 0.

        Raises:
            KinematicsError: the period is not positive, the robot has no steered wheels, or start is malformed.
        """
        super().__init__()
        self._kinematics = kinematics_of(robot)
        self._period = positive_time("period", period)
        steered, driven = self._kinematics.robot.steered_wheels, self._kinematics.robot.driven_wheels
        if not steered:
            raise KinematicsError(f"{self._kinematics.robot.name} has no steered wheels; accepted: InverseKinematics")
        angles = np.zeros(len(steered)) if start is None else np.asarray(start, dtype=np.float64)
        if angles.shape != (len(steered),) or not np.isfinite(angles).all():
            raise KinematicsError(f"start = {start!r}: accepted: {len(steered)} finite angles")
        self._twist = self.DeclareVectorInputPort("v_xyw_B", 3)
        speeds = self.DeclareDiscreteState(np.zeros(len(driven)))
        steering = self.DeclareDiscreteState(np.concatenate([angles, np.zeros(len(steered))]))
        self.DeclareStateOutputPort("wheel_speeds", speeds)
        self.DeclareStateOutputPort("steering", steering)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        before = context.get_discrete_state(1).value()
        step = steering_step(self._kinematics, self._twist.Eval(context), before[: len(before) // 2], self._period)
        state.get_mutable_vector(0).SetFromVector(step.wheel_speeds)
        state.get_mutable_vector(1).SetFromVector(np.concatenate([step.angles, step.rates]))
        return EventStatus.Succeeded()


class SteeredOdometry(LeafSystem):
    """Pose from measured wheel speeds and steering angles (`WheelKinematics.forward_at`), once a period.

    Input ports:
        wheel_speeds (n_driven): in the order of robot.yaml [rad/s].
        steering_angles (n_steered): of the steered wheels from heading_deg [rad].
    Output ports:
        q_xyt (3): pose of B in W; the yaw counts full turns [m, m, rad].
    """

    def __init__(self, robot: AnyRobot, period: float) -> None:
        """Makes the system; the pose starts at the origin.

        Args:
            robot: The robot, or its kinematics.
            period: Period of the updates [s].

        Raises:
            KinematicsError: the period is not positive.
        """
        super().__init__()
        self._kinematics = kinematics_of(robot)
        self._period = positive_time("period", period)
        wheels = self._kinematics.robot.wheels
        self._steered: Sequence[int] = [index for index, wheel in enumerate(wheels) if wheel.steered]
        self._speeds = self.DeclareVectorInputPort("wheel_speeds", len(self._kinematics.robot.driven_wheels))
        self._angles = self.DeclareVectorInputPort("steering_angles", len(self._steered))
        self.DeclareStateOutputPort("q_xyt", self.DeclareDiscreteState(3))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def set_pose(self, context: Context, q_xyt: ArrayLike) -> None:
        """Sets the pose (3,) in a context of this system.

        Raises:
            KinematicsError: q_xyt is not finite or not of shape (3,).
        """
        context.SetDiscreteState(planar_pose("q_xyt", q_xyt))

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        swivel = np.zeros(len(self._kinematics.robot.wheels))
        swivel[self._steered] = self._angles.Eval(context)
        twist = self._kinematics.forward_at(self._speeds.Eval(context), swivel)
        pose = odometry.integrate(context.get_discrete_state(0).value(), twist, self._period)
        state.get_mutable_vector(0).SetFromVector(pose)
        return EventStatus.Succeeded()
