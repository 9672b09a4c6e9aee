"""The ideal base moves as the equations say, and Drake's planning and linearisation take it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.planning import DirectCollocation
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ControllabilityMatrix, FirstOrderTaylorApproximation, Linearize
from scipy.spatial.transform import Rotation

import robots
import rollerbench as rb
from rollerbench.systems import InverseKinematics, KinematicBase

START = np.array([1.0, -2.0, 0.5])
KIWI = KinematicBase(robots.kiwi(), command="v_xyw_B")
STEP = 1e-6  # of central differences: their error is about 1e-10


def _context(base: KinematicBase, u: Any, q_xyt: Any = START) -> Any:
    context = base.CreateDefaultContext()
    base.set_pose(context, q_xyt)
    base.get_input_port().FixValue(context, u)
    return context


@pytest.mark.parametrize("time_step", [None, 0.01])
@pytest.mark.parametrize("name", ["youbot_base", "differential_cart", "six_wheel", "kiwi"])
def test_wheel_speeds_lead_where_the_exponential_does(name: str, time_step: float | None) -> None:
    kinematics = rb.WheelKinematics(name)
    base = KinematicBase(name, time_step=time_step)
    wheel_speeds = np.linspace(1.0, 4.0, len(kinematics.drive_matrix))
    simulator = Simulator(base)
    simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    context = simulator.get_mutable_context()
    base.set_pose(context, START)
    base.GetInputPort("wheel_speeds").FixValue(context, wheel_speeds)
    simulator.AdvanceTo(2.0)
    twist = kinematics.forward(wheel_speeds)
    expected = rb.odometry.integrate(START, twist, 2.0)
    accuracy = 1e-11 if time_step else 1e-7  # Runge and Kutta are not exact on an arc
    assert base.GetOutputPort("q_xyt").Eval(context) == pytest.approx(expected, abs=accuracy)
    assert base.GetOutputPort("v_xyw_B").Eval(context) == pytest.approx(twist, abs=1e-14)
    assert np.abs(kinematics.skid_speeds(twist)).max(initial=0.0) < 1e-13


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(-3, 3)] * 3), st.floats(-10, 10))
def test_the_pose_changes_by_the_twist_turned_by_the_yaw(v_xyw_B: tuple[float, ...], yaw: float) -> None:
    context = _context(KIWI, v_xyw_B, [0.3, 0.4, yaw])
    expected = Rotation.from_euler("z", yaw).apply([*v_xyw_B[:2], 0.0])[:2]
    rate = KIWI.EvalTimeDerivatives(context).CopyToVector()
    assert rate == pytest.approx([*expected, v_xyw_B[2]], abs=1e-14)


@pytest.mark.parametrize(
    ("robot", "expected"),
    [
        (robots.mecanum(), [0.3, 0.4, 0.5]),
        (robots.swerve(), [0.3, 0.4, 0.5]),
        (robots.cart(), [0.3, 0.0, 0.5]),
    ],
    ids=["rollers", "steered", "fixed"],
)
def test_a_twist_is_projected_on_what_fixed_tyres_allow(robot: Any, expected: list[float]) -> None:
    base = KinematicBase(robot, command="v_xyw_B")
    twist = base.GetOutputPort("v_xyw_B").Eval(_context(base, [0.3, 0.4, 0.5]))
    assert twist == pytest.approx(expected, abs=1e-15)


def test_wheel_speeds_without_residual_make_no_tyre_skid() -> None:
    """A tyre under a Mecanum base: it gives way to wheels that would strafe, and their residual tells."""
    data = robots.mecanum()
    tyre = {**robots.TYRE, "name": "tyre", "position": [0.0, 0.0, 0.05], "driven": False}
    kinematics = rb.WheelKinematics({**data, "wheels": [*data["wheels"], tyre]})
    base = KinematicBase(kinematics)
    for twist, skids in (([0.3, 0.0, 0.4], False), ([0.0, 0.3, 0.0], True)):
        wheel_speeds = kinematics.inverse(twist, strict=False)
        skid = kinematics.skid_speeds(base.GetOutputPort("v_xyw_B").Eval(_context(base, wheel_speeds)))
        for size in (np.abs(skid).max(), np.abs(kinematics.residual(wheel_speeds)).max()):
            assert size > 1e-3 if skids else size < 1e-13


def test_wheel_speeds_of_steered_wheels_mean_nothing_without_their_angles() -> None:
    with pytest.raises(rb.KinematicsError, match=r"swerve_base steers wheels.*accepted: robots that do not steer"):
        KinematicBase("swerve_base")
    angles = dict.fromkeys(["front_left", "front_right", "rear_left", "rear_right"], np.pi / 2)
    held = rb.WheelKinematics("swerve_base", swivel_angles=angles)
    base = KinematicBase(held)
    twist = base.GetOutputPort("v_xyw_B").Eval(_context(base, [4.0] * 4))
    assert twist == pytest.approx([0.0, 4.0 * held.robot.driven_wheels[0].radius, 0.0], abs=1e-15)


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="command = 'torques': accepted: 'wheel_speeds', 'v_xyw_B'"):
        KinematicBase("kiwi", command="torques")  # type: ignore[arg-type]
    for time_step in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(rb.KinematicsError, match=f"time_step = {time_step}"):
            KinematicBase("kiwi", time_step=time_step)
    with pytest.raises(rb.KinematicsError, match="leave a motion of the body open"):
        KinematicBase({**robots.kiwi(), "wheels": [{**w, "driven": False} for w in robots.kiwi()["wheels"]]})
    for pose in ([0.0, 1.0], [0.0, 1.0, np.nan]):
        with pytest.raises(rb.KinematicsError, match=r"accepted: three finite numbers \[x, y, yaw\]"):
            KIWI.set_pose(KIWI.CreateDefaultContext(), pose)


def _driven(robot: Any, time_step: float | None) -> tuple[Diagram, KinematicBase]:
    """Inverse kinematics before the base: from a twist to the pose."""
    builder = DiagramBuilder()
    inverse = builder.AddNamedSystem("inverse", InverseKinematics(robot))
    base = builder.AddNamedSystem("base", KinematicBase(robot, time_step=time_step))
    builder.Connect(inverse.GetOutputPort("wheel_speeds"), base.GetInputPort("wheel_speeds"))
    builder.ExportInput(inverse.GetInputPort("v_xyw_B"), "v_xyw_B")
    builder.ExportOutput(base.GetOutputPort("q_xyt"), "q_xyt")
    return builder.Build(), base


def _motion(system: Diagram, context: Any) -> Any:
    """Rate of the state, or the next state."""
    if context.has_only_continuous_state():
        return system.EvalTimeDerivatives(context).CopyToVector()
    return system.EvalUniquePeriodicDiscreteUpdate(context).get_vector().CopyToVector()


@pytest.mark.parametrize("time_step", [None, 0.05], ids=["continuous", "discrete"])
@pytest.mark.parametrize("composed", [False, True], ids=["alone", "composed"])
@pytest.mark.parametrize("name", ["youbot_base", "differential_cart"])
def test_linearisation_is_the_finite_difference(name: str, composed: bool, time_step: float | None) -> None:
    if composed:
        system, base = _driven(name, time_step)
    else:
        system = base = KinematicBase(name, time_step=time_step)
    size = system.get_input_port().size()
    random = np.random.default_rng(3)
    points = [*random.uniform(-3, 3, (4, 3 + size)), np.zeros(3 + size), np.concatenate([START, np.full(size, 2.0)])]
    for point in points:

        def moved(values: Any) -> Any:
            context = system.CreateDefaultContext()
            base.set_pose(base.GetMyMutableContextFromRoot(context) if composed else context, values[:3])
            system.get_input_port().FixValue(context, values[3:])
            return context

        linear = FirstOrderTaylorApproximation(system, moved(point))
        steps = STEP * np.eye(len(point))
        ends = [[_motion(system, moved(point + sign * step)) for step in steps] for sign in (1, -1)]
        differences = (np.array(ends[0]) - np.array(ends[1])).T / (2 * STEP)
        assert np.hstack([linear.A(), linear.B()]) == pytest.approx(differences, abs=1e-8)
        assert linear.C() == pytest.approx(np.eye(3), abs=0)


@pytest.mark.parametrize(("name", "rank"), [("youbot_base", 3), ("differential_cart", 2)])
def test_at_rest_only_an_omnidirectional_base_is_linearly_controllable(name: str, rank: int) -> None:
    """Source: Campion, Bastin, d'Andrea-Novel (1996), section V."""
    base = KinematicBase(name)
    linear = Linearize(base, _context(base, np.zeros(base.get_input_port().size())))
    assert np.linalg.matrix_rank(ControllabilityMatrix(linear)) == rank


