"""Two robots in one plant: a youBot brings a crate to a cart and steps aside; the cart pushes the crate back.

Run it with: python examples/two_robots.py
"""

import numpy as np
from pydrake.geometry import Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import RigidBody, SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import MatrixGain, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import rollerbench as rb

CONFIG = MultibodyPlantConfig(time_step=0.005, discrete_contact_approximation="lagged")
MASS, SIDE, BALL = 3.0, 0.4, 0.1  # Of the crate and of the balls in its corners [kg], [m], [m].
HALF_TURN, QUARTER = np.pi, np.pi / 2
# By robot: where it starts [m, m, rad]; then leg by leg how long it takes [s], and how far the body's x and y axes, and
# its yaw, move along: the displacement whose exponential is the way.
PLANS = {
    "youbot_base": (
        [-1.2, 0.0, 0.0],
        [[3.0, 0.9, 0.0, 0.0], [1.5, -0.3, 0.0, 0.0], [3.0, 0.0, 0.8, 0.0], [4.0, 0.0, 0.0, HALF_TURN]],
    ),
    "differential_cart": (
        [1.6, -0.6, QUARTER],
        [[2.0, 0.0, 0.0, 0.0], [4.0, 0.6 * QUARTER, 0.0, QUARTER], [1.5, 0.0, 0.0, 0.0], [4.0, 1.2, 0.0, 0.0]],
    ),
}


def add_crate(plant: MultibodyPlant) -> RigidBody:
    """Adds a crate on four balls, which touch steadily: point contact with a flat face would leap between corners."""
    inertia = SpatialInertia.SolidBoxWithMass(MASS, SIDE, SIDE, 2 * BALL)
    crate = plant.AddRigidBody("crate", plant.AddModelInstance("crate"), inertia)
    corner = 0.5 * SIDE - BALL
    for index, (x, y) in enumerate([(corner, corner), (corner, -corner), (-corner, corner), (-corner, -corner)]):
        friction, place = CoulombFriction(0.2, 0.2), RigidTransform([x, y, 0.0])
        plant.RegisterCollisionGeometry(crate, place, Sphere(BALL), f"ball_{index}", friction)
    return crate


def drive(builder: DiagramBuilder, model: rb.RobotModel, legs: np.ndarray) -> None:
    """Connects a robot's motors to its plan: every leg at rest at both ends, its twist in proportion to its way."""
    breaks, ways = (np.vstack([np.zeros(4), np.cumsum(legs, axis=0)])[:, part] for part in (0, slice(1, 4)))
    ways = PiecewisePolynomial.CubicHermite(breaks, ways.T, np.zeros_like(ways.T))
    twist = builder.AddSystem(TrajectorySource(ways, 1))
    select = builder.AddSystem(MatrixGain(np.eye(6)[3:]))
    kinematics = builder.AddSystem(rb.systems.InverseKinematics(model.robot))
    motors = builder.AddSystem(MatrixGain(model.desired_state_matrix()))
    builder.Connect(twist.get_output_port(), select.get_input_port())
    builder.Connect(select.get_output_port(), kinematics.GetInputPort("v_xyw_B"))
    builder.Connect(kinematics.GetOutputPort("wheel_speeds"), motors.get_input_port())
    builder.Connect(motors.get_output_port(), model.plant.get_desired_state_input_port(model.model_instance))


def main() -> None:
    """Simulates both robots and prints where they end, beside where odometry expects them."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(CONFIG, builder)
    models = [rb.add_robot(plant, name, roller_model="windowed", builder=builder) for name in PLANS]
    crate = add_crate(plant)
    rb.add_ground(plant)
    plant.Finalize()
    for model, (_, legs) in zip(models, PLANS.values(), strict=True):
        drive(builder, model, np.array(legs))
    simulator = Simulator(builder.Build())
    rb.follow_rollers(simulator)  # Once, for all robots.

    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, crate, RigidTransform([-0.4, 0.0, BALL]))
    for model, (start, _) in zip(models, PLANS.values(), strict=True):
        model.set_pose(context, start)
    for time in (4.5, 7.5, 11.5):
        simulator.AdvanceTo(time)
        print(f"At {time:4.1f} s the crate is at {crate.EvalPoseInWorld(context).translation()[:2].round(3)} m.")
    np.set_printoptions(precision=3, suppress=True)
    for model, (start, legs) in zip(models, PLANS.values(), strict=True):
        pose = plant.EvalBodyPoseInWorld(context, model.body)
        q_xyt = np.array([*pose.translation()[:2], RollPitchYaw(pose.rotation()).yaw_angle()])
        print(f"{model.robot.name} ends at {q_xyt};")
        speeds = rb.WheelKinematics(model.robot).inverse(np.array(legs)[:, 1:])
        for rollers in ("textbook", "finite"):  # Rollers of no length, and those that it has.
            kinematics = rb.WheelKinematics(model.robot, rollers=rollers)
            expected = rb.odometry.accumulate(start, kinematics.forward(speeds))[-1]
            x, y, yaw = q_xyt - expected
            turn = np.degrees(np.arctan2(np.sin(yaw), np.cos(yaw)))
            print(f"  odometry ({rollers} rollers) {expected}: {1e3 * np.hypot(x, y):.1f} mm, {turn:+.2f} deg off.")


if __name__ == "__main__":
    main()
