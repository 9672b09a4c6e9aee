"""Laws and published numbers of the wheels' kinematics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wpimath.geometry import Translation2d
from wpimath.kinematics import (
    ChassisSpeeds,
    DifferentialDriveKinematics,
    MecanumDriveKinematics,
    SwerveDrive4Kinematics,
)

import robots
import rollerbench as rb
from rollerbench.kinematics import finite_roller_factor

lengths = st.floats(0.15, 2.0)
speeds = st.floats(-5.0, 5.0)
twists = st.tuples(speeds, speeds, speeds)

MECANUM, KIWI, CART = (rb.WheelKinematics(make()) for make in (robots.mecanum, robots.kiwi, robots.cart))
MIXED, SWERVE = rb.WheelKinematics(robots.mixed()), rb.WheelKinematics(robots.swerve())


@pytest.mark.parametrize(
    ("v_xyw_B", "printed"),
    [
        # Huai and Jin (2022), Table 1, in their axes: X right, Y forward; wheels front left, rear left, rear right,
        # front right. The second column is as printed.
        ((1, 0, 0), (2.5, -2.5, 2.5, -2.5)),
        ((-1, 0, 0), (-2.5, 2.5, -2.5, 2.5)),
        ((0, 1, 0), (2.5, 2.5, 2.5, 2.5)),
        ((0, -1, 0), (-2.5, -2.5, -2.5, -2.5)),
        ((1, 1, 0), (5, 0, 5, 0)),
        ((1, -1, 0), (0, -5, 0, -5)),
        ((-1, 1, 0), (0, 5, 0, 5)),
        ((-1, -1, 0), (-5, 0, -5, 0)),
        ((0, 0, 1), (-3.5, -3.5, 3.5, 3.5)),
        ((0, 0, -1), (3.5, 3.5, -3.5, -3.5)),
    ],
)
def test_table_1_of_huai_and_jin(v_xyw_B: tuple[int, int, int], printed: tuple[float, ...]) -> None:
    kinematics = rb.WheelKinematics("mecanum_platform")
    right, forward, turn = v_xyw_B
    wheel_speeds = kinematics.inverse([forward, -right, turn])
    by_name = dict(zip(kinematics.robot.wheel_names, wheel_speeds, strict=True))
    order = ("front_left", "rear_left", "rear_right", "front_right")
    # 1e-15: (0.7 + 0.7) / 0.4 is 3.5 but for its last bit.
    assert [by_name[name] for name in order] == pytest.approx(printed, rel=0, abs=1e-15)
    assert by_name["front_left"] + by_name["front_right"] == pytest.approx(by_name["rear_left"] + by_name["rear_right"])


@pytest.mark.parametrize(
    ("wheel_speeds", "pose"),
    [
        ((10, 10, 10, 10), (0.475, 0, 0)),
        ((-10, 10, -10, 10), (0, 0.475, 0)),
        ((-10, 10, 10, -10), (0, 0, 0.475 / 0.385)),
    ],
)
def test_youbot_steps_of_modern_robotics(wheel_speeds: tuple[int, ...], pose: tuple[float, ...]) -> None:
    """Lynch and Park (2017), section 13.4: 1 s each; their order is front left, front right, rear right, rear left."""
    kinematics = rb.WheelKinematics("youbot_base")
    by_name = dict(zip(("front_left", "front_right", "rear_right", "rear_left"), wheel_speeds, strict=True))
    v_xyw_B = kinematics.forward([by_name[name] for name in kinematics.robot.wheel_names])
    assert rb.odometry.integrate([0, 0, 0], v_xyw_B, 1.0) == pytest.approx(pose, abs=1e-14)


@given(lengths, lengths, twists)
def test_mecanum_equals_wpilib(base: float, track: float, twist: tuple[float, float, float]) -> None:
    corners = [Translation2d(x * base, y * track) for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    oracle = MecanumDriveKinematics(*corners).toWheelSpeeds(ChassisSpeeds(*twist))
    expected = np.array([oracle.frontLeft, oracle.frontRight, oracle.rearLeft, oracle.rearRight])
    ours = 0.05 * rb.WheelKinematics(robots.mecanum(base, track)).inverse(twist)
    assert ours == pytest.approx(expected, abs=1e-12)


@given(speeds, speeds)
def test_differential_drive_equals_wpilib(forward: float, turn: float) -> None:
    oracle = DifferentialDriveKinematics(0.4).toWheelSpeeds(ChassisSpeeds(forward, 0, turn))
    ours = 0.1 * CART.inverse([forward, 0, turn])
    assert ours == pytest.approx([oracle.left, oracle.right], abs=1e-12)


@given(lengths, lengths, twists)
def test_swerve_equals_wpilib(base: float, track: float, twist: tuple[float, float, float]) -> None:
    corners = [Translation2d(x * base, y * track) for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    states = SwerveDrive4Kinematics(*corners).toSwerveModuleStates(ChassisSpeeds(*twist))
    angles, wheel_speeds = rb.WheelKinematics(robots.swerve(base, track)).steering(twist)
    # As vectors: the angle of a wheel at rest is free.
    expected = np.array([[s.speed * s.angle.cos(), s.speed * s.angle.sin()] for s in states])
    ours = 0.1 * wheel_speeds[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    # WPILib gives speeds below 1e-6 m/s no direction.
    clear = [abs(s.speed) > 2e-6 for s in states]
    assert ours[clear] == pytest.approx(expected[clear], abs=1e-12)
    assert np.hypot(*ours.T) == pytest.approx([abs(s.speed) for s in states], abs=1e-12)


@given(twists)
def test_forward_undoes_inverse(twist: tuple[float, float, float]) -> None:
    for kinematics in (MECANUM, KIWI):
        wheel_speeds = kinematics.inverse(twist)
        assert kinematics.forward(wheel_speeds) == pytest.approx(twist, abs=1e-12)
        assert kinematics.residual(wheel_speeds) == pytest.approx(0, abs=1e-10)


@given(twists, twists)
def test_every_wheel_obeys_its_own_contact(twist: tuple[float, float, float], place: tuple[float, ...]) -> None:
    """The velocity of the wheel's centre is rolling along t plus the roller's rolling across its axis."""
    kinematics = MIXED.at(place[:2])
    robot = kinematics.robot
    wheel_speeds = kinematics.inverse(twist, strict=False)
    rollers = kinematics.roller_matrix @ twist
    vx, vy, w = twist
    for wheel in robot.wheels:
        x, y = wheel.p_BoHo_B[:2] - np.array(place[:2])
        velocity = np.array([vx - w * y, vy + w * x])
        t = np.array([math.cos(wheel.heading), math.sin(wheel.heading)])
        n = np.array([-t[1], t[0]])
        if wheel.name == "m":
            g = math.radians(45 - 90)
            across = -math.sin(g) * t + math.cos(g) * n
            moved = wheel.radius * wheel_speeds[0] * t + rollers[0] * across
            assert moved == pytest.approx(velocity, abs=1e-12)
        elif wheel.driven:
            index = [driven.name for driven in robot.driven_wheels].index(wheel.name)
            assert wheel.radius * wheel_speeds[index] == pytest.approx(velocity @ t, abs=1e-12)
    trailing = next(wheel for wheel in robot.wheels if wheel.name == "c")
    x, y = trailing.p_BoHo_B[:2] - np.array(place[:2])
    swivel = (vy + w * x) / 0.03 - w
    assert kinematics.castor_rates(twist) == pytest.approx([swivel], abs=1e-9)  # divided by a trail of 0.03 m


@given(twists, st.tuples(speeds, speeds))
def test_another_reference_point_is_the_same_motion(twist: tuple[float, ...], point: tuple[float, float]) -> None:
    kinematics = MECANUM
    vx, vy, w = twist
    moved = [vx - w * point[1], vy + w * point[0], w]
    assert kinematics.at(point).inverse(moved) == pytest.approx(kinematics.inverse(twist), abs=1e-9)


def test_functions_broadcast() -> None:
    kinematics = rb.WheelKinematics("youbot_base")
    twist = np.random.default_rng(0).normal(size=(2, 5, 3))
    wheel_speeds = kinematics.inverse(twist)
    assert wheel_speeds.shape == (2, 5, 4)
    assert wheel_speeds[1, 3] == pytest.approx(kinematics.inverse(twist[1, 3]), abs=1e-14)
    assert kinematics.forward(wheel_speeds).shape == (2, 5, 3)
    assert kinematics.icr(twist).shape == (2, 5, 2)
    assert rb.WheelKinematics(robots.swerve()).steering(twist)[0].shape == (2, 5, 4)


def test_a_skidding_tyre_is_named() -> None:
    kinematics = rb.WheelKinematics(robots.cart())
    with pytest.raises(rb.InfeasibleTwist, match=r"left at \+0.3 m/s, right at \+0.3 m/s") as caught:
        kinematics.inverse([[1.0, 0.0, 0.0], [0.5, 0.3, 0.2]])
    assert caught.value.wheel_names == ("left", "right")
    assert kinematics.inverse([0.5, 0.3, 0.2], strict=False) == pytest.approx(kinematics.inverse([0.5, 0, 0.2]))
    assert kinematics.project([0.5, 0.3, 0.2]) == pytest.approx([0.5, 0, 0.2], abs=1e-15)


def test_mobility_of_the_classes() -> None:
    """Campion, Bastin, d'Andrea-Novel (1996), table 1."""
    one_steered = robots.cart()
    one_steered["wheels"][2] = {**one_steered["wheels"][2], "type": "steered", "driven": True}
    del one_steered["wheels"][2]["trail"]
    expected = {
        (3, 0): [robots.mecanum(), robots.kiwi()],
        (2, 0): [robots.cart()],
        (1, 1): [one_steered],
        (1, 2): [robots.swerve()],
    }
    for degrees, makers in expected.items():
        for data in makers:
            mobility = rb.WheelKinematics(data).mobility()
            assert (mobility.degree_of_mobility, mobility.degree_of_steerability) == degrees
            assert mobility.degree_of_manoeuvrability == sum(degrees)


