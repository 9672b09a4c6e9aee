"""Time-optimal speeds: as fast as the limits of the wheels allow, and no faster; beside an independent program."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import ClarabelSolver, MathematicalProgram
from scipy.interpolate import CubicSpline

import robots
import rollerbench as rb
from rollerbench.description.inertia import GRAVITY
from rollerbench.description.mass import axle_inertia, roller_inertia
from rollerbench.kinematics.dynamics import RollingDynamics
from rollerbench.kinematics.limits.cone_program import Cones, maximize, section
from rollerbench.kinematics.limits.contact_forces import ContactForces
from rollerbench.kinematics.limits.efforts import least_norm
from rollerbench.kinematics.profile import reference_poses

paths = rb.paths


def changed(name: str, **fields: Any) -> rb.Robot:
    """A shipped robot whose driven wheels differ."""
    data = rb.load_robot(name).model_dump(mode="json", exclude_none=True)
    data["wheels"] = [w if w["type"] == "castor" else {**w, **fields} for w in data["wheels"]]
    return rb.load_robot(data)


def without_damping(data: dict[str, Any]) -> rb.Robot:
    wheels = [{**w, "rollers": {**w["rollers"], "damping": 0.0}} for w in data["wheels"]]
    return rb.load_robot({**data, "body": {**data["body"], "center_of_mass": [0.03, -0.02, 0.05]}, "wheels": wheels})


BENT = [[1.5, 0.0], [1.5, 1.5], [0.0, 1.5]]
RUNS = {
    "mecanum, its grip": ("youbot_base", lambda: [paths.clothoid(BENT, yaw=[1.0, np.nan, 3.0])]),
    "mecanum, its speed": ("youbot_base", lambda: [paths.figure_eight(2.0, tangent=True)]),
    "omni, its efforts": (changed("omni_platform", max_effort=1.5), lambda: paths.square(1.0, tangent=False)[:2]),
    "kiwi": ("kiwi", lambda: [paths.spline(BENT, yaw=[1.0, np.nan, -1.0])]),
    "cart on ice": (
        changed("differential_cart", friction=0.2),
        lambda: [paths.clothoid(BENT, deviation=0.2, tangent=True)],
    ),
    "swerve": ("swerve_base", lambda: [paths.spline(BENT, tangent=True)]),
}


@pytest.mark.parametrize("name", RUNS)
def test_a_limit_is_reached_at_every_moment_and_none_exceeded(name: str) -> None:
    robot, legs = RUNS[name][0], RUNS[name][1]()
    run = paths.time_optimal(robot, legs)
    used = np.array(list(run.usage.values())).max(axis=0)
    assert used.max() < 1.002
    # But for the intervals within which the acceleration switches or the limits change: half as many at half the step.
    assert np.mean(used > 0.99) > 0.93
    assert np.mean(used > 0.95) > 0.97
    assert run.duration == run.twist.breaks[-1]
    assert set(run.active) <= run.usage.keys() <= {"speed", "steering", "adhesion", "lift-off", "effort"}
    # The twist leads to the end of the path, and its wheels keep their speeds.
    time = np.linspace(0, run.duration, 2001)
    # Sharp corners cost the most: between two breaks the change of their curvature jumps.
    assert reference_poses(run.twist, time)[-1] == pytest.approx(legs[-1].q_xyt[-1], abs=5e-5)
    kinematics = rb.WheelKinematics(robot)
    if not kinematics.robot.steered_wheels:
        limits = [wheel.max_speed for wheel in kinematics.robot.driven_wheels]
        assert (run.twist.mapped(kinematics.drive_matrix).peak <= np.array(limits) * (1 + 1e-9)).all()


@given(st.floats(-3.2, 3.2))
@settings(max_examples=2, deadline=None)
def test_straight_runs_start_and_cruise_at_the_limits_of_their_direction(direction: float) -> None:
    u = np.array([math.cos(direction), math.sin(direction)])
    for name in ("youbot_base", "kiwi"):
        run = paths.time_optimal(name, [paths.line([0, 0, 0], [8 * u[0], 8 * u[1], 0])])
        speed, push = np.hypot(*run.twist.peak[:2]), np.hypot(*run.twist.rate(1e-4)[:2])
        assert speed == pytest.approx(float(rb.limits.max_speed(name, direction)), rel=1e-7)
        limit = rb.limits.max_acceleration(name, direction, sharing="least_norm", roll_resistance=0.0)
        assert push == pytest.approx(float(limit), rel=1e-6)


def test_the_best_sharing_starts_as_max_acceleration_says() -> None:
    run = paths.time_optimal("youbot_base", [paths.line([0, 0, 0], [1, 0, 0])], sharing="best", roll_resistance=0.01)
    limit = rb.limits.max_acceleration("youbot_base", 0.0, roll_resistance=0.01)
    assert run.twist.rate(1e-4)[0] == pytest.approx(float(limit), rel=1e-6)


def test_without_limits_of_speed_a_line_takes_what_friction_allows() -> None:
    """T = sqrt(2 L (1/a + 1/b)) with the largest acceleration a and braking b."""
    data = robots.kiwi()
    data["body"]["center_of_mass"] = [0.05, 0.0, 0.06]
    ahead, back = rb.limits.max_acceleration(rb.load_robot(data), [0.0, math.pi]).value
    run = paths.time_optimal(rb.load_robot(data), [paths.line([0, 0, 0], [2, 0, 0])])
    assert run.duration == pytest.approx(math.sqrt(4 * (1 / ahead + 1 / back)), rel=1e-3)
    assert set(run.usage) == {"adhesion", "lift-off"}
    assert set(run.active) == {"adhesion"}


@pytest.mark.parametrize("robot", ["differential_cart", "kiwi"])
def test_laps_are_planned_as_finely_as_one(robot: str) -> None:
    legs = [paths.figure_eight(2.0, tangent=True)]
    one, two, twenty = (paths.time_optimal(robot, paths.laps(legs, count)) for count in (1, 2, 20))
    # The second lap starts at full speed, as all that follow.
    assert (twenty.duration - one.duration) / 19 == pytest.approx(two.duration - one.duration, rel=0.01)
    assert max(usage.max() for usage in twenty.usage.values()) < 1.01
    reached = reference_poses(twenty.twist, twenty.twist.breaks, 16)[-1]
    assert reached == pytest.approx(paths.laps(legs, 20)[0].q_xyt[-1], abs=1e-4)


def test_sharp_corners_are_planned_right_or_refused() -> None:
    sharp = paths.clothoid(BENT, deviation=0.05, tangent=True)
    run = paths.time_optimal("differential_cart", [sharp])
    assert max(usage.max() for usage in run.usage.values()) < 1.01
    assert reference_poses(run.twist, run.twist.breaks)[-1] == pytest.approx(sharp.q_xyt[-1], abs=1e-4)
    for deviation in (0.01, 1e-3):
        with pytest.raises(rb.KinematicsError, match=r"too sharp.* larger deviation"):
            paths.time_optimal("differential_cart", [paths.clothoid(BENT, deviation=deviation, tangent=True)])


def test_a_margin_keeps_its_share_of_every_load() -> None:
    robot, line = rb.load_robot("differential_cart"), paths.line([0, 0, 0], [3, 0, 0])
    run = paths.time_optimal(robot, [line], margin=0.8)
    v, rate = run.twist(run.time), run.twist.rate(run.time)
    # Along a straight line b is [1, 0, 0] and does not change.
    model = ContactForces(robot, np.tile([1.0, 0.0, 0.0], (len(v), 1)), 0.0, None, bend=np.zeros_like(v))
    x, _ = least_norm(model)
    loads = model.loads.at(x.at(np.column_stack([rate[:, 0], v[:, 0] ** 2])))
    at_rest = model.loads.at(x.at(np.zeros((len(v), 2))))
    kept = (loads / at_rest).min()
    assert kept == pytest.approx(0.2, abs=1e-3)
    assert run.usage["lift-off"].max() == pytest.approx(0.8, abs=1e-3)


def test_margins_rates_and_friction_slow_it_down() -> None:
    legs = [paths.line([0, 0, 0], [1, 0.5, 1.0])]
    full = paths.time_optimal("omni_platform", legs)
    slower = paths.time_optimal("omni_platform", legs, margin=0.7)
    assert max(usage.max() for usage in slower.usage.values()) == pytest.approx(0.7, rel=1e-3)
    icy = paths.time_optimal("omni_platform", legs, ground_friction=0.1)
    gentle = paths.time_optimal("omni_platform", legs, wheel_acceleration=10.0)
    assert set(gentle.active) == {"wheel_acceleration"}
    wheels = gentle.twist.mapped(rb.WheelKinematics("omni_platform").drive_matrix)
    assert np.abs(wheels.rate(gentle.time)).max() == pytest.approx(10.0, rel=2e-3)
    assert full.duration < min(slower.duration, icy.duration, gentle.duration)


def test_legs_follow_each_other_with_rests() -> None:
    legs = paths.square(1.0, tangent=False)[:2]
    run, resting = (paths.time_optimal("kiwi", legs, pause=pause) for pause in (0.0, 0.3))
    assert resting.duration == pytest.approx(run.duration + 0.3)
    assert (np.diff(resting.twist.breaks) > 0).all()
    corner = paths.time_optimal("kiwi", legs[:1]).duration
    assert resting.twist(np.linspace(corner + 1e-3, corner + 0.299, 9)) == pytest.approx(np.zeros((9, 3)), abs=1e-9)


@pytest.mark.parametrize("make", [robots.mecanum, robots.kiwi])
def test_contact_forces_on_a_curve_are_those_of_the_rigid_body(make: Any) -> None:
    """The efforts that the forces need lead in `RollingDynamics` to the same rate of the twist."""
    robot = without_damping(make())
    rng = np.random.default_rng(2)
    b, c, accelerations = rng.normal(size=(20, 3)), rng.normal(size=(20, 3)), rng.normal(size=(20, 2))
    accelerations[:, 1] **= 2
    model = ContactForces(robot, b, 0.0, None, bend=c)
    x, able = least_norm(model)
    assert able.all()
    efforts = model.efforts.at(x.at(accelerations))
    rates = RollingDynamics(rb.WheelKinematics(robot)).acceleration(b * np.sqrt(accelerations[:, 1:]), efforts)
    assert rates == pytest.approx(b * accelerations[:, :1] + c * accelerations[:, 1:], abs=1e-9)
    assert model.loads.at(x.at(accelerations)).sum(axis=1) == pytest.approx(np.full(20, robot.mass * GRAVITY))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=8, deadline=None)
def test_lines_through_cones_end_at_the_optimum_of_the_cone_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    constant, slope = rng.normal(size=(10, 5, 3)), 0.5 * rng.normal(size=(10, 5, 3))
    constant[:, 0], slope[:, 0] = [5.0, 0.0, 0.0], [0.0, 1.0, 0.0]
    low, high = section(constant, slope)
    for objective, bound in ((-1.0, low), (1.0, high)):
        z, feasible = maximize(np.full((10, 1), objective), Cones(constant=constant, slope=slope[..., np.newaxis]))
        assert (feasible == (high > low)).all()
        assert z[feasible, 0] == pytest.approx(bound[feasible], abs=1e-6)


@pytest.mark.parametrize(
    ("robot", "leg", "sharing"),
    [
        ("youbot_base", paths.clothoid(BENT, yaw=[1.0, np.nan, 3.0]), "least_norm"),
        (changed("omni_platform", max_effort=2.0), paths.spline(BENT, yaw=[1.0, np.nan, 3.0]), "least_norm"),
        ("kiwi", paths.figure_eight(1.5, tangent=True), "least_norm"),
        (changed("six_wheel", friction=0.2), paths.arc(2.0, 1.5, tangent=True), "best"),
    ],
    ids=["youbot", "omni", "kiwi", "six_wheel"],
)
def test_the_time_is_that_of_an_independent_program(robot: Any, leg: Any, sharing: Any) -> None:
    """Verscheure et al. (2009) by Clarabel: friction circles exact, midpoints, the leg's own parameter."""
    robot = rb.load_robot(robot)
    found = paths.time_optimal(robot, [leg], sharing=sharing).duration
    assert found == pytest.approx(independent_time(robot, leg, sharing, count=80), rel=0.01)


