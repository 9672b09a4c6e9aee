"""References and pose tracking as Systems: the numbers of the functions that they wrap, for every scalar type."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.autodiffutils import AutoDiffXd
from pydrake.systems.analysis import Simulator
from pydrake.trajectories import PiecewisePolynomial

import robots
import rollerbench as rb
from ports import documented_ports, ports
from rollerbench.kinematics.profile import held_with_ramps, reference_poses
from rollerbench.kinematics.steering import steering_step
from rollerbench.kinematics.tracking import DEFAULT_GAINS, tracking_law
from rollerbench.systems import PoseTracker, ReferenceSource, SteeredOdometry, SteeringKinematics

TURN = held_with_ramps([0.4, -0.1, 0.8], 3.0, 0.5)


def outputs(system, inputs: dict, time: float = 0.0) -> dict:
    """Values of all output ports by name."""
    context = system.CreateDefaultContext()
    context.SetTime(time)
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, value)
    return {name: system.GetOutputPort(name).Eval(context) for name in ports(system)[1]}


@pytest.mark.parametrize(
    "system",
    [
        ReferenceSource(TURN),
        PoseTracker("kiwi"),
        SteeringKinematics("swerve_base", 0.01),
        SteeredOdometry("swerve_base", 0.01),
    ],
    ids=lambda system: type(system).__name__,
)
def test_ports_are_the_documented_ones(system) -> None:
    assert ports(system) == documented_ports(type(system))


def test_the_reference_of_a_twist_is_its_integral() -> None:
    times = np.linspace(0.0, 3.0, 301)
    start = np.array([1.0, 2.0, 0.5])
    source = ReferenceSource(TURN, start)
    moved = reference_poses(TURN, times)[137]
    expected = [*(start[:2] + rb.odometry.rotate(start[2], moved[:2])), start[2] + moved[2]]
    got = outputs(source, {}, times[137])
    assert_allclose(got["q_xyt"], expected, atol=1e-9)
    assert_allclose(got["v_xyw_B"], TURN(times[137]), atol=1e-12)


def test_the_reference_of_poses_has_their_twist() -> None:
    times = np.linspace(0.0, 2.0, 9)
    poses = np.column_stack([np.sin(times), times**2, 2 * times])
    source = ReferenceSource(PiecewisePolynomial.CubicShapePreserving(times, poses.T))
    got = outputs(source, {}, 0.55)
    near = [outputs(source, {}, 0.55 + change)["q_xyt"] for change in (-1e-5, 1e-5)]
    assert_allclose(got["v_xyw_B"], rb.odometry.displacement(*near) / 2e-5, atol=1e-6)


@pytest.mark.parametrize("robot", ["youbot_base", "differential_cart", "swerve_base"])
def test_the_tracker_is_the_law_for_every_scalar_type(robot: str) -> None:
    law = tracking_law(rb.WheelKinematics(robot), DEFAULT_GAINS)
    values = np.random.default_rng(3).uniform(-1, 1, (3, 3))
    inputs = dict(zip(("q_xyt", "reference_q_xyt", "reference_v_xyw_B"), values, strict=True))
    expected = law(*values)
    system = PoseTracker(robot)
    assert_allclose(outputs(system, inputs)["v_xyw_B"], expected, atol=1e-13)
    derived = system.ToScalarType[AutoDiffXd]()
    seeds = {
        n: [AutoDiffXd(x, np.eye(9)[3 * k + i]) for i, x in enumerate(v)] for k, (n, v) in enumerate(inputs.items())
    }
    gradient = np.array([each.derivatives() for each in outputs(derived, seeds)["v_xyw_B"]])
    for column in range(9):
        change = 1e-6 * np.eye(9)[column].reshape(3, 3)
        assert_allclose(gradient[:, column], (law(*(values + change)) - law(*(values - change))) / 2e-6, atol=1e-6)
    assert system.ToSymbolic().ToScalarType[float]().num_input_ports() == 3


@pytest.mark.parametrize("robot", ["youbot_base", "differential_cart"])
def test_the_tracker_has_derivatives_at_rest_and_without_error(robot: str) -> None:
    derived = PoseTracker(robot).ToScalarType[AutoDiffXd]()
    names = ("q_xyt", "reference_q_xyt", "reference_v_xyw_B")
    seeds = {n: [AutoDiffXd(0.0, np.eye(9)[3 * k + i]) for i in range(3)] for k, n in enumerate(names)}
    gradient = np.array([each.derivatives() for each in outputs(derived, seeds)["v_xyw_B"]])
    gains, sideways = DEFAULT_GAINS, robot == "youbot_base"
    feedback = np.diag([gains.position, gains.position * sideways, gains.heading])
    assert_allclose(gradient, np.hstack([-feedback, feedback, np.diag([1.0, sideways, 1.0])]), atol=1e-9)


def test_steered_wheels_turn_no_faster_than_they_may_and_drive_less_meanwhile() -> None:
    data = robots.swerve()
    for wheel in data["wheels"]:
        wheel["max_steering_speed"] = 2.0
    kinematics = rb.WheelKinematics(data)
    angles, period = np.zeros(4), 0.01
    twist = np.array([0.1, 0.3, 0.0])
    wanted, speeds = kinematics.steering(twist, previous=angles)
    for _ in range(100):
        step = steering_step(kinematics, twist, angles, period)
        assert (np.abs(step.angles - angles) <= 2.0 * period * (1 + 1e-12)).all()
        assert_allclose(step.wheel_speeds, speeds * np.cos(wanted - step.angles), atol=1e-12)
        angles = step.angles
    assert_allclose(angles, wanted, atol=1e-12)
    assert_allclose(kinematics.forward_at(step.wheel_speeds, angles), twist, atol=1e-12)


def test_steered_wheels_keep_their_angles_where_next_to_no_speed_is_asked() -> None:
    kinematics = rb.WheelKinematics("swerve_base")
    angles = np.array([0.3, -0.2, 0.0, 1.0])
    step = steering_step(kinematics, np.array([0.0, 0.0009, 0.0]), angles, 0.01)
    assert_allclose(step.angles, angles, atol=0)
    assert_allclose(step.rates, 0.0, atol=0)
    radii = [wheel.radius for wheel in kinematics.robot.steered_wheels]
    assert_allclose(step.wheel_speeds * radii, 0.0009 * np.sin(angles), atol=1e-12)
    faster = steering_step(kinematics, np.array([0.0, 0.0011, 0.0]), angles, 1.0)
    assert_allclose(np.abs(faster.angles), np.pi / 2, atol=1e-12)


def test_steered_odometry_goes_where_the_steered_wheels_lead() -> None:
    kinematics = rb.WheelKinematics("swerve_base")
    twist = np.array([0.3, 0.2, 0.5])
    angles, speeds = kinematics.steering(twist)
    system = SteeredOdometry(kinematics, 0.01)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("wheel_speeds").FixValue(context, speeds)
    system.GetInputPort("steering_angles").FixValue(context, angles)
    system.set_pose(context, [1.0, 0.0, 0.3])
    simulator.AdvanceTo(1.0)
    expected = rb.odometry.integrate([1.0, 0.0, 0.3], twist, 1.0)
    assert_allclose(system.GetOutputPort("q_xyt").Eval(context), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SteeringKinematics("kiwi", 0.01), "no steered wheels"),
        (lambda: SteeringKinematics("swerve_base", 0.0), "period"),
        (lambda: SteeringKinematics("swerve_base", 0.01, [0.0]), "4 finite angles"),
        (lambda: ReferenceSource(held_with_ramps([1.0], 2.0, 0.5)), "1 components"),
        (lambda: ReferenceSource([1.0, 0.0, 0.0]), "reference is a list"),
        (lambda: ReferenceSource(TURN, [0.0, np.nan, 0.0]), "start"),
    ],
)
def test_bad_arguments_are_refused(make, message: str) -> None:
    with pytest.raises(rb.KinematicsError, match=message):
        make()
