"""The Systems of robots on legs: in diagrams built by hand, with ideal feedback and with a plant."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.common.value import Value
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder

import robots
import rollerbench as rb
from ports import documented_ports, ports
from rollerbench.kinematics.gaits import Gait, LegMode, LegPlanner
from rollerbench.plant import RobotModel, ServoGains, add_ground
from rollerbench.systems import (
    BodyPoseController,
    GaitPlanner,
    LegInverseKinematics,
    LegServo,
    LegTracker,
    LegWatch,
    StanceOdometry,
    damp_joints,
    unlimited,
)

HEXAPOD = rb.load_robot("wheel_leg_hexapod")
PLANNER = LegPlanner(HEXAPOD)
STEP = 0.002


def test_ports_have_their_documented_names() -> None:
    start = PLANNER.start()
    model, _ = robot_in_a_plant(HEXAPOD, DiagramBuilder())
    systems = {
        GaitPlanner: GaitPlanner(HEXAPOD),
        LegInverseKinematics: LegInverseKinematics(HEXAPOD),
        LegTracker: LegTracker(HEXAPOD),
        LegServo: LegServo(model, STEP),
        StanceOdometry: StanceOdometry(HEXAPOD, PLANNER, start),
        BodyPoseController: BodyPoseController(),
        LegWatch: LegWatch(PLANNER),
    }
    for kind, system in systems.items():
        assert ports(system) == documented_ports(kind), kind.__name__


def robot_in_a_plant(robot: rb.Robot, builder: DiagramBuilder) -> tuple[RobotModel, object]:
    """A robot on level ground, with motors for a LegServo."""
    config = MultibodyPlantConfig(time_step=STEP, discrete_contact_approximation="lagged")
    plant, scene_graph = AddMultibodyPlant(config, builder)
    model = rb.add_robot(plant, unlimited(robot), gains=ServoGains())
    damp_joints(model)
    add_ground(plant)
    plant.Finalize()
    return RobotModel(**{**vars(model), "robot": robot}), scene_graph


@dataclass
class Bench:
    """A robot on legs, wired by hand."""

    diagram: Diagram
    model: RobotModel
    planner: GaitPlanner
    tracker: LegTracker
    servo: LegServo

    def simulator(self) -> Simulator:
        """A simulation that starts with the robot standing at the origin."""
        simulator = Simulator(self.diagram)
        context = simulator.get_mutable_context()
        plant_context = self.model.plant.GetMyMutableContextFromRoot(context)
        self.model.set_pose(plant_context, [0, 0, 0])
        self.servo.set_angles(self.servo.GetMyMutableContextFromRoot(context), self.tracker.angles)
        simulator.Initialize()
        return simulator

    def twist(self, context, v_xyw_B) -> None:
        own = self.planner.GetMyMutableContextFromRoot(context)
        self.planner.GetInputPort("v_xyw_B").FixValue(own, v_xyw_B)

    def body(self, context):
        """Pose (4, 4) of the body."""
        plant = self.model.plant
        return plant.GetFreeBodyPose(plant.GetMyContextFromRoot(context), self.model.body).GetAsMatrix4()


def bench(robot: rb.Robot, mode: LegMode | None = None) -> Bench:
    builder = DiagramBuilder()
    model, _ = robot_in_a_plant(robot, builder)
    planner = builder.AddSystem(GaitPlanner(robot, mode=mode))
    tracker = builder.AddSystem(LegTracker(robot, mode=mode))
    servo = builder.AddSystem(LegServo(model, STEP))
    state = model.plant.get_state_output_port(model.model_instance)
    for output, target in (
        (planner.GetOutputPort("plan"), tracker.GetInputPort("plan")),
        (tracker.GetOutputPort("tracked"), planner.GetInputPort("tracked")),
        (tracker.GetOutputPort("joint_rates"), servo.GetInputPort("joint_rates")),
        (tracker.GetOutputPort("joint_efforts"), servo.GetInputPort("joint_efforts")),
        (state, servo.GetInputPort("state")),
        (servo.GetOutputPort("actuation"), model.plant.get_actuation_input_port(model.model_instance)),
    ):
        builder.Connect(output, target)
    return Bench(diagram=builder.Build(), model=model, planner=planner, tracker=tracker, servo=servo)


def tilt(pose) -> float:
    """Inclination of the body [deg]."""
    return float(np.degrees(np.arccos(min(1.0, pose[2, 2]))))


def test_the_hexapod_stands_in_a_diagram_built_by_hand() -> None:
    """Nothing is connected that is optional: it stands still."""
    robot = bench(HEXAPOD)
    simulator = robot.simulator()
    start = robot.body(simulator.get_context())
    simulator.AdvanceTo(0.8)
    end = robot.body(simulator.get_context())
    assert np.linalg.norm((end - start)[:3, 3]) < 0.5e-3
    assert tilt(end) < 0.1


def test_a_clone_goes_on_like_its_original() -> None:
    robot = bench(HEXAPOD)
    simulator = robot.simulator()
    robot.twist(simulator.get_mutable_context(), [0.2, 0.0, 0.1])
    simulator.AdvanceTo(0.5 + 0.5 * STEP)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(0.9)
    other = Simulator(robot.diagram, clone)
    other.AdvanceTo(0.9)
    plant = robot.model.plant
    states, plans = [], []
    for each in (simulator, other):
        context = each.get_context()
        states.append(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))
        plans.append(robot.planner.plan(robot.planner.GetMyContextFromRoot(context)))
    assert (plans[0].swing >= 0).any()
    assert states[0].tolist() == states[1].tolist()
    assert plans[0].feet_P.tolist() == plans[1].feet_P.tolist()
    assert plans[0].time == plans[1].time == pytest.approx(0.9, abs=0.0201)


def test_motors_give_no_more_than_they_have() -> None:
    """Joints are thrown to angles far off at once; motors are at their limits, and never beyond."""
    robot = bench(HEXAPOD)
    simulator = robot.simulator()
    context = simulator.get_mutable_context()
    own = robot.servo.GetMyMutableContextFromRoot(context)
    robot.servo.set_angles(own, robot.tracker.angles + np.random.default_rng(1).uniform(-0.5, 0.5, 30))
    limits = np.array([[link.max_effort for link in leg.links] + [leg.wheel.max_effort] for leg in HEXAPOD.legs])
    saturated = 0
    for step in range(50):
        simulator.AdvanceTo((step + 1) * STEP)
        efforts = np.abs(robot.servo.GetOutputPort("motor_efforts").Eval(own))
        assert (efforts <= limits.ravel()).all()
        saturated += int((efforts == limits.ravel()).sum())
    assert saturated > 50


def test_a_quadruped_crawls_with_a_gait_of_its_own() -> None:
    """A wave with pauses between its steps; the quadruped's own has no margin, with a leg always in the air."""
    robot = rb.load_robot(robots.quadruped())
    crawl = Gait(name="crawl", duty=0.9, lag=0.75, offset=0.5, period=2.0, lift=0.02)
    walker = bench(robot, LegMode(posture="stand", gait=crawl))
    simulator = walker.simulator()
    walker.twist(simulator.get_mutable_context(), [0.04, 0.0, 0.0])
    simulator.AdvanceTo(4.0)
    context = simulator.get_context()
    pose = walker.body(context)
    reference = walker.planner.GetOutputPort("q_xyt").Eval(walker.planner.GetMyContextFromRoot(context))
    assert reference[0] > 0.04
    assert pose[:2, 3] == pytest.approx(reference[:2], abs=2e-3)
    assert tilt(pose) < 0.3


