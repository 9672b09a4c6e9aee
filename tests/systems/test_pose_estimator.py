"""The pose estimator as a System is the pure filter; its sensors deliver what they say, always the same bits."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput
from scipy.stats import chi2

import rollerbench as rb
from rollerbench.kinematics.estimation import PoseFilter
from rollerbench.kinematics.uncertainty import GyroNoise, OdometryNoise
from rollerbench.systems import GyroSensor, InverseKinematics, Odometry, PoseEstimator, PoseFixSensor

STEP, BIAS = 0.01, 0.03
FIX = (0.02, 0.02, 0.01)
GYRO = GyroNoise(density=1e-3, bias_walk=1e-4, bias_deviation=0.05)
SETTINGS = {"wheels": OdometryNoise(travel=1e-5), "gyro": GYRO, "fix_deviation": FIX}
OUTPUTS = ("q_xyt", "covariance", "gyro_bias", "v_xyw_B", "fix_counts")


def world(seed: int = 3, latency: float = 0.123, time_step: float = STEP) -> Diagram:
    """A Mecanum base on a circle, with its sensors, its estimator, and logs of all that it gets and tells."""
    builder = DiagramBuilder()
    twist = builder.AddNamedSystem("twist", ConstantVectorSource([0.4, 0.1, 0.5]))
    wheels = builder.AddNamedSystem("wheels", InverseKinematics("youbot_base"))
    truth = builder.AddNamedSystem("truth", Odometry("youbot_base", time_step))
    gyro = builder.AddNamedSystem("gyro", GyroSensor(time_step, GYRO, bias=BIAS, seed=seed))
    fixes = builder.AddNamedSystem("fixes", PoseFixSensor(FIX, period=0.5, latency=latency, seed=seed))
    estimator = builder.AddNamedSystem("estimator", PoseEstimator("youbot_base", time_step, **SETTINGS))
    for source, target in (
        (twist.get_output_port(), wheels.GetInputPort("v_xyw_B")),
        (twist.get_output_port(), gyro.GetInputPort("v_xyw_B")),
        (wheels.GetOutputPort("wheel_speeds"), truth.GetInputPort("wheel_speeds")),
        (truth.GetOutputPort("q_xyt"), fixes.GetInputPort("q_xyt")),
        (wheels.GetOutputPort("wheel_speeds"), estimator.GetInputPort("wheel_speeds")),
        (gyro.GetOutputPort("yaw_rate"), estimator.GetInputPort("yaw_rate")),
        (fixes.GetOutputPort("pose_fix"), estimator.GetInputPort("pose_fix")),
    ):
        builder.Connect(source, target)
    outputs = [wheels.GetOutputPort("wheel_speeds"), gyro.GetOutputPort("yaw_rate"), fixes.GetOutputPort("pose_fix")]
    outputs += [truth.GetOutputPort("q_xyt"), *(estimator.GetOutputPort(name) for name in OUTPUTS)]
    for port in outputs:
        LogVectorOutput(port, builder, time_step).set_name(f"{port.get_system().get_name()}_{port.get_name()}")
    return builder.Build()


def logs(diagram: Diagram, context) -> dict[str, np.ndarray]:
    sinks = [system for system in diagram.GetSystems() if hasattr(system, "FindLog")]
    return {sink.get_name(): sink.FindLog(context).data().T.copy() for sink in sinks}


def run(diagram: Diagram, duration: float) -> dict[str, np.ndarray]:
    simulator = Simulator(diagram)
    simulator.AdvanceTo(duration)
    return logs(diagram, simulator.get_context())


def test_the_system_is_the_filter() -> None:
    """To the bit, on what its inputs showed; and that is near the truth."""
    data = run(world(), 4.0)
    estimate = (pure := PoseFilter("youbot_base", STEP, **SETTINGS)).start()
    inputs = zip(data["wheels_wheel_speeds"], data["gyro_yaw_rate"][:, 0], data["fixes_pose_fix"], strict=True)
    for step, (wheel_speeds, yaw_rate, fix) in enumerate(inputs):
        assert (data["estimator_q_xyt"][step] == estimate.q_xyt).all()
        assert (data["estimator_covariance"][step] == estimate.covariance[:3, :3].ravel()).all()
        assert data["estimator_gyro_bias"][step] == estimate.gyro_bias
        assert (data["estimator_v_xyw_B"][step] == estimate.v_xyw_B).all()
        assert (data["estimator_fix_counts"][step] == estimate.fixes).all()
        estimate = pure.advance(estimate, wheel_speeds, yaw_rate, fix)
    assert step == 400
    assert data["estimator_fix_counts"][-1].tolist() == [8, 0, 0, 0]
    error = data["estimator_q_xyt"][-1] - data["truth_q_xyt"][-1]
    distance = error @ np.linalg.solve(data["estimator_covariance"][-1].reshape(3, 3), error)
    assert distance < chi2.ppf(0.999, 3)
    assert data["estimator_gyro_bias"][-1] == pytest.approx(BIAS, abs=0.005)
    assert data["estimator_v_xyw_B"][-1] == pytest.approx([0.4, 0.1, 0.5], abs=0.02)


def test_the_same_seed_gives_the_same_bits() -> None:
    first, again, other = run(world(), 1.0), run(world(), 1.0), run(world(seed=4), 1.0)
    for name, values in first.items():
        assert np.array_equal(values, again[name], equal_nan=True)
    for name in ("gyro_yaw_rate", "estimator_q_xyt"):
        assert not np.array_equal(first[name], other[name])


def test_a_cloned_context_goes_on_as_the_first() -> None:
    """All state lies in the context: waiting fixes, the filter's memory, the noise."""
    diagram = world()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.55)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(1.3)
    expected = {name: values[-70:] for name, values in logs(diagram, simulator.get_context()).items()}
    other = Simulator(diagram, clone)
    other.AdvanceTo(1.3)
    for name, values in logs(diagram, other.get_context()).items():
        assert np.array_equal(values[-70:], expected[name], equal_nan=True)


