"""The Systems give the numbers of the functions that they wrap, for every scalar type."""

import numpy as np
import pytest
from pydrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from pydrake.symbolic import Evaluate, MakeVectorVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

import robots
import rollerbench as rb
from rollerbench.systems import PlanarState

CASES = [
    (rb.systems.InverseKinematics, "v_xyw_B", "wheel_speeds", "drive_matrix"),
    (rb.systems.ForwardKinematics, "wheel_speeds", "v_xyw_B", "forward_matrix"),
]


@pytest.mark.parametrize(("system_class", "source", "target", "matrix"), CASES)
def test_named_ports_and_scalar_types(system_class, source: str, target: str, matrix: str) -> None:
    kinematics = rb.WheelKinematics(robots.mecanum())
    expected = getattr(kinematics, matrix)
    value = np.linspace(-1, 1, expected.shape[1])

    system = system_class(kinematics)
    context = system.CreateDefaultContext()
    system.GetInputPort(source).FixValue(context, value)
    assert system.GetOutputPort(target).Eval(context) == pytest.approx(expected @ value, abs=1e-13)

    derived = system.ToAutoDiffXd()
    context = derived.CreateDefaultContext()
    derived.GetInputPort(source).FixValue(context, InitializeAutoDiff(value).ravel())
    gradient = ExtractGradient(derived.GetOutputPort(target).Eval(context))
    assert gradient == pytest.approx(expected, abs=1e-13)

    symbolic = system.ToSymbolic()
    context = symbolic.CreateDefaultContext()
    variables = MakeVectorVariable(expected.shape[1], "u")
    symbolic.GetInputPort(source).FixValue(context, variables)
    outputs = symbolic.GetOutputPort(target).Eval(context)
    numbers = Evaluate(np.array(outputs), dict(zip(variables, value, strict=True))).ravel()
    assert numbers == pytest.approx(expected @ value, abs=1e-12)


def test_odometry_integrates_the_exponential() -> None:
    kinematics = rb.WheelKinematics("youbot_base")
    odometry = rb.systems.Odometry("youbot_base", time_step=0.01)
    simulator = Simulator(odometry)
    context = simulator.get_mutable_context()
    odometry.set_pose(context, [1.0, -2.0, 0.5])
    wheel_speeds = [3.0, -1.0, 2.0, 5.0]
    odometry.GetInputPort("wheel_speeds").FixValue(context, wheel_speeds)
    simulator.AdvanceTo(2.0)
    expected = rb.odometry.integrate([1.0, -2.0, 0.5], kinematics.forward(wheel_speeds), 2.0)
    assert odometry.GetOutputPort("q_xyt").Eval(context) == pytest.approx(expected, abs=1e-12)


def test_odometry_stands_still_and_goes_straight() -> None:
    odometry = rb.systems.Odometry("youbot_base", time_step=0.01)
    simulator = Simulator(odometry)
    context = simulator.get_mutable_context()
    odometry.GetInputPort("wheel_speeds").FixValue(context, np.zeros(4))
    simulator.AdvanceTo(1.0)
    assert odometry.GetOutputPort("q_xyt").Eval(context) == pytest.approx(np.zeros(3), abs=0)
    odometry.GetInputPort("wheel_speeds").FixValue(context, np.full(4, 2.0))
    simulator.AdvanceTo(2.0)
    assert odometry.GetOutputPort("q_xyt").Eval(context) == pytest.approx([0.095, 0, 0], abs=1e-12)


def test_a_bad_time_step_is_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="time_step = -1"):
        rb.systems.Odometry("youbot_base", time_step=-1)


def test_systems_compose_in_a_users_diagram() -> None:
    """Inverse, then forward kinematics, then odometry: a circle closes."""
    builder = DiagramBuilder()
    inverse = builder.AddNamedSystem("inverse", rb.systems.InverseKinematics("youbot_base"))
    forward = builder.AddNamedSystem("forward", rb.systems.ForwardKinematics("youbot_base"))
    odometry = builder.AddNamedSystem("odometry", rb.systems.Odometry("youbot_base", time_step=0.001))
    builder.Connect(inverse.GetOutputPort("wheel_speeds"), forward.GetInputPort("wheel_speeds"))
    builder.Connect(inverse.GetOutputPort("wheel_speeds"), odometry.GetInputPort("wheel_speeds"))
    builder.ExportInput(inverse.GetInputPort("v_xyw_B"), "v_xyw_B")
    log = LogVectorOutput(forward.GetOutputPort("v_xyw_B"), builder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    twist = np.array([0.3, 0.1, 2 * np.pi])
    diagram.GetInputPort("v_xyw_B").FixValue(context, twist)
    simulator.AdvanceTo(1.0)
    pose = odometry.GetOutputPort("q_xyt").Eval(odometry.GetMyContextFromRoot(context))
    assert pose == pytest.approx([0, 0, 2 * np.pi], abs=1e-9)  # a thousand steps
    assert log.FindLog(context).data()[:, -1] == pytest.approx(twist, abs=1e-12)


def test_planar_state_of_a_tilted_body() -> None:
    yaw, roll = 0.7, 0.05
    half = np.array([np.cos(0.5 * roll), np.sin(0.5 * roll)])
    turn = np.array([np.cos(0.5 * yaw), np.sin(0.5 * yaw)])
    quaternion = [turn[0] * half[0], turn[0] * half[1], turn[1] * half[1], turn[1] * half[0]]
    system = PlanarState()
    context = system.CreateDefaultContext()
    velocity_B = np.array([0.4, -0.2])
    cos, sin = np.cos(yaw), np.sin(yaw)
    velocity_W = [cos * velocity_B[0] - sin * velocity_B[1], sin * velocity_B[0] + cos * velocity_B[1], 0.1]
    system.GetInputPort("state").FixValue(context, [*quaternion, 1.0, 2.0, 0.3, 0.0, 0.0, 0.9, *velocity_W])
    assert system.GetOutputPort("q_xyt").Eval(context) == pytest.approx([1.0, 2.0, yaw], abs=1e-12)
    assert system.GetOutputPort("v_xyw_B").Eval(context) == pytest.approx([*velocity_B, 0.9], abs=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda: rb.systems.Odometry("swerve_base", 0.01),
        lambda: rb.systems.ForwardKinematics("swerve_base"),
        lambda: rb.estimation.PoseFilter(
            "swerve_base",
            0.01,
            wheels=rb.uncertainty.OdometryNoise(travel=1e-4),
            gyro=rb.uncertainty.GyroNoise(density=1e-3),
            fix_deviation=[0.1, 0.1, 0.1],
        ),
    ],
)
def test_wheel_speeds_alone_are_refused_where_wheels_steer(make) -> None:
    with pytest.raises(rb.KinematicsError, match="swerve_base steers wheels"):
        make()
