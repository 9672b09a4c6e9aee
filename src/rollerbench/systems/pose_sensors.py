"""Sensors with noise, to try pose estimators on: a gyroscope, and something that tells the pose now and then, late.

Their noise is a function of the seed and the sample's number, so the same run gives the same bits, whichever contexts
are cloned on the way.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, LeafSystem

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.given import positive_time
from rollerbench.kinematics.uncertainty import GyroNoise

Array = NDArray[np.float64]


class GyroSensor(LeafSystem):
    """Reads the yaw rate with white noise and a bias that wanders.

    yaw_rate = wz + b + density / sqrt(dt) n1,      b_next = b + bias_walk sqrt(dt) n2,      n1, n2 new every dt.

    Input ports:
        v_xyw_B (3): true body twist [m/s, m/s, rad/s].
    Output ports:
        yaw_rate (1): as measured, without a delay [rad/s].
        gyro_bias (1): the true bias [rad/s].
    """

    def __init__(self, time_step: float, noise: GyroNoise, *, bias: float = 0.0, seed: int = 0) -> None:
        """Makes the sensor.

        Args:
            time_step: Period dt of its samples [s].
            noise: Its noise.
            bias: Bias at the start [rad/s].
            seed: Seed of its noise; sensors of unequal seeds are independent.

        Raises:
            KinematicsError: an argument is not accepted.
        """
        super().__init__()
        positive_time("time_step", time_step)
        if not math.isfinite(bias):
            raise KinematicsError(f"bias = {bias}: accepted: a finite number [rad/s]")
        self._seed, self._period = _checked(seed), time_step
        self._scale = np.array([noise.bias_walk * math.sqrt(time_step), noise.density / math.sqrt(time_step)])
        self._twist = self.DeclareVectorInputPort("v_xyw_B", 3)
        first = self._scale * _normal(self._seed, GYRO, 0, 2)
        state = self.DeclareDiscreteState([bias, first[1]])
        self.DeclarePeriodicDiscreteUpdateEvent(time_step, 0.0, self._update)
        ticket = self.discrete_state_ticket(state)
        self.DeclareVectorOutputPort("yaw_rate", 1, self._calc_rate, {self._twist.ticket(), ticket})
        self.DeclareVectorOutputPort("gyro_bias", 1, self._calc_bias, {ticket})

    def _update(self, context: Context, state: DiscreteValues) -> None:
        number = round(context.get_time() / self._period) + 1
        step, noise = self._scale * _normal(self._seed, GYRO, number, 2)
        state.set_value(0, [context.get_discrete_state(0).value()[0] + step, noise])

    def _calc_rate(self, context: Context, output: BasicVector) -> None:
        bias, noise = context.get_discrete_state(0).value()
        output.SetFromVector([self._twist.Eval(context)[2] + bias + noise])

    def _calc_bias(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(0).value()[:1])


class PoseFixSensor(LeafSystem):
    """Measures the pose once a period, with noise, and tells it when the latency has passed, with its time.

    Input ports:
        q_xyt (3): true pose of B in W [m, m, rad].
    Output ports:
        pose_fix (4): time of the measurement, x, y, yaw [s, m, m, rad]; NaN until the first is delivered.
    """

    def __init__(self, deviation: ArrayLike, *, period: float = 1.0, latency: float = 0.2, seed: int = 0) -> None:
        """Makes the sensor.

        Args:
            deviation: Standard deviations (3,) of its noise in W [m, m, rad].
            period: Time between measurements [s].
            latency: Time from a measurement until it is delivered [s]; may be longer than the period.
            seed: Seed of its noise; sensors of unequal seeds are independent.

        Raises:
            KinematicsError: an argument is not accepted.
        """
        super().__init__()
        positive_time("period", period)
        if not (math.isfinite(latency) and latency >= 0):
            raise KinematicsError(f"latency = {latency}: accepted: 0 s or more")
        self._deviation = np.asarray(deviation, dtype=np.float64)
        if self._deviation.shape != (3,) or not (np.isfinite(self._deviation) & (self._deviation >= 0)).all():
            raise KinematicsError(f"deviation = {deviation!r}: accepted: three numbers of 0 or more [m, m, rad]")
        self._seed, self._period, self._latency = _checked(seed), period, latency
        self._slots = math.ceil(latency / period) + 1
        self._pose = self.DeclareVectorInputPort("q_xyt", 3)
        delivered = self.DeclareDiscreteState(np.full(4, np.nan))
        self._waiting = self.DeclareDiscreteState(np.full(4 * self._slots, np.nan))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._measure)
        self.DeclarePeriodicDiscreteUpdateEvent(period, latency, self._deliver)
        self.DeclareVectorOutputPort("pose_fix", 4, self._calc, {self.discrete_state_ticket(delivered)})

    def _measure(self, context: Context, state: DiscreteValues) -> None:
        time = context.get_time()
        number = round(time / self._period)
        pose = self._pose.Eval(context) + self._deviation * _normal(self._seed, FIX, number, 3)
        self._slot(state, number)[:] = [time, *pose]

    def _deliver(self, context: Context, state: DiscreteValues) -> None:
        number = round((context.get_time() - self._latency) / self._period)
        state.set_value(0, self._slot(state, number))

    def _slot(self, state: DiscreteValues, number: int) -> Any:
        return state.get_mutable_value(self._waiting).reshape(self._slots, 4)[number % self._slots]

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(0).value())


GYRO, FIX = 1, 2
"""Streams of noise: sensors of two kinds with the same seed are independent, too."""


def _normal(seed: int, stream: int, number: int, size: int) -> Array:
    """Standard normal numbers (size,) of a sample; the counter's highest word keeps samples apart."""
    bits = np.random.Philox(key=[seed, stream], counter=[0, 0, 0, number])
    return np.random.Generator(bits).standard_normal(size)


def _checked(seed: int) -> int:
    if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**63):
        raise KinematicsError(f"seed = {seed}: accepted: a whole number of 0 or more")
    return int(seed)
