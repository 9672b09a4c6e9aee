"""The diagram that a scenario simulates: command, kinematics, servo, plant."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydrake.geometry import Meshcat, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LogVectorOutput,
    MatrixGain,
    Multiplexer,
    TrajectorySource,
    VectorLogSink,
)
from pydrake.trajectories import PiecewisePolynomial

from rollerbench.kinematics.profile import Profile
from rollerbench.plant import RobotModel, ServoGains, add_ground, add_robot, servo_gains
from rollerbench.simulation.commands import WheelEffortsCommand, WheelSpeedsCommand
from rollerbench.simulation.drake_config import add_plant
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.systems import (
    Drivetrain,
    InverseKinematics,
    Odometry,
    PidGains,
    PlanarState,
    RollResistance,
    SlipMonitor,
    WheelSpeedController,
)
from rollerbench.visualization.scene import add_bump_visuals, add_ground_visual, add_meshcat


@dataclass(frozen=True, kw_only=True)
class StationParts:
    """Subsystems of a station.

    Attributes:
        model: The robot in the plant.
        scene_graph: The plant's scene graph.
        odometry: The odometry.
        logs: Log sinks by the name of the exported output port that they record, one sample a step of the plant.
    """

    model: RobotModel
    scene_graph: SceneGraph
    odometry: Odometry
    logs: dict[str, VectorLogSink]


class Station(Diagram):
    """A robot on its ground, driven by a scenario's command.

    Where rollers are windowed, as they are by default, call `follow_rollers(simulator)` before the simulation. With
    all rollers, and without slip and rolling resistance, all systems are Drake's own, and ToAutoDiffXd() converts it.

    Input ports:
        v_xyw_B (3): body twist command [m/s, m/s, rad/s]; only if the command comes from outside.
    Output ports:
        state (nq + nv): state of the robot's model instance, as the plant orders it.
        q_xyt (3): pose of B in W, yaw in (-pi, pi] [m, m, rad].
        v_xyw_B (3): twist in B turned upright [m/s, m/s, rad/s].
        wheel_speed_command (n_driven): commanded wheel speeds [rad/s].
        wheel_speeds (n_driven): wheel speeds that the encoders measure [rad/s].
        net_actuation (n_actuators): torques of the servos [N m].
        slip_speeds (n_wheels): how fast wheels slide over the ground [m/s] (`SlipMonitor`); only if asked for.
        normal_forces (n_wheels): loads of the wheels [N]; only if asked for.
        odometry_q_xyt (3): pose from these measured wheel speeds [m, m, rad].
        rollers (...): state of the `RollerWindow`; only if rollers are windowed.
        contact_results: Drake's ContactResults.
        query_object: Drake's QueryObject.

    Attributes:
        parts: Subsystems.
    """

    parts: StationParts

    def __init__(
        self,
        scenario: Scenario,
        *,
        command: Literal["scenario", "external"] = "scenario",
        meshcat: Meshcat | None = None,
        log: bool = False,
        visuals: bool = True,
        slip: bool = False,
    ) -> None:
        """Builds the diagram of a scenario.

        Args:
            scenario: What to simulate.
            command: "scenario" drives the robot as the scenario says; "external" exports the input v_xyw_B.
            meshcat: Where to show the robot.
            log: Whether to record outputs (see `StationParts.logs`).
            visuals: Whether the robot shall be seen, in the meshcat or by what is connected to query_object.
            slip: Whether to export slip_speeds and normal_forces.

        Raises:
            DescriptionError: Drake refuses a setting of the plant.
            InfeasibleTwist: the command would make a tyre skid.
        """
        super().__init__()
        builder = DiagramBuilder()
        plant, scene_graph = add_plant(builder, scenario)
        model = add_robot(
            plant,
            scenario.simulated_robot,
            gains=_gains(scenario, external=command == "external"),
            roller_model=scenario.plant.roller_model,
            builder=builder,
            window_size=scenario.window_size,
            visuals=visuals,
        )
        _add_ground(plant, scenario, drawn=meshcat is not None)
        plant.Finalize()

        command_port = _add_command(builder, scenario, external=command == "external")
        measured_port = _add_motors(builder, scenario, model, command_port, external=command == "external")
        _add_roll_resistance(builder, scenario, model)
        outputs = {
            "state": plant.get_state_output_port(model.model_instance),
            "wheel_speed_command": command_port,
            "wheel_speeds": measured_port,
            "net_actuation": plant.get_net_actuation_output_port(model.model_instance),
            "contact_results": plant.get_contact_results_output_port(),
            "query_object": scene_graph.get_query_output_port(),
        }
        if model.roller_window is not None:
            outputs["rollers"] = model.roller_window.GetOutputPort("rollers")
        if slip:
            monitor = builder.AddNamedSystem("slip_monitor", SlipMonitor(model))
            builder.Connect(outputs["contact_results"], monitor.GetInputPort("contact_results"))
            outputs |= {name: monitor.GetOutputPort(name) for name in ("slip_speeds", "normal_forces")}
        body = builder.AddNamedSystem("body_state", MatrixGain(model.body_state_matrix()))
        builder.Connect(outputs["state"], body.get_input_port())
        planar = builder.AddNamedSystem("planar_state", PlanarState())
        builder.Connect(body.get_output_port(), planar.GetInputPort("state"))
        outputs |= {name: planar.GetOutputPort(name) for name in ("q_xyt", "v_xyw_B")}
        odometry = builder.AddNamedSystem("odometry", Odometry(scenario.motion.kinematics, scenario.plant.time_step))
        builder.Connect(outputs["wheel_speeds"], odometry.GetInputPort("wheel_speeds"))
        outputs["odometry_q_xyt"] = odometry.GetOutputPort("q_xyt")
        for name, port in outputs.items():
            builder.ExportOutput(port, name)

        logs = {}
        if log:
            recorded = ("state", "wheel_speed_command", "wheel_speeds", "net_actuation", "odometry_q_xyt", "rollers")
            for name in outputs.keys() & set(recorded):
                logs[name] = LogVectorOutput(outputs[name], builder, publish_period=scenario.plant.time_step)
        if meshcat is not None:
            add_meshcat(builder, scene_graph, meshcat, scenario.recording.frames_per_second)
        builder.BuildInto(self)
        self.parts = StationParts(model=model, scene_graph=scene_graph, odometry=odometry, logs=logs)


def build_station(
    scenario: Scenario | str | Path,
    *,
    command: Literal["scenario", "external"] = "scenario",
    meshcat: Meshcat | None = None,
    slip: bool = False,
) -> Station | LegStation:
    """The diagram of a scenario, to simulate or to compose with other systems.

    See `Station`; of a robot on legs `LegStation`, which always exports slip_speeds and normal_forces.
    """
    loaded = load_scenario(scenario)
    if loaded.robot.legs:
        return LegStation(loaded, command=command, meshcat=meshcat)
    return Station(loaded, command=command, meshcat=meshcat, slip=slip)


def _add_ground(plant: MultibodyPlant, scenario: Scenario, *, drawn: bool) -> None:
    bumps, ground = scenario.bumps, scenario.ground
    carrier = add_ground(plant, friction=ground.friction, slope_deg=ground.slope_deg, bumps=bumps)
    if drawn:
        add_ground_visual(plant, scenario.simulated_robot)
        if bumps is not None and carrier is not None:
            add_bump_visuals(plant, carrier, bumps)


def _gains(scenario: Scenario, *, external: bool) -> ServoGains:
    """Gains of the plant's servos: none for wheels that are driven by torques."""
    gains = servo_gains(scenario.robot, time_constant=scenario.wheel_control.servo_time_constant)
    return replace(gains, drive_damping={}) if _by_torques(scenario, external=external) else gains