def independent_time(robot: rb.Robot, leg: Any, sharing: str, count: int) -> float:
    """Shortest time along a leg of a robot without castors and steered wheels."""
    path = CubicSpline(np.linspace(0, 1, len(leg.q_xyt)), leg.q_xyt)
    program, step = MathematicalProgram(), 1 / count
    # Squared speeds at the nodes and, by rotated cones, at most their roots and at least the times of the intervals.
    x, root = program.NewContinuousVariables(count + 1, "x"), program.NewContinuousVariables(count + 1, "root")
    time = program.NewContinuousVariables(count, "time")
    program.AddBoundingBoxConstraint(0, 0, x[[0, -1]])
    for k in range(count + 1):
        program.AddRotatedLorentzConeConstraint([[1, 0], [0, 0], [0, 1]], [0, 1, 0], [x[k], root[k]])
    for k in range(count):
        rows = [[1, 0, 0], [0, 1, 1], [0, 0, 0]]
        program.AddRotatedLorentzConeConstraint(rows, [0, 0, math.sqrt(2 * step)], [time[k], root[k], root[k + 1]])
        forces = program.NewContinuousVariables(2 * len(robot.wheels) + 3)
        limits = _limits(robot, path, (k + 0.5) * step, step, sharing)
        for kind, rows in limits:
            variables = np.concatenate([x[k : k + 2], forces])
            if kind == "zero":
                program.AddLinearEqualityConstraint(rows[:, :-1], -rows[:, -1], variables)
            elif kind == "positive":
                program.AddLinearConstraint(rows[:, :-1], -rows[:, -1], np.full(len(rows), np.inf), variables)
            else:
                program.AddLorentzConeConstraint(rows[:, :-1], rows[:, -1], variables)
    program.AddLinearCost(np.ones(count), 0.0, time)
    result = ClarabelSolver().Solve(program)
    assert result.is_success()
    return float(result.get_optimal_cost())


