"""What a robot can be asked to do: the command of a scenario, and the motion that it means."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rollerbench.description import Robot
from rollerbench.description.part import NonNegative, Number, Part, Positive, Vector3
from rollerbench.description.problems import Problem
from rollerbench.kinematics import WheelKinematics, paths
from rollerbench.kinematics.profile import Profile, held_with_ramps, sum_of_steps
from rollerbench.simulation.leg_command import GaitCommand

STEERING_PAUSE = 0.5
"""Rest between the legs of a path in which steered wheels turn to the next [s]."""

Infeasible = Literal["refuse", "project"]


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


class _AlongPath(Part):
    """What commands that follow a path share.

    Attributes:
        heading: "tangent": the body looks along the path; "fixed": it keeps its heading, or turns evenly on the way. By
            default tangent for robots that cannot move in every direction (degree of manoeuvrability below 3).
        speed: Largest speed of Bo, and of a point at the wheels' mean distance as the body turns [m/s]. By default as
            slow as the scenario's duration allows.
        speed_law: "minimum_jerk", or "trapezoidal" with smooth corners.
        infeasible: "refuse" a twist at which a tyre would skid, or "project" it on what is feasible.
    """

    heading: Literal["tangent", "fixed"] | None = None
    speed: Positive | None = None
    speed_law: paths.SpeedLaw = "trapezoidal"
    infeasible: Infeasible = "refuse"

    def legs(self, robot: Robot) -> list[paths.Leg]:
        """The path from rest to rest."""
        raise AssertionError("each command has its own")

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """A speed too low for the duration."""
        legs = self.legs(robot)
        if sum(each.effort(1.0) for each in legs) < 1e-9:
            yield Problem(("command",), "the path has no length; accepted: one that leads somewhere")
        elif self._pause(robot, legs) >= duration:
            message = (
                f"the rests in which its wheels steer take {self._pause(robot, legs):g} s; accepted: a longer duration"
            )
            yield Problem(("command",), message)
        elif self.speed is not None:
            needed = paths.fastest_duration(legs, self.speed, self.speed_law, _turning_radius(robot))
            needed += self._pause(robot, legs)
            if needed > duration:
                message = f"the path takes {needed:.4g} s at this speed; accepted: a duration or speed that is larger"
                yield Problem(("command", "speed"), message, self.speed)

    def twist(self, robot: Robot, duration: float, time_step: float) -> Profile:
        """Body twist (3) over time."""
        legs, radius = self.legs(robot), _turning_radius(robot)
        if self.speed is not None:
            duration = paths.fastest_duration(legs, self.speed, self.speed_law, radius) + self._pause(robot, legs)
        return paths.twist_along(legs, duration, self.speed_law, radius, pause=self._pause(robot, legs))

    def _pause(self, robot: Robot, legs: list[paths.Leg]) -> float:
        """Time of all rests between legs, in which steered wheels turn [s]."""
        return STEERING_PAUSE * (len(legs) - 1) if robot.steered_wheels else 0.0

    def _tangent(self, robot: Robot) -> bool:
        if self.heading is not None:
            return self.heading == "tangent"
        return WheelKinematics(robot).mobility().degree_of_manoeuvrability < 3


class WaypointsCommand(_AlongPath):
    """Straight lines from waypoint to waypoint, with a rest at each.

    Attributes:
        waypoints: Each [x, y] or [x, y, yaw_deg], in the frame of the start [m, m, deg].
    """

    type: Literal["waypoints"] = "waypoints"
    waypoints: Annotated[
        tuple[Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)], ...], Field(min_length=1)
    ]

    def legs(self, robot: Robot) -> list[paths.Leg]:
        """The lines, and turns on the spot."""
        waypoints = [(*waypoint[:2], *map(math.radians, waypoint[2:])) for waypoint in self.waypoints]
        return paths.through_waypoints(waypoints, tangent=self._tangent(robot))


class PathCommand(_AlongPath):
    """A named path from the start.

    Attributes:
        name: line (length, direction_deg), arc (radius, angle_deg), circle (radius), square (length of the side),
            figure_eight (length along its axis), spline (points).
        length: Length of a line, of a square's side, of a figure of eight [m].
        direction_deg: Direction of a line from +x [deg]; with tangent heading only 0.
        radius: Radius of an arc or circle [m].
        angle_deg: Angle of an arc [deg], left positive.
        points: Points [x, y] that a spline passes after the start [m].
    """

    type: Literal["path"] = "path"
    name: Literal["line", "arc", "circle", "square", "figure_eight", "spline"]
    length: Positive | None = None
    direction_deg: Number | None = None
    radius: Positive | None = None
    angle_deg: Number | None = None
    points: Annotated[tuple[tuple[Number, Number], ...] | None, Field(min_length=1)] = None

    @model_validator(mode="after")
    def _has_its_sizes(self) -> Self:
        needs = {
            **{name: {"length"} for name in ("line", "square", "figure_eight")},
            **{"arc": {"radius", "angle_deg"}, "circle": {"radius"}, "spline": {"points"}},
        }[self.name]
        may = {*needs, "direction_deg"} if self.name == "line" else needs
        for field in ("length", "direction_deg", "radius", "angle_deg", "points"):
            if getattr(self, field) is None and field in needs:
                raise ValueError(f"{field}: this field is required for a {self.name}")
            if getattr(self, field) is not None and field not in may:
                raise ValueError(f"{field}: a {self.name} has none; accepted: {', '.join(sorted(may))}")
        return self

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """What the path cannot be."""
        if self.direction_deg and self._tangent(robot):
            message = "with tangent heading a line leads ahead; accepted: 0, or heading: fixed"
            yield Problem(("command", "direction_deg"), message, self.direction_deg)
        through = np.array([(0.0, 0.0), *(self.points or ())])
        if (np.hypot(*np.diff(through, axis=0).T) < 1e-9).any():
            message = "two points in a row are one (the start is [0, 0]); accepted: points apart from each other"
            yield Problem(("command", "points"), message, self.points)
            return
        yield from super().problems(robot, duration, time_step)

    def legs(self, robot: Robot) -> list[paths.Leg]:
        """The path's legs."""
        tangent = self._tangent(robot)
        length, radius = self.length or 0.0, self.radius or 0.0
        match self.name:
            case "line":
                direction = math.radians(self.direction_deg or 0.0)
                return [paths.line((0, 0, 0), (length * math.cos(direction), length * math.sin(direction), 0))]
            case "arc":
                return [paths.arc(radius, math.radians(self.angle_deg or 0.0), tangent=tangent)]
            case "circle":
                return [paths.arc(radius, 2 * math.pi, tangent=tangent)]
            case "square":
                return paths.square(length, tangent=tangent)
            case "figure_eight":
                return [paths.figure_eight(length, tangent=tangent)]
            case "spline":
                return [paths.spline(self.points or (), tangent=tangent)]


Command = Annotated[
    TwistCommand | WheelSpeedsCommand | WheelEffortsCommand | WaypointsCommand | PathCommand | GaitCommand,
    Field(discriminator="type"),
]


def _ramp_problems(ramp: float, duration: float) -> Iterator[Problem]:
    if 2 * ramp > duration:
        message = f"start and stop do not fit into duration = {duration}; accepted: up to {duration / 2:g}"
        yield Problem(("command", "ramp"), message, ramp)


def _turning_radius(robot: Robot) -> float:
    """Mean distance of the wheels from Bo [m]."""
    return float(np.mean([np.hypot(*wheel.p_BoHo_B[:2]) for wheel in robot.wheels])) or 1.0