def test_centre_of_rotation() -> None:
    kinematics = rb.WheelKinematics("youbot_base")
    assert kinematics.icr([0.5, 0.0, 0.25]) == pytest.approx([0.0, 2.0])
    assert kinematics.icr([1.0, 0.0, 0.0]) == pytest.approx([0.0, np.inf])
    assert kinematics.icr([0.0, -1.0, 0.0]) == pytest.approx([np.inf, 0.0])
    assert np.isnan(kinematics.icr([0.0, 0.0, 0.0])).all()


def test_condition_number() -> None:
    """Three omni wheels at 120 deg are isotropic for speeds; with the right length for yaw rates too."""
    kinematics = rb.WheelKinematics(robots.kiwi(distance=0.2))
    # J^T J = diag(3/2, 3/2, 3 d^2)/R^2, so the length d/sqrt(1/2) makes all three equal.
    assert kinematics.condition_number(characteristic_length=0.2 * math.sqrt(2)) == pytest.approx(1.0, abs=1e-12)
    assert kinematics.condition_number() == pytest.approx(math.sqrt(2), abs=1e-12)
    assert rb.WheelKinematics(robots.cart()).condition_number() < math.inf


def test_an_undetermined_twist_is_said() -> None:
    data = robots.kiwi()
    data["wheels"][0]["driven"] = False
    with pytest.raises(rb.KinematicsError, match="do not determine the twist"):
        rb.WheelKinematics(data).forward([1.0, 1.0])


