"""Drake Systems that read a plant's contacts: slip of the wheels, and rolling resistance."""

import math

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults, PointPairContactInfo
from pydrake.multibody.tree import RevoluteJoint
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, LeafSystem

from rollerbench.description.inertia import GRAVITY
from rollerbench.description.mass import axle_inertia
from rollerbench.errors import SimulationError
from rollerbench.kinematics.limits import wheel_loads
from rollerbench.plant import RobotModel

STEPS_TO_STOP = 4.0
"""Rolling resistance falls off below the speed that it could take away in so many steps [-]."""

AXLE, ROLLER_AXIS = 1, 0
"""About which of its axes a hub, and a roller, turns."""


class SlipMonitor(LeafSystem):
    """How fast each wheel slides over what it touches, from the contacts that the plant finds.

    Input ports:
        contact_results: Drake's ContactResults.
    Output ports:
        slip_speeds (n_wheels): speed of the wheel's or roller's surface over the ground, where it is fastest [m/s]; 0
            for a wheel in the air. In the order of robot.yaml.
        normal_forces (n_wheels): load of each wheel [N].
        contact_forces (3 n_wheels): force of the ground on each wheel in W, wheel by wheel x, y, z [N].
        contact_points (3 n_wheels): where it acts, the mean of several contacts, in the same order [m].
    """

    def __init__(self, model: RobotModel) -> None:
        """Makes the system for a robot in a plant."""
        super().__init__()
        self._wheel_of = _wheel_of_body(model)
        self._contacts = self.DeclareAbstractInputPort("contact_results", Value(ContactResults()))
        count = len(model.robot.wheels or model.robot.legs)
        self.DeclareVectorOutputPort("slip_speeds", count, self._calc_slip)
        self.DeclareVectorOutputPort("normal_forces", count, self._calc_loads)
        self.DeclareVectorOutputPort("contact_forces", 3 * count, self._calc_forces)
        self.DeclareVectorOutputPort("contact_points", 3 * count, self._calc_points)

    def _calc_slip(self, context: Context, output: BasicVector) -> None:
        slip = np.zeros(output.size())
        contacts = self._contacts.Eval(context)
        for index in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(index)
            for wheel in _wheels_in(info, self._wheel_of):
                slip[wheel] = max(slip[wheel], info.slip_speed())
        output.SetFromVector(slip)

    def _calc_loads(self, context: Context, output: BasicVector) -> None:
        loads = np.zeros(output.size())
        contacts = self._contacts.Eval(context)
        for index in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(index)
            for wheel in _wheels_in(info, self._wheel_of):
                loads[wheel] += _normal_force(info)
        output.SetFromVector(loads)

    def _calc_forces(self, context: Context, output: BasicVector) -> None:
        forces = np.zeros((output.size() // 3, 3))
        contacts = self._contacts.Eval(context)
        for index in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(index)
            # Drake tells the force on body B.
            for body, sign in ((info.bodyA_index(), -1.0), (info.bodyB_index(), 1.0)):
                if int(body) in self._wheel_of:
                    forces[self._wheel_of[int(body)]] += sign * info.contact_force()
        output.SetFromVector(forces.ravel())

    def _calc_points(self, context: Context, output: BasicVector) -> None:
        sums, loads = np.zeros((output.size() // 3, 3)), np.zeros(output.size() // 3)
        contacts = self._contacts.Eval(context)
        for index in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(index)
            for wheel in _wheels_in(info, self._wheel_of):
                load = max(_normal_force(info), 1e-12)
                sums[wheel] += load * info.contact_point()
                loads[wheel] += load
        output.SetFromVector((sums / np.where(loads > 0, loads, 1.0)[:, np.newaxis]).ravel())


class RollResistance(LeafSystem):
    """Torques that oppose the rolling of wheels and of rollers, in proportion to the load on them.

    On the axle of a wheel whose contact carries N at the distance R from it, the torque f N R sign(q'), and on the axis
    of the roller, at the distance r, the torque f N r sign(s): over the ground each is a drag f N along its direction
    of rolling. Near rest the sign is a smooth tanh, wide enough for the time step. The loads are those of the step
    before.

    Input ports:
        contact_results: Drake's ContactResults.
        body_poses: Drake's poses of all bodies in W.
        velocities (nv): velocities of the plant.
    Output ports:
        generalized_force (nv): for the plant's applied_generalized_force port [N m].
    """

    def __init__(self, model: RobotModel, coefficient: float) -> None:
        """Makes the system for a robot in a plant that is finalized.

        Args:
            model: The robot.
            coefficient: Rolling resistance over load f [-].
        """
        super().__init__()
        if not (math.isfinite(coefficient) and coefficient >= 0):
            raise SimulationError(f"coefficient = {coefficient}: accepted: 0 or more")
        plant = model.plant
        self._rolling = _rolling_of_body(model, coefficient)
        self._f = coefficient
        self._contacts = self.DeclareAbstractInputPort("contact_results", Value(ContactResults()))
        self._poses = self.DeclareAbstractInputPort("body_poses", Value[list[RigidTransform]]())
        self._velocities = self.DeclareVectorInputPort("velocities", plant.num_velocities())
        index = self.DeclareDiscreteState(plant.num_velocities())
        self.DeclareStateOutputPort("generalized_force", index)
        self.DeclarePeriodicDiscreteUpdateEvent(plant.time_step(), 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        contacts, velocities, poses = (port.Eval(context) for port in (self._contacts, self._velocities, self._poses))
        force = np.zeros(len(velocities))
        for number in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(number)
            drag = self._f * _normal_force(info)
            for body in (int(info.bodyA_index()), int(info.bodyB_index())):
                for index, link, axis, slow in self._rolling.get(body, ()):
                    arm = poses[link].inverse().multiply(info.contact_point())
                    lever = math.hypot(arm[axis - 1], arm[axis - 2])
                    force[index] -= drag * lever * math.tanh(lever * velocities[index] / slow)
        state.get_mutable_vector(0).SetFromVector(force)
        return EventStatus.Succeeded()


def _wheel_of_body(model: RobotModel) -> dict[int, int]:
    """Indices of the wheels, or feet, by those of their hubs and rollers."""
    found = {}
    for index, wheel in enumerate(model.robot.wheels):
        for joint in (model.drive_joint(wheel), *model.roller_joints(wheel)):
            found[int(joint.child_body().index())] = index
    found |= {int(model.foot_body(leg).index()): index for index, leg in enumerate(model.robot.legs)}
    return found


def _rolling_of_body(model: RobotModel, coefficient: float) -> dict[int, list[tuple[int, int, int, float]]]:
    """What rolls where a body touches: index in the velocities, link, axis that it turns about, and width of the tanh.

    The torques are explicit. So that they bring to rest, and do not shake, neither the whole robot nor a single wheel,
    which is light, a step takes away no more than a part of the speed: f g dt, and f N R^2 dt / J_wheel.
    """

    def rolling(joint: RevoluteJoint, axis: int, slow: float) -> tuple[int, int, int, float]:
        return int(joint.velocity_start()), int(joint.child_body().index()), axis, slow

    found = {}
    impulse = coefficient * model.plant.time_step()
    for wheel, load in zip(model.robot.wheels, wheel_loads(model.robot, 0.0, 0.0), strict=True):
        single = impulse * max(0.0, float(load)) * wheel.radius**2 / axle_inertia(wheel)
        slow = max(1e-4, STEPS_TO_STOP * impulse * GRAVITY, single)
        drive = rolling(model.drive_joint(wheel), AXLE, slow)
        found[drive[1]] = [drive]
        for joint in model.roller_joints(wheel):
            roller = rolling(joint, ROLLER_AXIS, slow)
            found[roller[1]] = [drive, roller]
    return found


def _wheels_in(info: PointPairContactInfo, wheel_of: dict[int, int]) -> list[int]:
    bodies = (int(info.bodyA_index()), int(info.bodyB_index()))
    return [wheel_of[body] for body in bodies if body in wheel_of]


def _normal_force(info: PointPairContactInfo) -> float:
    return abs(float(info.contact_force() @ info.point_pair().nhat_BA_W))