def test_the_planner_alone_plans_as_if_legs_followed() -> None:
    planner = GaitPlanner(HEXAPOD)
    simulator = Simulator(planner)
    context = simulator.get_mutable_context()
    planner.GetInputPort("v_xyw_B").FixValue(context, [0.1, 0.0, 0.0])
    simulator.AdvanceTo(2.0 - 1e-9)
    plan = planner.plan(context)
    assert plan.time == pytest.approx(2.0)
    assert plan.status == ""
    assert planner.GetOutputPort("q_xyt").Eval(context).tolist() == plan.reference.tolist()
    assert planner.GetOutputPort("v_xyw_B").Eval(context) == pytest.approx([0.1, 0.0, 0.0], abs=1e-12)
    assert planner.GetOutputPort("stance").Eval(context).tolist() == (plan.swing < 0).tolist()
    feet = planner.GetOutputPort("foot_positions").Eval(context).reshape(6, 3)
    assert_allclose(feet, planner.planner.centers_B(plan), atol=1e-15)
    assert plan.reference[0] == pytest.approx(0.1 * (2.0 - 1.45 / 2), abs=1e-9)


def test_a_fault_halts_the_planner() -> None:
    planner = GaitPlanner(HEXAPOD)
    simulator = Simulator(planner)
    context = simulator.get_mutable_context()
    planner.GetInputPort("v_xyw_B").FixValue(context, [0.1, 0.0, 0.0])
    simulator.AdvanceTo(1.0)
    planner.GetInputPort("fault").FixValue(context, [3.0])
    simulator.AdvanceTo(3.0)
    plan = planner.plan(context)
    assert plan.activity == "halt"
    assert "does not follow" in plan.status
    assert HEXAPOD.legs[2].name in plan.status
    assert (plan.swing < 0).all()
    assert not plan.twist.value.any()


