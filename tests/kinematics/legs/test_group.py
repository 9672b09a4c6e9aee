"""All legs of a robot at once: against one leg at a time, finite differences, and Drake."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from scipy.spatial.transform import Rotation

import robots
import rollerbench as rb
from rollerbench.description import Posture
from rollerbench.kinematics.legs.chain import geometric_jacobian
from rollerbench.kinematics.legs.group import Hold, LegGroup

GRAVITY = 9.81
LEGGED = {"hexapod": lambda: "wheel_leg_hexapod", "mixed": robots.mixed_legs, **robots.LEGGED}
every = pytest.mark.parametrize("make", LEGGED.values(), ids=LEGGED)


def shaken(group: LegGroup, rng: np.random.Generator):
    """Random joint angles within the limits; 0 where there is no joint."""
    return rng.uniform(*group.limits) * group.present


def nudged(q, leg, joint, step=1e-6):
    """Joint angles a little ahead and behind."""
    change = np.zeros_like(q)
    change[leg, joint] = step
    return q + change, q - change


def up_of(rng: np.random.Generator):
    return Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix()[2]


def joints_of(group: LegGroup):
    return [(leg, joint) for leg, joint in np.argwhere(group.present)]


@every
def test_frames_are_those_of_each_leg(make) -> None:
    robot = rb.load_robot(make())
    group, rng = LegGroup(robot), np.random.default_rng(1)
    for _ in range(5):
        q = shaken(group, rng)
        for leg, own, frames in zip(robot.legs, q, group.frames(q), strict=True):
            count = len(leg.links)
            expected = leg.frames_B(own[:count])
            assert_allclose(frames[:count], expected[:count], atol=1e-12)
            assert_allclose(frames[-1], expected[-1], atol=1e-12)
            index = robot.legs.index(leg)
            alone = group.leg_frames(index, own[:count])
            assert_allclose(alone, expected, atol=1e-12)
            assert_allclose(geometric_jacobian(alone), group.jacobian(group.frames(q))[index][:, :count], atol=1e-12)


@every
def test_the_jacobian_is_the_difference_of_frames(make) -> None:
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(2)
    q = shaken(group, rng)
    frames = group.frames(q)
    jacobian = group.jacobian(frames)
    assert not jacobian.swapaxes(1, 2)[~group.present].any()
    for leg, joint in joints_of(group):
        ahead, behind = (group.frames(each)[leg, -1] for each in nudged(q, leg, joint))
        rate = (ahead - behind) / 2e-6
        spin = rate[:3, :3] @ frames[leg, -1, :3, :3].T
        # 1e-9: the central difference of a step of 1e-6 rad.
        expected = [spin[2, 1], spin[0, 2], spin[1, 0], *rate[:3, 3]]
        assert_allclose(jacobian[leg, :, joint], expected, atol=1e-9)


@every
def test_vectors_hold_joints_and_wheels_leg_by_leg(make) -> None:
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(3)
    q, wheel = shaken(group, rng), rng.uniform(-1, 1, len(group.robot.legs))
    vector = group.to_vector(q, wheel)
    expected = [[*own[: len(leg.links)], turn] for leg, own, turn in zip(group.robot.legs, q, wheel, strict=True)]
    assert vector.tolist() == [value for values in expected for value in values]
    again, turns = group.from_vector(vector)
    assert (again == q).all()
    assert (turns == wheel).all()
    order = np.arange(len(vector), dtype=float)
    assert group.to_vector(*group.from_vector(order)).tolist() == order.tolist()


@every
def test_limits_are_those_of_the_links(make) -> None:
    group = LegGroup(rb.load_robot(make()))
    low, high = group.limits
    assert not group.beyond_limits(low).any()
    assert not group.beyond_limits(high).any()
    assert_allclose(group.beyond_limits(high + 0.1)[group.present], 0.1)
    assert_allclose(group.beyond_limits(low - 0.2)[group.present], 0.2)
    assert not group.beyond_limits(high + 0.1)[~group.present].any()


@every
def test_the_inverse_reaches(make) -> None:
    robot = rb.load_robot(make())
    group, rng = LegGroup(robot), np.random.default_rng(4)
    for posture in robot.standing:
        wanted = group.hold(posture, group.posture(posture.name))
        home = group.frames(wanted.near)[:, -1, :3, 3]
        for _ in range(5):
            target = home + rng.uniform(-0.02, 0.02, home.shape)
            q, frames, missed = group.inverse(target, wanted, iterations=50, tolerance=1e-12)
            assert missed.max() < 1e-9
            assert_allclose(frames[:, -1, :3, 3], target, atol=1e-9)
            assert_allclose(group.frames(q), frames, atol=1e-12)
            assert not q[~group.present].any()


@pytest.mark.parametrize("posture", ["insect", "mammal"])
@pytest.mark.parametrize("hold", ["tibia", "joint_1", "joint_2", "joint_3", "joint_4"])
def test_the_inverse_holds(posture: str, hold: str) -> None:
    group, rng = LegGroup(rb.load_robot("wheel_leg_hexapod")), np.random.default_rng(5)
    q = group.posture(posture) + rng.uniform(-0.1, 0.1, group.shape)
    wanted = group.hold(Posture(name=posture, hold=hold), q)
    expected = q[:, 1] + q[:, 2] if hold == "tibia" else q[:, int(hold[-1]) - 1]
    assert_allclose(wanted.values, expected, atol=1e-15)
    target = group.frames(q)[:, -1, :3, 3]
    near = replace(wanted, near=q + rng.uniform(-0.05, 0.05, q.shape))
    found, _, missed = group.inverse(target, near, iterations=50, tolerance=1e-12)
    assert missed.max() < 1e-9
    assert_allclose(np.sum(wanted.rows * found, axis=1), wanted.values, atol=1e-9)


def test_the_inverse_steers_wheels_where_they_shall_roll() -> None:
    group, rng = LegGroup(rb.load_robot("wheel_leg_hexapod")), np.random.default_rng(6)
    q = group.posture("insect")
    frames = group.frames(q)
    heading = group.headings(frames) + rng.uniform(-0.3, 0.3, 6)
    hold = Hold(rows=np.zeros(group.shape), values=heading, heading=np.ones(6, dtype=bool), near=q)
    target = frames[:, -1, :3, 3] + rng.uniform(-0.01, 0.01, (6, 3))
    _, frames, missed = group.inverse(target, hold, iterations=50, tolerance=1e-12)
    assert missed.max() < 1e-9
    assert_allclose(np.cos(group.headings(frames) - heading), 1.0, atol=1e-12)


def test_the_least_motion_has_no_part_that_moves_no_foot() -> None:
    group, rng = LegGroup(rb.load_robot("wheel_leg_hexapod")), np.random.default_rng(7)
    q = group.posture("insect")
    hold = group.hold(Posture(name="insect", hold="least"), q)
    frames = group.frames(q)
    target = frames[:, -1, :3, 3] + rng.uniform(-1e-4, 1e-4, (6, 3))
    found, _, missed = group.inverse(target, hold, iterations=50, tolerance=1e-12)
    assert missed.max() < 1e-9
    for jacobian, step in zip(group.jacobian(frames)[:, 3:], found - q, strict=True):
        idle = np.linalg.svd(jacobian)[2][3]
        # 1e-3: the first step leaves out what moves no foot at its start; it turns on the way.
        assert abs(idle @ step) < 1e-3 * np.linalg.norm(step)


@every
def test_the_ways_wheels_roll_are_those_of_leg_kinematics(make) -> None:
    """Positive speeds turn a wheel about its axle: its upper side goes ahead."""
    group = LegGroup(rb.load_robot(make()))
    frames = group.frames(group.posture(group.robot.standing[0].name))
    heading = group.headings(frames)
    axle = frames[:, -1, :3, 2]
    top = np.cross(axle, [0.0, 0.0, 1.0])
    assert_allclose(
        top[:, :2] / np.linalg.norm(top, axis=1, keepdims=True),
        np.column_stack([np.cos(heading), np.sin(heading)]),
        atol=1e-12,
    )


def energy(group: LegGroup, q, up) -> float:
    """Potential energy of the robot, from its centre of mass [J]."""
    return group.robot.mass * GRAVITY * float(group.center_of_mass(group.frames(q)) @ up)


@every
def test_gravity_efforts_are_the_gradient_of_the_energy(make) -> None:
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(8)
    q, up = shaken(group, rng), up_of(rng)
    efforts = group.gravity_efforts(group.frames(q), up)
    assert not efforts[~group.present].any()
    for leg, joint in joints_of(group):
        ahead, behind = (energy(group, each, up) for each in nudged(q, leg, joint))
        # 1e-7 N m: rounding of energies of 300 J over 2e-6 rad; torques are of some N m.
        assert efforts[leg, joint] == pytest.approx((ahead - behind) / 2e-6, abs=1e-7)


@every
def test_gravity_efforts_are_those_of_drake(make) -> None:
    robot = rb.load_robot(make())
    group, rng = LegGroup(robot), np.random.default_rng(9)
    plant = MultibodyPlant(0.002)
    model = rb.add_robot(plant, robot)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for _ in range(3):
        q, turn = shaken(group, rng), Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix()
        plant.SetFreeBodyPose(context, model.body, RigidTransform(RotationMatrix(turn), [0.0, 0.0, 1.0]))
        for leg, own in zip(robot.legs, q, strict=True):
            for joint, angle in zip(model.leg_joints(leg), own, strict=False):
                joint.set_angle(context, angle)
        expected = -plant.CalcGravityGeneralizedForces(context)
        efforts = group.gravity_efforts(group.frames(q), turn[2])
        for leg, own in zip(robot.legs, efforts, strict=True):
            rows = [joint.velocity_start() for joint in model.leg_joints(leg)]
            # 1e-9: SDF carries twelve digits.
            assert_allclose(own[: len(rows)], expected[rows], atol=1e-9)


@every
def test_contact_efforts_do_the_work_of_the_forces(make) -> None:
    """Torques that press with -f on the ground: their power is that of -f at the ball's lowest material point."""
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(10)
    q, up = shaken(group, rng), up_of(rng)
    frames = group.frames(q)
    forces = rng.uniform(-50, 50, (len(q), 3))
    joints, wheels = group.contact_efforts(frames, forces, up)
    contact = frames[:, -1, :3, 3] - group.wheel_radius[:, np.newaxis] * up
    for leg, joint in joints_of(group):

        def moved(each, leg=leg):
            """Where the point of the wheel goes that is the lowest one now."""
            frame = group.frames(each)[leg, -1]
            own = frames[leg, -1, :3, :3].T @ (contact[leg] - frames[leg, -1, :3, 3])
            return frame[:3, :3] @ own + frame[:3, 3]

        ahead, behind = (moved(each) for each in nudged(q, leg, joint))
        # 1e-7 N m: rounding of 1e-16 m over 2e-6 rad, times 50 N.
        assert joints[leg, joint] == pytest.approx(-forces[leg] @ (ahead - behind) / 2e-6, abs=1e-7)
    rolling = np.cross(frames[:, -1, :3, 2], contact - frames[:, -1, :3, 3])
    assert_allclose(wheels, -np.sum(forces * rolling, axis=1), atol=1e-12)
    assert not joints[~group.present].any()


