"""Robots as parts of somebody's plant: beside other models, beside each other, and with an arm on top."""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.primitives import Adder, MatrixGain

import robots
import rollerbench as rb
from rollerbench.sdf.contact import static_penetration
from worlds import ARM, ARM_MASS, BOX, BOX_SIZE, World, add_model, root_frame

GRAVITY = 9.81
TWISTS = {"test_cart": [0.3, 0.0, 0.4], "test_swerve": [0.3, 0.0, 0.0]}
ROLLER_MODELS = pytest.mark.parametrize("roller_model", ["full", "windowed"])
Added = rb.RobotModel | ModelInstanceIndex


def two_robots(first: Any, second: Any, at: Sequence[Sequence[float]], roller_model: str) -> World:
    world = World(roller_model)
    models = world.add(first), world.add(second)
    world.start()
    for model, q_xyt in zip(models, at, strict=True):
        model.set_pose(world.context, q_xyt)
    return world


@cache
def driven(roller_model: str, before: str | None, after: str | None) -> Any:
    """The pose of a Mecanum robot's body after a moment, with another model added before or after it."""
    world = World(roller_model)
    others: dict[str, Added] = {}

    def add(kind: str | None) -> None:
        if kind in ("box", "fixed"):
            others[kind] = instance = add_model(world.plant, BOX)
            if kind == "fixed":
                place = RigidTransform([0.0, 3.0, 0.1])
                world.plant.WeldFrames(world.plant.world_frame(), root_frame(world.plant, instance), place)
        elif kind == "arm":
            place = RigidTransform([0.0, 3.0, 0.5])
            others[kind] = world.add_arm(world.plant.world_frame(), place)
        elif kind is not None:
            others[kind] = world.add(NEIGHBOURS[kind])

    add(before)
    model = world.add(robots.mecanum(count=8))
    add(after)
    world.start()
    for kind, other in others.items():
        if isinstance(other, rb.RobotModel):
            other.set_pose(world.context, (0.0, 3.0, 0.0))
            if not other.robot.legs:
                world.drive(other, TWISTS.get(other.robot.name, [0.2, 0.1, 0.3]))
        elif kind == "box":
            body = world.plant.GetBodyByName("box", other)
            world.plant.SetFreeBodyPose(world.context, body, RigidTransform([0.0, 3.0, 0.5 * BOX_SIZE]))
    world.drive(model, [0.3, 0.1, 0.4])
    world.simulator.AdvanceTo(0.2)
    assert world.q_xyt(model)[0] > 0.04
    return world.plant.EvalBodyPoseInWorld(world.context, model.body).GetAsMatrix4()


NEIGHBOURS: dict[str, Any] = {
    "same": robots.mecanum(count=8),
    "cart": robots.cart(),
    "hexapod": "wheel_leg_hexapod",
    "fixed": None,
    "box": None,
    "arm": None,
}


@pytest.mark.parametrize(
    ("roller_model", "neighbour"), [*(("windowed", name) for name in NEIGHBOURS), ("full", "same"), ("full", "box")]
)
def test_other_models_do_not_change_a_robots_motion(roller_model: str, neighbour: str) -> None:
    alone = driven(roller_model, None, None)
    for around in ((neighbour, None), (None, neighbour)):
        # Contacts and servos of all are solved together, up to a tolerance on their sum.
        tolerance = {"fixed": 0.0, "arm": 1e-12}.get(neighbour, 1e-8)
        assert abs(driven(roller_model, *around) - alone).max() <= tolerance, around


@cache
def crowd(roller_model: str) -> World:
    """One robot of each kind, two of one, models on moving parts of theirs, and models beside them."""
    world = World(roller_model)
    add_model(world.plant, BOX)
    first = world.add(robots.mecanum(count=8))
    swerve = world.add(robots.swerve())
    world.add_arm(swerve.plant.GetBodyByName("fl_fork", swerve.model_instance).body_frame())
    world.add("wheel_leg_hexapod")
    world.add(robots.mecanum(count=8), "full" if roller_model == "windowed" else "windowed")
    world.add(robots.cart())
    world.add_arm(first.body.body_frame(), first.X_BT)
    world.add(robots.kiwi())
    world.start()
    return world