def test_inverse_kinematics_reach_and_say_what_they_do_not_reach() -> None:
    system = LegInverseKinematics(HEXAPOD, "mammal")
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    q = PLANNER.stances.joints("mammal")
    feet = PLANNER.group.frames(q)[:, -1, :3, 3]
    target = feet + np.random.default_rng(2).uniform(-0.02, 0.02, feet.shape)
    system.GetInputPort("foot_positions").FixValue(context, target.ravel())
    simulator.AdvanceTo(0.1)
    angles, wheels = PLANNER.group.from_vector(system.GetOutputPort("joint_angles").Eval(context))
    assert not wheels.any()
    assert_allclose(PLANNER.group.frames(angles)[:, -1, :3, 3], target, atol=1e-8)
    assert_allclose(angles[:, 0], q[:, 0], atol=1e-8)  # the mammal holds joint 1
    assert system.GetOutputPort("out_of_reach").Eval(context) == [0.0]
    away = target.copy()
    away[3] += [0.0, 0.0, -0.5]
    system.GetInputPort("foot_positions").FixValue(context, away.ravel())
    simulator.AdvanceTo(0.2)
    stopped, _ = PLANNER.group.from_vector(system.GetOutputPort("joint_angles").Eval(context))
    assert_allclose(stopped, angles, atol=1e-8)
    # At full length it reaches 0.44 m; the foot is asked to be at 0.84 m below its hip.
    assert 0.3 < system.GetOutputPort("out_of_reach").Eval(context)[0] < 0.5


@pytest.mark.parametrize("make", [GaitPlanner, LegTracker, LegInverseKinematics])
def test_robots_without_legs_and_bad_periods_are_refused(make) -> None:
    with pytest.raises(rb.KinematicsError, match="test_cart has no legs"):
        make(robots.cart())
    for period in (0.0, -1.0, np.nan):
        with pytest.raises(rb.KinematicsError, match="accepted: a positive number of seconds"):
            make(HEXAPOD, period=period)


def test_an_unknown_posture_is_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="posture = 'sit': accepted: insect, mammal"):
        LegInverseKinematics(HEXAPOD, "sit")
    with pytest.raises(rb.KinematicsError, match="posture = 'sit': accepted: insect, mammal"):
        GaitPlanner(HEXAPOD, mode=LegMode(posture="sit"))