def test_it_works_without_fixes_and_from_a_later_time() -> None:
    estimator = PoseEstimator("youbot_base", 0.1, **SETTINGS)
    context = estimator.CreateDefaultContext()
    context.SetTime(5.0)
    estimator.set_pose(context, [1.0, 2.0, 0.5], np.diag([0.04, 0.04, 0.01]), gyro_bias=0.02)
    estimator.GetInputPort("wheel_speeds").FixValue(context, np.zeros(4))
    estimator.GetInputPort("yaw_rate").FixValue(context, [0.02])
    simulator = Simulator(estimator, context)
    simulator.AdvanceTo(6.0)
    assert estimator.GetOutputPort("q_xyt").Eval(context) == pytest.approx([1.0, 2.0, 0.5], abs=1e-12)
    assert estimator.GetOutputPort("gyro_bias").Eval(context) == pytest.approx([0.02], abs=1e-15)
    estimator.GetInputPort("pose_fix").FixValue(context, [5.7, 1.1, 2.0, 0.5])
    simulator.AdvanceTo(7.0)
    assert estimator.GetOutputPort("fix_counts").Eval(context).tolist() == [1, 0, 0, 0]
    share = 0.04 / (0.04 + FIX[0] ** 2)
    assert estimator.GetOutputPort("q_xyt").Eval(context) == pytest.approx([1 + 0.1 * share, 2.0, 0.5], abs=1e-12)


