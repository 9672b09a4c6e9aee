"""The fastest motion along legs that a robot's own limits allow: speeds and efforts of its wheels, and their grip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.force_limits import friction_coefficients
from rollerbench.kinematics.limits.path_limits import PathLimits, Sharing, speed_usage
from rollerbench.kinematics.limits.result import finite_number
from rollerbench.kinematics.paths.accuracy import end_error, samples
from rollerbench.kinematics.paths.course import Course, course, metric
from rollerbench.kinematics.paths.legs import Leg
from rollerbench.kinematics.paths.reachability import fastest, intervals
from rollerbench.kinematics.profile import Profile
from rollerbench.kinematics.rows import wheeled

Array = NDArray[np.float64]

INTERVALS: dict[Sharing, int] = {"least_norm": 480, "best": 160}
"""Intervals of constant acceleration that a leg is cut into at first; fewer where each needs many optimisations."""

NODES_PLANNED = 8 * 480
"""Nodes of a leg up to which these are enough to begin with; legs of more nodes begin with more intervals."""

DOUBLINGS = 3
"""How often the intervals are halved where the plan exceeds a limit or misses the leg's end."""

EXCESS = 0.01
"""Share by which a plan may exceed a limit for a moment [-]."""

END_ERROR, END_ERROR_PER_WAY = 1e-4, 1e-6
"""How far a plan may miss the leg's end: at least [m], and more for each metre of way [-]."""

JUMP = 1e-4
"""Share of an interval in which the acceleration changes to that of the next [-]."""