def _by_torques(scenario: Scenario, *, external: bool) -> bool:
    return scenario.wheel_control.servo == "pid" or (not external and scenario.motion.wheel_efforts is not None)


def _add_command(builder: DiagramBuilder, scenario: Scenario, *, external: bool) -> OutputPort:
    """The output port of the commanded wheel speeds; where torques are commanded, of those that they should lead to."""
    motion = scenario.motion
    if not external and (motion.steers or isinstance(scenario.command, WheelSpeedsCommand | WheelEffortsCommand)):
        return builder.AddNamedSystem("wheel_speed_command", _source(motion.wheel_speeds)).get_output_port()
    kinematics = builder.AddNamedSystem("inverse_kinematics", InverseKinematics(motion.kinematics))
    if external:
        builder.ExportInput(kinematics.GetInputPort("v_xyw_B"), "v_xyw_B")
    else:
        twist = builder.AddNamedSystem("twist_command", _source(motion.twist))
        builder.Connect(twist.get_output_port(), kinematics.GetInputPort("v_xyw_B"))
    return kinematics.GetOutputPort("wheel_speeds")


def _add_motors(
    builder: DiagramBuilder, scenario: Scenario, model: RobotModel, command_port: OutputPort, *, external: bool
) -> OutputPort:
    """Connects what drives and steers the wheels; returns the output port of the wheel speeds that are measured."""
    servo_port, measured_port = _add_drivetrain(builder, scenario, model, command_port)
    if not _by_torques(scenario, external=external):
        _connect_servo(builder, scenario, model, servo_port, external=external)
        return measured_port
    if model.robot.steered_wheels:
        still = ConstantVectorSource(np.zeros(len(model.robot.driven_wheels)))
        _connect_servo(
            builder, scenario, model, builder.AddNamedSystem("no_servo", still).get_output_port(), external=external
        )
    if scenario.motion.wheel_efforts is not None and not external:
        efforts = builder.AddNamedSystem("wheel_effort_command", _source(scenario.motion.wheel_efforts))
        effort_port = efforts.get_output_port()
    else:
        settings = scenario.wheel_control.pid
        gains = None
        if settings is not None:
            gains = [PidGains(kp=settings.kp, ki=settings.ki, kd=settings.kd)] * len(scenario.robot.driven_wheels)
        pid = WheelSpeedController(scenario.robot, scenario.plant.time_step, gains)
        controller = builder.AddNamedSystem("wheel_speed_controller", pid)
        builder.Connect(servo_port, controller.GetInputPort("wheel_speed_command"))
        builder.Connect(measured_port, controller.GetInputPort("wheel_speeds"))
        effort_port = controller.GetOutputPort("wheel_efforts")
    motors = builder.AddNamedSystem("motors", MatrixGain(model.actuation_matrix()))
    builder.Connect(effort_port, motors.get_input_port())
    builder.Connect(motors.get_output_port(), model.plant.get_actuation_input_port(model.model_instance))
    return measured_port