@ROLLER_MODELS
def test_matrices_pick_the_coordinates_of_every_robot(roller_model: str) -> None:
    world = crowd(roller_model)
    plant, context = world.plant, world.context
    generator = np.random.default_rng(3)
    plant.SetVelocities(context, generator.uniform(-1, 1, plant.num_velocities()))
    for index, model in enumerate(world.models):
        X_WB = RigidTransform(RollPitchYaw(0.1, -0.2, 0.4 * index), [index, -index, 0.5])
        plant.SetFreeBodyPose(context, model.body, X_WB)
        for joint in all_joints(model):
            joint.set_angle(context, generator.uniform(-2, 2))
    for model in world.models:
        robot, state = model.robot, world.state(model)
        drives = [model.drive_joint(wheel) for wheel in robot.driven_wheels]
        assert (model.wheel_angle_matrix() @ state).tolist() == [joint.get_angle(context) for joint in drives]
        assert (model.wheel_speed_matrix() @ state).tolist() == [joint.get_angular_rate(context) for joint in drives]
        for joint in all_joints(model):
            offset = plant.num_positions(model.model_instance)
            assert state[model.position_index(joint)] == joint.get_angle(context)
            assert state[offset + model.velocity_index(joint)] == joint.get_angular_rate(context)
        body = model.body_state_matrix() @ state
        pose, velocity = plant.GetFreeBodyPose(context, model.body), model.body.EvalSpatialVelocityInWorld(context)
        assert body[:4] * np.sign(body[0]) == pytest.approx(pose.rotation().ToQuaternion().wxyz(), abs=1e-15)
        assert body[4:7].tolist() == pose.translation().tolist()
        assert body[7:] == pytest.approx(np.r_[velocity.rotational(), velocity.translational()], abs=1e-15)
        legs = [[*model.leg_joints(leg), model.wheel_joint(leg)] for leg in robot.legs]
        n = sum(map(len, legs))
        assert (model.leg_state_matrix() @ state)[:n].tolist() == [j.get_angle(context) for leg in legs for j in leg]


@ROLLER_MODELS
def test_matrices_command_the_motors_of_every_robot(roller_model: str) -> None:
    world = crowd(roller_model)
    plant = world.plant
    to_joints = plant.MakeActuationMatrix()
    for model in world.models:
        robot = model.robot
        n = len(model.actuators)
        desired = model.desired_state_matrix()
        for column, wheel in enumerate(robot.driven_wheels):
            efforts = np.zeros(plant.num_actuators())
            plant.SetActuationInArray(model.model_instance, model.actuation_matrix()[:, column], efforts)
            forces = to_joints @ efforts
            assert forces[model.drive_joint(wheel).velocity_start()] == 1.0
            assert np.count_nonzero(forces) == 1
            assert desired[n:, column].tolist() == model.actuation_matrix()[:, column].tolist()
            assert not desired[:n, column].any()
        for column, wheel in enumerate(robot.steered_wheels, start=len(robot.driven_wheels)):
            motor = [actuator.joint().name() for actuator in model.actuators].index(model.swivel_joint(wheel).name())
            angle, rate = desired[:, column], desired[:, column + len(robot.steered_wheels)]
            assert np.flatnonzero(angle).tolist() == [motor]
            assert np.flatnonzero(rate).tolist() == [n + motor]
        assert all(actuator.has_controller() for actuator in model.actuators)


def all_joints(model: rb.RobotModel) -> list[Any]:
    robot = model.robot
    joints = [model.drive_joint(wheel) for wheel in robot.wheels]
    joints += [model.swivel_joint(wheel) for wheel in robot.wheels if wheel.swivels]
    joints += [joint for wheel in robot.wheels for joint in model.roller_joints(wheel)]
    return joints + [joint for leg in robot.legs for joint in (*model.leg_joints(leg), model.wheel_joint(leg))]


