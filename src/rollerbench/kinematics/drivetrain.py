"""What lies between a motor and its wheel: an unequal gear, play, an encoder. See `systems.Drivetrain`."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelDrive:
    """Drivetrain of one wheel; motor and shaft angles are those seen at the wheel, over the described gear ratio.

    The shaft is what the motor turns, behind the play. Where it has turned by s, the wheel turns at (1 + eps) times its
    speed, eps = constant + amplitude sin(cycles s + phase). So a wave alone leaves the mean ratio as it is.

    Attributes:
        constant: Mean relative error of the gear ratio [-].
        amplitude: Amplitude of its wave [-].
        cycles: Periods of the wave in one turn [-].
        phase: Phase of the wave at the start [rad].
        backlash: Play between motor and shaft [rad]; it starts in the middle.
        counts: Counts of the encoder, which sits on the motor, in one turn of the wheel; None measures continuously.
    """

    constant: float = 0.0
    amplitude: float = 0.0
    cycles: float = 1.0
    phase: float = 0.0
    backlash: float = 0.0
    counts: int | None = None

    def __post_init__(self) -> None:
        """Checks that the wheel follows its motor.

        Raises:
            KinematicsError: it does not, or a number is not of its kind.
        """
        if not abs(self.amplitude) < 1 + self.constant:
            raise KinematicsError(
                f"constant = {self.constant}, amplitude = {self.amplitude}: accepted: |amplitude| < 1 + constant"
            )
        if not (self.cycles > 0 and self.backlash >= 0 and (self.counts is None or self.counts > 0)):
            raise KinematicsError(
                f"cycles = {self.cycles}, backlash = {self.backlash}, counts = {self.counts}: "
                "accepted: cycles > 0, backlash >= 0, counts > 0 or None"
            )

    def wheel_angle(self, shaft_angle: ArrayLike) -> Array:
        """Angles (...,) of the wheel at angles (...,) of the shaft: (1 + constant) s plus the wave's integral [rad]."""
        s = np.asarray(shaft_angle, dtype=np.float64)
        wave = np.cos(self.cycles * s + self.phase) - math.cos(self.phase)
        angle: Array = (1 + self.constant) * s - self.amplitude / self.cycles * wave
        return angle

    @property
    def iterations(self) -> int:
        """Fixed-point iterations that find the shaft's angle from the wheel's to rounding; see `systems.Drivetrain`."""
        contraction = abs(self.amplitude) / (1 + self.constant)
        return 0 if contraction == 0 else max(1, math.ceil(math.log(1e-14) / math.log(contraction)))