def test_direct_collocation_takes_it() -> None:
    """Its dynamics hold along a motion that the equations give, and fail beside it."""
    kinematics = rb.WheelKinematics("youbot_base")
    base = KinematicBase(kinematics)
    problem = DirectCollocation(base, base.CreateDefaultContext(), 3, 0.01, 0.01)
    wheel_speeds = np.array([3.0, -1.0, 2.0, 6.0])
    poses = rb.odometry.integrate(START, kinematics.forward(wheel_speeds), np.array([0.0, 0.01, 0.02]))
    values = np.zeros(problem.prog().num_vars())
    for index, pose in enumerate(poses):
        for variables, numbers in (
            (problem.time_step(min(index, 1)), [0.01]),
            (problem.state(index), pose),
            (problem.input(index), wheel_speeds),
        ):
            values[problem.prog().FindDecisionVariableIndices(np.ravel(variables))] = numbers
    defects = [problem.prog().EvalBinding(binding, values) for binding in problem.prog().generic_constraints()]
    assert len(defects) == 2
    assert np.abs(defects).max() < 1e-8  # Hermite and Simpson: of fourth order
    values[problem.prog().FindDecisionVariableIndices(problem.state(1))] += [1e-3, 0.0, 0.0]
    off = [problem.prog().EvalBinding(binding, values) for binding in problem.prog().generic_constraints()]
    assert np.abs(off).max() > 1e-2