def test_robots_are_placed_one_by_one_and_named_apart() -> None:
    world = crowd.__wrapped__("windowed")
    for index, model in enumerate(world.models):
        others = [world.state(other) for other in world.models if other is not model]
        model.set_pose(world.context, (2.0 * index, 1.0, 0.3))
        assert world.q_xyt(model) == pytest.approx([2.0 * index, 1.0, 0.3], abs=1e-15)
        after = [world.state(other) for other in world.models if other is not model]
        assert all((one == other).all() for one, other in zip(others, after, strict=True))
    names = [world.plant.GetModelInstanceName(model.model_instance) for model in world.models]
    assert len(set(names)) == len(names)
    assert {"test_mecanum", "test_mecanum_1"} <= set(names)


def test_robots_on_wheels_and_on_legs_of_both_roller_models_move_together() -> None:
    """One call follows the windowed ones; a full and a windowed robot of a kind go the same way."""
    world = World()
    full, windowed = world.add(robots.mecanum(count=8), "full"), world.add(robots.mecanum(count=8))
    kiwi, hexapod = world.add(robots.kiwi()), world.add("wheel_leg_hexapod")
    world.start()
    for index, model in enumerate(world.models):
        model.set_pose(world.context, (0.0, 2.0 * index, 0.0))
        if not model.robot.legs:
            world.drive(model, [0.2, 0.2, 0.3])
    stood = world.plant.EvalBodyPoseInWorld(world.context, hexapod.body).translation()
    world.simulator.AdvanceTo(0.5)
    ends = [world.q_xyt(model) - [0.0, 2.0 * index, 0.0] for index, model in enumerate(world.models[:3])]
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)
    expected = rb.odometry.integrate(np.zeros(3), [0.2, 0.2, 0.3], 0.5)
    for end in ends:
        # 12 mm: finite rollers, and slip as they start from rest at full speed.
        assert end == pytest.approx(expected, abs=0.012)
    assert full.roller_window is None
    assert windowed.roller_window is not None
    assert kiwi.roller_window is not None
    assert world.plant.EvalBodyPoseInWorld(world.context, hexapod.body).translation() == pytest.approx(stood, abs=3e-3)


@ROLLER_MODELS
def test_robots_that_meet_stop_each_other(roller_model: str) -> None:
    """Head on, body against body."""
    start = [(-0.31, 0.0, 0.0), (0.31, 0.0, np.pi)]
    world = two_robots("youbot_base", "youbot_base", start, roller_model)
    for model in world.models:
        world.drive(model, [0.15, 0.0, 0.0])
    world.simulator.AdvanceTo(0.5)
    assert frozenset({"youbot_base", "youbot_base_1"}) in world.touching()
    left, right = (world.q_xyt(model) for model in world.models)
    length = world.models[0].robot.body.size[0]
    assert right[0] - left[0] == pytest.approx(length, abs=2e-3)
    assert left[:2] == pytest.approx(-right[:2], abs=1e-3)


def test_wheels_that_meet_sideways_stop_robots_that_have_all_their_rollers() -> None:
    start = [(0.0, -0.18, 0.0), (0.0, 0.18, 0.0)]
    world = two_robots("youbot_base", "youbot_base", start, "full")
    for model, side in zip(world.models, (1.0, -1.0), strict=True):
        world.drive(model, [0.0, 0.1 * side, 0.0])
    world.simulator.AdvanceTo(0.4)
    assert frozenset({"youbot_base", "youbot_base_1"}) in world.touching()
    right, left = (world.q_xyt(model) for model in world.models)
    assert left[1] - right[1] > 0.3