@every
@pytest.mark.parametrize("flying", [(), (0,), (1, 2)])
def test_the_shared_load_bears_the_robot(make, flying) -> None:
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(11)
    frames = group.frames(group.posture(group.robot.standing[0].name))
    load = rng.uniform(0.2, 1.0, len(frames))
    # Two feet bear no moment about the line between them.
    flying = list(flying[: len(load) - 3])
    load[flying] = 0.0
    pull = GRAVITY * up_of(rng)
    forces = group.shared_load(frames, load, pull)
    weight = group.robot.mass * GRAVITY
    arms = frames[:, -1, :3, 3] - group.center_of_mass(frames)
    # 1e-5: a slight regularisation keeps two feet from infinite forces.
    assert_allclose(forces.sum(axis=0), group.robot.mass * pull, atol=1e-5 * weight)
    assert_allclose(np.cross(arms, forces).sum(axis=0), 0.0, atol=1e-5 * weight)
    assert not forces[flying].any()


@every
def test_the_centre_of_mass_is_that_of_the_description(make) -> None:
    robot = rb.load_robot(make())
    group = LegGroup(robot)
    frames = group.frames(group.posture(robot.standing[0].name))
    assert_allclose(group.center_of_mass(frames), robot.inertia.com, atol=1e-12)