SAMPLES = 16
"""Samples of the twist on an interval that must keep the limits of speed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeOptimal:
    """The fastest motion along legs.

    Attributes:
        twist: Body twist (3) over time [m/s, m/s, rad/s]; its acceleration jumps.
        time: Times (n,) in the middle of the intervals of constant acceleration [s].
        usage: Share (n,) of each limit that is used then, by its name: "speed" of a driven wheel, "steering" speed,
            "adhesion" of a wheel, "lift-off" (the share of a wheel's load at rest that is gone), "effort" of a driven
            wheel, "wheel_acceleration"; those that the robot has.
    """

    twist: Profile
    time: Array
    usage: Mapping[str, Array]

    @property
    def duration(self) -> float:
        """Time of the whole motion [s]."""
        return float(self.twist.breaks[-1])

    @property
    def active(self) -> NDArray[np.str_]:
        """The limit (n,) that is used most at each time."""
        names = np.array(list(self.usage))
        return names[np.argmax(np.array([self.usage[name] for name in names]), axis=0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Options:
    margin: float
    sharing: Sharing
    ground_friction: float | None
    roll_resistance: float
    wheel_acceleration: float | None


def time_optimal(
    robot: Robot | str | Path,
    legs: Sequence[Leg],
    *,
    margin: float = 1.0,
    sharing: Sharing = "least_norm",
    ground_friction: float | None = None,
    roll_resistance: float = 0.0,
    wheel_acceleration: float | None = None,
    pause: float = 0.0,
) -> TimeOptimal:
    """The fastest motion along legs, from rest to rest on each, within the limits of the robot's wheels.

    Its driven wheels keep their max_speed and max_effort, steered ones their max_steering_speed, and no wheel needs
    more than its friction times its load, which the acceleration shifts (see `path_limits` and `reachability`).
    Steered tyres and castors follow their way at once: what it takes to swivel them is left out, and so is what it
    takes to spin up each roller as it touches the ground.

    In simulation the planned wheel speeds are commanded exactly. Measured ones stay within 0.5 % of the limits on
    youbot_base, kiwi, six_wheel, swerve_base and differential_cart, but run 2 % over on mecanum_platform, at a margin
    of 0.8 too: its efforts clamp as its heavy rollers are spun up. Efforts of Mecanum bases are 3 to 11 % above the
    plan on average, and peak at several times the plan for moments. The sharing "least_norm" is that of servos of equal
    gains among like wheels; among unlike ones it differs: on six_wheel the tyres carry 43 % more than planned, and the
    omni wheels less.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        legs: The legs, each starting where the last one ends.
        margin: Share of each limit that may be used [-], more than 0 and at most 1; each wheel keeps 1 - margin of its
            load at rest.
        sharing: How wheels share a push that several ways make: "least_norm" as servos of equal gains share it, or
            "best" for the shortest time, which takes control of the efforts and longer to compute.
        ground_friction: Coefficient of friction of the ground, which combines with a wheel's to 2ab/(a + b); None for
            each wheel's own.
        roll_resistance: Resisting force of a rolling wheel or roller over its load [-].
        wheel_acceleration: Largest rate of the driven wheels' speeds [rad/s2]; None for no limit.
        pause: Time that is spent at rest between the legs, evenly [s].

    Raises:
        InfeasibleTwist: a fixed tyre would skid.
        KinematicsError: an argument is malformed, the robot cannot follow the legs however slowly, or a leg too sharp
            or long for a plan that keeps the limits to 1 % and meets its end.

    Source: Verscheure et al. (2009); Pham and Pham (2018).
    """
    robot = wheeled(robot)
    if not 0 < finite_number("margin", margin) <= 1:
        raise KinematicsError(f"margin = {margin!r}: accepted: more than 0, at most 1")
    if sharing not in INTERVALS:
        raise KinematicsError(f"sharing = {sharing!r}: accepted: {' or '.join(map(repr, INTERVALS))}")
    finite_number("pause", pause, smallest=0.0)
    finite_number("roll_resistance", roll_resistance, smallest=0.0)
    if wheel_acceleration is not None and not finite_number("wheel_acceleration", wheel_acceleration) > 0:
        raise KinematicsError(f"wheel_acceleration = {wheel_acceleration!r}: accepted: more than 0 [rad/s2]")
    if not legs:
        raise KinematicsError("legs = []: accepted: one or more")
    options = _Options(
        margin=margin,
        sharing=sharing,
        ground_friction=ground_friction,
        roll_resistance=roll_resistance,
        wheel_acceleration=wheel_acceleration,
    )
    runs = [_run(robot, each, options) for each in legs]
    ends = np.cumsum([run.twist.breaks[-1] for run in runs]) + pause / max(1, len(legs) - 1) * np.arange(len(legs))
    starts = [end - run.twist.breaks[-1] for end, run in zip(ends, runs, strict=True)]
    return TimeOptimal(
        twist=_in_turn([run.twist for run in runs], starts, rests=pause > 0),
        time=np.concatenate([start + run.time for start, run in zip(starts, runs, strict=True)]),
        usage={kind: np.concatenate([run.usage[kind] for run in runs]) for kind in runs[0].usage},
    )


def _run(robot: Robot, each: Leg, options: _Options) -> TimeOptimal:
    """The fastest motion along one leg, in as many intervals as it takes to keep the limits and reach the end."""
    count = round(INTERVALS[options.sharing] * max(1.0, (len(each.q_xyt) - 1) / NODES_PLANNED))
    for doubled in range(DOUBLINGS + 1):
        run = _planned(robot, course(each, robot, count << doubled), options)
        fault = _fault(run.twist, robot, each, options) if run else ""
        if run and not fault:
            return run
        if not run and doubled:
            raise KinematicsError(f"{robot.name} cannot follow the path, however slowly")
    raise KinematicsError(
        f"the path of {robot.name} is too sharp or too long to plan in {count << DOUBLINGS} intervals: {fault}; "
        "accepted: a larger deviation at corners, fewer laps, or a smoother path"
    )


def _fault(twist: Profile, robot: Robot, each: Leg, options: _Options) -> str:
    """What is the matter with a twist along a leg; nothing, if it keeps the limits and leads to the end."""
    scale = metric(robot)
    missed = end_error(twist, each.q_xyt[0], each.q_xyt[-1], scale)
    accepted = END_ERROR + END_ERROR_PER_WAY * each.effort(scale[2])
    if missed > accepted:
        return f"the plan misses the end by {1e3 * missed:.3g} mm instead of up to {1e3 * accepted:.3g} mm"
    b, c, u, x = samples(twist, scale)
    usage = _limits(robot, b, c, options).usage(u, x)
    worst = max(usage, key=lambda kind: float(usage[kind].max()))
    most = float(usage[worst].max()) / options.margin
    return f"the plan uses {most:.3g} times the limit of {worst}" if most > 1 + EXCESS else ""


def _planned(robot: Robot, course: Course, options: _Options) -> TimeOptimal | None:
    """The fastest motion along a course, in its intervals; None if no motion comes through."""
    steps, cap = np.diff(course.s[::2]), _reachable(robot, course, options.ground_friction)[::2]
    # Starts, middles and ends of the intervals.
    first, middle, last = course.b[:-2:2], course.b[1::2], course.b[2::2]
    c = course.changes
    both = _limits(robot, np.vstack([first, last]), np.vstack([c[0], c[2]]), options)
    starts, ends = zip(*(np.split(rows, 2) for rows in both.ranges(np.concatenate([cap[:-1], cap[1:]]))), strict=True)
    inside = _limits(robot, middle, c[1], options)
    squares = fastest(intervals(steps, starts, ends))
    if squares is None or (squares[1:-1] <= 0).any():
        return None
    u, x = 0.5 * np.diff(squares) / steps, np.zeros(len(course.s))
    x[::2], x[1::2] = squares, 0.5 * (squares[1:] + squares[:-1])
    twist = _slowed(_twist(course, x, np.repeat(u, 2)), robot, options.margin)
    return TimeOptimal(twist=twist, time=twist.breaks[2:-1:4], usage=inside.usage(u, x[1::2]))


def _limits(robot: Robot, b: Array, c: Array, options: _Options) -> PathLimits:
    return PathLimits(
        robot,
        b,
        c,
        margin=options.margin,
        sharing=options.sharing,
        ground_friction=options.ground_friction,
        roll_resistance=options.roll_resistance,
        wheel_acceleration=options.wheel_acceleration,
    )


def _twist(course: Course, x: Array, u: Array) -> Profile:
    """The twist over time from 0 on, two breaks for each step of the way: at its start, and just before its end."""
    b, c, pace = course.b, course.changes, np.sqrt(x)[:, np.newaxis]
    steps = 2 * np.diff(course.s) / (pace[1:, 0] + pace[:-1, 0])
    time = np.concatenate([[0.0], np.cumsum(steps)])
    values, push = b * pace, u[:, np.newaxis]
    after = b[:-1] * push + _woven(c[0], c[1]) * x[:-1, np.newaxis]
    before = b[1:] * push + _woven(c[1], c[2]) * x[1:, np.newaxis]
    gap = JUMP * steps
    return Profile(
        breaks=np.append(np.column_stack([time[:-1], time[1:] - gap]).ravel(), time[-1]),
        values=np.vstack([_woven(values[:-1], values[1:] - gap[:, np.newaxis] * before), np.zeros(3)]),
        slopes=np.vstack([_woven(after, before), np.zeros(3)]),
    )


def _woven(one: Array, other: Array) -> Array:
    """Rows (2n, 3) of two arrays (n, 3), in turn."""
    return np.stack([one, other], axis=1).reshape(-1, one.shape[1])


def _slowed(twist: Profile, robot: Robot, margin: float) -> Profile:
    """The twist, slower by the little that its speeds between the breaks exceed the limits."""
    pieces = len(twist.breaks) - 1
    time = np.interp(np.arange(SAMPLES * pieces + 1) / SAMPLES, np.arange(pieces + 1), twist.breaks)
    excess = max(1.0, float(speed_usage(robot, twist(time)).max(initial=0.0)) / margin)
    return Profile(breaks=twist.breaks * excess, values=twist.values / excess, slopes=twist.slopes / excess**2)


def _in_turn(twists: Sequence[Profile], starts: Sequence[float], *, rests: bool) -> Profile:
    """Twists from rest to rest, one after the other, each from its start on."""
    breaks: list[Array] = []
    values: list[Array] = []
    slopes: list[Array] = []
    for twist, start in zip(twists, starts, strict=True):
        time = start + twist.breaks
        if breaks and rests:
            # At rest until then: its acceleration begins at once.
            breaks.append(time[:1] - JUMP * (time[1] - time[0]))
            values.append(np.zeros((1, 3)))
            slopes.append(np.zeros((1, 3)))
        elif breaks:
            breaks[-1], values[-1], slopes[-1] = breaks[-1][:-1], values[-1][:-1], slopes[-1][:-1]
        breaks.append(time)
        values.append(twist.values)
        slopes.append(twist.slopes)
    return Profile(breaks=np.concatenate(breaks), values=np.vstack(values), slopes=np.vstack(slopes))


def _reachable(robot: Robot, course: Course, ground_friction: float | None) -> Array:
    """Squared speeds (d,) that no push of the ground exceeds: mu m g over the way of the fastest wheel, as energy."""
    inertia, friction = robot.inertia, float(friction_coefficients(robot, ground_friction).max())
    places = np.array([wheel.p_BoHo_B[:2] for wheel in robot.wheels])
    turn = np.column_stack([-places[:, 1], places[:, 0]])
    b = course.b
    pace = np.linalg.norm(b[:, np.newaxis, :2] + b[:, np.newaxis, 2:] * turn, axis=-1).max(axis=1)
    way = float(np.max(pace)) * course.s[-1]
    at_com = b[:, :2] + b[:, 2:] * np.array([-inertia.com[1], inertia.com[0]])
    mass = robot.mass * np.sum(at_com**2, axis=1) + inertia.moment[2, 2] * b[:, 2] ** 2
    return 2 * friction * robot.mass * GRAVITY * way / mass
