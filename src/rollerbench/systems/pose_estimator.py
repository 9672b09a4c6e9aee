"""The pose filter as a Drake System."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from rollerbench.kinematics.estimation import PoseEstimate, PoseFilter
from rollerbench.kinematics.given import AnyRobot
from rollerbench.kinematics.uncertainty import GyroNoise, OdometryNoise

OUTPUTS: dict[str, tuple[int, Any]] = {
    "q_xyt": (3, lambda estimate: estimate.q_xyt),
    "covariance": (9, lambda estimate: estimate.covariance[:3, :3].ravel()),
    "gyro_bias": (1, lambda estimate: estimate.gyro_bias),
    "v_xyw_B": (3, lambda estimate: estimate.v_xyw_B),
    "fix_counts": (4, lambda estimate: np.array(estimate.fixes, dtype=np.float64)),
}
"""Size of each output port, and where its value is in the estimate."""


class PoseEstimator(LeafSystem):
    """Pose from wheel speeds, a gyroscope and late pose fixes: `estimation.PoseFilter`, once in a period of control.

    As with `Odometry`, what the inputs show at an update holds until the next, and the outputs tell of the next. A fix
    is taken when its stamp changes, at the state of its stamp, which must lie within largest_latency before the update.

    Input ports:
        wheel_speeds (n_driven): measured, in the order of robot.yaml [rad/s].
        yaw_rate (1): measured by the gyroscope [rad/s].
        pose_fix (4): stamp, x, y, yaw of B in W [s, m, m, rad]; a stamp of NaN tells that there is none yet. May be
            left open.
    Output ports:
        q_xyt (3): pose of B in W; the yaw counts full turns [m, m, rad].
        covariance (9): of x, y, yaw in W, row by row [m, m, rad]^2.
        gyro_bias (1): of the gyroscope [rad/s].
        v_xyw_B (3): body twist of the last step, wheels and gyroscope weighed [m/s, m/s, rad/s].
        fix_counts (4): fixes that lay in the history, those that came too late for it, those with a stamp in the
            future, and, of the first, those beyond the gate [-]. Only the first, without the last, were used.
    """

    def __init__(
        self,
        robot: AnyRobot,
        time_step: float,
        *,
        wheels: OdometryNoise,
        gyro: GyroNoise,
        fix_deviation: ArrayLike,
        largest_latency: float = 0.5,
        gate: float | None = None,
    ) -> None:
        """Makes the system; the pose starts at the origin, without doubt (see `set_pose`).

        Args:
            robot: The robot, or its kinematics.
            time_step: Period of the updates [s].
            wheels: Noise of the wheel speeds; see there for wrong radii.
            gyro: Noise of the gyroscope.
            fix_deviation: Standard deviations (3,) of a fix in W [m, m, rad].
            largest_latency: Age of the oldest fix that is still used [s].
            gate: Largest normalised innovation squared of a fix that is used; see `PoseFilter`.

        Raises:
            KinematicsError: an argument is not accepted.
        """
        super().__init__()
        self.filter = PoseFilter(
            robot,
            time_step,
            wheels=wheels,
            gyro=gyro,
            fix_deviation=fix_deviation,
            largest_latency=largest_latency,
            gate=gate,
        )
        n_driven = len(self.filter.kinematics.drive_matrix)
        self._wheel_speeds = self.DeclareVectorInputPort("wheel_speeds", n_driven)
        self._yaw_rate = self.DeclareVectorInputPort("yaw_rate", 1)
        self._pose_fix = self.DeclareVectorInputPort("pose_fix", 4)
        own = {self.abstract_state_ticket(self.DeclareAbstractState(Value(self.filter.start())))}
        self.DeclarePeriodicUnrestrictedUpdateEvent(time_step, 0.0, self._update)
        for name, (size, values) in OUTPUTS.items():
            self.DeclareVectorOutputPort(
                name, size, lambda context, out, values=values: self._calc(context, out, values), own
            )

    def estimate(self, context: Context) -> PoseEstimate:
        """The estimate in a context of this system."""
        return context.get_abstract_state(0).get_value()

    def set_pose(
        self, context: Context, q_xyt: ArrayLike, covariance: ArrayLike | None = None, *, gyro_bias: float = 0.0
    ) -> None:
        """Starts anew in a context of this system, from a pose (3,) with its covariance (3, 3) (`PoseFilter.start`)."""
        context.SetAbstractState(0, self.filter.start(q_xyt, covariance, gyro_bias=gyro_bias))

    def _update(self, context: Context, state: State) -> None:
        estimate = self.estimate(context)
        if not estimate.history:
            estimate = replace(estimate, step=round(context.get_time() / self.filter.time_step))
        fix = self._pose_fix.Eval(context) if self._pose_fix.HasValue(context) else None
        following = self.filter.advance(
            estimate, self._wheel_speeds.Eval(context), self._yaw_rate.Eval(context)[0], fix
        )
        state.get_mutable_abstract_state(0).set_value(following)

    def _calc(self, context: Context, output: BasicVector, values: Any) -> None:
        output.SetFromVector(np.atleast_1d(values(self.estimate(context))))