@pytest.mark.parametrize("latency", [0.0, 0.21, 0.5, 1.33])
def test_fixes_come_late_with_their_stamps(latency: float) -> None:
    """Without noise a fix is the pose at its stamp, delivered latency later, never before."""
    builder = DiagramBuilder()
    twist = builder.AddNamedSystem("twist", ConstantVectorSource(np.full(4, 5.0)))
    truth = builder.AddNamedSystem("truth", Odometry("youbot_base", 0.1))
    fixes = builder.AddNamedSystem("fixes", PoseFixSensor([0, 0, 0], period=0.5, latency=latency))
    builder.Connect(twist.get_output_port(), truth.GetInputPort("wheel_speeds"))
    builder.Connect(truth.get_output_port(), fixes.GetInputPort("q_xyt"))
    sinks = [LogVectorOutput(system.get_output_port(), builder, 0.05) for system in (truth, fixes)]
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(4.01)
    times = sinks[0].FindLog(simulator.get_context()).sample_times()
    poses, told = (sink.FindLog(simulator.get_context()).data().T for sink in sinks)
    for time, fix in zip(times, told, strict=True):
        # The log shows what was before updates of the same time.
        passed = np.ceil((time - latency) / 0.5 - 1e-9) - 1
        if passed < 0:
            assert np.isnan(fix).all()
        else:
            assert fix[0] == pytest.approx(0.5 * passed, abs=1e-12)
            assert fix[1:] == pytest.approx(poses[round(10 * passed)], abs=1e-12)


def test_noise_has_the_sizes_that_were_asked_for() -> None:
    """Within four standard errors: 1 / sqrt(2 n) of a deviation."""
    count, noise = 3000, GyroNoise(density=2e-3, bias_walk=1e-2)
    builder = DiagramBuilder()
    twist = builder.AddNamedSystem("twist", ConstantVectorSource([0.0, 0.0, 0.7]))
    pose = builder.AddNamedSystem("pose", ConstantVectorSource([1.0, 2.0, 3.0]))
    gyro = builder.AddNamedSystem("gyro", GyroSensor(STEP, noise, bias=0.1))
    fixes = builder.AddNamedSystem("fixes", PoseFixSensor([0.1, 0.2, 0.3], period=STEP, latency=0.0))
    builder.Connect(twist.get_output_port(), gyro.get_input_port())
    builder.Connect(pose.get_output_port(), fixes.get_input_port())
    ports = [gyro.GetOutputPort("yaw_rate"), gyro.GetOutputPort("gyro_bias"), fixes.GetOutputPort("pose_fix")]
    sinks = [LogVectorOutput(port, builder, STEP) for port in ports]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(count * STEP)
    rate, bias, fix = (sink.FindLog(simulator.get_context()).data() for sink in sinks)
    white, steps, scatter = rate[0] - bias[0] - 0.7, np.diff(bias[0]), fix[1:, 1:] - [[1.0], [2.0], [3.0]]
    assert bias[0, 0] == 0.1
    tolerance = 4 / np.sqrt(2 * count)
    assert white.std() == pytest.approx(2e-3 / np.sqrt(STEP), rel=tolerance)
    assert steps.std() == pytest.approx(1e-2 * np.sqrt(STEP), rel=tolerance)
    assert scatter.std(axis=1) == pytest.approx([0.1, 0.2, 0.3], rel=tolerance)
    together = np.corrcoef([white[1:], steps, *scatter])
    assert np.abs(together - np.eye(5)).max() < 4 / np.sqrt(count)
    assert np.abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 4 / np.sqrt(count)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GyroSensor(0.0, GYRO), "time_step = 0.0: accepted: a positive number of seconds"),
        (lambda: GyroSensor(0.01, GYRO, bias=float("nan")), "bias = nan: accepted: a finite number"),
        (lambda: GyroSensor(0.01, GYRO, seed=-1), "seed = -1: accepted: a whole number of 0 or more"),
        (lambda: PoseFixSensor(FIX, period=-1.0), "period = -1.0: accepted: a positive number of seconds"),
        (lambda: PoseFixSensor(FIX, latency=-0.1), "latency = -0.1: accepted: 0 s or more"),
        (lambda: PoseFixSensor([0.1, -0.1, 0.1]), r"deviation = \[0.1, -0.1, 0.1\]: accepted: three numbers"),
        (lambda: PoseEstimator("youbot_base", -1.0, **SETTINGS), "time_step = -1.0: accepted"),
    ],
)
def test_bad_arguments_are_refused(make, message: str) -> None:
    with pytest.raises(rb.KinematicsError, match=message):
        make()
