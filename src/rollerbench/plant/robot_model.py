"""A robot as part of a MultibodyPlant."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator, ModelInstanceIndex, RevoluteJoint, RigidBody
from pydrake.systems.framework import Context

from rollerbench.description import AnyWheel, Leg, Robot
from rollerbench.errors import SimulationError
from rollerbench.plant.servos import leg_and_wheel_joints
from rollerbench.plant.window import RollerWindow
from rollerbench.sdf import names
from rollerbench.sdf.contact import static_penetration


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """Where a robot's parts are in a plant.

    The servo takes desired states [q; v] of `actuated_joints` on
    plant.get_desired_state_input_port(model_instance).

    Attributes:
        robot: What was added.
        plant: Where it was added.
        model_instance: Its model instance.
        body: The chassis.
        roller_window: What remembers the rollers that are not simulated, if there are such.
    """

    robot: Robot
    plant: MultibodyPlant
    model_instance: ModelInstanceIndex
    body: RigidBody
    roller_window: RollerWindow | None = None

    def drive_joint(self, wheel: AnyWheel) -> RevoluteJoint:
        """The joint about a wheel's axle."""
        return self._joint(names.drive_joint(wheel.name))

    def swivel_joint(self, wheel: AnyWheel) -> RevoluteJoint:
        """The joint about the vertical axis of a castor or steered wheel."""
        return self._joint(names.swivel_joint(wheel.name))

    def roller_joints(self, wheel: AnyWheel) -> list[RevoluteJoint]:
        """The joints of a wheel's rollers, from the one at the bottom at wheel angle 0; none for a tyre.

        Of a windowed wheel those of the simulated rollers, by slot (see `rollerbench.sdf.window.Window`).
        """
        count = wheel.ring.count if wheel.ring else 0
        if self.roller_window is not None and wheel.name in self.roller_window.windows:
            count = self.roller_window.windows[wheel.name].size
        return [self._joint(names.roller_joint(wheel.name, index)) for index in range(count)]

    def leg_joints(self, leg: Leg) -> list[RevoluteJoint]:
        """The joints of a leg, from the hip on."""
        return [self._joint(name) for name in names.leg_joints(leg.name, len(leg.links))]

    def wheel_joint(self, leg: Leg) -> RevoluteJoint:
        """The joint about the axle of a foot's driven wheel."""
        return self._joint(names.drive_joint(leg.name))

    def foot_body(self, leg: Leg) -> RigidBody:
        """The wheel at a leg's foot; its frame at wheel angle 0 is the last of `Leg.frames_B`."""
        return self.plant.GetBodyByName(names.foot(leg.name), self.model_instance)

    @property
    def X_BT(self) -> RigidTransform:
        """Where to weld an arm or a payload: frame T in the middle of the top of the body's box, parallel to B.

        plant.WeldFrames(model.body.body_frame(), base_of_the_arm, model.X_BT)
        """
        box = self.robot.body
        x, y, z = box.box_center
        return RigidTransform([x, y, z + 0.5 * box.size[2]])

    @property
    def actuators(self) -> list[JointActuator]:
        """Actuators in the order of the plant's actuation and desired state ports."""
        if not self.plant.is_finalized():
            # Drake's list is empty until then, and joints would be missing without a word.
            raise SimulationError("actuators: the plant is not finalized; accepted: after plant.Finalize()")
        return [
            self.plant.get_joint_actuator(index) for index in self.plant.GetJointActuatorIndices(self.model_instance)
        ]

    def desired_state_matrix(self) -> NDArray[np.float64]:
        """Matrix (2 n_actuators, n_driven + 2 n_steered) to the servo's [q; v].

        It takes [wheel_speeds; steering_angles; steering_rates].

        Drive servos have no stiffness, so their desired angles stay 0; steering servos hold angles.
        """
        robot, actuators = self.robot, self.actuators
        row = {actuator.joint().name(): index for index, actuator in enumerate(actuators)}
        matrix = np.zeros((2 * len(actuators), len(robot.driven_wheels) + 2 * len(robot.steered_wheels)))
        for column, wheel in enumerate(robot.driven_wheels):
            matrix[len(actuators) + row[names.drive_joint(wheel.name)], column] = 1.0
        for column, wheel in enumerate(robot.steered_wheels, start=len(robot.driven_wheels)):
            matrix[row[names.swivel_joint(wheel.name)], column] = 1.0
            rate = column + len(robot.steered_wheels)
            matrix[len(actuators) + row[names.swivel_joint(wheel.name)], rate] = 1.0
        return matrix

    def actuation_matrix(self) -> NDArray[np.float64]:
        """Matrix (n_actuators, n_driven) from wheel efforts [N m] to the plant's actuation port of the model."""
        row = {actuator.joint().name(): index for index, actuator in enumerate(self.actuators)}
        matrix = np.zeros((len(row), len(self.robot.driven_wheels)))
        for column, wheel in enumerate(self.robot.driven_wheels):
            matrix[row[names.drive_joint(wheel.name)], column] = 1.0
        return matrix

    def wheel_speed_matrix(self) -> NDArray[np.float64]:
        """Matrix (n_driven, nq + nv) from the robot's state [q; v] to the speeds of its driven wheels."""
        plant, instance = self.plant, self.model_instance
        offset = plant.num_positions(instance)
        matrix = np.zeros((len(self.robot.driven_wheels), plant.num_multibody_states(instance)))
        for row, wheel in enumerate(self.robot.driven_wheels):
            matrix[row, offset + self.velocity_index(self.drive_joint(wheel))] = 1.0
        return matrix

    def wheel_angle_matrix(self) -> NDArray[np.float64]:
        """Matrix (n_driven, nq + nv) from the robot's state [q; v] to the angles of its driven wheels."""
        matrix = np.zeros((len(self.robot.driven_wheels), self.plant.num_multibody_states(self.model_instance)))
        for row, wheel in enumerate(self.robot.driven_wheels):
            matrix[row, self.position_index(self.drive_joint(wheel))] = 1.0
        return matrix

    def steering_state_matrix(self) -> NDArray[np.float64]:
        """Matrix (2 n_steered, nq + nv) from the robot's state [q; v] to [angles; rates] of its steered wheels."""
        steered, offset = self.robot.steered_wheels, self.plant.num_positions(self.model_instance)
        matrix = np.zeros((2 * len(steered), self.plant.num_multibody_states(self.model_instance)))
        for row, wheel in enumerate(steered):
            joint = self.swivel_joint(wheel)
            matrix[row, self.position_index(joint)] = 1.0
            matrix[row + len(steered), offset + self.velocity_index(joint)] = 1.0
        return matrix

    def leg_state_matrix(self) -> NDArray[np.float64]:
        """Matrix (2 n, nq + nv) from the robot's state [q; v] to [angles; rates] of its legs' n joints and wheels.

        Leg by leg, each leg's joints and then its wheel; 0 for a wheel that is locked.
        """
        offset, joints = self.plant.num_positions(self.model_instance), leg_and_wheel_joints(self.robot)
        matrix = np.zeros((2 * len(joints), self.plant.num_multibody_states(self.model_instance)))
        for row, name in enumerate(joints):
            if name is not None:
                matrix[row, self.position_index(self._joint(name))] = 1.0
                matrix[row + len(joints), offset + self.velocity_index(self._joint(name))] = 1.0
        return matrix

    def leg_command_matrix(self) -> NDArray[np.float64]:
        """Matrix (2 n_actuators, 2 n) from desired [angles; rates] to the servo's [q; v], ordered like the state."""
        efforts = self.leg_effort_matrix()
        nothing = np.zeros_like(efforts)
        return np.block([[efforts, nothing], [nothing, efforts]])

    def leg_effort_matrix(self) -> NDArray[np.float64]:
        """Matrix (n_actuators, n) from torques [N m], in the order of `leg_state_matrix`, to the actuation port."""
        row = {actuator.joint().name(): index for index, actuator in enumerate(self.actuators)}
        joints = leg_and_wheel_joints(self.robot)
        matrix = np.zeros((len(row), len(joints)))
        for column, name in enumerate(joints):
            if name is not None:
                matrix[row[name], column] = 1.0
        return matrix

    def body_state_matrix(self) -> NDArray[np.float64]:
        """Matrix (13, nq + nv) from the robot's state to its body's [quaternion, p_WB, w_WB_W, v_WB_W]."""
        plant, instance = self.plant, self.model_instance
        matrix = np.zeros((13, plant.num_multibody_states(instance)))
        q = self.body_position_index
        v = plant.num_positions(instance) + self.body_velocity_index
        matrix[range(7), range(q, q + 7)] = 1.0
        matrix[range(7, 13), range(v, v + 6)] = 1.0
        return matrix

    @property
    def body_position_index(self) -> int:
        """Where the body's quaternion and position start in the robot's positions."""
        self._require_floating("body_position_index")
        return self._positions.index(int(self.body.floating_positions_start()))

    @property
    def body_velocity_index(self) -> int:
        """Where the body's angular and linear velocity start in the robot's velocities."""
        self._require_floating("body_velocity_index")
        return self._velocities.index(int(self.body.floating_velocities_start_in_v()))

    def position_index(self, joint: RevoluteJoint) -> int:
        """Index of a joint's angle in the robot's positions."""
        return self._positions.index(int(joint.position_start()))

    def velocity_index(self, joint: RevoluteJoint) -> int:
        """Index of a joint's rate in the robot's velocities."""
        return self._velocities.index(int(joint.velocity_start()))

    def start_in(self, posture: str) -> None:
        """Makes a posture, on level ground, the one in which contexts start; before the plant is finalized."""
        place = RigidTransform([0.0, 0.0, standing_height(self.robot, posture)])
        self.plant.SetDefaultFloatingBaseBodyPose(self.body, place)
        for leg in self.robot.legs:
            for joint, angle in zip(self.leg_joints(leg), leg.posture(posture), strict=True):
                joint.set_default_angle(angle)

    def set_pose(self, context: Context, q_xyt: ArrayLike, posture: str | None = None) -> None:
        """Stands the robot on level ground at a planar pose (3,) in W, sunk in by what its weight will do.

        Legs take a posture, by default the first.

        Raises:
            SimulationError: the robot has no such posture, or its body is not free.
        """
        self._require_floating("set_pose")
        postures = [standing.name for standing in self.robot.standing]
        if posture is not None and posture not in postures:
            raise SimulationError(f"set_pose: posture = {posture!r}: accepted: {', '.join(postures) or 'None'}")
        x, y, yaw = np.asarray(q_xyt, dtype=np.float64)
        for leg in self.robot.legs:
            for joint, angle in zip(
                self.leg_joints(leg), leg.posture(posture or self.robot.standing[0].name), strict=True
            ):
                joint.set_angle(context, angle)
        pose = RigidTransform(RollPitchYaw(0.0, 0.0, yaw), [x, y, standing_height(self.robot, posture)])
        self.plant.SetFreeBodyPose(context, self.body, pose)

    def _require_floating(self, what: str) -> None:
        if not self.body.is_floating_base_body():
            raise SimulationError(
                f"{what}: the body of {self.plant.GetModelInstanceName(self.model_instance)} is not free, but fixed to "
                "another; accepted: a robot that others are welded onto, WeldFrames(model.body.body_frame(), other)"
            )

    @property
    def _positions(self) -> list[int]:
        """Which of the plant's positions are the robot's; those of a model on its fork or leg lie between them."""
        every = np.arange(self.plant.num_positions(), dtype=np.float64)
        return self.plant.GetPositionsFromArray(self.model_instance, every).astype(int).tolist()

    @property
    def _velocities(self) -> list[int]:
        """Which of the plant's velocities are the robot's."""
        every = np.arange(self.plant.num_velocities(), dtype=np.float64)
        return self.plant.GetVelocitiesFromArray(self.model_instance, every).astype(int).tolist()

    def _joint(self, name: str) -> RevoluteJoint:
        return self.plant.GetJointByName(name, self.model_instance)


def standing_height(robot: Robot, posture: str | None = None) -> float:
    """Height of Bo above level ground, sunk in by what the weight does [m]."""
    ground = robot.ground_height
    if robot.legs:
        ground = min(foot[2] - leg.wheel.radius for foot, leg in zip(robot.feet_B(posture), robot.legs, strict=True))
    return -float(ground) - static_penetration(robot)
