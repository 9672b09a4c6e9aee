"""The servos of a robot in a plant, and the order in which vectors carry the joints of legs."""

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains

from rollerbench.description import Robot
from rollerbench.sdf import names
from rollerbench.sdf.servo import ServoGains


def set_gains(plant: MultibodyPlant, instance: ModelInstanceIndex, robot: Robot, gains: ServoGains) -> None:
    """Gives the actuators of a robot their gains; those that `gains` leaves out have no servo."""
    pd = {names.drive_joint(wheel): (0.0, damping) for wheel, damping in gains.drive_damping.items()}
    for wheel, stiffness in gains.steering_stiffness.items():
        pd[names.swivel_joint(wheel)] = (stiffness, gains.steering_damping[wheel])
    for leg in robot.legs:
        if (of_leg := gains.legs.get(leg.name)) is not None:
            joints = names.leg_joints(leg.name, len(leg.links))
            pd |= dict.fromkeys(joints, (of_leg.stiffness, of_leg.damping))
            pd[names.drive_joint(leg.name)] = (of_leg.wheel_stiffness, of_leg.wheel_damping)
    # Not by instance: such a list is empty before the plant is finalized.
    for index in plant.GetJointActuatorIndices():
        actuator = plant.get_joint_actuator(index)
        name = actuator.joint().name()
        if actuator.model_instance() == instance and name in pd:
            p, d = pd[name]
            actuator.set_controller_gains(PdControllerGains(p=p, d=d))


def leg_and_wheel_joints(robot: Robot) -> list[str | None]:
    """Names of the joints of legs and their wheels, leg by leg; None for a wheel that is locked."""
    joints: list[str | None] = []
    for leg in robot.legs:
        joints += names.leg_joints(leg.name, len(leg.links))
        joints.append(names.drive_joint(leg.name) if leg.wheel.driven else None)
    return joints
