"""The diagram that a scenario simulates: command, kinematics, servo, plant."""

from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from pydrake.geometry import Meshcat, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput, MatrixGain, VectorLogSink

from rollerbench.errors import SimulationError
from rollerbench.plant import RobotModel, add_ground, add_robot
from rollerbench.simulation.drake_config import add_plant
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.motors import Motors, add_motors, add_roll_resistance, servo_gains_of
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.wheel_command import FOR_LEGS, CommandFrom, add_command, drive_of, steers
from rollerbench.systems import Odometry, PlanarState, SlipMonitor, SteeredOdometry
from rollerbench.visualization.surroundings import add_bump_visuals, add_ground_visual, add_meshcat

LOGGED = ("state", "wheel_speed_command", "wheel_speeds", "net_actuation", "odometry", "rollers", "contact_forces")
"""Outputs that a run records."""


CONTACTS = ("normal_forces", "contact_forces", "contact_points")
"""Outputs of the `SlipMonitor` besides slip."""


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
    odometry: Odometry | SteeredOdometry
    logs: dict[str, VectorLogSink]


class Station(Diagram):
    """A robot on its ground, driven by a scenario's command.

    Where rollers are windowed, as they are by default, call `follow_rollers(simulator)` before the simulation. With
    all rollers, and without slip, rolling resistance and steering on the way, ToAutoDiffXd() converts it; but Drake's
    contacts of rollers are for floats only, so that such a plant can be evaluated and not stepped.

    Input ports, only if the command comes from outside, and then the one that fits the scenario:
        twist_command (3): body twist [m/s, m/s, rad/s]; where the scenario commands a twist, waypoints or a path.
        wheel_command (n_driven): speeds of the driven wheels [rad/s]; where it commands wheel speeds, and whatever it
            commands with command="wheels".
        steering_command (2 n_steered): angles of the steered wheels from heading_deg, then their rates [rad, rad/s];
            with command="wheels" only, if there are such wheels.
        effort_command (n_driven): torques of the driven wheels [N m]; where it commands wheel efforts.
        reference_pose (3), reference_twist (3): where B should be in W [m, m, rad], and its twist there in its own
            axes [m/s, m/s, rad/s]; in place of these, where the controller tracks poses.
    Output ports:
        pose (3): q_xyt, pose of B in W, yaw in (-pi, pi] [m, m, rad].
        twist (3): v_xyw_B, twist in B turned upright [m/s, m/s, rad/s].
        odometry (3): pose from the measured wheel speeds, and from the steering angles of wheels that steer; its yaw
            counts full turns [m, m, rad].
        wheel_state (2 n_driven): true angles of the driven wheels, then their speeds [rad, rad/s].
        wheel_speeds (n_driven): what their encoders measure [rad/s].
        wheel_speed_command (n_driven): what they are told [rad/s].
        steering_state (2 n_steered): angles of the steered wheels from heading_deg, then their rates [rad, rad/s];
            only if there are such wheels.
        net_actuation (n_actuators): torques of the motors, as the plant orders them [N m].
        slip (n_wheels): how fast wheels slide over the ground [m/s] (`SlipMonitor`).
        normal_forces (n_wheels): loads of the wheels [N].
        contact_forces (3 n_wheels): forces of the ground on the wheels in W, wheel by wheel [N].
        contact_points (3 n_wheels): where they act [m].
        state (nq + nv): state of the robot's model instance, as the plant orders it.
        reference_pose (3), reference_twist (3), twist_command (3): what the controller tracks, and what it commands;
            only where it tracks poses.
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
        command: CommandFrom = "scenario",
        meshcat: Meshcat | None = None,
        log: bool = False,
        visuals: bool = True,
        slip: bool = True,
    ) -> None:
        """Builds the diagram of a scenario.

        Args:
            scenario: What to simulate.
            command: "scenario" drives the robot as the scenario says; "external" exports inputs for that; "rest" holds
                the wheels; "wheels" exports inputs of the wheels, whatever the scenario commands.
            meshcat: Where to show the robot.
            log: Whether to record outputs (see `StationParts.logs`).
            visuals: Whether the robot shall be seen, in the meshcat or by what is connected to query_object.
            slip: Whether to export slip and normal_forces, which no AutoDiffXd can tell.

        Raises:
            DescriptionError: Drake refuses a setting of the plant.
            InfeasibleTwist: the command would make a tyre skid.
        """
        super().__init__()
        builder, drive = DiagramBuilder(), drive_of(scenario, command)
        plant, scene_graph = add_plant(builder, scenario)
        model = add_robot(
            plant,
            scenario.simulated_robot,
            gains=servo_gains_of(scenario, drive),
            roller_model=scenario.plant.roller_model,
            builder=builder,
            window_size=scenario.window_size,
            visuals=visuals,
        )
        _add_ground(plant, scenario, drawn=meshcat is not None)
        plant.Finalize()

        outputs = _add_sensors(builder, scene_graph, model, slip=slip)
        motors = add_motors(builder, scenario, model, drive)
        odometry = _add_odometry(builder, scenario, outputs, motors, steered=steers(scenario, command))
        outputs |= {"wheel_speeds": motors.measured, "odometry": odometry.GetOutputPort("q_xyt")}
        outputs |= add_command(builder, scenario, motors, outputs, command)
        add_roll_resistance(builder, scenario, model)
        for name, port in outputs.items():
            builder.ExportOutput(port, name)

        logs = {}
        if log:
            for name in LOGGED:
                if name in outputs and (name != "contact_forces" or scenario.recording.forces):
                    logs[name] = LogVectorOutput(outputs[name], builder, publish_period=scenario.plant.time_step)
        if meshcat is not None:
            add_meshcat(builder, scene_graph, meshcat, scenario.recording.frames_per_second)
        builder.BuildInto(self)
        self.parts = StationParts(model=model, scene_graph=scene_graph, odometry=odometry, logs=logs)


def build_station(
    scenario: Scenario | str | Path,
    *,
    command: CommandFrom = "scenario",
    meshcat: Meshcat | None = None,
    slip: bool = True,
) -> Station | LegStation:
    """The diagram of a scenario, to simulate or to compose with other systems: a `Station`, or on legs a `LegStation`.

    Args:
        scenario: Scenario, name of a shipped one, or path to a scenario.yaml.
        command: "scenario" drives the robot as the scenario says; "external" exports inputs for that; for robots on
            wheels "rest" holds these, and "wheels" exports inputs of each, whatever the scenario commands.
        meshcat: Where to show the robot.
        slip: Whether robots on wheels export slip and normal_forces, which no AutoDiffXd can tell.

    Raises:
        SimulationError: the command is none of these.
        DescriptionError, InfeasibleTwist: as of `Station`.
    """
    loaded = load_scenario(scenario)
    accepted = FOR_LEGS if loaded.robot.legs else get_args(CommandFrom)
    if command not in accepted:
        raise SimulationError(f"build_station: command = {command!r}: accepted: {', '.join(map(repr, accepted))}")
    if loaded.robot.legs:
        return LegStation(loaded, command="scenario" if command == "scenario" else "external", meshcat=meshcat)
    return Station(loaded, command=command, meshcat=meshcat, slip=slip)


def _add_sensors(
    builder: DiagramBuilder, scene_graph: SceneGraph, model: RobotModel, *, slip: bool
) -> dict[str, OutputPort]:
    """Output ports of what the plant tells."""
    plant = model.plant
    state = plant.get_state_output_port(model.model_instance)
    body = builder.AddNamedSystem("body_state", MatrixGain(model.body_state_matrix()))
    planar = builder.AddNamedSystem("planar_state", PlanarState())
    builder.Connect(state, body.get_input_port())
    builder.Connect(body.get_output_port(), planar.GetInputPort("state"))
    outputs = {
        "pose": planar.GetOutputPort("q_xyt"),
        "twist": planar.GetOutputPort("v_xyw_B"),
        "state": state,
        "net_actuation": plant.get_net_actuation_output_port(model.model_instance),
        "contact_results": plant.get_contact_results_output_port(),
        "query_object": scene_graph.get_query_output_port(),
    }
    selected = {"wheel_state": np.vstack([model.wheel_angle_matrix(), model.wheel_speed_matrix()])}
    if model.robot.steered_wheels:
        selected["steering_state"] = model.steering_state_matrix()
    for name, matrix in selected.items():
        gain = builder.AddNamedSystem(name, MatrixGain(matrix))
        builder.Connect(state, gain.get_input_port())
        outputs[name] = gain.get_output_port()
    if slip:
        monitor = builder.AddNamedSystem("slip_monitor", SlipMonitor(model))
        builder.Connect(outputs["contact_results"], monitor.GetInputPort("contact_results"))
        outputs |= {"slip": monitor.GetOutputPort("slip_speeds")}
        outputs |= {name: monitor.GetOutputPort(name) for name in CONTACTS}
    if model.roller_window is not None:
        outputs["rollers"] = model.roller_window.GetOutputPort("rollers")
    return outputs


def _add_odometry(
    builder: DiagramBuilder, scenario: Scenario, outputs: dict[str, OutputPort], motors: Motors, *, steered: bool
) -> Odometry | SteeredOdometry:
    kinematics, step = scenario.motion.kinematics, scenario.plant.time_step
    if steered and scenario.tracking is not None:
        step = scenario.tracking.period
    if not steered:
        odometry = builder.AddNamedSystem("odometry", Odometry(kinematics, step))
    else:
        odometry = builder.AddNamedSystem("odometry", SteeredOdometry(kinematics, step))
        count = len(scenario.robot.steered_wheels)
        angles = builder.AddNamedSystem("steering_angles", MatrixGain(np.eye(count, 2 * count)))
        builder.Connect(outputs["steering_state"], angles.get_input_port())
        builder.Connect(angles.get_output_port(), odometry.GetInputPort("steering_angles"))
    builder.Connect(motors.measured, odometry.GetInputPort("wheel_speeds"))
    return odometry


def _add_ground(plant: MultibodyPlant, scenario: Scenario, *, drawn: bool) -> None:
    bumps, ground = scenario.bumps, scenario.ground
    carrier = add_ground(plant, friction=ground.friction, slope_deg=ground.slope_deg, bumps=bumps)
    if drawn:
        add_ground_visual(plant, scenario.simulated_robot)
        if bumps is not None and carrier is not None:
            add_bump_visuals(plant, carrier, bumps)
