"""What every engine simulates: one Mecanum base with any number of rollers, and six motions."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import rollerbench as rb
from rollerbench.description.rollers import largest_radius, roller_clearance
from rollerbench.kinematics.profile import Profile, reference_poses

if TYPE_CHECKING:
    # Its import loads Drake, which processes that measure the memory of other engines must not.
    from rollerbench.simulation import Scenario

Array = NDArray[np.float64]

ROBOT = "youbot_base"
COUNT = 12
"""Rollers a wheel of the comparison."""

TWISTS: dict[str, tuple[float, float, float]] = {
    "x": (0.4, 0.0, 0.0),
    "y": (0.0, 0.4, 0.0),
    "diagonal": (0.3, 0.3, 0.0),
    "combined": (0.3, 0.2, 0.6),
    "fast y": (0.0, 0.8, 0.0),
    "turn": (0.0, 0.0, 1.5),
}
"""Twists [m/s, m/s, rad/s]; 0.8 m/s is the top speed of the youBot."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A twist with smooth ramps.

    Attributes:
        name: Its name.
        scenario: It as a scenario of rollerbench.
    """

    name: str
    scenario: "Scenario"

    @cached_property
    def twist(self) -> Profile:
        """Body twist over time."""
        return self.scenario.motion.twist

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return self.scenario.duration

    def wheel_speeds(self, time_step: float) -> Array:
        """Commanded wheel speeds (n, n_driven) in each of the n steps of a simulation, at its start [rad/s]."""
        times = time_step * np.arange(round(self.duration / time_step), dtype=np.float64)
        return self.scenario.motion.wheel_speeds(times)

    def error_percent(self, q_xyt: Array, reference: Array) -> float:
        """Distance of two final poses (3,) in % of the path; for a turn on the spot of their yaw, in % of the turn."""
        if not np.isfinite(q_xyt).all():
            return float("inf")
        path, turn = self._extent
        if path > 0:
            return 100 * float(np.hypot(*(q_xyt - reference)[:2])) / path
        apart = (q_xyt[2] - reference[2] + np.pi) % (2 * np.pi) - np.pi
        return 100 * abs(float(apart)) / turn

    @cached_property
    def _extent(self) -> tuple[float, float]:
        """Length of the path [m] and the angle turned [rad]."""
        times = np.linspace(0.0, self.duration, 2001)
        twist = self.twist(times)
        speed, rate = np.hypot(twist[:, 0], twist[:, 1]), np.abs(twist[:, 2])
        return float(np.trapezoid(speed, times)), float(np.trapezoid(rate, times))

    @cached_property
    def reference_pose(self) -> Array:
        """Final pose (3,) that the textbook equations promise."""
        pose: Array = reference_poses(self.twist, np.linspace(0.0, self.duration, 201))[-1]
        return pose


def robot_with_rollers(count: int = COUNT) -> rb.Robot:
    """The base with this many rollers a wheel, thinner ones where they would touch each other."""
    robot = rb.load_robot(ROBOT)
    ring = robot.wheels[0].ring
    if ring is None:
        raise rb.DescriptionError(f"{ROBOT}: its wheels have no rollers")
    wanted = replace(ring, count=count)
    radius = ring.roller_radius if roller_clearance(wanted) >= 0 else largest_radius(wanted)
    data = robot.model_dump(mode="json", exclude_none=True)
    for wheel in data["wheels"]:
        wheel["rollers"] |= {"count": count, "radius": radius}
    return rb.load_robot(data)


def motions(
    robot: rb.Robot, *, duration: float = 3.0, ramp: float = 0.5, names: tuple[str, ...] = tuple(TWISTS)
) -> list[Motion]:
    """The six motions of a robot, or some of them."""
    command = {"type": "twist", "ramp": ramp}
    recording = {"html": False}
    return [
        Motion(
            name=name,
            scenario=rb.load_scenario(
                {
                    **{"name": name.replace(" ", "_"), "robot": robot, "duration": duration, "recording": recording},
                    "command": {**command, "v_xyw_B": TWISTS[name]},
                }
            ),
        )
        for name in names
    ]