@ROLLER_MODELS
def test_a_robot_pushes_a_box(roller_model: str) -> None:
    world = World(roller_model)
    box = world.plant.GetBodyByName("box", add_model(world.plant, BOX))
    model = world.add("youbot_base")
    world.start()
    front, gap = 0.5 * model.robot.body.size[0], 0.02
    at = front + gap + 0.5 * BOX_SIZE
    world.plant.SetFreeBodyPose(world.context, box, RigidTransform([at, 0.0, 0.5 * BOX_SIZE]))
    world.drive(model, [0.25, 0.0, 0.0])
    world.simulator.AdvanceTo(0.05)
    assert world.plant.EvalBodyPoseInWorld(world.context, box).translation()[0] == pytest.approx(at, abs=1e-6)
    world.simulator.AdvanceTo(0.4)
    assert frozenset({"box", "youbot_base"}) in world.touching()
    assert world.x_ahead(model, box) == pytest.approx(at - gap, abs=1e-3)
    before = world.q_xyt(model)[0]
    world.simulator.AdvanceTo(0.8)
    assert world.q_xyt(model) == pytest.approx([before + 0.25 * 0.4, 0.0, 0.0], abs=2e-3)
    assert world.x_ahead(model, box) == pytest.approx(at - gap, abs=1e-3)


@ROLLER_MODELS
def test_a_base_drives_on_with_an_arm_on_top(roller_model: str) -> None:
    world = World(roller_model)
    bare = World(roller_model)
    model, other = world.add("youbot_base"), bare.add("youbot_base")
    arm = world.add_arm(model.body.body_frame(), model.X_BT)
    for each in (world, bare):
        each.start()
    assert world.plant.num_actuators(arm) == 2
    for one, same in zip(model.actuators, other.actuators, strict=True):
        gains, expected = one.get_controller_gains(), same.get_controller_gains()
        assert (one.joint().name(), gains.p, gains.d) == (same.joint().name(), expected.p, expected.d)
    bent = np.array([0.5, -0.8])
    world.plant.get_desired_state_input_port(arm).FixValue(world.context, [*bent, 0.0, 0.0])
    world.plant.SetPositions(world.context, arm, bent)
    for each, which in ((world, model), (bare, other)):
        which.set_pose(each.context, (1.0, 2.0, 0.5))
        each.drive(which, [0.2, 0.2, 0.3])
        each.simulator.AdvanceTo(0.6)
    # 1 mm: the load shares out over the wheels in another way, which slip a little as the base starts at once.
    assert world.q_xyt(model) == pytest.approx(bare.q_xyt(other), abs=1e-3)
    # 10 mrad: the weight of the bent arm, and the start, on its servos.
    assert world.plant.GetPositions(world.context, arm) == pytest.approx(bent, abs=0.02)


def test_a_load_sinks_the_wheels_in_proportion() -> None:
    depths = []
    for loaded in (False, True):
        world = World()
        model = world.add("youbot_base")
        if loaded:
            world.add_arm(model.body.body_frame(), model.X_BT)
        world.start()
        model.set_pose(world.context, (0.0, 0.0, 0.0))
        world.simulator.AdvanceTo(0.5)
        height = world.plant.EvalBodyPoseInWorld(world.context, model.body).translation()[2]
        depths.append(-model.robot.ground_height - height)
    robot = rb.load_robot("youbot_base")
    # 2 %: wheels that stand between two rollers are not as high as on the middle of one.
    assert depths == pytest.approx(static_penetration(robot) * np.array([1.0, 1 + ARM_MASS / robot.mass]), rel=0.02)


@pytest.mark.parametrize("name", ["youbot_base", "differential_cart", "wheel_leg_hexapod"])
def test_the_top_is_where_the_box_ends(name: str) -> None:
    world = World()
    model = world.add(name)
    world.start()
    inspector = world.scene_graph.model_inspector()
    (box,) = world.plant.GetCollisionGeometriesForBody(model.body)
    top = inspector.GetPoseInFrame(box).multiply(np.array([0.0, 0.0, 0.5 * inspector.GetShape(box).height()]))
    assert model.X_BT.translation() == pytest.approx(top, abs=1e-12)
    assert model.X_BT.rotation().IsNearlyIdentity()


