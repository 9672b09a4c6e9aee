"""The diagram that a scenario of a robot on legs simulates: command, planner, tracker, servo, plant."""

from dataclasses import dataclass, replace
from typing import Literal

from pydrake.common.value import Value
from pydrake.geometry import Meshcat, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.primitives import LogVectorOutput, MatrixGain, VectorLogSink

from rollerbench.kinematics.gaits import LegCommand, LegMode
from rollerbench.plant import RobotModel, ServoGains, add_ground, add_robot
from rollerbench.simulation.drake_config import add_plant
from rollerbench.simulation.leg_command import GaitCommand, command_at
from rollerbench.simulation.scenario import Scenario
from rollerbench.systems import PlanarState, SlipMonitor
from rollerbench.systems.leg_servo import LegServo, damp_joints, unlimited
from rollerbench.systems.legs import GaitPlanner, LegTracker
from rollerbench.systems.stance import BodyPoseController, LegWatch, StanceOdometry
from rollerbench.visualization.surroundings import add_ground_visual, add_meshcat


@dataclass(frozen=True, kw_only=True)
class LegStationParts:
    """Subsystems of a station.

    Attributes:
        model: The robot in the plant.
        scene_graph: The plant's scene graph.
        planner: The planner.
        tracker: What carries out its plans.
        servo: The joints' servo.
        logs: Log sinks by the name of the exported output port that they record.
    """

    model: RobotModel
    scene_graph: SceneGraph
    planner: GaitPlanner
    tracker: LegTracker
    servo: LegServo
    logs: dict[str, VectorLogSink]


EVERY_STEP = ("state", "motor_efforts", "contact_efforts")
"""Outputs that are recorded at every step of the plant, and ..."""

EVERY_PERIOD = ("reference_pose", "reference_twist", "desired", "stance", "odometry")
"""... those that change once in a period of control."""


class CommandSource(LeafSystem):
    """The course of a gait command over time.

    Output ports:
        v_xyw_B (3): body twist [m/s, m/s, rad/s].
        body_offset (6): pose of the body from where its posture has it [m, rad].
        mode: the `LegMode`.
    """

    def __init__(self, course: list[tuple[float, LegCommand]]) -> None:
        """Makes the system for a course (`GaitCommand.course`)."""
        super().__init__()
        self._course = course
        first = course[0][1]
        self.DeclareVectorOutputPort("v_xyw_B", 3, lambda c, out: out.SetFromVector(self._now(c).v_xyw_B))
        self.DeclareVectorOutputPort("body_offset", 6, lambda c, out: out.SetFromVector(self._now(c).offset))
        self.DeclareAbstractOutputPort(
            "mode", lambda: Value(first.mode), lambda c, out: out.set_value(self._now(c).mode)
        )

    def _now(self, context: Context) -> LegCommand:
        return command_at(self._course, context.get_time())


