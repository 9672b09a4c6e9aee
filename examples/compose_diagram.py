"""Our Systems in a diagram of your own: a controller that you write drives a youBot base where an estimator sees it.

The estimator knows the base from its wheels, a noisy gyroscope and a camera that tells its pose once a second, late.
Run it with: python examples/compose_diagram.py
"""

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput, MatrixGain

import rollerbench as rb

PLACES = [(1.0, 0.0, 0.0), (1.0, 0.8, 90.0), (0.0, 0.0, 0.0)]  # x, y [m], yaw [deg]: ten seconds for each
STAY, PERIOD, STEP = 10.0, 0.01, 0.005  # [s]


class VisitPlaces(LeafSystem):
    """Your own controller: straight to the place that is due, ever slower the nearer it is."""

    def __init__(self) -> None:
        """Declares a port for the pose that is known, and one for the twist that is wanted."""
        super().__init__()
        self.pose = self.DeclareVectorInputPort("q_xyt", 3)
        self.DeclareVectorOutputPort("v_xyw_B", 3, self.calc_twist)

    def calc_twist(self, context: Context, twist: BasicVector) -> None:
        """1.5 m/s for a metre of distance; how much of that the wheels can do is left to the limiter."""
        x, y, degrees = PLACES[min(int(context.get_time() / STAY), len(PLACES) - 1)]
        q = self.pose.Eval(context)
        to_place = rb.odometry.rotate(-q[2], np.array([x, y]) - q[:2])
        turn = (np.radians(degrees) - q[2] + np.pi) % (2 * np.pi) - np.pi
        twist.SetFromVector(1.5 * np.array([*to_place, turn]))


def main() -> None:
    """Wires the diagram, drives to all places, and prints where the base is and where it believes to be."""
    robot = rb.load_robot("youbot_base")
    builder = DiagramBuilder()
    config = MultibodyPlantConfig(time_step=STEP, discrete_contact_approximation="lagged")
    plant, _ = AddMultibodyPlant(config, builder)
    model = rb.add_robot(plant, robot, roller_model="windowed", builder=builder)
    rb.add_ground(plant)
    plant.Finalize()

    wheels, gyro = (
        rb.uncertainty.OdometryNoise(travel=1e-4),
        rb.uncertainty.GyroNoise(density=2e-3, bias_deviation=0.01),
    )
    camera = [0.02, 0.02, 0.01]  # standard deviations [m, m, rad]
    systems = {
        "visit": VisitPlaces(),
        "limiter": rb.systems.TwistLimiter(robot, PERIOD, max_wheel_acceleration=20.0),
        "inverse": rb.systems.InverseKinematics(robot),
        "servo": MatrixGain(model.desired_state_matrix()),
        "speeds": MatrixGain(model.wheel_speed_matrix()),
        "body": MatrixGain(model.body_state_matrix()),
        "planar": rb.systems.PlanarState(),
        "gyro": rb.systems.GyroSensor(PERIOD, gyro, bias=0.01, seed=1),
        "camera": rb.systems.PoseFixSensor(camera, period=1.0, latency=0.2, seed=2),
        "estimator": rb.systems.PoseEstimator(robot, PERIOD, wheels=wheels, gyro=gyro, fix_deviation=camera),
    }
    part = {name: builder.AddNamedSystem(name, system) for name, system in systems.items()}
    state = plant.get_state_output_port(model.model_instance)
    for source, target in (
        (state, part["body"].get_input_port()),
        (state, part["speeds"].get_input_port()),
        (part["body"].get_output_port(), part["planar"].GetInputPort("state")),
        (part["planar"].GetOutputPort("v_xyw_B"), part["gyro"].GetInputPort("v_xyw_B")),
        (part["planar"].GetOutputPort("q_xyt"), part["camera"].GetInputPort("q_xyt")),
        (part["speeds"].get_output_port(), part["estimator"].GetInputPort("wheel_speeds")),
        (part["gyro"].GetOutputPort("yaw_rate"), part["estimator"].GetInputPort("yaw_rate")),
        (part["camera"].GetOutputPort("pose_fix"), part["estimator"].GetInputPort("pose_fix")),
        (part["estimator"].GetOutputPort("q_xyt"), part["visit"].GetInputPort("q_xyt")),
        (part["visit"].GetOutputPort("v_xyw_B"), part["limiter"].GetInputPort("v_xyw_B")),
        (part["limiter"].GetOutputPort("v_xyw_B"), part["inverse"].GetInputPort("v_xyw_B")),
        (part["inverse"].GetOutputPort("wheel_speeds"), part["servo"].get_input_port()),
        (part["servo"].get_output_port(), plant.get_desired_state_input_port(model.model_instance)),
    ):
        builder.Connect(source, target)
    speeds = LogVectorOutput(part["inverse"].GetOutputPort("wheel_speeds"), builder, publish_period=PERIOD)

    simulator = Simulator(builder.Build())
    rb.follow_rollers(simulator)
    for index, (x, y, _) in enumerate(PLACES, start=1):
        simulator.AdvanceTo(index * STAY)
        context = simulator.get_context()
        true, known = (
            part[n].GetOutputPort("q_xyt").Eval(part[n].GetMyContextFromRoot(context)) for n in ("planar", "estimator")
        )
        off, error = (1e3 * np.hypot(*(pose - true[:2])) for pose in ((x, y), known[:2]))
        print(f"Place {index}: the base stands {off:.1f} mm beside it, and errs about where it is by {error:.1f} mm.")
    fastest = np.abs(speeds.FindLog(simulator.get_context()).data()).max()
    print(f"Fastest wheel command: {fastest:.2f} rad/s of {robot.driven_wheels[0].max_speed:g} that are allowed.")


if __name__ == "__main__":
    main()