def test_wheels_without_motors_do_not_drive() -> None:
    with pytest.raises(rb.KinematicsError, match="test_quadruped cannot drive: the wheels of fl, fr, rl, rr have no"):
        GaitPlanner(robots.quadruped(), mode=LegMode(posture="stand", motion="drive"))


def test_corrections_are_bounded_and_turn_the_shorter_way() -> None:
    system = BodyPoseController(period=0.01, gain=2.0)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    yaw = 3.1
    system.GetInputPort("desired").FixValue(context, [0.01, 0.0, 0.2, 0.0, 0.01, -3.1])
    system.GetInputPort("pose").FixValue(context, [0.0, 0.0, 0.199, 0.0, 0.0, yaw])
    found = system.GetOutputPort("correction").Eval(context)
    # In B, at the measured yaw; and 0.083 rad to the left rather than 6.2 to the right.
    expected = 2.0 * np.array([0.01 * np.cos(yaw), -0.01 * np.sin(yaw), 2 * np.pi - 6.2])
    assert found == pytest.approx(expected, abs=1e-12)
    simulator.AdvanceTo(0.1 - 1e-9)
    # Ten periods of the integral.
    assert system.GetOutputPort("level").Eval(context) == pytest.approx([2e-4, 0.0, 2e-3], abs=1e-12)
    system.GetInputPort("desired").FixValue(context, [9.0, -9.0, 9.0, 9.0, -9.0, 1.0])
    simulator.AdvanceTo(3.0)
    assert np.abs(system.GetOutputPort("correction").Eval(context)).max() <= 0.2
    assert np.abs(system.GetOutputPort("correction").Eval(context))[:2].tolist() == [0.05, 0.05]
    assert system.GetOutputPort("level").Eval(context) == pytest.approx([0.02, 0.1, -0.1])


def test_the_watch_names_a_leg_that_lags_and_no_wheel() -> None:
    watch = LegWatch(PLANNER)
    context = watch.CreateDefaultContext()
    group = PLANNER.group
    lag, wheels = np.zeros(group.shape), np.full(6, 5.0)
    for leg, sign, fault in ((2, 0.19, 0.0), (2, -0.21, 3.0), (5, 0.3, 6.0)):
        lag[leg, 1] = sign
        watch.GetInputPort("lag").FixValue(context, group.to_vector(lag, wheels))
        assert watch.GetOutputPort("fault").Eval(context).tolist() == [fault]


def test_stance_odometry_finds_the_body_over_its_feet() -> None:
    start = PLANNER.start()
    system = StanceOdometry(HEXAPOD, PLANNER, start, period=0.01)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    q, group = PLANNER.stances.joints("insect"), PLANNER.group
    feet = group.frames(q)[:, -1, :3, 3]
    moved, _, missed = group.inverse(feet - [0.01, 0.02, 0.005], PLANNER.stances.holds("insect"), iterations=40)
    assert missed.max() < 1e-9
    still = np.zeros(30)
    system.GetInputPort("plan").FixValue(context, Value(start))
    system.GetInputPort("joint_state").FixValue(context, np.r_[group.to_vector(q, np.zeros(6)), still])
    assert system.GetOutputPort("pose").Eval(context)[2] == pytest.approx(PLANNER.stances.height("insect"), abs=1e-12)
    simulator.AdvanceTo(0.1)
    assert system.GetOutputPort("q_xyt").Eval(context) == pytest.approx([0, 0, 0], abs=1e-9)
    system.GetInputPort("joint_state").FixValue(context, np.r_[group.to_vector(moved, np.zeros(6)), still])
    simulator.AdvanceTo(0.105)
    simulator.AdvanceTo(0.115)
    # 1e-8: what the inverse leaves.
    assert system.GetOutputPort("q_xyt").Eval(context) == pytest.approx([0.01, 0.02, 0], abs=1e-8)
    assert not system.GetOutputPort("slipped").Eval(context).any()