class LegStation(Diagram):
    """A robot on legs on its ground, driven by a scenario's gait command.

    Input ports, only if the command comes from outside:
        twist_command (3): body twist [m/s, m/s, rad/s].
        body_offset (6): pose of the body from where its posture has it [m, rad]; 0 if not connected.
        mode: a `LegMode`; standing and walking in the first posture if not connected.
    Output ports:
        state (nq + nv): state of the robot's model instance, as the plant orders it.
        pose (3): q_xyt, pose of B in W, yaw in (-pi, pi] [m, m, rad].
        twist (3): v_xyw_B, twist in B turned upright [m/s, m/s, rad/s].
        reference_pose (3): where the accepted twists lead to [m, m, rad].
        reference_twist (3): the accepted twist, smoothed [m/s, m/s, rad/s].
        desired (6): pose of the body on its reference, x, y, z [m], roll, pitch, yaw [rad].
        stance (n_legs): 1 for feet that shall stand, 0 for those in the air.
        plan: the `LegPlan`.
        joint_state (2 n): measured angles, then rates, leg by leg, each leg's joints and then its wheel [rad, rad/s].
        motor_efforts (n): torques of the motors in the same order [N m].
        contact_efforts (nv): the contacts' forces on the velocities of the robot's model instance, as the plant orders
            them [N, N m].
        normal_forces (n_legs): loads of the feet [N].
        contact_forces (3 n_legs): forces of the ground on the feet in W, foot by foot [N].
        contact_points (3 n_legs): where they act [m].
        slip (n_legs): how fast feet slide over the ground [m/s].
        odometry (3): pose from the legs that stand [m, m, rad]; with a closed loop only.
        contact_results: Drake's ContactResults.
        query_object: Drake's QueryObject.

    Attributes:
        parts: Subsystems.
    """

    parts: LegStationParts

    def __init__(
        self,
        scenario: Scenario,
        *,
        command: Literal["scenario", "external"] = "scenario",
        meshcat: Meshcat | None = None,
        log: bool = False,
        visuals: bool = True,
    ) -> None:
        """Builds the diagram of a scenario; arguments as of `Station`.

        Raises:
            DescriptionError: Drake refuses a setting of the plant.
        """
        super().__init__()
        assert isinstance(scenario.command, GaitCommand)
        builder = DiagramBuilder()
        plant, scene_graph = add_plant(builder, scenario)
        control, ground = scenario.leg_control, scenario.ground
        course = scenario.command.course(scenario.robot)
        mode = course[0][1].mode
        model = _standing_robot(plant, scenario, mode.posture, visuals=visuals)
        if meshcat is not None:
            add_ground_visual(plant, model.robot)
        plant.Finalize()

        planner = builder.AddNamedSystem("gait_planner", GaitPlanner(scenario.robot, control.period, mode))
        tracker = builder.AddNamedSystem("tracker", LegTracker(scenario.robot, control.period, mode, ground.up_W))
        servo = builder.AddNamedSystem(
            "servo", LegServo(model, scenario.plant.time_step, scenario.errors.lost_legs, mode.posture)
        )
        watch = builder.AddNamedSystem("leg_watch", LegWatch(planner.planner))
        contacts = builder.AddNamedSystem("contacts", SlipMonitor(model))
        joints = builder.AddNamedSystem("joint_state", MatrixGain(model.leg_state_matrix()))
        body = builder.AddNamedSystem("body_state", MatrixGain(model.body_state_matrix()))
        planar = builder.AddNamedSystem("planar_state", PlanarState())
        state = plant.get_state_output_port(model.model_instance)
        wires = [
            (planner.GetOutputPort("plan"), tracker.GetInputPort("plan")),
            (tracker.GetOutputPort("tracked"), planner.GetInputPort("tracked")),
            (tracker.GetOutputPort("joint_rates"), servo.GetInputPort("joint_rates")),
            (tracker.GetOutputPort("joint_efforts"), servo.GetInputPort("joint_efforts")),
            (state, servo.GetInputPort("state")),
            (servo.GetOutputPort("actuation"), plant.get_actuation_input_port(model.model_instance)),
            (servo.GetOutputPort("lag"), watch.GetInputPort("lag")),
            (watch.GetOutputPort("fault"), planner.GetInputPort("fault")),
            (plant.get_contact_results_output_port(), contacts.GetInputPort("contact_results")),
            (state, joints.get_input_port()),
            (state, body.get_input_port()),
            (body.get_output_port(), planar.GetInputPort("state")),
        ]
        if ground.steps:
            wires.append((contacts.GetOutputPort("normal_forces"), planner.GetInputPort("foot_loads")))
        outputs = {
            "state": state,
            "pose": planar.GetOutputPort("q_xyt"),
            "twist": planar.GetOutputPort("v_xyw_B"),
            "reference_pose": planner.GetOutputPort("q_xyt"),
            "reference_twist": planner.GetOutputPort("v_xyw_B"),
            "desired": planner.GetOutputPort("desired"),
            "stance": planner.GetOutputPort("stance"),
            "plan": planner.GetOutputPort("plan"),
            "joint_state": joints.get_output_port(),
            "motor_efforts": servo.GetOutputPort("motor_efforts"),
            "contact_efforts": plant.get_generalized_contact_forces_output_port(model.model_instance),
            "normal_forces": contacts.GetOutputPort("normal_forces"),
            "contact_forces": contacts.GetOutputPort("contact_forces"),
            "contact_points": contacts.GetOutputPort("contact_points"),
            "slip": contacts.GetOutputPort("slip_speeds"),
            "contact_results": plant.get_contact_results_output_port(),
            "query_object": scene_graph.get_query_output_port(),
        }
        if control.closed_loop:
            outputs["odometry"] = _close_loop(builder, planner, joints.get_output_port(), mode, control.period)
        if command == "external":
            for theirs, name in (("v_xyw_B", "twist_command"), ("body_offset", "body_offset"), ("mode", "mode")):
                builder.ExportInput(planner.GetInputPort(theirs), name)
        else:
            source = builder.AddNamedSystem("command", CommandSource(course))
            wires += [
                (source.GetOutputPort(name), planner.GetInputPort(name)) for name in ("v_xyw_B", "body_offset", "mode")
            ]
        for output, target in wires:
            builder.Connect(output, target)
        for name, port in outputs.items():
            builder.ExportOutput(port, name)
        logs = {}
        for names, period in ((EVERY_STEP, scenario.plant.time_step), (EVERY_PERIOD, control.period)) if log else ():
            for name in names:
                if name in outputs:
                    logs[name] = LogVectorOutput(outputs[name], builder, publish_period=period)
        if meshcat is not None:
            add_meshcat(builder, scene_graph, meshcat, scenario.recording.frames_per_second)
        builder.BuildInto(self)
        self.parts = LegStationParts(
            model=model, scene_graph=scene_graph, planner=planner, tracker=tracker, servo=servo, logs=logs
        )


