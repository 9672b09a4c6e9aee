"""An arm on a Mecanum base: the base drives a circle, the arm holds its gripper still in the world.

Run it with: python examples/mobile_manipulator.py
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody import tree
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem
from pydrake.systems.primitives import MatrixGain, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import rollerbench as rb

PERIOD, RADIUS, DURATION = 0.005, 0.25, 8.0  # Of plant and controller [s]; of the circle [m], [s].
CONFIG = MultibodyPlantConfig(time_step=PERIOD, discrete_contact_approximation="lagged")
LINKS = {"waist": (1.5, 0.1), "shoulder": (2.5, 0.45), "elbow": (1.5, 0.45)}  # By the joint below: kg, m.


def add_arm(plant: MultibodyPlant, base: rb.RobotModel) -> tuple[tree.ModelInstanceIndex, tree.Frame]:
    """Welds three rods, each on a motor that follows a rate, onto the base; the gripper is the end of the last."""
    arm = plant.AddModelInstance("arm")
    end = plant.AddRigidBody("foot", arm, tree.SpatialInertia.Zero()).body_frame()
    plant.WeldFrames(base.body.body_frame(), end, base.X_BT)
    for name, (mass, length) in LINKS.items():
        inertia = tree.SpatialInertia.SolidCylinderWithMassAboutEnd(mass, 0.03, length, [0, 0, 1])
        link = plant.AddRigidBody(f"{name}_link", arm, inertia).body_frame()
        joint = plant.AddJoint(tree.RevoluteJoint(name, end, link, [0, 0, 1] if name == "waist" else [0, 1, 0]))
        plant.AddJointActuator(name, joint, 60.0).set_controller_gains(tree.PdControllerGains(p=0.0, d=1000.0))
        end = plant.AddFrame(tree.FixedOffsetFrame(f"{name}_end", link, RigidTransform([0.0, 0.0, length])))
    return arm, end


class HoldStill(LeafSystem):
    """From the plant's state to rates of the arm: J_arm^-1 (K (target - gripper) - J_base v_base), K = 20 / s."""

    def __init__(self, plant: MultibodyPlant, arm: tree.ModelInstanceIndex, gripper: tree.Frame) -> None:
        super().__init__()
        self.plant, self.gripper, self.model, self.target = plant, gripper, plant.CreateDefaultContext(), np.zeros(3)
        self.joints = [plant.GetJointByName(name, arm).velocity_start() for name in LINKS]
        self.DeclareVectorInputPort("state", plant.num_multibody_states())
        self.DeclareStateOutputPort("desired_state", self.DeclareDiscreteState(2 * len(LINKS)))
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self.update)

    def update(self, context: Context, state: DiscreteValues) -> None:
        """Computes the rates."""
        plant, world, kV = self.plant, self.plant.world_frame(), tree.JacobianWrtVariable.kV
        plant.SetPositionsAndVelocities(self.model, self.GetInputPort("state").Eval(context))
        J = plant.CalcJacobianTranslationalVelocity(self.model, kV, self.gripper, np.zeros(3), world, world)
        others = plant.GetVelocities(self.model).copy()
        others[self.joints] = 0.0
        wanted = 20.0 * (self.target - self.gripper.CalcPoseInWorld(self.model).translation()) - J @ others
        state.set_value(np.r_[np.zeros(len(LINKS)), np.linalg.solve(J[:, self.joints], wanted)])


def circle() -> TrajectorySource:
    """Twist of the base: once round from rest to rest, looking to +x all the time."""
    s = np.linspace(0.0, 1.0, 401)
    angle, rate = 2 * np.pi * s**3 * (10 - 15 * s + 6 * s**2), 60 * np.pi * (s * (1 - s)) ** 2 / DURATION
    v_xyw_B = RADIUS * rate * np.array([-np.sin(angle), np.cos(angle), 0 * s])
    return TrajectorySource(PiecewisePolynomial.FirstOrderHold(DURATION * s, v_xyw_B))


def main(roller_model: str = "windowed") -> None:
    """Simulates with roller contacts, and prints how far the gripper strayed while the base went round."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(CONFIG, builder)
    base = rb.add_robot(plant, "youbot_base", roller_model=roller_model, builder=builder)
    arm, gripper = add_arm(plant, base)
    rb.add_ground(plant)
    plant.Finalize()
    twist, hold = builder.AddSystem(circle()), builder.AddSystem(HoldStill(plant, arm, gripper))
    kinematics = builder.AddSystem(rb.systems.InverseKinematics("youbot_base"))
    motors = builder.AddSystem(MatrixGain(base.desired_state_matrix()))
    builder.Connect(twist.get_output_port(), kinematics.GetInputPort("v_xyw_B"))
    builder.Connect(kinematics.GetOutputPort("wheel_speeds"), motors.get_input_port())
    builder.Connect(motors.get_output_port(), plant.get_desired_state_input_port(base.model_instance))
    builder.Connect(plant.get_state_output_port(), hold.GetInputPort("state"))
    builder.Connect(hold.GetOutputPort("desired_state"), plant.get_desired_state_input_port(arm))
    simulator = Simulator(builder.Build())
    rb.follow_rollers(simulator)
    context, log = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), []
    plant.SetPositions(context, arm, [0.0, -0.38, 2.33])
    hold.target = gripper.CalcPoseInWorld(context).translation()
    for time in np.arange(PERIOD, DURATION + 1.0, PERIOD):
        simulator.AdvanceTo(time)
        places = [frame.CalcPoseInWorld(context).translation() for frame in (gripper, base.body.body_frame())]
        log.append(np.r_[*places, np.degrees(plant.GetPositions(context, arm))])
    grips, places, angles = np.split(np.array(log), [3, 6], axis=1)
    way, (x, y, _) = np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1).sum(), np.ptp(places, axis=0)
    print(f"The base drove {way:.3f} m round a circle that is {x:.3f} m along x and {y:.3f} m along y.")
    print(f"The arm turned its joints by up to {np.ptp(angles, axis=0).round(1)} deg.")
    stray = np.linalg.norm(grips - hold.target, axis=1).max()
    print(f"The gripper strayed by at most {1e3 * stray:.2f} mm from its place at {hold.target.round(3)} m.")


if __name__ == "__main__":
    main()
