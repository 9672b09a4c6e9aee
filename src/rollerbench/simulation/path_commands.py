"""Commands along a path: waypoints, and named paths, with a speed law."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rollerbench.description import Robot
from rollerbench.description.part import Number, Part, Positive
from rollerbench.description.problems import Problem
from rollerbench.errors import KinematicsError
from rollerbench.kinematics import WheelKinematics, paths
from rollerbench.kinematics.profile import Profile
from rollerbench.simulation.settings import Ground

STEERING_PAUSE = 0.5
"""Rest between the legs of a path in which steered wheels turn to the next [s]."""

Infeasible = Literal["refuse", "project"]


class AlongPath(Part):
    """What commands that follow a path share.

    Attributes:
        heading: "tangent": the body looks along the path; "fixed": it keeps its heading, or turns evenly on the way. By
            default tangent for robots that cannot move in every direction (degree of manoeuvrability below 3). "free",
            of paths with points: it turns smoothly to the yaw of each point that has one, whatever the path.
        speed: Largest speed of Bo, and of a point at the wheels' mean distance as the body turns [m/s]. By default as
            slow as the scenario's duration allows.
        speed_law: "minimum_jerk"; "trapezoidal" with smooth corners; or "time_optimal", as fast as the speeds, efforts
            and grip of the wheels allow (`rollerbench.paths.time_optimal`), then at rest for what is left of the time.
        margin: Share of these limits that time_optimal may use [-]; 1 by default. Controllers need the rest.
        wheel_acceleration: Largest rate of the driven wheels' speeds for time_optimal [rad/s2].
        infeasible: "refuse" a twist at which a tyre would skid, or "project" it on what is feasible.
    """

    heading: Literal["tangent", "fixed", "free"] | None = None
    speed: Positive | None = None
    speed_law: paths.SpeedLaw | Literal["time_optimal"] = "trapezoidal"
    margin: Annotated[Positive, Field(le=1)] | None = None
    wheel_acceleration: Positive | None = None
    infeasible: Infeasible = "refuse"

    @model_validator(mode="after")
    def _limits_belong_to_their_law(self) -> Self:
        fits = self.speed_law == "time_optimal"
        for field in ("speed",) if fits else ("margin", "wheel_acceleration"):
            if getattr(self, field) is not None:
                accepted = "the robot's limits instead, or a margin" if fits else "with speed_law: time_optimal only"
                raise ValueError(f"{field}: not with speed_law: {self.speed_law}; accepted: {accepted}")
        return self

    def legs(self, robot: Robot) -> list[paths.Leg]:
        """The path from rest to rest."""
        raise AssertionError("each command has its own")

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """What the path cannot be, and what takes longer than the duration."""
        try:
            legs = self.legs(robot)
        except KinematicsError as error:
            yield Problem(("command",), str(error))
            return
        if sum(each.effort(1.0) for each in legs) < 1e-9:
            yield Problem(("command",), "the path has no length; accepted: one that leads somewhere")
        elif self._pause(robot, legs) >= duration:
            message = (
                f"the rests in which its wheels steer take {self._pause(robot, legs):g} s; accepted: a longer duration"
            )
            yield Problem(("command",), message)
        elif self.speed is not None and self.speed_law != "time_optimal":
            needed = paths.fastest_duration(legs, self.speed, self.speed_law, _turning_radius(robot))
            needed += self._pause(robot, legs)
            if needed > duration:
                message = f"the path takes {needed:.4g} s at this speed; accepted: a duration or speed that is larger"
                yield Problem(("command", "speed"), message, self.speed)

    def twist(self, robot: Robot, duration: float, time_step: float) -> Profile:
        """Body twist (3) over time."""
        legs, radius = self.legs(robot), _turning_radius(robot)
        assert self.speed_law != "time_optimal"  # see fastest
        if self.speed is not None:
            duration = paths.fastest_duration(legs, self.speed, self.speed_law, radius) + self._pause(robot, legs)
        return paths.twist_along(legs, duration, self.speed_law, radius, pause=self._pause(robot, legs))

    def fastest(self, robot: Robot, ground: Ground) -> paths.TimeOptimal:
        """The time-optimal motion along the path on level ground.

        Raises:
            KinematicsError: the robot cannot follow the path.
        """
        legs = self.legs(robot)
        return paths.time_optimal(
            robot,
            legs,
            margin=self.margin or 1.0,
            ground_friction=ground.friction,
            roll_resistance=ground.roll_resistance,
            wheel_acceleration=self.wheel_acceleration,
            pause=self._pause(robot, legs),
        )

    def _pause(self, robot: Robot, legs: list[paths.Leg]) -> float:
        """Time of all rests between legs, in which steered wheels turn [s]."""
        return STEERING_PAUSE * (len(legs) - 1) if robot.steered_wheels else 0.0

    def _tangent(self, robot: Robot) -> bool:
        if self.heading is not None:
            return self.heading == "tangent"
        return WheelKinematics(robot).mobility().degree_of_manoeuvrability < 3


class WaypointsCommand(AlongPath):
    """Straight lines from waypoint to waypoint, with a rest at each.

    Attributes:
        waypoints: Each [x, y] or [x, y, yaw_deg], in the frame of the start [m, m, deg].
    """

    type: Literal["waypoints"] = "waypoints"
    heading: Literal["tangent", "fixed"] | None = None
    waypoints: Annotated[
        tuple[Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)], ...], Field(min_length=1)
    ]

    def legs(self, robot: Robot) -> list[paths.Leg]:
        """The lines, and turns on the spot."""
        waypoints = [(*waypoint[:2], *map(math.radians, waypoint[2:])) for waypoint in self.waypoints]
        return paths.through_waypoints(waypoints, tangent=self._tangent(robot))


CLOSED = ("circle", "square", "figure_eight")
"""Paths that end where they begin."""


class PathCommand(AlongPath):
    """A named path from the start.

    Attributes:
        name: line (length, direction_deg), arc (radius, angle_deg), circle (radius), square (length of the side),
            figure_eight (length along its axis), spline (points), clothoid (points, deviation): straight lines with
            their corners rounded so that the curvature does not jump.
        length: Length of a line, of a square's side, of a figure of eight [m].
        direction_deg: Direction of a line from +x [deg]; with tangent heading only 0.
        radius: Radius of an arc or circle [m].
        angle_deg: Angle of an arc [deg], left positive.
        points: Points [x, y] or, with heading: free, [x, y, yaw_deg] after the start, that a spline passes, or whose
            corners a clothoid path rounds [m, m, deg]; yaws count full turns.
        laps: How often a circle, square or figure of eight is driven; but for the square without a rest in between.
        deviation: How far a clothoid path may pass a corner [m]; by default as far as there is room.
    """

    type: Literal["path"] = "path"
    name: Literal["line", "arc", "circle", "square", "figure_eight", "spline", "clothoid"]
    length: Positive | None = None
    direction_deg: Number | None = None
    radius: Positive | None = None
    angle_deg: Number | None = None
    points: Annotated[
        tuple[Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)], ...] | None, Field(min_length=1)
    ] = None
    deviation: Positive | None = None
    laps: Annotated[int, Field(strict=True, ge=1, le=100)] = 1

    @model_validator(mode="after")
    def _has_its_sizes(self) -> Self:
        needs = {
            **{name: {"length"} for name in ("line", "square", "figure_eight")},
            **{"arc": {"radius", "angle_deg"}, "circle": {"radius"}, "spline": {"points"}, "clothoid": {"points"}},
        }[self.name]
        may = needs | {"line": {"direction_deg"}, "clothoid": {"deviation"}}.get(self.name, set())
        for field in ("length", "direction_deg", "radius", "angle_deg", "points", "deviation"):
            if getattr(self, field) is None and field in needs:
                raise ValueError(f"{field}: this field is required for a {self.name}")
            if getattr(self, field) is not None and field not in may:
                raise ValueError(f"{field}: a {self.name} has none; accepted: {', '.join(sorted(may))}")
        if self.heading == "free" and self.points is None:
            raise ValueError(f"heading = 'free': a {self.name} has no points with yaws; accepted: tangent, fixed")
        if self.heading != "free" and any(len(point) == 3 for point in self.points or ()):
            raise ValueError("points: a yaw_deg belongs to heading: free; accepted: [x, y], or that heading")
        if self.laps > 1 and self.name not in CLOSED:
            raise ValueError(f"laps = {self.laps}: a {self.name} does not close; accepted: {', '.join(CLOSED)}, or 1")
        return self

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """What the path cannot be."""
        if self.direction_deg and self._tangent(robot):
            message = "with tangent heading a line leads ahead; accepted: 0, or heading: fixed"
            yield Problem(("command", "direction_deg"), message, self.direction_deg)
        through = np.array([(0.0, 0.0), *(point[:2] for point in self.points or ())])
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
                return paths.laps([paths.arc(radius, 2 * math.pi, tangent=tangent)], self.laps)
            case "square":
                return paths.laps(paths.square(length, tangent=tangent), self.laps)
            case "figure_eight":
                return paths.laps([paths.figure_eight(length, tangent=tangent)], self.laps)
        points = [point[:2] for point in self.points or ()]
        yaw = None
        if self.heading == "free":
            yaw = [math.radians(point[2]) if len(point) == 3 else math.nan for point in self.points or ()]
        if self.name == "spline":
            return [paths.spline(points, tangent=tangent, yaw=yaw)]
        return [paths.clothoid(points, deviation=self.deviation, tangent=tangent, yaw=yaw)]


def _turning_radius(robot: Robot) -> float:
    """Mean distance of the wheels from Bo [m]."""
    return float(np.mean([np.hypot(*wheel.p_BoHo_B[:2]) for wheel in robot.wheels])) or 1.0