def _standing_robot(plant: MultibodyPlant, scenario: Scenario, posture: str, *, visuals: bool) -> RobotModel:
    """Adds the robot and its ground to a plant, with joints damped for its servo."""
    robot, ground = scenario.simulated_robot, scenario.ground
    # The servo knows the motors' limits; the plant's own would clamp what it adds for stability.
    model = replace(add_robot(plant, unlimited(robot), gains=ServoGains(), visuals=visuals), robot=robot)
    damp_joints(model)
    model.start_in(posture)
    steps = [(step.start, step.end, step.height) for step in ground.steps]
    add_ground(plant, friction=ground.friction, slope_deg=ground.slope_deg, steps=steps)
    return model


def _close_loop(
    builder: DiagramBuilder, planner: GaitPlanner, joint_state: OutputPort, mode: LegMode, period: float
) -> OutputPort:
    """Brings the body back to its reference by stance odometry; returns the output port of its planar pose."""
    start = planner.planner.start(mode)
    odometry = StanceOdometry(planner.planner.robot, planner.planner, start, period)
    builder.AddNamedSystem("stance_odometry", odometry)
    loop = builder.AddNamedSystem("body_pose_controller", BodyPoseController(period))
    for output, target in (
        (planner.GetOutputPort("plan"), odometry.GetInputPort("plan")),
        (joint_state, odometry.GetInputPort("joint_state")),
        (planner.GetOutputPort("desired"), loop.GetInputPort("desired")),
        (odometry.GetOutputPort("pose"), loop.GetInputPort("pose")),
        (loop.GetOutputPort("correction"), planner.GetInputPort("correction")),
        (loop.GetOutputPort("level"), planner.GetInputPort("level")),
    ):
        builder.Connect(output, target)
    return odometry.GetOutputPort("q_xyt")
