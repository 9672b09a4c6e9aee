"""The servo of a robot's legs as a Drake System: torques that make joints follow speeds, within what motors have."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Adder, Gain, LinearSystem, MatrixGain, Saturation

from rollerbench.description import Leg, Robot
from rollerbench.plant import RobotModel
from rollerbench.sdf.servo import leg_gains

Array = NDArray[np.float64]


class LegServo(Diagram):
    """Torques that make joints follow speeds, within what the motors have.

    motor = sat(k (q_d - q) + d (v_d - v) + u_ff). A damping of this size would shake in steps of milliseconds, so the
    joints have it too, where Drake takes it implicitly (`damp_joints`), and the actuation adds it: u = motor + d v.
    All of it is Drake's C++.

    Input ports:
        joint_rates (n): desired speeds, leg by leg, each leg's joints and then its wheel [rad/s].
        joint_efforts (n): feed-forward torques in the same order [N m].
        state (nq + nv): state of the robot's model instance.
    Output ports:
        actuation (n_actuators): for the plant's actuation port [N m].
        motor_efforts (n): torques of the motors, in the order of the inputs [N m].
        lag (n): desired minus true angles [rad].
    """

    def __init__(
        self,
        model: RobotModel,
        time_step: float,
        lost: Mapping[str, float] = MappingProxyType({}),
        posture: str | None = None,
    ) -> None:
        """Builds the diagram.

        Args:
            model: The robot, in a plant that is finalized.
            time_step: Step of the plant [s].
            lost: Legs whose motors give no torque any more, by name, and from when on [s].
            posture: The posture in which the robot starts; by default the first.
        """
        super().__init__()
        builder = DiagramBuilder()
        stiffness, damping, limit = _gains(model)
        size = len(stiffness)
        identity = np.eye(size)
        # The plant's step starts from the angles at its beginning: the sum lags by a step, which D makes up.
        desired = LinearSystem(identity, time_step * identity, identity, time_step * identity, time_step)
        name = posture or model.robot.standing[0].name
        desired.configure_default_state(np.concatenate([[*leg.posture(name), 0.0] for leg in model.robot.legs]))
        self._desired = builder.AddNamedSystem("desired_angles", desired)
        angles, rates = np.split(model.leg_state_matrix(), 2)
        lag = builder.AddNamedSystem("lag", Adder(2, size))
        builder.Connect(self._desired.get_output_port(), lag.get_input_port(0))
        minus = builder.AddNamedSystem("minus_angles", MatrixGain(-angles))
        builder.Connect(minus.get_output_port(), lag.get_input_port(1))
        terms = builder.AddNamedSystem("terms", Adder(4, size))
        for index, (name, gain) in enumerate((("stiffness", stiffness), ("damping", damping))):
            system = builder.AddNamedSystem(name, Gain(gain))
            builder.Connect(system.get_output_port(), terms.get_input_port(index))
        builder.Connect(lag.get_output_port(), builder.GetSubsystemByName("stiffness").get_input_port())
        viscous = builder.AddNamedSystem("viscous", MatrixGain(-damping[:, np.newaxis] * rates))
        builder.Connect(viscous.get_output_port(), terms.get_input_port(2))
        motors = builder.AddNamedSystem("motors", Saturation(-limit, limit))
        builder.Connect(terms.get_output_port(), motors.get_input_port())
        effort_port = motors.get_output_port()
        if lost:
            failing = builder.AddNamedSystem("lost_legs", LostLegs(model.robot, lost))
            builder.Connect(effort_port, failing.get_input_port())
            effort_port = failing.get_output_port()
        efforts = model.leg_effort_matrix()
        actuated = builder.AddNamedSystem("actuated", MatrixGain(efforts))
        builder.Connect(effort_port, actuated.get_input_port())
        added = builder.AddNamedSystem("added_damping", MatrixGain(efforts @ (damping[:, np.newaxis] * rates)))
        actuation = builder.AddNamedSystem("actuation", Adder(2, len(efforts)))
        builder.Connect(actuated.get_output_port(), actuation.get_input_port(0))
        builder.Connect(added.get_output_port(), actuation.get_input_port(1))
        builder.ExportInput(self._desired.get_input_port(), "joint_rates")
        builder.ConnectInput("joint_rates", builder.GetSubsystemByName("damping").get_input_port())
        builder.ExportInput(terms.get_input_port(3), "joint_efforts")
        builder.ExportInput(minus.get_input_port(), "state")
        for system in (viscous, added):
            builder.ConnectInput("state", system.get_input_port())
        builder.ExportOutput(actuation.get_output_port(), "actuation")
        builder.ExportOutput(effort_port, "motor_efforts")
        builder.ExportOutput(lag.get_output_port(), "lag")
        builder.BuildInto(self)

    def set_angles(self, context: Context, angles: ArrayLike) -> None:
        """Sets the desired angles (n) in a context of this system [rad]."""
        own = self.GetMutableSubsystemContext(self._desired, context)
        own.SetDiscreteState(np.asarray(angles, dtype=np.float64))


class LostLegs(LeafSystem):
    """Motors of legs that give no torque any more from some time on.

    Input ports:
        efforts (n): torques, leg by leg, each leg's joints and then its wheel [N m].
    Output ports:
        efforts (n): those that are left [N m].
    """

    def __init__(self, robot: Robot, lost: Mapping[str, float]) -> None:
        """Makes the system for legs by name and the times when they are lost [s]."""
        super().__init__()
        times = [[lost.get(leg.name, np.inf)] * (len(leg.links) + 1) for leg in robot.legs]
        self._until = np.concatenate(times)
        self._efforts = self.DeclareVectorInputPort("efforts", len(self._until))
        self.DeclareVectorOutputPort("efforts", len(self._until), self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.where(context.get_time() < self._until, self._efforts.Eval(context), 0.0))


def unlimited(robot: Robot) -> Robot:
    """The robot with motors of legs that have no limits: its `LegServo` knows them."""

    def leg(described: Leg) -> Leg:
        links = tuple(link.model_copy(update={"max_effort": None}) for link in described.links)
        wheel = described.wheel.model_copy(update={"max_effort": None})
        return described.model_copy(update={"links": links, "wheel": wheel})

    return robot.model_copy(update={"legs": tuple(leg(each) for each in robot.legs)})


def damp_joints(model: RobotModel) -> None:
    """Gives the joints of a robot's legs the damping of its `LegServo`, before the plant is finalized."""
    for leg in model.robot.legs:
        gains = leg_gains(model.robot, leg)
        for joint in model.leg_joints(leg):
            joint.set_default_damping(gains.damping)
        if leg.wheel.driven:
            model.wheel_joint(leg).set_default_damping(gains.wheel_damping)


def _gains(model: RobotModel) -> tuple[Array, Array, Array]:
    """Stiffness [N m], damping [N m s] and largest torque [N m], in the order of `RobotModel.leg_state_matrix`."""
    rows = []
    for leg in model.robot.legs:
        gains = leg_gains(model.robot, leg)
        rows += [(gains.stiffness, gains.damping, link.max_effort or np.inf) for link in leg.links]
        wheel = (gains.wheel_stiffness, gains.wheel_damping, leg.wheel.max_effort or np.inf)
        rows.append(wheel if leg.wheel.driven else (0.0, 0.0, np.inf))
    stiffness, damping, limit = np.array(rows).T
    return stiffness, damping, limit