def _limits(robot: rb.Robot, path: Any, at: float, step: float, sharing: str) -> list[tuple[str, np.ndarray]]:
    """What must be zero, positive, or in a cone at one point of a path.

    Rows are affine in the squared speeds before and after it, in the force of the ground on each wheel in B, and in a
    wrench; the last column is the constant. With u = s'' and x = s'^2.
    """
    wheels, count = robot.wheels, len(robot.wheels)
    unit = np.eye(2 + 2 * count + 3 + 1)
    u, x, one = (unit[1] - unit[0]) / (2 * step), (unit[0] + unit[1]) / 2, unit[-1]
    force, wrench = unit[2 : 2 + 2 * count].reshape(count, 2, -1), unit[2 + 2 * count : -1]
    yaw, slope, bend = path(at)[2], path(at, 1), path(at, 2)
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    b, w = np.append(turn @ slope[:2], slope[2]), slope[2]
    c = np.append(turn @ bend[:2] - w * quarter @ turn @ slope[:2], bend[2])
    rate = np.outer(b, u) + np.outer(c, x)
    com, height = robot.inertia.com[:2], robot.inertia.com[2] - robot.ground_height
    # The acceleration of Bo in W, seen in B, is the path's own; that of the mass centre has two terms more.
    push = np.outer(turn @ slope[:2], u) + np.outer(turn @ bend[:2], x)
    push += np.outer(quarter @ com, rate[2]) - w**2 * np.outer(com, x)
    rows, left = rb.WheelKinematics(robot).rolling_matrix, _sideways(robot)
    found, tilt, efforts = [], -robot.mass * height * push, []
    for i, wheel in enumerate(wheels):
        ahead = np.array([math.cos(wheel.heading), math.sin(wheel.heading)])
        axis = ahead + wheel.roller_slope * (quarter @ ahead)
        across = quarter @ axis / np.linalg.norm(axis)
        spin = axle_inertia(wheel) / wheel.radius
        tilt -= spin * (np.outer(ahead, rows[i] @ rate) + w * (rows[i] @ b) * np.outer(quarter @ ahead, x))
        efforts.append(wheel.radius * (ahead @ force[i]) + spin * (rows[i] @ rate))
        if wheel.ring is not None:
            momentum = roller_inertia(wheel).moment[0, 0] / wheel.rollers.radius * math.hypot(1.0, wheel.roller_slope)
            found.append(("zero", [across @ force[i] + momentum / wheel.rollers.radius * (left[i] @ rate)]))
            tilt -= momentum * np.outer(across, left[i] @ rate)
            tilt -= momentum * w * (left[i] @ b) * np.outer(quarter @ across, x)
        found.append(("positive", [wheel.max_speed**2 * one - (rows[i] @ b / wheel.radius) ** 2 * x]))
        found.append(("positive", [wheel.max_effort * one - efforts[-1], wheel.max_effort * one + efforts[-1]]))
    arms = np.array([wheel.p_BoHo_B[:2] for wheel in wheels]) - com
    moment = np.einsum("i,ik->k", arms[:, 0], force[:, 1]) - np.einsum("i,ik->k", arms[:, 1], force[:, 0])
    found.append(("zero", force.sum(axis=0) - robot.mass * push))
    found.append(("zero", [moment - robot.inertia.moment[2, 2] * rate[2]]))
    weight = np.vstack([robot.mass * GRAVITY * one, tilt])
    loads = np.linalg.pinv(np.column_stack([np.ones(count), arms]).T) @ weight
    found += [("cone", [wheel.friction * loads[i], *force[i]]) for i, wheel in enumerate(wheels)]
    # Torques of least norm are those that a wrench makes through the columns of J; otherwise it does nothing.
    least = sharing == "least_norm"
    found.append(("zero", efforts - rb.WheelKinematics(robot).drive_matrix @ wrench if least else wrench))
    return [(kind, np.array(rows)) for kind, rows in found]


