"""Robots on legs in Drake: where their links are, how they stand, what their matrices select."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import robots
import rollerbench as rb
from rollerbench.plant import RobotModel, add_ground, servo_gains
from rollerbench.sdf.contact import contact_stiffness, static_penetration

LEGGED = {"hexapod": lambda: "wheel_leg_hexapod", **robots.LEGGED}
every = pytest.mark.parametrize("make", LEGGED.values(), ids=LEGGED)


def _model(robot: rb.Robot) -> tuple[RobotModel, Context]:
    plant = MultibodyPlant(0.002)
    model = rb.add_robot(plant, robot)
    plant.Finalize()
    return model, plant.CreateDefaultContext()


def _shake(model: RobotModel, context: Context) -> list[NDArray[np.float64]]:
    """Random joint angles within the limits, set in the context."""
    generator, angles = np.random.default_rng(1), []
    for leg in model.robot.legs:
        angles.append(generator.uniform(*leg.limits))
        for joint, angle in zip(model.leg_joints(leg), angles[-1], strict=True):
            joint.set_angle(context, angle)
    return angles


@every
def test_links_and_feet_are_where_the_rows_put_them(make) -> None:
    model, context = _model(rb.load_robot(make()))
    for leg, q in zip(model.robot.legs, _shake(model, context), strict=True):
        bodies = [*(joint.child_body() for joint in model.leg_joints(leg)), model.foot_body(leg)]
        for body, frame in zip(bodies, leg.frames_B(q), strict=True):
            X_BF = model.plant.CalcRelativeTransform(context, model.body.body_frame(), body.body_frame())
            # 1e-10: SDF carries twelve digits.
            assert X_BF.GetAsMatrix4() == pytest.approx(frame, abs=1e-10)


@every
def test_the_jacobian_of_a_foot_is_the_difference_of_its_frames(make) -> None:
    model, context = _model(rb.load_robot(make()))
    body = model.body.body_frame()
    for leg, q in zip(model.robot.legs, _shake(model, context), strict=True):
        jacobian = model.plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, model.foot_body(leg).body_frame(), [0, 0, 0], body, body
        )
        rotation, step = leg.frames_B(q)[-1, :3, :3], 1e-6
        for index, joint in enumerate(model.leg_joints(leg)):
            ahead, behind = (leg.frames_B(q + sign * step * np.eye(len(q))[index])[-1] for sign in (1, -1))
            rate = (ahead - behind) / (2 * step)
            spin = rate[:3, :3] @ rotation.T
            expected = [spin[2, 1], spin[0, 2], spin[1, 0], *rate[:3, 3]]
            # 1e-9: the central difference of a step of 1e-6 rad.
            assert jacobian[:, joint.velocity_start()] == pytest.approx(expected, abs=1e-9)


@every
def test_matrices_pick_and_command_the_joints_leg_by_leg(make) -> None:
    model, context = _model(rb.load_robot(make()))
    angles, plant = _shake(model, context), model.plant
    plant.SetVelocities(context, np.arange(1.0, plant.num_velocities() + 1))
    state = model.leg_state_matrix() @ plant.GetPositionsAndVelocities(context, model.model_instance)
    expected_angles, expected_rates, driven = [], [], []
    for leg, q in zip(model.robot.legs, angles, strict=True):
        joints = model.leg_joints(leg)
        expected_angles += [*q, 0.0]
        expected_rates += [joint.get_angular_rate(context) for joint in joints]
        expected_rates.append(model.wheel_joint(leg).get_angular_rate(context) if leg.wheel.driven else 0.0)
        driven += [*(joint.name() for joint in joints), f"{leg.name}_drive" if leg.wheel.driven else None]
    assert state.tolist() == [*expected_angles, *expected_rates]
    efforts = model.leg_effort_matrix()
    for index, actuator in enumerate(model.actuators):
        assert efforts[index].tolist() == [float(name == actuator.joint().name()) for name in driven]
    command, count = model.leg_command_matrix(), len(model.actuators)
    assert command[:count] @ state == pytest.approx(
        [actuator.joint().get_angle(context) for actuator in model.actuators]
    )
    assert command[count:] @ state == pytest.approx(efforts @ expected_rates)


@every
@pytest.mark.parametrize("time_step", [0.002, 0.005])
def test_a_robot_stands_in_every_posture(make, time_step: float) -> None:
    """Its servos give way by millimetres, and its feet sink in as deep as their stiffness says."""
    robot = rb.load_robot(make())
    for posture in robot.standing:
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlant(
            MultibodyPlantConfig(time_step=time_step, discrete_contact_approximation="lagged"), builder
        )
        model = rb.add_robot(plant, robot, roller_model="windowed")
        add_ground(plant)
        plant.Finalize()
        wanted = [[*leg.posture(posture.name), 0.0] for leg in robot.legs]
        q = np.concatenate(wanted)
        desired = builder.AddSystem(ConstantVectorSource(model.leg_command_matrix() @ np.r_[q, np.zeros(len(q))]))
        builder.Connect(desired.get_output_port(), plant.get_desired_state_input_port(model.model_instance))
        diagram = builder.Build()
        simulator = Simulator(diagram)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        if posture == robot.standing[0]:
            start = plant.GetFreeBodyPose(context, model.body).GetAsMatrix4()
            model.set_pose(context, [0, 0, 0])
            assert plant.GetFreeBodyPose(context, model.body).GetAsMatrix4() == pytest.approx(start)
        model.set_pose(context, [0.3, -0.2, 0.5], posture.name)
        height = plant.GetFreeBodyPose(context, model.body).translation()[2]
        simulator.AdvanceTo(1.5)
        X_WB = plant.GetFreeBodyPose(context, model.body)
        assert X_WB.translation() == pytest.approx([0.3, -0.2, height], abs=3e-3)
        assert X_WB.rotation().matrix()[2, 2] > np.cos(np.radians(0.3))
        contacts = plant.get_contact_results_output_port().Eval(context)
        pairs = [contacts.point_pair_contact_info(i) for i in range(contacts.num_point_pair_contacts())]
        assert len(pairs) == len(robot.legs)
        loads = np.array([abs(pair.contact_force()[2]) for pair in pairs])
        depths = np.array([pair.point_pair().depth for pair in pairs])
        # 1e-3: what is left of the sinking in.
        assert loads.sum() == pytest.approx(robot.mass * 9.81, rel=1e-3)
        assert loads / depths == pytest.approx(contact_stiffness(robot), rel=1e-2)
        assert depths.mean() == pytest.approx(static_penetration(robot), rel=1e-2)


def test_gains_scale_with_weight_and_length() -> None:
    robot = rb.load_robot("wheel_leg_hexapod")
    gains = servo_gains(robot).legs["front_left"]
    share = robot.mass * 9.81 / 6
    leg = robot.legs[0]
    assert gains.stiffness * 0.03 == pytest.approx(2 * share * leg.length)
    assert gains.wheel_stiffness * 0.03 == pytest.approx(2 * share * leg.wheel.radius)
    plant = MultibodyPlant(0.002)
    some = replace(servo_gains(robot), legs={"front_left": gains})
    model = rb.add_robot(plant, robot, gains=some)
    plant.Finalize()
    with_servo = [actuator.joint().name() for actuator in model.actuators if actuator.has_controller()]
    assert with_servo == [*(f"front_left_joint_{number}" for number in range(1, 5)), "front_left_drive"]
    (motor,) = (actuator for actuator in model.actuators if actuator.joint().name() == "front_left_joint_1")
    assert motor.default_rotor_inertia() == leg.links[0].rotor_inertia
    assert motor.effort_limit() == leg.links[0].max_effort


def test_joints_have_the_limits_of_the_links() -> None:
    model, _ = _model(rb.load_robot(robots.quadruped()))
    for leg in model.robot.legs:
        joints = model.leg_joints(leg)
        limits = [[joint.position_lower_limits()[0], joint.position_upper_limits()[0]] for joint in joints]
        assert np.array(limits) == pytest.approx(leg.limits.T)
        assert joints[2].velocity_upper_limits()[0] == 8.0


def test_an_unknown_posture_is_refused() -> None:
    model, context = _model(rb.load_robot("wheel_leg_hexapod"))
    with pytest.raises(rb.SimulationError, match=r"posture = 'sit': accepted: insect, mammal"):
        model.set_pose(context, [0, 0, 0], "sit")
