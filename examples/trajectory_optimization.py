"""Plan the fastest wheel speeds with Drake's trajectory optimisation on a robot's own equations; then check them.

Bases park 1 m to their left between two posts, and cross a room to a place 3 m ahead and 3 m to the left.
Run it with: python examples/trajectory_optimization.py
"""

import numpy as np
from pydrake.math import cos, eq, le, sin
from pydrake.planning import DirectCollocation
from pydrake.solvers import SnoptSolver
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from scipy.linalg import null_space

import rollerbench as rb

FirstOrderHold = PiecewisePolynomial.FirstOrderHold
PARK, CROSS = np.array([0.0, 1.0, 0.0]), np.array([3.0, 3.0, 0.0])
POST, KNOTS = 0.1, 31  # radius of a post [m]; times at which a plan has its wheel speeds


def keep_off_posts(problem: DirectCollocation, robot: rb.Robot) -> None:
    """Three discs cover the robot; the place between the two posts is 0.1 m longer than they are."""
    middle, third = robot.body.box_center[0], robot.body.size[0] / 6
    radius = np.hypot(third, max(abs(wheel.p_BoHo_B[1]) + 0.5 * wheel.width for wheel in robot.wheels))
    x, y, yaw = problem.state()
    for side in (-1, 1):
        post = PARK[0] + middle + side * (2 * third + radius + 0.05 + POST), PARK[1]
        for ahead in (middle - 2 * third, middle, middle + 2 * third):
            distance_squared = (x + ahead * cos(yaw) - post[0]) ** 2 + (y + ahead * sin(yaw) - post[1]) ** 2
            problem.AddConstraintToAllKnotPoints(distance_squared >= (radius + POST) ** 2)


def plan(kinematics: rb.WheelKinematics, goal: np.ndarray) -> PiecewisePolynomial:
    """Wheel speeds from rest at the origin to rest at the goal, changing at half of what the limits along x permit."""
    robot, base = kinematics.robot, rb.systems.KinematicBase(kinematics)
    problem = DirectCollocation(base, base.CreateDefaultContext(), KNOTS, 0.01, 0.5)
    program, limit = problem.prog(), np.array([wheel.max_speed for wheel in robot.driven_wheels])
    problem.AddConstraintToAllKnotPoints(le([*problem.input(), *-problem.input()], [*limit, *limit]))
    for row in null_space(kinematics.drive_matrix.T).T:  # wheels that contradict each other would slip
        problem.AddConstraintToAllKnotPoints(row @ problem.input() == 0)
    rate = 0.5 * min(rb.limits.max_acceleration(robot, [0, np.pi]).value) * np.abs(kinematics.drive_matrix[:, 0])
    for k in range(KNOTS - 1):
        change, step = problem.input(k + 1) - problem.input(k), problem.time_step(k)[0]
        program.AddLinearConstraint(le([*change, *-change], [*rate * step, *rate * step]))
    for k, pose in ((0, np.zeros(3)), (KNOTS - 1, goal)):
        program.AddLinearConstraint(eq([*problem.state(k), *problem.input(k)], [*pose, *0 * limit]))
    if goal is PARK:
        keep_off_posts(problem, robot)
    problem.AddEqualTimeIntervalsConstraints()
    problem.AddFinalCost(problem.time())
    # The guess turns, drives along x, or along the nearest axis of a base that moves along both, and turns back.
    heading = np.arctan2(goal[1], goal[0]) % (np.pi if kinematics.mobility().degree_of_mobility < 3 else np.pi / 2)
    guess = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, heading], [*goal[:2], heading], goal])
    problem.SetInitialTrajectory(PiecewisePolynomial(), FirstOrderHold([0.0, 1.0, 3.0, 4.0], guess.T))
    result = SnoptSolver().Solve(program)
    assert result.is_success(), result.get_solution_result()
    return problem.ReconstructInputTrajectory(result)


def simulated_pose(robot: rb.Robot, speeds: PiecewisePolynomial) -> np.ndarray:
    """Where the robot with its mass, motors and rollers stands 0.5 s after the plan's end."""
    end, breaks = speeds.end_time() + 0.5, speeds.get_segment_times()
    scenario = {"name": "plan", "robot": robot, "duration": end, "command": {"type": "twist", "v_xyw_B": [0, 0, 0]}}
    scenario["plant"] = {"time_step": 0.002}  # a wheel turns by 3.4 deg a step, of the 30 deg from roller to roller
    builder = DiagramBuilder()
    station = builder.AddSystem(rb.build_station(rb.load_scenario(scenario), command="external"))
    twists = FirstOrderHold(breaks, rb.WheelKinematics(robot).forward_matrix @ speeds.vector_values(breaks))
    source = builder.AddSystem(TrajectorySource(twists))  # the station makes them the same wheel speeds again
    builder.Connect(source.get_output_port(), station.GetInputPort("twist_command"))
    simulator = Simulator(builder.Build())
    rb.follow_rollers(simulator)
    simulator.AdvanceTo(end)
    return station.GetOutputPort("pose").Eval(station.GetMyContextFromRoot(simulator.get_context()))


def main() -> None:
    """Prints how long each plan takes, what it asks of the wheels, and how far from the goal it leads."""
    print("task, robot, rollers                   duration  turn     fastest wheel  misses by equations, in Drake")
    bases = (("youbot_base", "textbook"), ("youbot_base", "finite"), ("differential_cart", "textbook"))
    for goal, (name, rollers) in [(PARK, base) for base in bases] + [(CROSS, base) for base in bases[1:]]:
        kinematics = rb.WheelKinematics(name, rollers=rollers)
        robot, speeds = kinematics.robot, plan(kinematics, goal)
        time = np.linspace(0.0, speeds.end_time(), 5001)
        twists = kinematics.forward(speeds.vector_values(time[1:] - 0.5 * time[1]).T)
        poses = rb.odometry.accumulate(np.zeros(3), twists * time[1])
        fastest, turn = np.abs(speeds.vector_values(time)).max(), np.degrees(np.ptp(poses[:, 2]))
        miss, drake = (1e3 * np.hypot(*(end - goal)[:2]) for end in (poses[-1], simulated_pose(robot, speeds)))
        task, limit = "parks" if goal is PARK else "crosses", robot.driven_wheels[0].max_speed
        print(f"{task:8} {name:17} {rollers:8} {time[-1]:6.3f} s {turn:4.0f} deg  {fastest:5.2f}", end="")
        print(f" of {limit:.0f} rad/s {miss:8.4f} mm {drake:11.1f} mm")
    slow = float(rb.limits.max_speed("youbot_base", np.pi / 4))
    print(f"Straight along the diagonal, at {slow:.3f} m/s, the youBot takes {np.hypot(*CROSS[:2]) / slow:.3f} s.")


if __name__ == "__main__":
    main()