@every
def test_rolling_wheels_rest_on_the_ground_along_their_way(make) -> None:
    group, rng = LegGroup(rb.load_robot(make())), np.random.default_rng(12)
    frames = group.frames(group.posture(group.robot.standing[0].name) + rng.uniform(-0.2, 0.2, group.shape))
    up = up_of(rng)
    spin, velocity = rng.uniform(-1, 1, (2, len(frames), 3))
    velocity -= np.outer(velocity @ up, up)
    speed, across = group.rolling(frames, spin, velocity, up)
    axle = frames[:, -1, :3, 2]
    arm = -group.wheel_radius[:, np.newaxis] * up
    turning = spin + speed[:, np.newaxis] * axle

    driven = np.array([leg.wheel.driven for leg in group.robot.legs])
    ahead = np.cross(axle, up) / np.linalg.norm(np.cross(axle, up), axis=1, keepdims=True)
    lowest = velocity + np.cross(turning, arm)
    assert_allclose(np.sum(lowest * ahead, axis=1)[driven], 0.0, atol=1e-12)
    assert not speed[~driven].any()
    # A centre that moves where its wheel rolls, and else as `rolling` says, leaves the lowest point at rest altogether.
    following = across + driven[:, np.newaxis] * ahead * np.sum(velocity * ahead, axis=1, keepdims=True)
    assert_allclose(following + np.cross(turning, arm), 0.0, atol=1e-12)
    assert_allclose(across @ up, 0.0, atol=1e-12)


def test_wheels_are_no_legs() -> None:
    with pytest.raises(rb.KinematicsError, match="test_cart has no legs; accepted: a robot with legs"):
        LegGroup(rb.load_robot(robots.cart()))
