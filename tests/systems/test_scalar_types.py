"""Algebraic Systems convert to AutoDiffXd and Expression and back, and say the same in every scalar type."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd, ExtractValue
from pydrake.symbolic import Evaluate, Expression, Jacobian, MakeVectorVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, System, System_
from pydrake.systems.primitives import ConstantVectorSource, Integrator

import robots
import rollerbench as rb
from rollerbench import systems
from rollerbench.kinematics.drivetrain import WheelDrive
from rollerbench.systems import PidGains

DT = 0.01
DRIVES = [
    WheelDrive(constant=0.02, amplitude=0.1, cycles=3, phase=0.4, backlash=0.05, counts=500),
    WheelDrive(amplitude=-0.2, cycles=0.5, backlash=0.02),
]

ALGEBRAIC: dict[str, Callable[[], Diagram]] = {
    "InverseKinematics": lambda: systems.InverseKinematics(robots.mixed()),
    "ForwardKinematics": lambda: systems.ForwardKinematics("six_wheel"),
    "Odometry": lambda: systems.Odometry("youbot_base", DT),
    "PlanarState": systems.PlanarState,
    "KinematicBase": lambda: systems.KinematicBase("youbot_base"),
    "KinematicBase, discrete": lambda: systems.KinematicBase("differential_cart", time_step=DT),
    "KinematicBase, by twist": lambda: systems.KinematicBase("swerve_base", command="v_xyw_B"),
    "WheelSpeedController": lambda: systems.WheelSpeedController("youbot_base", DT, [PidGains(kp=1, ki=4, kd=0.1)] * 4),
    "Drivetrain": lambda: systems.Drivetrain(DRIVES, DT),
    "TwistLimiter": lambda: systems.TwistLimiter("youbot_base", DT, max_wheel_acceleration=20.0),
    "PoseTracker": lambda: systems.PoseTracker("differential_cart"),
}

NUMERIC = {
    *("SlipMonitor", "RollResistance"),  # read the plant's contacts
    *("GaitPlanner", "LegInverseKinematics", "LegTracker", "LegWatch", "StanceOdometry", "BodyPoseController"),
    "LegServo",  # its switch for lost legs is written in Python
    "ReferenceSource",  # Drake's TrajectorySource converts from floats only
    *("SteeringKinematics", "SteeredOdometry", "PoseEstimator", "GyroSensor", "PoseFixSensor"),
}
"""Systems that are of float by nature: they branch, iterate or read what Drake has for floats only."""

SHIPPED = ["mecanum_platform", "youbot_base", "omni_platform", "kiwi", "six_wheel", "differential_cart", "swerve_base"]


def test_every_system_is_known_to_convert_or_not() -> None:
    exported = {name: getattr(systems, name) for name in systems.__all__}
    classes = {name for name, item in exported.items() if inspect.isclass(item) and issubclass(item, System)}
    assert classes == NUMERIC | {name.split(",")[0] for name in ALGEBRAIC}


def _names(system: Any) -> tuple[list[str], list[str]]:
    return (
        [system.get_input_port(index).get_name() for index in range(system.num_input_ports())],
        [system.get_output_port(index).get_name() for index in range(system.num_output_ports())],
    )


def _numbers(values: Any) -> np.ndarray:
    values = np.asarray(values)
    if values.dtype == object and isinstance(values.flat[0], AutoDiffXd):
        return ExtractValue(values).ravel()
    if values.dtype == object:
        return Evaluate(values).ravel()
    return values


def _answers(system: Any, scalar: Any, inputs: list[np.ndarray], state: list[np.ndarray]) -> list[np.ndarray]:
    """Outputs, and the state's rates or next values, in numbers."""
    context = system.CreateDefaultContext()
    for index, values in enumerate(inputs):
        system.get_input_port(index).FixValue(context, [scalar(value) for value in values])
    vectors = _state(context)
    for vector, values in zip(vectors, state, strict=True):
        vector.SetFromVector([scalar(value) for value in values])
    answers = [system.get_output_port(index).Eval(context) for index in range(system.num_output_ports())]
    if context.num_discrete_state_groups():
        updates = system.AllocateDiscreteVariables()
        system.CalcForcedDiscreteVariableUpdate(context, updates)
        answers += [updates.get_vector(group).CopyToVector() for group in range(updates.num_groups())]
    if context.num_continuous_states():
        answers.append(system.EvalTimeDerivatives(context).CopyToVector())
    return [_numbers(answer) for answer in answers]


