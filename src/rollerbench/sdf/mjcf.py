"""A robot as an MJCF model for MuJoCo, on level ground, with servos on its wheels and legs."""

from collections.abc import Iterable

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from rollerbench.description import AnyWheel, Leg, Robot, RollerWheel
from rollerbench.description.inertia import RigidInertia
from rollerbench.description.mass import body_inertia, fork_inertia, hub_inertia, roller_inertia, roller_poses_H
from rollerbench.sdf import names
from rollerbench.sdf.legs import link_steps
from rollerbench.sdf.servo import LegGains, ServoGains, servo_gains

CONTACT = {"solref": "0.002 1", "solimp": "0.99 0.99 0.001"}
"""Stiff contact: a robot sinks in by a few micrometres. Time constants of two steps of 1 ms are the least."""

DEFAULT_STEP = 0.001
"""Step of an exported model [s]."""


def robot_to_mjcf(
    robot: Robot,
    *,
    friction: float = 0.8,
    gravity: Iterable[float] = (0.0, 0.0, -9.81),
    gains: ServoGains | None = None,
    time_step: float = DEFAULT_STEP,
) -> str:
    """The robot as MJCF text with ground at z = 0, complete in itself.

    Bodies and joints have the names and signs of the SDF model. Collision shapes are the same ellipsoids and balls;
    nothing but the ground collides with them. Each driven wheel has a velocity actuator, each steered one a position
    actuator, named as their joints. Legs have position actuators on their joints and then on their wheel, leg by leg,
    and every posture is a keyframe with the angles and the controls that hold it.

    The servos are as implicit as Drake's: the torque kv (command - speed after the step) acts as that at the start of
    the step does on a joint with h kv more armature (h^2 kp too, for a stiffness). MuJoCo's own implicit
    integrators damp only after the contacts were solved, and let an accelerating robot run ahead of its wheels. A motor
    at its effort limit feels that armature.

    Args:
        robot: The robot.
        friction: Coefficient of friction of the ground; with a wheel's it combines to 2ab/(a+b), as in Drake.
        gravity: Acceleration (3,) [m/s2].
        gains: Gains of the servos; by default those of `servo_gains(robot)`. To follow a moving angle with the damping
            of Drake's servo, control a position actuator by angle + rate kv / kp.
        time_step: MuJoCo's step [s].
    """
    gains = gains or servo_gains(robot)
    root = etree.Element("mujoco", model=robot.name)
    _add(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    option = _add(root, "option", timestep=_numbers([time_step]), gravity=_numbers(gravity), cone="elliptic")
    option.set("integrator", "Euler")
    option.set("impratio", "100")
    # Rollers on different wheels do not feel each other; MuJoCo chooses this only from 60 velocities on.
    option.set("jacobian", "sparse")
    _add(option, "flag", autoreset="disable")
    world = _add(root, "worldbody")
    # MuJoCo takes the larger friction and the mean of the stiffnesses: the wheels carry the combined friction.
    ground = _add(world, "geom", name="ground", type="plane", size="0 0 1", contype="1", conaffinity="0")
    ground.attrib.update({**CONTACT, "friction": "0 0 0"})
    body = _add(world, "body", name=names.BODY, pos=_numbers([0, 0, -robot.ground_height]))
    _add(body, "freejoint", name="floating_base")
    _add_inertial(body, body_inertia(robot.body))
    half = [0.5 * side for side in robot.body.size]
    tyres = (*robot.wheels, *(leg.wheel for leg in robot.legs))
    box = _add(body, "geom", name="box", type="box", size=_numbers(half), pos=_numbers(robot.body.box_center))
    _add_contact(box, _combined(min(tyre.friction for tyre in tyres), friction))
    actuators = etree.Element("actuator")
    for leg in robot.legs:
        _add_leg(body, actuators, leg, _combined(leg.wheel.friction, friction), gains.legs[leg.name], time_step)
    for wheel in robot.wheels:
        _add_wheel(body, wheel, _combined(wheel.friction, friction), gains, time_step)
        if wheel.driven:
            gain = gains.drive_damping[wheel.name]
            motor = _add(actuators, "velocity", name=names.drive_joint(wheel.name), joint=names.drive_joint(wheel.name))
            motor.set("kv", _numbers([gain]))
            _limit(motor, wheel.max_effort)
    for wheel in robot.steered_wheels:
        stiffness, damping = gains.steering_stiffness[wheel.name], gains.steering_damping[wheel.name]
        joint = names.swivel_joint(wheel.name)
        motor = _add(actuators, "position", name=joint, joint=joint, kp=_numbers([stiffness]), kv=_numbers([damping]))
        _limit(motor, getattr(wheel, "max_steering_effort", None))
    root.append(actuators)
    if robot.legs:
        _add_keyframes(root, robot)
    text: bytes = etree.tostring(root, pretty_print=True, encoding="utf-8")
    return text.decode("utf-8")


def _add_wheel(body: etree._Element, wheel: AnyWheel, friction: float, gains: ServoGains, time_step: float) -> None:
    carrier, position = body, wheel.center_B
    rotation = Rotation.from_euler("z", wheel.heading_degrees, degrees=True)
    if wheel.swivels:
        carrier = _add_body(body, names.fork(wheel.name), wheel.p_BoHo_B, rotation)
        swivel = _add(carrier, "joint", name=names.swivel_joint(wheel.name), type="hinge", axis="0 0 1")
        if wheel.steered:
            kp, kv = gains.steering_stiffness[wheel.name], gains.steering_damping[wheel.name]
            swivel.set("armature", _numbers([time_step * kv + time_step**2 * kp]))
        _add_inertial(carrier, fork_inertia(wheel))
        position, rotation = np.array([-wheel.swivel_offset, 0.0, 0.0]), Rotation.identity()
    hub = _add_body(carrier, names.hub(wheel.name), position, rotation)
    drive = _add(hub, "joint", name=names.drive_joint(wheel.name), type="hinge", axis="0 1 0")
    if wheel.driven:
        drive.set("armature", _numbers([time_step * gains.drive_damping[wheel.name]]))
    _add_inertial(hub, hub_inertia(wheel))
    if not isinstance(wheel, RollerWheel):
        radii = (wheel.radius, 0.5 * wheel.width, wheel.radius)
        _add_contact(_add(hub, "geom", name=f"{wheel.name}_tyre", type="ellipsoid", size=_numbers(radii)), friction)
        return
    ring = wheel.ring
    for index, (matrix, center) in enumerate(roller_poses_H(wheel)):
        roller = _add_body(hub, names.roller(wheel.name, index), center, Rotation.from_matrix(matrix))
        joint = _add(roller, "joint", name=names.roller_joint(wheel.name, index), type="hinge", axis="1 0 0")
        joint.set("damping", _numbers([wheel.rollers.damping]))
        _add_inertial(roller, roller_inertia(wheel))
        radii = (ring.semi_axis, ring.roller_radius, ring.roller_radius)
        _add_contact(_add(roller, "geom", type="ellipsoid", size=_numbers(radii)), friction)


def _add_leg(
    body: etree._Element, actuators: etree._Element, leg: Leg, friction: float, gains: LegGains, time_step: float
) -> None:
    carrier, steps = body, link_steps(leg)
    for number, (link, step) in enumerate(zip(leg.links, steps, strict=False), start=1):
        rotation = Rotation.from_matrix(step[:3, :3])
        carrier = _add_body(carrier, names.leg_link(leg.name, number), step[:3, 3], rotation)
        joint = names.leg_joint(leg.name, number)
        servo = (link.max_effort, link.rotor_inertia, gains.stiffness, gains.damping)
        _add_servo(carrier, actuators, joint, *servo, time_step).set(
            "range", _numbers(np.radians((link.min_deg, link.max_deg)))
        )
        _add_inertial(carrier, link.inertia)
    wheel, rotation = leg.wheel, Rotation.from_matrix(steps[-1][:3, :3])
    foot = _add_body(carrier, names.foot(leg.name), steps[-1][:3, 3], rotation)
    if wheel.driven:
        servo = (wheel.max_effort, wheel.rotor_inertia, gains.wheel_stiffness, gains.wheel_damping)
        _add_servo(foot, actuators, names.drive_joint(leg.name), *servo, time_step)
    _add_inertial(foot, wheel.inertia)
    ball = _add(foot, "geom", name=f"{leg.name}_tyre", type="sphere", size=_numbers([wheel.radius]))
    _add_contact(ball, friction)


def _add_servo(
    body: etree._Element,
    actuators: etree._Element,
    name: str,
    effort: float | None,
    rotor_inertia: float,
    kp: float,
    kv: float,
    time_step: float,
) -> etree._Element:
    """A joint about a body's z axis, and its position actuator."""
    joint = _add(body, "joint", name=name, type="hinge", axis="0 0 1")
    joint.set("armature", _numbers([rotor_inertia + time_step * kv + time_step**2 * kp]))
    motor = _add(actuators, "position", name=name, joint=name, kp=_numbers([kp]), kv=_numbers([kv]))
    _limit(motor, effort)
    return joint


def _add_keyframes(root: etree._Element, robot: Robot) -> None:
    keyframes = _add(root, "keyframe")
    for posture in robot.standing:
        held = [(leg.posture(posture.name).tolist(), [0.0] * leg.wheel.driven) for leg in robot.legs]
        angles = [angle for joints, wheel in held for angle in (*joints, *wheel)]
        feet = zip(robot.feet_B(posture.name), robot.legs, strict=True)
        height = max(leg.wheel.radius - foot[2] for foot, leg in feet)
        pose = [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0]
        _add(keyframes, "key", name=posture.name, qpos=_numbers([*pose, *angles]), ctrl=_numbers(angles))


def _add_body(parent: etree._Element, name: str, position: Iterable[float], rotation: Rotation) -> etree._Element:
    quaternion = rotation.as_quat(canonical=True, scalar_first=True)
    return _add(parent, "body", name=name, pos=_numbers(position), quat=_numbers(quaternion))


def _add_inertial(body: etree._Element, inertia: RigidInertia) -> None:
    moment = inertia.moment
    full = [moment[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    _add(body, "inertial", pos=_numbers(inertia.com), mass=_numbers([inertia.mass]), fullinertia=_numbers(full))


def _add_contact(geom: etree._Element, friction: float) -> None:
    geom.set("contype", "0")
    geom.set("conaffinity", "1")
    geom.set("condim", "3")
    geom.set("friction", _numbers([friction, 0.0, 0.0]))
    geom.attrib.update(CONTACT)


def _combined(first: float, second: float) -> float:
    return 2 * first * second / (first + second)


def _limit(motor: etree._Element, effort: float | None) -> None:
    if effort is not None:
        motor.set("forcerange", _numbers([-effort, effort]))


def _add(parent: etree._Element, tag: str, **attributes: str) -> etree._Element:
    return etree.SubElement(parent, tag, attrib=attributes)


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)
