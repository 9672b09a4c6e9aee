"""Where the motors' commands come from in a station: the scenario, a port, or feedback of the pose."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, PassThrough, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from rollerbench.kinematics.profile import Profile
from rollerbench.simulation.commands import WheelEffortsCommand, WheelSpeedsCommand
from rollerbench.simulation.motors import Drive, Motors
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.settings import PoseTracking
from rollerbench.systems import InverseKinematics, PoseTracker, ReferenceSource, SteeringKinematics, TwistLimiter

CommandFrom = Literal["scenario", "external", "rest", "wheels"]

FOR_LEGS: tuple[CommandFrom, ...] = ("scenario", "external")
"""Those that robots on legs know."""

WITHOUT_COMMAND: tuple[CommandFrom, ...] = ("rest", "wheels")
"""Those for which it does not matter what the scenario commands."""


def drive_of(scenario: Scenario, command: CommandFrom) -> Drive:
    """What turns the wheels."""
    if isinstance(scenario.command, WheelEffortsCommand) and command not in WITHOUT_COMMAND:
        return "efforts"
    return "servo" if scenario.wheel_control.servo == "implicit" else "pid"


def steers(scenario: Scenario, command: CommandFrom) -> bool:
    """Whether wheels steer on the way."""
    if command == "rest" or not scenario.robot.steered_wheels:
        return False
    if command == "wheels":
        return True
    of_wheels = isinstance(scenario.command, WheelSpeedsCommand | WheelEffortsCommand)
    return scenario.tracking is not None or (scenario.motion.steers if command == "scenario" else not of_wheels)


def add_command(
    builder: DiagramBuilder,
    scenario: Scenario,
    motors: Motors,
    sensors: Mapping[str, OutputPort],
    command: CommandFrom,
) -> dict[str, OutputPort]:
    """Connects the motors with what commands them; returns output ports to export."""
    if command == "rest":
        return _rest(builder, scenario, motors)
    if command == "wheels":
        return _add_wheel_inputs(builder, scenario, motors)
    if scenario.tracking is not None:
        twist, ports = _add_tracker(builder, scenario, scenario.tracking, sensors, external=command == "external")
        return ports | _follow_twist(builder, scenario, motors, twist, steering=True)
    if command == "external":
        return _add_inputs(builder, scenario, motors)
    motion = scenario.motion
    if motors.efforts is not None and motion.wheel_efforts is not None:
        efforts = builder.AddNamedSystem("effort_command", _source(motion.wheel_efforts))
        builder.Connect(efforts.get_output_port(), motors.efforts)
    if motion.steers or isinstance(scenario.command, WheelSpeedsCommand | WheelEffortsCommand):
        speeds = builder.AddNamedSystem("wheel_command", _source(motion.wheel_speeds)).get_output_port()
        return _connect(builder, scenario, motors, speeds)
    twist = builder.AddNamedSystem("twist_command", _source(motion.twist)).get_output_port()
    return _follow_twist(builder, scenario, motors, twist, steering=False)


def _rest(builder: DiagramBuilder, scenario: Scenario, motors: Motors) -> dict[str, OutputPort]:
    still = ConstantVectorSource(np.zeros(len(scenario.robot.driven_wheels)))
    speeds = builder.AddNamedSystem("rest", still).get_output_port()
    return _connect(builder, scenario, motors, speeds, held=True)


def _add_wheel_inputs(builder: DiagramBuilder, scenario: Scenario, motors: Motors) -> dict[str, OutputPort]:
    """Exports what the motors are told, each by itself."""
    driven = builder.AddNamedSystem("wheel_command", PassThrough(len(scenario.robot.driven_wheels)))
    builder.ExportInput(driven.get_input_port(), "wheel_command")
    builder.Connect(driven.get_output_port(), motors.speeds)
    if motors.steering is not None:
        builder.ExportInput(motors.steering, "steering_command")
    return {"wheel_speed_command": driven.get_output_port()}


def _add_inputs(builder: DiagramBuilder, scenario: Scenario, motors: Motors) -> dict[str, OutputPort]:
    """Exports the input that fits the scenario's command."""
    if motors.efforts is not None:
        builder.ExportInput(motors.efforts, "effort_command")
        _steer(builder, scenario, motors, held=True)
        return {}
    of_wheels = isinstance(scenario.command, WheelSpeedsCommand)
    name, size = ("wheel_command", len(scenario.robot.driven_wheels)) if of_wheels else ("twist_command", 3)
    command = builder.AddNamedSystem(name, PassThrough(size))
    builder.ExportInput(command.get_input_port(), name)
    if of_wheels:
        return _connect(builder, scenario, motors, command.get_output_port(), held=True)
    return _follow_twist(builder, scenario, motors, command.get_output_port(), steering=True)


