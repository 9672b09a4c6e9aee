"""Plants that hold robots and other models, for tests."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains, RigidBody
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, InputPort

import rollerbench as rb

BOX_MASS, BOX_SIZE, FOOT = 2.0, 0.2, 0.03
# Balls under its corners: the point contact of a box with a plane, or with a box, is one point that leaps about.
BOX = (
    '<?xml version="1.0"?><sdf version="1.9"><model name="box"><link name="box">'
    f"<inertial><mass>{BOX_MASS}</mass><inertia><ixx>0.0133</ixx><iyy>0.0133</iyy><izz>0.0133</izz></inertia></inertial>"
    + "".join(
        f'<collision name="foot_{index}"><pose>{x} {y} {FOOT - 0.5 * BOX_SIZE} 0 0 0</pose>'
        f"<geometry><sphere><radius>{FOOT}</radius></sphere></geometry>"
        "<surface><friction><ode><mu>0.3</mu><mu2>0.3</mu2></ode></friction></surface></collision>"
        for index, (x, y) in enumerate(product((FOOT - 0.5 * BOX_SIZE, 0.5 * BOX_SIZE - FOOT), repeat=2))
    )
    + "</link></model></sdf>"
)

ARM_MASS = 3.0


def _link(name: str, mass: float, z: float) -> str:
    inertia = "<ixx>0.002</ixx><iyy>0.002</iyy><izz>0.002</izz>"
    return (
        f'<link name="{name}"><pose>0 0 {z} 0 0 0</pose><inertial><pose>0 0 0.1 0 0 0</pose><mass>{mass}</mass>'
        f"<inertia>{inertia}</inertia></inertial></link>"
    )


def _joint(name: str, parent: str, child: str, axis: str) -> str:
    limit = "<limit><effort>50</effort></limit>"
    return (
        f'<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child>'
        f"<axis><xyz>{axis}</xyz>{limit}</axis></joint>"
    )


ARM = (
    '<?xml version="1.0"?><sdf version="1.9"><model name="arm">'
    + _link("base", 1.0, 0.0)
    + _link("upper", 1.2, 0.0)
    + _link("lower", 0.8, 0.2)
    + _joint("shoulder", "base", "upper", "0 0 1")
    + _joint("elbow", "upper", "lower", "0 1 0")
    + "</model></sdf>"
)


def add_model(plant: MultibodyPlant, text: str) -> ModelInstanceIndex:
    parser = Parser(plant)
    parser.SetAutoRenaming(True)
    (instance,) = parser.AddModelsFromString(text, "sdf")
    return instance


def root_frame(plant: MultibodyPlant, instance: ModelInstanceIndex) -> Any:
    return plant.get_body(plant.GetBodyIndices(instance)[0]).body_frame()


class World:
    """A plant with robots and other models on level ground."""

    def __init__(self, roller_model: str = "windowed") -> None:
        self.builder, self.roller_model = DiagramBuilder(), roller_model
        config = MultibodyPlantConfig(time_step=0.005, contact_model="point", discrete_contact_approximation="lagged")
        self.plant, self.scene_graph = AddMultibodyPlant(config, self.builder)
        self.models: list[rb.RobotModel] = []

    def add(self, robot: Any, roller_model: str | None = None) -> rb.RobotModel:
        options = {"roller_model": roller_model or self.roller_model, "builder": self.builder, "visuals": False}
        model = rb.add_robot(self.plant, robot, **options)
        self.models.append(model)
        return model

    def add_arm(self, frame: Any, X_FA: RigidTransform | None = None) -> ModelInstanceIndex:
        """An arm on a frame, whose joints hold their angles."""
        arm = add_model(self.plant, ARM)
        self.plant.WeldFrames(frame, root_frame(self.plant, arm), X_FA or RigidTransform())
        for index in self.plant.GetJointActuatorIndices():
            actuator = self.plant.get_joint_actuator(index)
            if actuator.model_instance() == arm:
                actuator.set_controller_gains(PdControllerGains(p=400.0, d=40.0))
        return arm

    def start(self, finish: Callable[["World"], None] = lambda world: None) -> None:
        """Builds the diagram; every robot and arm is to stand still."""
        rb.add_ground(self.plant)
        self.plant.Finalize()
        finish(self)
        self.simulator = Simulator(self.builder.Build())
        rb.follow_rollers(self.simulator)
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for index in range(2, self.plant.num_model_instances()):
            port = self.plant.get_desired_state_input_port(ModelInstanceIndex(index))
            if port.size():
                port.FixValue(self.context, np.zeros(port.size()))
        for model in self.models:
            if model.robot.legs:
                self.stand(model)

    def desired(self, model: rb.RobotModel) -> InputPort:
        return self.plant.get_desired_state_input_port(model.model_instance)

    def drive(self, model: rb.RobotModel, v_xyw_B: Sequence[float]) -> None:
        matrix = model.desired_state_matrix()
        command = np.zeros(matrix.shape[1])
        speeds = rb.WheelKinematics(model.robot).inverse(v_xyw_B)
        command[: len(speeds)] = speeds
        self.desired(model).FixValue(self.context, matrix @ command)

    def stand(self, model: rb.RobotModel) -> None:
        q = np.concatenate([[*leg.posture(model.robot.standing[0].name), 0.0] for leg in model.robot.legs])
        self.desired(model).FixValue(self.context, model.leg_command_matrix() @ np.r_[q, np.zeros(len(q))])

    def state(self, model: rb.RobotModel) -> Any:
        return self.plant.GetPositionsAndVelocities(self.context, model.model_instance)

    def q_xyt(self, model: rb.RobotModel) -> Any:
        pose = self.plant.EvalBodyPoseInWorld(self.context, model.body)
        return np.array([*pose.translation()[:2], RollPitchYaw(pose.rotation()).yaw_angle()])

    def x_ahead(self, model: rb.RobotModel, body: RigidBody) -> float:
        """How far a body is ahead of a robot along x of the world."""
        return self.plant.EvalBodyPoseInWorld(self.context, body).translation()[0] - self.q_xyt(model)[0]

    def touching(self) -> set[frozenset[str]]:
        """Pairs of model instances that touch."""
        contacts = self.plant.get_contact_results_output_port().Eval(self.context)
        infos = [contacts.point_pair_contact_info(index) for index in range(contacts.num_point_pair_contacts())]
        bodies = [[self.plant.get_body(i) for i in (info.bodyA_index(), info.bodyB_index())] for info in infos]
        return {frozenset(self.plant.GetModelInstanceName(b.model_instance()) for b in pair) for pair in bodies}
