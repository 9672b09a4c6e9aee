"""The limiter keeps the direction of twists and, whatever is commanded, the limits of every wheel."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from pydrake.autodiffutils import ExtractGradient, ExtractValue, InitializeAutoDiff
from pydrake.symbolic import Evaluate, Expression, MakeVectorVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import robots
import rollerbench as rb
from rollerbench.systems import TwistLimiter

Array = NDArray[np.float64]
DT = 0.01
SETTINGS = [
    {},
    {"max_wheel_acceleration": 20.0},
    {"max_wheel_acceleration": 20.0, "max_wheel_jerk": 400.0},
]


@cache
def limited_robot(name: str, max_speeds: tuple[float, ...] = (8.0, 10.0, 9.0, 11.0)) -> rb.Robot:
    data = robots.ALL[name]()
    driven = [wheel for wheel in data["wheels"] if wheel["type"] != "castor"]
    for wheel, speed in zip(driven, max_speeds, strict=False):
        wheel["max_speed"] = speed
    return rb.load_robot(data)


def update(limiter: TwistLimiter, context: Any) -> Array:
    """The output after one update; the same without a Simulator, which would be slower."""
    state = limiter.EvalUniquePeriodicDiscreteUpdate(context)
    values = [state.value(group).copy() for group in range(state.num_groups())]
    for group, value in enumerate(values):
        context.SetDiscreteState(group, value)
    return np.array(limiter.GetOutputPort("v_xyw_B").Eval(context))


def follow(limiter: TwistLimiter, commands: ArrayLike, centers: ArrayLike | None = None) -> Array:
    """Outputs (n, 3) after each of the commands (n, 3)."""
    context = limiter.CreateDefaultContext()
    outputs = []
    for index, command in enumerate(np.asarray(commands, np.float64)):
        limiter.GetInputPort("v_xyw_B").FixValue(context, command)
        if centers is not None:
            limiter.GetInputPort("p_BoCo_B").FixValue(context, np.asarray(centers)[index])
        outputs.append(update(limiter, context))
    return np.array(outputs)


@pytest.mark.parametrize("arguments", SETTINGS)
@pytest.mark.parametrize("name", list(robots.ALL))
def test_direction_is_kept_under_saturation(name: str, arguments: dict[str, float]) -> None:
    """From rest to a speed that is too much, and back to rest; at the end a wheel turns as fast as it may."""
    command = np.array([5.0, -3.0, 20.0])
    limiter = TwistLimiter(limited_robot(name), DT, **arguments)
    v = follow(limiter, np.repeat([command, np.zeros(3)], 200, axis=0))
    along = v @ command / (command @ command)
    assert np.abs(v - along[:, np.newaxis] * command).max() < 1e-9 * np.abs(v).max()
    assert (limiter.limits.wheel_speeds(v[199]) / limiter.limits.speeds).max() == pytest.approx(1.0, abs=1e-9)
    assert v[199] == pytest.approx(limiter.limits.scale(command), rel=1e-9)
    assert not v[-1].any()


finite_twists = st.tuples(*[st.floats(-limit, limit) for limit in (20.0, 20.0, 100.0)])
places = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


@settings(max_examples=40, deadline=None)
@given(
    name=st.sampled_from(list(robots.ALL)),
    time_step=st.sampled_from([0.002, 0.01, 0.05]),
    hold=st.sampled_from(["twist", "displacement"]),
    speeds=st.lists(st.floats(0.5, 50.0), min_size=4, max_size=4),
    acceleration=st.floats(2.0, 200.0),
    ramp_steps=st.floats(0.3, 30.0),
    commands=st.lists(st.tuples(finite_twists, places, st.integers(1, 15)), min_size=1, max_size=12),
    data=st.data(),
)
def test_no_wheel_ever_exceeds_a_limit(
    name: str,
    time_step: float,
    hold: Any,
    speeds: list[float],
    acceleration: float,
    ramp_steps: float,
    commands: list[Any],
    data: st.DataObject,
) -> None:
    """Jumps of the command and of the rotation centre included."""
    robot = limited_robot(name)
    names = [wheel.name for wheel in robot.driven_wheels]
    factors = data.draw(st.lists(st.floats(0.5, 2.0), min_size=len(names), max_size=len(names)))
    accelerations = {wheel: factor * acceleration for wheel, factor in zip(names, factors, strict=True)}
    jerk = acceleration / (ramp_steps * time_step)
    limiter = TwistLimiter(
        robot,
        time_step,
        max_wheel_speed=dict(zip(names, speeds, strict=False)),
        max_wheel_acceleration=accelerations,
        max_wheel_jerk=jerk,
        hold=hold,
        p_BoCo_B="port",
    )
    twists = np.repeat([twist for twist, _, _ in commands], [count for _, _, count in commands], axis=0)
    centers = np.repeat([place for _, place, _ in commands], [count for _, _, count in commands], axis=0)
    v = np.vstack([np.zeros((2, 3)), follow(limiter, twists, centers)])
    limits = limiter.limits
    rounding = 1 + 1e-9, 1e-12 * max(speeds)
    assert (limits.wheel_speeds(v) <= limits.speeds * rounding[0]).all()
    changes = np.diff(v, axis=0)
    allowed = np.array(list(accelerations.values())) * time_step
    assert (limits.wheel_speeds(changes) <= allowed * rounding[0] + rounding[1]).all()
    assert (limits.wheel_speeds(np.diff(changes, axis=0)) <= jerk * time_step**2 * rounding[0] + rounding[1]).all()
    # The same by the rows of the kinematics, and by the speeds that wheels have as they steer.
    kinematics = rb.WheelKinematics(robot)
    wheel_speeds = np.abs(kinematics.inverse(v, strict=False))
    assert (wheel_speeds <= limits.speeds * rounding[0]).all()
    if name == "swerve":
        steered = kinematics.steering(v)[1]
        assert (steered <= limits.speeds * rounding[0]).all()
        assert (np.abs(np.diff(steered, axis=0)) <= allowed * rounding[0] + rounding[1]).all()


@pytest.mark.parametrize("arguments", SETTINGS)
def test_limits_are_used(arguments: dict[str, float]) -> None:
    """A reversal at full speed takes the time that the limits ask for."""
    limiter = TwistLimiter(limited_robot("mecanum"), DT, **arguments)
    v = follow(limiter, [[5.0, 0.0, 0.0]] * 100 + [[-5.0, 0.0, 0.0]] * 150)
    wheel_speed = v[:, 0] / 0.05
    steps = int(np.flatnonzero(wheel_speed <= -8.0 * (1 - 1e-9))[0]) - 99
    assert wheel_speed[99] == pytest.approx(8.0)
    ramp = int(np.ceil(16.0 / (20.0 * DT)))
    assert steps == [1, ramp, ramp + limiter.limits.samples - 1][SETTINGS.index(arguments)]


@pytest.mark.parametrize("arguments", SETTINGS)
@pytest.mark.parametrize("command", [[4.0, 1.0, 30.0], [-1.0, 6.0, -0.5]])
def test_heading_does_not_drift_in_saturation(command: list[float], arguments: dict[str, float]) -> None:
    """After 1000 saturated steps the heading is the commanded curvature times the path."""
    v = follow(TwistLimiter(limited_robot("mecanum"), DT, **arguments), [command] * 1000)
    q = rb.odometry.accumulate(np.zeros(3), v * DT)
    path = np.sum(np.linalg.norm(v[:, :2], axis=1)) * DT
    assert q[-1, 2] == pytest.approx(command[2] / np.hypot(*command[:2]) * path, rel=1e-9)
    # On one circle all the time.
    radius = np.array([-command[1], command[0]]) / command[2]
    assert np.linalg.norm(q[:, :2] - radius, axis=1) == pytest.approx(np.linalg.norm(radius), rel=1e-9)


@pytest.mark.parametrize("arguments", SETTINGS)
def test_a_saturated_translation_keeps_the_heading_at_exactly_zero(arguments: dict[str, float]) -> None:
    v = follow(TwistLimiter(limited_robot("kiwi"), DT, **arguments), [[30.0, -7.0, 0.0]] * 1000)
    q = rb.odometry.accumulate(np.zeros(3), v * DT)
    assert np.linalg.norm(q[-1]) > 1.0
    assert not q[:, 2].any()
    assert q[:, 1] == pytest.approx(-7 / 30 * q[:, 0], rel=1e-9)


def drive_along_world_x(limiter: TwistLimiter, speed: float, yaw_rate: float, steps: int = 1000) -> Array:
    """Poses (steps + 1, 3) of C, commanded to world +x while the body spins, as seen at the start of each step."""
    context = limiter.CreateDefaultContext()
    q = [np.zeros(3)]
    for _ in range(steps):
        velocity_B = rb.odometry.rotate(-q[-1][2], [speed, 0.0])
        limiter.GetInputPort("v_xyw_B").FixValue(context, np.append(velocity_B, yaw_rate))
        q.append(rb.odometry.integrate(q[-1], update(limiter, context), DT))
    return np.array(q)


@pytest.mark.parametrize("name", ["mecanum", "kiwi", "swerve"])
def test_displacements_stay_on_a_world_line_while_spinning(name: str) -> None:
    speed, yaw_rate = 3.0, 10.0
    robot = limited_robot(name)
    q = drive_along_world_x(TwistLimiter(robot, DT, hold="displacement"), speed, yaw_rate)
    path = q[-1, 0]
    assert path < 0.5 * speed * DT * 1000  # saturated
    assert np.abs(q[:, 1]).max() < 1e-9 * path
    assert q[:, 2] == pytest.approx(yaw_rate / speed * q[:, 0], rel=1e-9)
    # Without the compensation it leaves the line, by half of a step's turn: so this test can fail.
    plain = drive_along_world_x(TwistLimiter(robot, DT), speed, yaw_rate)
    drift = 0.5 * DT * plain[-1, 2] / (1000 * DT) * plain[-1, 0]
    assert plain[-1, 1] == pytest.approx(drift, rel=0.1)
    assert plain[-1, 1] > 1e-3 * path


def test_a_displacement_on_its_way_from_rest_is_off_by_less_than_half_of_its_turn() -> None:
    command = np.array([0.2, 0.1, 0.8])
    v = follow(
        TwistLimiter(limited_robot("kiwi"), 0.1, hold="displacement", max_wheel_acceleration=10.0), [command] * 20
    )
    moved = rb.odometry.integrate(np.zeros(3), v, 0.1)
    share = v[:, 2] / v[-1, 2]
    angle = np.arctan2(moved[:, 1], moved[:, 0]) - np.arctan2(0.1, 0.2)
    assert 0.1 < share[0] < 0.5
    assert angle == pytest.approx(-(1 - share) * 0.5 * 0.1 * v[-1, 2], abs=1e-12)
    assert moved[-1] == pytest.approx(0.1 * command, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    name=st.sampled_from(["mecanum", "kiwi", "swerve", "mixed"]),
    command=st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-300, 300)),
    place=places,
)
def test_a_limited_displacement_has_the_commanded_direction(name: str, command: Any, place: Any) -> None:
    """Its point C moves along the commanded chord, and a wheel is at its limit if it could not move as commanded."""
    robot = limited_robot(name)
    time_step = 0.03
    limiter = TwistLimiter(robot, time_step, hold="displacement", p_BoCo_B="port")
    twist = follow(limiter, [command], [place])[0]
    about_C = twist + twist[2] * np.array([-place[1], place[0], 0.0])
    moved = rb.odometry.integrate(np.zeros(3), about_C, time_step) / time_step
    wanted = np.array(command)
    size = np.linalg.norm(wanted)
    scale = moved @ wanted / size**2 if size else 1.0
    assert moved == pytest.approx(scale * wanted, abs=1e-9 * (1 + np.linalg.norm(moved)))
    load = (limiter.limits.wheel_speeds(twist) / limiter.limits.speeds).max()
    assert load <= 1 + 1e-9
    if scale < 1 - 1e-6:
        assert load == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("name", list(robots.ALL))
def test_the_rotation_centre_is_that_of_the_moved_robot(name: str) -> None:
    robot, place, command = limited_robot(name), np.array([0.3, -0.2]), np.array([0.02, -0.03, 0.1])
    moved = rb.WheelKinematics(robot).at(place)
    limiter = TwistLimiter(robot, DT, p_BoCo_B=place)
    own = rb.WheelKinematics(robot)
    twist = follow(limiter, [command])[0]
    assert own.drive_matrix @ twist == pytest.approx(moved.drive_matrix @ command, abs=1e-12)
    # Saturated: scaled, and the centre of a pure rotation stays where it is.
    turning = follow(limiter, [[0.0, 0.0, 200.0]])[0]
    assert own.icr(turning) == pytest.approx(place, abs=1e-9)
    # The same by the port, and with the kinematics of the moved robot, whose output is that of its own point.
    port = TwistLimiter(robot, DT, p_BoCo_B="port")
    assert follow(port, [command], [place])[0] == pytest.approx(twist, abs=1e-15)
    theirs = TwistLimiter(moved, DT)
    assert follow(theirs, [command])[0] == pytest.approx(command, abs=1e-15)
    assert moved.icr(follow(theirs, [[0.0, 0.0, 200.0]])[0]) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert theirs.limits.wheel_speeds(command) == pytest.approx(limiter.limits.wheel_speeds(twist), abs=1e-12)


VALUES = [np.zeros(5), np.array([0.1, 0.2, 0.3, 0.05, 0.1]), np.array([3.0, 1.0, -2.0, 0.2, 0.1])]


def every_limit(hold: Any) -> TwistLimiter:
    """With all its parts, and wheels that are alike."""
    limits = {"max_wheel_acceleration": 500.0, "max_wheel_jerk": 50000.0}
    return TwistLimiter(limited_robot("mecanum", (8.0,) * 4), DT, **limits, hold=hold, p_BoCo_B="port")


def step(limiter: Any, inputs: Any) -> Array:
    """The output from rest, for [v_xyw_B; p_BoCo_B] of any scalar type."""
    context = limiter.CreateDefaultContext()
    limiter.GetInputPort("v_xyw_B").FixValue(context, inputs[:3])
    limiter.GetInputPort("p_BoCo_B").FixValue(context, inputs[3:])
    return update(limiter, context)


@pytest.mark.parametrize("hold", ["twist", "displacement"])
def test_gradients_are_those_of_finite_differences(hold: Any) -> None:
    limiter = every_limit(hold)
    derived = limiter.ToAutoDiffXd()
    for value in VALUES:
        output = step(derived, InitializeAutoDiff(value).ravel())
        assert ExtractValue(output).ravel() == pytest.approx(step(limiter, value), abs=1e-14)
        shifts = 1e-6 * np.eye(5)
        differences = [step(limiter, value + shift) - step(limiter, value - shift) for shift in shifts]
        # As good as such differences are.
        assert ExtractGradient(output) == pytest.approx(np.transpose(differences) / 2e-6, abs=1e-8)


@pytest.mark.parametrize("hold", ["twist", "displacement"])
def test_expressions_have_the_values_of_numbers(hold: Any) -> None:
    limiter = every_limit(hold)
    symbolic = limiter.ToSymbolic()
    variables = MakeVectorVariable(5, "u")
    expressions = step(symbolic, variables) if hold == "twist" else None
    for value in VALUES:
        if expressions is None:
            found = Evaluate(step(symbolic, [Expression(number) for number in value])).ravel()
        else:
            found = Evaluate(expressions, dict(zip(variables, value, strict=True))).ravel()
        assert found == pytest.approx(step(limiter, value), abs=1e-14)


def test_a_gradient_where_wheels_tie_is_finite() -> None:
    """Straight on, all wheels of a Mecanum base reach their limit together."""
    derived = TwistLimiter(limited_robot("mecanum", (8.0,) * 4), DT, max_wheel_acceleration=20.0).ToAutoDiffXd()
    context = derived.CreateDefaultContext()
    derived.GetInputPort("v_xyw_B").FixValue(context, InitializeAutoDiff(np.array([5.0, 0.0, 0.0])).ravel())
    output = update(derived, context)
    assert ExtractValue(output).ravel() == pytest.approx([20.0 * DT * 0.05, 0.0, 0.0], rel=1e-9)
    assert np.isfinite(ExtractGradient(output)).all()


def test_it_holds_a_command_for_a_step_in_a_simulation() -> None:
    """Without limits it is a zero-order hold; the command at t_k is what holds until t_k + dt."""
    builder = DiagramBuilder()
    ramp = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.array([[0.0, 1.0], [0.0, -2.0], [0.0, 3.0]]))
    source = builder.AddSystem(TrajectorySource(ramp))
    limiter = builder.AddSystem(TwistLimiter(robots.mecanum(), 0.1))
    builder.Connect(source.get_output_port(), limiter.GetInputPort("v_xyw_B"))
    log = LogVectorOutput(limiter.GetOutputPort("v_xyw_B"), builder, 0.03)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    found = log.FindLog(simulator.get_context())
    times = found.sample_times()
    between = np.abs(times / 0.1 - np.round(times / 0.1)) > 0.01
    start = 0.1 * np.floor(times[between] / 0.1)
    assert found.data().T[between] == pytest.approx(np.outer(start, [1.0, -2.0, 3.0]), abs=1e-12)
    assert limiter.GetOutputPort("v_xyw_B").get_index() == 0
    assert not limiter.HasAnyDirectFeedthrough()


def test_it_can_start_moving() -> None:
    limiter = TwistLimiter(limited_robot("mecanum"), DT, max_wheel_acceleration=20.0, max_wheel_jerk=400.0)
    context = limiter.CreateDefaultContext()
    twist = [0.1, -0.05, 0.2]
    limiter.set_twist(context, twist)
    limiter.GetInputPort("v_xyw_B").FixValue(context, twist)
    assert limiter.GetOutputPort("v_xyw_B").Eval(context) == pytest.approx(twist, abs=1e-15)
    for _ in range(20):
        assert update(limiter, context) == pytest.approx(twist, abs=1e-15)
    with pytest.raises(rb.KinematicsError, match="fl would turn at 20 rad/s; accepted: 8 at most"):
        limiter.set_twist(context, [1.0, 0.0, 0.0])
    with pytest.raises(rb.KinematicsError, match=r"v_xyw_B has shape \(2,\)"):
        limiter.set_twist(context, [1.0, 0.0])


def test_limits_come_from_the_robot_and_by_name() -> None:
    robot = limited_robot("mecanum")
    limits = TwistLimiter(robot, DT, max_wheel_speed={"fl": 3.0, "rr": None}, max_wheel_acceleration={"fr": 5.0}).limits
    assert limits.speeds.tolist() == [3.0, 10.0, 9.0, np.inf]
    assert limits.speed_changes.tolist() == [np.inf, 5.0 * DT, np.inf, np.inf]
    assert TwistLimiter(robot, DT, max_wheel_speed=2.0).limits.speeds.tolist() == [2.0] * 4
    # The functions without Drake are what the System does.
    limits = TwistLimiter(robot, DT, max_wheel_acceleration=20.0).limits
    expected, command = np.zeros(3), np.array([2.0, 1.0, -3.0])
    found = follow(TwistLimiter(robot, DT, max_wheel_acceleration=20.0), [command] * 30)
    for twist in found:
        expected = limits.approach(expected, limits.scale(command))
        assert twist == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"time_step": 0.0}, "time_step = 0.0: accepted: a positive number"),
        ({"time_step": float("nan")}, "time_step = nan"),
        ({"max_wheel_speed": -1.0}, "max_wheel_speed = -1.0: accepted: a positive number, or None"),
        ({"max_wheel_acceleration": float("nan")}, "max_wheel_acceleration = nan"),
        ({"max_wheel_acceleration": {"fl": "fast"}}, r"max_wheel_acceleration\['fl'\] = 'fast'"),
        ({"max_wheel_acceleration": {"front": 1.0}}, r"\['front'\]: not a driven wheel; accepted: fl, fr, rl, rr"),
        ({"max_wheel_jerk": 1.0}, "max_wheel_jerk of fl = 1, but it has no max_wheel_acceleration"),
        (
            {"max_wheel_acceleration": 20.0, "max_wheel_jerk": 1.0},
            "jerk of fl = 1: keeping it would take a mean of 4000 time steps of 0.01 s; accepted: 8 or more",
        ),
        ({"hold": "arc"}, "hold = 'arc': accepted: 'twist', 'displacement'"),
        ({"p_BoCo_B": [1.0]}, r"p_BoCo_B has shape \(1,\): accepted: \(2,\), or 'port'"),
        ({"p_BoCo_B": "centre"}, "p_BoCo_B = 'centre'"),
        ({"p_BoCo_B": [0.0, np.inf]}, "p_BoCo_B holds NaN or infinite values"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(rb.KinematicsError, match=words):
        TwistLimiter(limited_robot("mecanum"), **{"time_step": DT, **arguments})
