"""What a robot can be asked to do: the command of a scenario, and the motion that it means."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rollerbench.description import Robot
from rollerbench.description.part import NonNegative, Number, Part, Positive, Vector3
from rollerbench.description.problems import Problem
from rollerbench.kinematics.profile import Profile, held_with_ramps, sum_of_steps
from rollerbench.simulation.leg_command import GaitCommand
from rollerbench.simulation.path_commands import Infeasible, PathCommand, WaypointsCommand


class TwistPiece(Part):
    """A twist that is held for a while.

    Attributes:
        duration: Time from the start of the change to it to the start of the next change [s].
        v_xyw_B: Twist [vx, vy, wz] [m/s, m/s, rad/s].
    """

    duration: Positive
    v_xyw_B: Vector3


class TwistCommand(Part):
    """A constant body twist, or several in turn, with smooth changes.

    Attributes:
        v_xyw_B: Twist [vx, vy, wz] that is held for the whole duration [m/s, m/s, rad/s].
        pieces: Twists that are held in turn, instead of v_xyw_B; together they last no longer than the scenario.
        ramp: Time of each smooth change, the start and the stop among them [s]; one step of the plant at least.
        infeasible: "refuse" a twist at which a tyre would skid, or "project" it on what is feasible.
    """

    type: Literal["twist"] = "twist"
    v_xyw_B: Vector3 | None = None
    pieces: Annotated[tuple[TwistPiece, ...] | None, Field(min_length=1)] = None
    ramp: NonNegative = 0.5
    infeasible: Infeasible = "refuse"

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.v_xyw_B is None) == (self.pieces is None):
            raise ValueError("v_xyw_B: this field is required (or pieces instead of it, not both)")
        return self

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """What does not fit into the duration."""
        if self.pieces is None:
            yield from _ramp_problems(self.ramp, duration)
            return
        total = sum(piece.duration for piece in self.pieces)
        if total > duration * (1 + 1e-9):
            message = f"the pieces last {total:g} s; accepted: at most the scenario's duration, {duration:g} s"
            yield Problem(("command", "pieces"), message)
        for index, piece in enumerate(self.pieces):
            room = piece.duration if index < len(self.pieces) - 1 else 0.5 * piece.duration
            ramp = max(self.ramp, time_step)
            if ramp > room * (1 + 1e-9):
                message = f"shorter than the changes take (ramp = {ramp:g}); accepted: a longer piece or less ramp"
                yield Problem(("command", "pieces", index, "duration"), message, piece.duration)

    def twist(self, robot: Robot, duration: float, time_step: float) -> Profile:
        """Body twist (3) over time."""
        if self.pieces is None:
            ramp = min(max(self.ramp, time_step), 0.5 * duration)
            return held_with_ramps(np.array(self.v_xyw_B), duration, ramp)
        ramp = max(self.ramp, time_step)
        ends = np.cumsum([piece.duration for piece in self.pieces])
        starts = np.concatenate([[0.0], ends[:-1], [ends[-1] - ramp]])
        levels = np.array([(0.0, 0.0, 0.0), *(piece.v_xyw_B for piece in self.pieces), (0.0, 0.0, 0.0)])
        return sum_of_steps(starts, starts + ramp, np.diff(levels, axis=0))


class Step(Part):
    """ADAMS' STEP function: a cubic from 0 at start to height at stop.

    Attributes:
        start: When it begins [s].
        stop: When it ends [s].
        height_deg: Height [deg/s].
    """

    start: NonNegative
    stop: Positive
    height_deg: Number

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.stop < self.start + 1e-6:
            raise ValueError(f"stop = {self.stop}: accepted: later than start = {self.start}")
        return self


class WheelSpeedsCommand(Part):
    """Wheel speeds by name: constant between smooth ramps, or sums of step functions.

    Attributes:
        wheel_speeds: Speeds of the driven wheels [rad/s]; 0 for those left out.
        steps: Steps to sum up for each driven wheel, instead of wheel_speeds; "all" stands for every wheel not named.
        ramp: Time of the smooth start, and of the smooth stop, of wheel_speeds [s]; one step of the plant at least.
    """

    type: Literal["wheel_speeds"] = "wheel_speeds"
    wheel_speeds: dict[str, Number] | None = None
    steps: dict[str, tuple[Step, ...]] | None = None
    ramp: NonNegative = 0.5

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.wheel_speeds is None) == (self.steps is None):
            raise ValueError("wheel_speeds: this field is required (or steps instead of it, not both)")
        return self

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """Names that are no driven wheels, and what does not fit into the duration."""
        names = [wheel.name for wheel in robot.driven_wheels]
        field, given, extra = ("steps", self.steps, ["all"]) if self.steps else ("wheel_speeds", self.wheel_speeds, [])
        for name in given or {}:
            if name not in [*names, *extra]:
                message = f"not a driven wheel of {robot.name}; accepted: {', '.join([*names, *extra]) or 'none'}"
                yield Problem(("command", field, name), message)
        if self.wheel_speeds is not None:
            yield from _ramp_problems(self.ramp, duration)

    def wheel_speed_profile(self, robot: Robot, duration: float, time_step: float) -> Profile:
        """Wheel speeds (n_driven) over time."""
        names = [wheel.name for wheel in robot.driven_wheels]
        if self.wheel_speeds is not None:
            ramp = min(max(self.ramp, time_step), 0.5 * duration)
            return held_with_ramps([self.wheel_speeds.get(name, 0.0) for name in names], duration, ramp)
        steps = self.steps or {}
        terms = [(index, step) for index, name in enumerate(names) for step in steps.get(name, steps.get("all", ()))]
        # A step of no height at the origin, so that a robot without any step stands still.
        starts, stops = [0.0, *(step.start for _, step in terms)], [time_step, *(step.stop for _, step in terms)]
        heights = np.zeros((len(terms) + 1, len(names)))
        for row, (column, step) in enumerate(terms, start=1):
            heights[row, column] = math.radians(step.height_deg)
        return sum_of_steps(starts, stops, heights)


class WheelEffortsCommand(Part):
    """Torques of the driven wheels by name, held between smooth ramps; nothing controls the wheels' speeds.

    Attributes:
        wheel_efforts: Torques at the wheels, positive forward [N m]; 0 for those left out.
        ramp: Time of the smooth start, and of the smooth stop [s]; one step of the plant at least.
    """

    type: Literal["wheel_efforts"] = "wheel_efforts"
    wheel_efforts: dict[str, Number]
    ramp: NonNegative = 0.0

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """Names that are no driven wheels, torques that their motors do not have, and too long ramps."""
        wheels = {wheel.name: wheel for wheel in robot.driven_wheels}
        for name, effort in self.wheel_efforts.items():
            if name not in wheels:
                message = f"not a driven wheel of {robot.name}; accepted: {', '.join(wheels) or 'none'}"
                yield Problem(("command", "wheel_efforts", name), message)
            elif (limit := wheels[name].max_effort) is not None and abs(effort) > limit:
                message = f"more than the motor has; accepted: from {-limit:g} to {limit:g}"
                yield Problem(("command", "wheel_efforts", name), message, effort)
        yield from _ramp_problems(self.ramp, duration)

    def wheel_effort_profile(self, robot: Robot, duration: float, time_step: float) -> Profile:
        """Torques (n_driven) over time."""
        ramp = min(max(self.ramp, time_step), 0.5 * duration)
        return held_with_ramps(
            [self.wheel_efforts.get(wheel.name, 0.0) for wheel in robot.driven_wheels], duration, ramp
        )


Command = Annotated[
    TwistCommand | WheelSpeedsCommand | WheelEffortsCommand | WaypointsCommand | PathCommand | GaitCommand,
    Field(discriminator="type"),
]


def _ramp_problems(ramp: float, duration: float) -> Iterator[Problem]:
    if 2 * ramp > duration:
        message = f"start and stop do not fit into duration = {duration}; accepted: up to {duration / 2:g}"
        yield Problem(("command", "ramp"), message, ramp)
