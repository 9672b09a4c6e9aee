"""Gaits: when each leg lifts, as data."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError


@dataclass(frozen=True, slots=True, kw_only=True)
class Gait:
    """A periodic gait: on each side of the body legs follow one another at even phases.

    Attributes:
        name: Name of the gait.
        duty: Share of a period in which a foot is on the ground [-]; 0 for that of the wave, which lifts one leg at a
            time.
        lag: Phase of a leg ahead of the next one behind it on the same side [-]; 0 for that of the wave.
        offset: Phase of the right side ahead of the left one [-].
        period: Time of a step of all legs [s].
        lift: Height by which feet are lifted [m].
    """

    name: str
    duty: float
    lag: float
    offset: float
    period: float = 1.0
    lift: float = 0.05

    def __post_init__(self) -> None:
        accepted = {
            "duty": (self.duty == 0 or 0.05 <= self.duty <= 0.98, "0, or from 0.05 to 0.98"),
            "period": (0.1 <= self.period <= 100, "from 0.1 to 100 s"),
            "lift": (0 < self.lift <= 1, "up to 1 m"),
            "lag": (0 <= self.lag < 1, "from 0 to less than 1"),
            "offset": (0 <= self.offset < 1, "from 0 to less than 1"),
        }
        for name, (good, what) in accepted.items():
            if not good:
                raise KinematicsError(f"gait {self.name}: {name} = {getattr(self, name)}: accepted: {what}")


GAITS = {
    gait.name: gait
    for gait in (
        Gait(name="tripod", duty=0.55, lag=1 / 2, offset=1 / 2),
        Gait(name="ripple", duty=2 / 3, lag=2 / 3, offset=1 / 2),
        Gait(name="amble", duty=0.7, lag=1 / 3, offset=1 / 3),
        Gait(name="wave", duty=0, lag=0, offset=1 / 2),
    )
}
"""The common gaits; where legs change over in groups, both groups stand for a moment.

Source: McGhee and Frank (1968) for wave gaits.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Schedule:
    """A gait of a certain robot.

    Attributes:
        gait: The gait.
        duty: Share of a period in which a foot is on the ground [-].
        phases: Phases (k,) of the legs [-]: a foot lifts when its phase plus time over period passes the duty.
    """

    gait: Gait
    duty: float
    phases: NDArray[np.float64]


def schedule(gait: Gait, robot: Robot) -> Schedule:
    """A gait of a robot: on each side legs follow one another from the rear, the left side leads."""
    duty = gait.duty or 1 - 1 / (2 * _legs_per_side(robot))
    lag, phases = gait.lag or duty, np.zeros(len(robot.legs))
    for side, offset in ((1.0, 0.0), (-1.0, gait.offset)):
        legs = [i for i, leg in enumerate(robot.legs) if math.copysign(1.0, leg.hip[1]) == side]
        for rank, index in enumerate(sorted(legs, key=lambda i: robot.legs[i].hip[0])):
            phases[index] = (rank * lag + offset) % 1.0
    return Schedule(gait=gait, duty=duty, phases=np.round(phases, 9) % 1.0)


def gait_of(name: str) -> Gait:
    """A gait by name.

    Raises:
        KinematicsError: there is none of this name.
    """
    if name not in GAITS:
        raise KinematicsError(f"gait = {name!r}: accepted: {', '.join(GAITS)}")
    return GAITS[name]


def _legs_per_side(robot: Robot) -> int:
    left = sum(leg.hip[1] >= 0 for leg in robot.legs)
    return max(left, len(robot.legs) - left)