def _add_tracker(
    builder: DiagramBuilder,
    scenario: Scenario,
    tracking: PoseTracking,
    sensors: Mapping[str, OutputPort],
    *,
    external: bool,
) -> tuple[OutputPort, dict[str, OutputPort]]:
    """The port of the twist that leads back to the reference, and ports to export."""
    kinematics = scenario.motion.kinematics
    tracker = builder.AddNamedSystem("pose_tracker", PoseTracker(kinematics, tracking.gains))
    limiter = TwistLimiter(
        kinematics,
        tracking.period,
        max_wheel_acceleration=tracking.max_wheel_acceleration,
        max_wheel_jerk=tracking.max_wheel_jerk,
    )
    builder.AddNamedSystem("twist_limiter", limiter)
    builder.Connect(sensors[tracking.feedback], tracker.GetInputPort("q_xyt"))
    builder.Connect(tracker.GetOutputPort("v_xyw_B"), limiter.GetInputPort("v_xyw_B"))
    twist = limiter.GetOutputPort("v_xyw_B")
    ports = {"twist_command": twist}
    if external:
        builder.ExportInput(tracker.GetInputPort("reference_q_xyt"), "reference_pose")
        builder.ExportInput(tracker.GetInputPort("reference_v_xyw_B"), "reference_twist")
        return twist, ports
    motion = scenario.motion.twist
    reference = builder.AddNamedSystem("reference", ReferenceSource(motion))
    ports |= {"reference_pose": reference.GetOutputPort("q_xyt"), "reference_twist": reference.GetOutputPort("v_xyw_B")}
    # A twist that is held for a period lags by half of it, a mean of N by half of N - 1, and wheels that steer follow
    # the limiter's twist of the period before: take the twist of the time when it will be driven.
    periods = 0.5 * limiter.limits.samples + bool(scenario.robot.steered_wheels)
    ahead = builder.AddNamedSystem(
        "feedforward", _source(replace(motion, breaks=motion.breaks - periods * tracking.period))
    )
    builder.Connect(ports["reference_pose"], tracker.GetInputPort("reference_q_xyt"))
    builder.Connect(ahead.get_output_port(), tracker.GetInputPort("reference_v_xyw_B"))
    return twist, ports


def _follow_twist(
    builder: DiagramBuilder, scenario: Scenario, motors: Motors, twist: OutputPort, *, steering: bool
) -> dict[str, OutputPort]:
    """Wheel speeds, and if wheels shall steer their angles, from a twist."""
    kinematics = scenario.motion.kinematics
    if motors.steering is None or not steering:
        inverse = builder.AddNamedSystem("inverse_kinematics", InverseKinematics(kinematics))
        builder.Connect(twist, inverse.GetInputPort("v_xyw_B"))
        return _connect(builder, scenario, motors, inverse.GetOutputPort("wheel_speeds"), held=True)
    period = scenario.plant.time_step if scenario.tracking is None else scenario.tracking.period
    system = SteeringKinematics(kinematics, period, scenario.motion.steering_angles(0.0))
    builder.AddNamedSystem("steering_kinematics", system)
    builder.Connect(twist, system.GetInputPort("v_xyw_B"))
    builder.Connect(system.GetOutputPort("wheel_speeds"), motors.speeds)
    builder.Connect(system.GetOutputPort("steering"), motors.steering)
    return {"wheel_speed_command": system.GetOutputPort("wheel_speeds")}


def _connect(
    builder: DiagramBuilder, scenario: Scenario, motors: Motors, speeds: OutputPort, *, held: bool = False
) -> dict[str, OutputPort]:
    """Connects wheel speeds, and the steering angles of the motion."""
    builder.Connect(speeds, motors.speeds)
    _steer(builder, scenario, motors, held=held)
    return {"wheel_speed_command": speeds}


def _steer(builder: DiagramBuilder, scenario: Scenario, motors: Motors, *, held: bool) -> None:
    """Steers wheels as the motion says, or holds them as they are at its start."""
    if motors.steering is None:
        return
    angles = scenario.motion.steering_angles
    still = ConstantVectorSource(np.concatenate([angles(0.0), np.zeros(angles.values.shape[1])]))
    source = builder.AddNamedSystem("steering_command", still if held else _source(angles, with_rates=True))
    builder.Connect(source.get_output_port(), motors.steering)


def _source(profile: Profile, *, with_rates: bool = False) -> TrajectorySource:
    """Values of a profile over time, followed by their time derivatives if asked for."""
    trajectory = PiecewisePolynomial.CubicHermite(profile.breaks, profile.values.T, profile.slopes.T)
    return TrajectorySource(trajectory, output_derivative_order=int(with_rates), zero_derivatives_beyond_limits=True)
