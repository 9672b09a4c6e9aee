"""What turns and steers the wheels in a station, and what measures how far they turn."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import MatrixGain, Multiplexer, PassThrough

from rollerbench.plant import RobotModel, ServoGains, servo_gains
from rollerbench.simulation.scenario import Scenario
from rollerbench.systems import Drivetrain, PidGains, RollResistance, WheelSpeedController

Drive = Literal["servo", "pid", "efforts"]
"""What turns the wheels: the plant's own servo, a controller's torques, or commanded torques."""


@dataclass(frozen=True, kw_only=True)
class Motors:
    """Ports of the motors.

    Attributes:
        model: The robot in the plant.
        measured: Wheel speeds (n_driven) that the encoders measure [rad/s].
        speeds: What the driven wheels are told (n_driven) [rad/s].
        steering: What the steered wheels are told (2 n_steered), angles and rates [rad, rad/s]; None if there are none.
        efforts: Torques (n_driven) [N m], where they are commanded.
    """

    model: RobotModel
    measured: OutputPort
    speeds: InputPort
    steering: InputPort | None
    efforts: InputPort | None


def servo_gains_of(scenario: Scenario, drive: Drive) -> ServoGains:
    """Gains of the plant's servos: none for wheels that it does not turn."""
    gains = servo_gains(scenario.robot, time_constant=scenario.wheel_control.servo_time_constant)
    return replace(gains, drive_damping={}) if drive != "servo" else gains


def add_motors(builder: DiagramBuilder, scenario: Scenario, model: RobotModel, drive: Drive) -> Motors:
    """Adds what turns the wheels, drivetrain and encoders."""
    speeds, servo_port, measured = _add_drivetrain(builder, scenario, model)
    steering = _add_servo(builder, model, servo_port if drive == "servo" else None)
    efforts = None
    if drive != "servo":
        motors = builder.AddNamedSystem("motors", MatrixGain(model.actuation_matrix()))
        builder.Connect(motors.get_output_port(), model.plant.get_actuation_input_port(model.model_instance))
        efforts = motors.get_input_port()
    if drive == "pid" and efforts is not None:
        builder.Connect(_add_pid(builder, scenario, servo_port, measured), efforts)
        efforts = None
    return Motors(model=model, measured=measured, speeds=speeds, steering=steering, efforts=efforts)


def add_roll_resistance(builder: DiagramBuilder, scenario: Scenario, model: RobotModel) -> None:
    """Adds the ground's resistance to rolling, if it has any."""
    if not scenario.ground.roll_resistance:
        return
    plant = model.plant
    velocities = np.hstack([np.zeros((plant.num_velocities(), plant.num_positions())), np.eye(plant.num_velocities())])
    selector = builder.AddNamedSystem("velocities", MatrixGain(velocities))
    builder.Connect(plant.get_state_output_port(), selector.get_input_port())
    drag = builder.AddNamedSystem("roll_resistance", RollResistance(model, scenario.ground.roll_resistance))
    builder.Connect(plant.get_contact_results_output_port(), drag.GetInputPort("contact_results"))
    builder.Connect(plant.get_body_poses_output_port(), drag.GetInputPort("body_poses"))
    builder.Connect(selector.get_output_port(), drag.GetInputPort("velocities"))
    builder.Connect(drag.GetOutputPort("generalized_force"), plant.get_applied_generalized_force_input_port())


def _add_drivetrain(
    builder: DiagramBuilder, scenario: Scenario, model: RobotModel
) -> tuple[InputPort, OutputPort, OutputPort]:
    """The port that takes wheel speeds, that of the speeds for the servos, and that of those that are measured."""
    state = model.plant.get_state_output_port(model.model_instance)
    speeds = builder.AddNamedSystem("wheel_speed_sensor", MatrixGain(model.wheel_speed_matrix()))
    builder.Connect(state, speeds.get_input_port())
    drives = scenario.errors.drives(scenario.robot)
    if drives is None:
        command = builder.AddNamedSystem("wheel_speed_command", PassThrough(len(model.robot.driven_wheels)))
        return command.get_input_port(), command.get_output_port(), speeds.get_output_port()
    angles = builder.AddNamedSystem("wheel_angle_sensor", MatrixGain(model.wheel_angle_matrix()))
    builder.Connect(state, angles.get_input_port())
    drivetrain = builder.AddNamedSystem("drivetrain", Drivetrain(drives, scenario.plant.time_step))
    builder.Connect(angles.get_output_port(), drivetrain.GetInputPort("wheel_angles"))
    return (
        drivetrain.GetInputPort("wheel_speed_command"),
        drivetrain.GetOutputPort("servo_wheel_speeds"),
        drivetrain.GetOutputPort("measured_wheel_speeds"),
    )


def _add_servo(builder: DiagramBuilder, model: RobotModel, speeds: OutputPort | None) -> InputPort | None:
    """Connects the plant's servo, without speeds where it does not turn the wheels; returns the port for steering."""
    robot, driven = model.robot, len(model.robot.driven_wheels)
    if not model.actuators or (speeds is None and not robot.steered_wheels):
        return None
    matrix, desired = model.desired_state_matrix(), model.plant.get_desired_state_input_port(model.model_instance)
    servo = builder.AddNamedSystem("servo_command", MatrixGain(matrix if speeds is not None else matrix[:, driven:]))
    builder.Connect(servo.get_output_port(), desired)
    if speeds is None:
        return servo.get_input_port()
    if not robot.steered_wheels:
        builder.Connect(speeds, servo.get_input_port())
        return None
    both = builder.AddNamedSystem("motor_commands", Multiplexer([driven, 2 * len(robot.steered_wheels)]))
    builder.Connect(speeds, both.get_input_port(0))
    builder.Connect(both.get_output_port(), servo.get_input_port())
    return both.get_input_port(1)


def _add_pid(builder: DiagramBuilder, scenario: Scenario, wanted: OutputPort, measured: OutputPort) -> OutputPort:
    settings, gains = scenario.wheel_control.pid, None
    if settings is not None:
        gains = [PidGains(kp=settings.kp, ki=settings.ki, kd=settings.kd)] * len(scenario.robot.driven_wheels)
    pid = WheelSpeedController(scenario.robot, scenario.plant.time_step, gains)
    controller = builder.AddNamedSystem("wheel_speed_controller", pid)
    builder.Connect(wanted, controller.GetInputPort("wheel_speed_command"))
    builder.Connect(measured, controller.GetInputPort("wheel_speeds"))
    return controller.GetOutputPort("wheel_efforts")