def _state(context: Any) -> list[Any]:
    groups = context.num_discrete_state_groups()
    vectors = [context.get_mutable_discrete_state(group) for group in range(groups)]
    return vectors + ([context.get_mutable_continuous_state_vector()] if context.num_continuous_states() else [])


@pytest.mark.parametrize("case", ALGEBRAIC)
def test_they_go_together_with_continuous_states(case: str) -> None:
    """Drake's SymbolicVectorSystem would end the process."""
    builder = DiagramBuilder()
    system = builder.AddSystem(ALGEBRAIC[case]())
    for index in range(system.num_input_ports()):
        port = system.get_input_port(index)
        values = np.full(port.size(), 0.1)
        builder.Connect(builder.AddSystem(ConstantVectorSource(values)).get_output_port(), port)
    output = system.get_output_port(0)
    integrator = builder.AddSystem(Integrator(output.size()))
    builder.Connect(output, integrator.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    assert np.isfinite(simulator.get_context().get_continuous_state_vector().CopyToVector()).all()


@pytest.mark.parametrize("case", ALGEBRAIC)
def test_conversions_and_their_way_back_give_the_same(case: str) -> None:
    system = ALGEBRAIC[case]()
    random = np.random.default_rng(5)
    sizes = [system.get_input_port(index).size() for index in range(system.num_input_ports())]
    inputs = [random.uniform(-3, 3, size) for size in sizes]
    state = [random.uniform(-0.02, 0.02, vector.size()) for vector in _state(system.CreateDefaultContext())]
    expected = _answers(system, float, inputs, state)
    assert any(np.abs(answer).max() > 1e-3 for answer in expected)

    for converted, scalar, other in (
        (system.ToAutoDiffXd(), AutoDiffXd, Expression),
        (system.ToSymbolic(), Expression, AutoDiffXd),
    ):
        back, across = converted.ToScalarType[float](), converted.ToScalarType[other]()
        for each, kind in ((converted, scalar), (back, float), (across, other)):
            assert _names(each) == _names(system)
            for answer, number in zip(_answers(each, kind, inputs, state), expected, strict=True):
                assert answer == pytest.approx(number, rel=1e-13, abs=1e-13)


def test_conversion_leaves_a_plain_diagram() -> None:
    """Python's class and its methods do not survive: without `set_pose`, set the state, which is the pose."""
    back = systems.KinematicBase("kiwi").ToAutoDiffXd().ToScalarType[float]()
    assert type(back) is Diagram
    assert isinstance(systems.KinematicBase("kiwi").ToSymbolic(), System_[Expression])
    context = back.CreateDefaultContext()
    context.SetContinuousState([1.0, 2.0, 3.0])
    assert back.GetOutputPort("q_xyt").Eval(context) == pytest.approx([1.0, 2.0, 3.0], abs=0)


@pytest.mark.parametrize("robot", [*SHIPPED, *(make() for make in robots.ALL.values())], ids=[*SHIPPED, *robots.ALL])
def test_the_symbolic_matrix_is_the_drive_matrix(robot: Any) -> None:
    kinematics = rb.WheelKinematics(robot)
    inverse = systems.InverseKinematics(kinematics).ToSymbolic()
    context = inverse.CreateDefaultContext()
    twist = MakeVectorVariable(3, "v")
    inverse.GetInputPort("v_xyw_B").FixValue(context, twist)
    matrix = Evaluate(Jacobian(inverse.GetOutputPort("wheel_speeds").Eval(context), twist))
    assert matrix == pytest.approx(kinematics.drive_matrix, rel=1e-15, abs=0)