def _sideways(robot: rb.Robot) -> np.ndarray:
    """Speeds (n_wheels, 3) of the wheels' centres to their left, per twist."""
    heading = np.array([wheel.heading for wheel in robot.wheels])
    x, y = np.array([wheel.p_BoHo_B[:2] for wheel in robot.wheels]).T
    return np.column_stack([-np.sin(heading), np.cos(heading), y * np.sin(heading) + x * np.cos(heading)])


@pytest.mark.parametrize(
    ("robot", "legs", "options", "words"),
    [
        ("kiwi", [], {}, "legs = "),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"margin": 1.5}, "margin = 1.5: accepted: more than 0"),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"wheel_acceleration": 0.0}, "wheel_acceleration = 0"),
        (
            "kiwi",
            [paths.line([0, 0, 0], [1, 0, 0])],
            {"sharing": "even"},
            "sharing = 'even': accepted: 'least_norm' or",
        ),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"pause": -1.0}, "pause = -1.0: accepted: a number of 0"),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"pause": math.nan}, "pause holds NaN"),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"roll_resistance": -0.1}, "roll_resistance = -0.1"),
        ("kiwi", [paths.line([0, 0, 0], [1, 0, 0])], {"ground_friction": 0.0}, "however slowly"),
        ("kiwi", [paths.line([0, 0, 0], [0, 0, 0])], {}, "a leg stands still"),
        ("kiwi", [paths.spline([[1, 0], [0, 0]])], {}, "turns back on itself.* at x, y, yaw = 0.99"),
        ("differential_cart", [paths.line([0, 0, 0], [0, 1, 0])], {}, r"skid sideways \(left, right\)"),
        (changed("kiwi", max_effort=0.01), [paths.line([0, 0, 0], [1, 0, 0])], {"roll_resistance": 0.05}, "however"),
    ],
)
def test_what_cannot_be_done_is_said(robot: Any, legs: Any, options: Any, words: str) -> None:
    with pytest.raises(rb.KinematicsError, match=words):
        paths.time_optimal(robot, legs, **options)