@given(twists, st.lists(st.floats(-10, 10), min_size=4, max_size=4))
def test_a_steered_wheel_takes_the_shorter_turn(twist: tuple[float, ...], previous: list[float]) -> None:
    kinematics = SWERVE
    angles, wheel_speeds = kinematics.steering(twist, previous)
    assert (np.abs(angles - previous) <= 0.5 * np.pi + 1e-12).all()
    free_angles, free_speeds = kinematics.steering(twist)
    assert wheel_speeds * np.cos(angles) == pytest.approx(free_speeds * np.cos(free_angles), abs=1e-10)
    assert wheel_speeds * np.sin(angles) == pytest.approx(free_speeds * np.sin(free_angles), abs=1e-10)
    at_rest, _ = kinematics.steering([0.0, 0.0, 0.0], previous)
    assert at_rest == pytest.approx(previous, abs=0)


@pytest.mark.parametrize("count", [8, 12, 16])
def test_finite_rollers_are_the_mean_over_a_pitch(count: int) -> None:
    """Lateral speed at constant wheel speed is R q' tan(gamma) cos(theta); the mean over the pitch is the factor."""
    theta = (np.arange(2000) + 0.5) / 2000 * 2 * np.pi / count - np.pi / count
    assert finite_roller_factor(count) == pytest.approx(np.cos(theta).mean(), abs=1e-7)  # midpoint rule
    data = robots.mecanum(count=count, radius=0.005)
    textbook, finite = rb.WheelKinematics(data), rb.WheelKinematics(data, rollers="finite")
    wheel_speeds = textbook.inverse([0.0, 1.0, 0.0])
    assert finite.forward(wheel_speeds) == pytest.approx([0, finite_roller_factor(count), 0], abs=1e-12)
    assert finite.inverse([1.0, 0.0, 0.0]) == pytest.approx(textbook.inverse([1.0, 0.0, 0.0]))
    assert rb.WheelKinematics(robots.kiwi(), rollers="finite").drive_matrix == pytest.approx(
        rb.WheelKinematics(robots.kiwi()).drive_matrix
    )


@pytest.mark.parametrize("bad", [[1.0, 2.0], [np.nan, 0, 0], 3.0])
def test_bad_twists_are_refused(bad: object) -> None:
    with pytest.raises(rb.KinematicsError, match="v_xyw_B"):
        rb.WheelKinematics("youbot_base").inverse(bad)