def test_slip_and_rolling_resistance_are_each_robots_own() -> None:
    world, monitors, drags = World(), [], []

    def connect(world: World) -> None:
        builder, plant = world.builder, world.plant
        nq, nv = plant.num_positions(), plant.num_velocities()
        velocities = builder.AddSystem(MatrixGain(np.hstack([np.zeros((nv, nq)), np.eye(nv)])))
        builder.Connect(plant.get_state_output_port(), velocities.get_input_port())
        total = builder.AddSystem(Adder(2, nv))
        for index, model in enumerate(world.models):
            monitors.append(builder.AddSystem(rb.systems.SlipMonitor(model)))
            drags.append(builder.AddSystem(rb.systems.RollResistance(model, 0.05)))
            for system in (monitors[-1], drags[-1]):
                contacts = plant.get_contact_results_output_port()
                builder.Connect(contacts, system.GetInputPort("contact_results"))
            builder.Connect(plant.get_body_poses_output_port(), drags[-1].GetInputPort("body_poses"))
            builder.Connect(velocities.get_output_port(), drags[-1].GetInputPort("velocities"))
            builder.Connect(drags[-1].GetOutputPort("generalized_force"), total.get_input_port(index))
        builder.Connect(total.get_output_port(), plant.get_applied_generalized_force_input_port())

    for robot in ("youbot_base", robots.cart()):
        world.add(robot)
    world.start(connect)
    for index, model in enumerate(world.models):
        model.set_pose(world.context, (0.0, 2.0 * index, 0.0))
        world.drive(model, [0.3, 0.0, 0.0])
    world.simulator.AdvanceTo(0.3)
    root = world.simulator.get_context()
    own = np.arange(world.plant.num_velocities(), dtype=float)
    for model, monitor, drag in zip(world.models, monitors, drags, strict=True):
        loads = monitor.GetOutputPort("normal_forces").Eval(monitor.GetMyContextFromRoot(root))
        # 5 %: rollers lift and lower the robot as they take turns.
        assert loads.sum() == pytest.approx(model.robot.mass * GRAVITY, rel=0.05)
        force = drag.GetOutputPort("generalized_force").Eval(drag.GetMyContextFromRoot(root))
        indices = world.plant.GetVelocitiesFromArray(model.model_instance, own)
        assert np.flatnonzero(force).size > 0
        assert set(np.flatnonzero(force)) <= set(indices.astype(int))


def test_a_robot_that_hangs_on_another_model_is_refused_by_name() -> None:
    world = World()
    model = world.add(robots.kiwi())
    arm = add_model(world.plant, ARM)
    world.plant.WeldFrames(root_frame(world.plant, arm), model.body.body_frame())
    world.start()
    for ask in (model.body_state_matrix, lambda: model.set_pose(world.context, (0.0, 0.0, 0.0))):
        with pytest.raises(rb.SimulationError, match=r"test_kiwi is not free.*WeldFrames\(model.body.body_frame"):
            ask()
    assert model.wheel_speed_matrix().any(axis=1).all()


def test_matrices_of_a_plant_that_is_not_finalized_are_refused() -> None:
    model = World().add(robots.cart())
    for ask in (model.desired_state_matrix, model.actuation_matrix):
        with pytest.raises(rb.SimulationError, match=r"not finalized; accepted: after plant.Finalize\(\)"):
            ask()


def test_every_contact_between_parts_of_one_robot_is_left_out() -> None:
    """Also of the second of two of a name, whose collision filter has the same name."""
    world = two_robots("youbot_base", "youbot_base", [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0)], "full")
    world.simulator.AdvanceTo(0.05)
    pairs = world.touching()
    assert pairs == {frozenset({name, "WorldModelInstance"}) for name in ("youbot_base", "youbot_base_1")}
    inspector = world.scene_graph.model_inspector()
    for model in world.models:
        bodies = [world.plant.get_body(index) for index in world.plant.GetBodyIndices(model.model_instance)]
        shapes = [shape for body in bodies for shape in world.plant.GetCollisionGeometriesForBody(body)]
        assert all(inspector.CollisionFiltered(one, other) for one, other in pairwise(shapes))