def _add_roll_resistance(builder: DiagramBuilder, scenario: Scenario, model: RobotModel) -> None:
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
    builder: DiagramBuilder, scenario: Scenario, model: RobotModel, command_port: OutputPort
) -> tuple[OutputPort, OutputPort]:
    """The output ports of the wheel speeds for the servos, and of those that are measured."""
    state = model.plant.get_state_output_port(model.model_instance)
    speeds = builder.AddNamedSystem("wheel_speed_sensor", MatrixGain(model.wheel_speed_matrix()))
    builder.Connect(state, speeds.get_input_port())
    drives = scenario.errors.drives(scenario.robot)
    if drives is None:
        return command_port, speeds.get_output_port()
    angles = builder.AddNamedSystem("wheel_angle_sensor", MatrixGain(model.wheel_angle_matrix()))
    builder.Connect(state, angles.get_input_port())
    drivetrain = builder.AddNamedSystem("drivetrain", Drivetrain(drives, scenario.plant.time_step))
    builder.Connect(command_port, drivetrain.GetInputPort("wheel_speed_command"))
    builder.Connect(angles.get_output_port(), drivetrain.GetInputPort("wheel_angles"))
    return drivetrain.GetOutputPort("servo_wheel_speeds"), drivetrain.GetOutputPort("measured_wheel_speeds")


def _connect_servo(
    builder: DiagramBuilder, scenario: Scenario, model: RobotModel, command_port: OutputPort, *, external: bool
) -> None:
    plant = model.plant
    if not model.actuators:
        return
    servo = builder.AddNamedSystem("servo_command", MatrixGain(model.desired_state_matrix()))
    builder.Connect(servo.get_output_port(), plant.get_desired_state_input_port(model.model_instance))
    if not scenario.robot.steered_wheels:
        builder.Connect(command_port, servo.get_input_port())
        return
    angles = scenario.motion.steering_angles
    held = ConstantVectorSource(np.concatenate([angles(0.0), np.zeros(angles.values.shape[1])]))
    source = held if external else _source(angles, with_rates=True)
    steering = builder.AddNamedSystem("steering_command", source).get_output_port()
    both = builder.AddNamedSystem("motor_commands", Multiplexer([command_port.size(), steering.size()]))
    builder.Connect(command_port, both.get_input_port(0))
    builder.Connect(steering, both.get_input_port(1))
    builder.Connect(both.get_output_port(), servo.get_input_port())


def _source(profile: Profile, *, with_rates: bool = False) -> TrajectorySource:
    """Values of a profile over time, followed by their time derivatives if asked for."""
    trajectory = PiecewisePolynomial.CubicHermite(profile.breaks, profile.values.T, profile.slopes.T)
    return TrajectorySource(trajectory, output_derivative_order=int(with_rates), zero_derivatives_beyond_limits=True)
