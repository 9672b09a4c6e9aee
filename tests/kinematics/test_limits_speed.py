"""Laws and published numbers of the largest speeds."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robots
import rollerbench as rb

angles = st.floats(-7.0, 7.0)
MAX_SPEEDS = (12.0, 9.0, 15.0, 11.0, 10.0)


def limited(data: dict[str, Any]) -> rb.Robot:
    """The robot with unequal largest speeds of its driven wheels."""
    wheels = [
        {**wheel, "max_speed": speed} if wheel.get("driven", wheel["type"] != "castor") else wheel
        for wheel, speed in zip(data["wheels"], MAX_SPEEDS, strict=False)
    ]
    return rb.load_robot({**data, "wheels": wheels})


MECANUM, KIWI, CART, SWERVE, MIXED = (
    limited(make()) for make in (robots.mecanum, robots.kiwi, robots.cart, robots.swerve, robots.mixed)
)


def allowed(robot: rb.Robot, twists: np.ndarray, slack: float = 1e-9) -> np.ndarray:
    """Whether (...) no driven wheel of a base without steering exceeds its limit at the twists (..., 3)."""
    kinematics = rb.WheelKinematics(robot)
    largest = np.array([wheel.max_speed for wheel in robot.driven_wheels])
    speeds = kinematics.inverse(twists, strict=False)
    skids = np.abs(kinematics.skid_speeds(twists)).max(axis=-1, initial=0.0)
    return (np.abs(speeds) <= largest + slack).all(axis=-1) & (skids <= slack)


def omni(delta: float, distance: float = 0.4) -> rb.Robot:
    robot = rb.load_robot("omni_platform")
    azimuths = (delta / 2, 180 - delta / 2, 180 + delta / 2, -delta / 2)
    wheels = tuple(
        wheel.model_copy(update={"azimuth_deg": azimuth, "distance": distance})
        for wheel, azimuth in zip(robot.wheels, azimuths, strict=True)
    )
    return robot.model_copy(update={"wheels": wheels})


@pytest.mark.parametrize(("delta", "x", "y"), [(90, 2**0.5, 2**0.5), (60, 2, 2 / 3**0.5), (30, 3.8637033, 1.0352762)])
def test_figure_4_of_leng_and_cao(delta: float, x: float, y: float) -> None:
    """Rhombi tangent to the unit circle; (3.864, 1.035) are 1 / sin 15 deg and 1 / cos 15 deg."""
    x, y = (1 / math.sin(math.radians(15)), 1 / math.cos(math.radians(15))) if delta == 30 else (x, y)
    robot = omni(delta)
    polygon = rb.limits.speed_polygon(robot)
    corners = polygon.vertices / (0.09 * 20.0)
    expected = [(x, 0), (0, y), (-x, 0), (0, -y)]
    for corner in expected:
        assert np.linalg.norm(corners - corner, axis=1).min() < 1e-12
    assert len(corners) == 4
    assert polygon.exact
    direction = np.radians(np.arange(0, 360, 10))
    gamma = np.radians(delta / 2)
    closed = 1 / np.maximum(np.abs(np.sin(direction - gamma)), np.abs(np.sin(direction + gamma)))
    assert rb.limits.max_speed(robot, direction).value / 1.8 == pytest.approx(closed, rel=1e-12)


def test_the_limiting_wheels_are_named() -> None:
    limit = rb.limits.max_speed(omni(60), np.radians([20.0, -20.0]))
    # Wheels at azimuths 150 and 330 roll at 240 and 60 deg: the closest to 20 deg.
    assert limit.wheels(0) == ("rear_left", "front_right")
    assert limit.wheels(1) == ("front_left", "rear_right")
    assert (limit.cause == "speed").all()
    edges = rb.limits.speed_polygon(omni(60)).edge_wheels
    assert {frozenset(names) for names in edges} == {frozenset(limit.wheels(i)) for i in range(2)}


@given(angles, st.floats(0.1, 10.0))
def test_speeds_scale_with_the_limits(direction: float, factor: float) -> None:
    for robot in (MECANUM, KIWI, SWERVE):
        wheels = tuple(wheel.model_copy(update={"max_speed": factor * wheel.max_speed}) for wheel in robot.wheels)
        faster = robot.model_copy(update={"wheels": wheels})
        assert rb.limits.max_speed(faster, direction).value == pytest.approx(
            factor * rb.limits.max_speed(robot, direction).value, rel=1e-12
        )


@given(st.floats(-3.0, 3.0), st.integers(0, 2**32 - 1))
def test_the_polygon_holds_exactly_the_allowed_twists(yaw_rate: float, seed: int) -> None:
    for robot in (MECANUM, KIWI):
        if abs(yaw_rate) > rb.limits.max_yaw_rate(robot).value * 0.99:
            continue
        polygon = rb.limits.speed_polygon(robot, yaw_rate)
        first, second = polygon.vertices, np.roll(polygon.vertices, -1, axis=0)
        normal = np.stack([(second - first)[:, 1], -(second - first)[:, 0]], axis=-1)
        assert (normal[:, 0] * (np.roll(second, -1, axis=0) - first)[:, 0]
                + normal[:, 1] * (np.roll(second, -1, axis=0) - first)[:, 1] <= 0).all()  # fmt: skip
        points = np.random.default_rng(seed).uniform(-1.5, 1.5, (200, 2))
        depth = np.max(np.einsum("ij,kij->ki", normal, points[:, np.newaxis] - first), axis=1)
        twists = np.column_stack([points, np.full(200, yaw_rate)])
        clear = np.abs(depth) > 1e-9
        assert (allowed(robot, twists) == (depth <= 0))[clear].all()
        corners = np.column_stack([first, np.full(len(first), yaw_rate)])
        assert allowed(robot, corners).all()


@given(angles, st.floats(-3.0, 3.0))
def test_the_largest_speed_is_allowed_and_no_larger_one(direction: float, turn: float) -> None:
    for robot in (MECANUM, KIWI):
        for name in ("yaw_rate", "curvature"):
            limit = rb.limits.max_speed(robot, direction, **{name: turn})
            if not limit.feasible:
                assert name == "yaw_rate"
                assert limit.cause == "speed"
                continue
            speed = float(limit)
            for factor, expected in ((1.0, True), (1.0001, False)):
                s = factor * speed
                twist = [s * math.cos(direction), s * math.sin(direction), turn if name == "yaw_rate" else turn * s]
                assert allowed(robot, np.array(twist), 1e-8) == expected


@given(angles)
def test_the_polygon_and_the_speeds_agree(direction: float) -> None:
    for robot, tolerance in ((MECANUM, 1e-10), (SWERVE, 2e-5)):
        vertices = rb.limits.speed_polygon(robot).vertices
        speed = float(rb.limits.max_speed(robot, direction))
        point = speed * np.array([math.cos(direction), math.sin(direction)])
        edges = np.roll(vertices, -1, axis=0) - vertices
        normal = np.stack([edges[:, 1], -edges[:, 0]], axis=-1) / np.linalg.norm(edges, axis=1)[:, np.newaxis]
        depth = np.max(np.sum(normal * (point - vertices), axis=1))
        assert abs(depth) <= tolerance * speed


@given(angles, st.floats(-2.0, 2.0))
def test_a_steered_base_turned_by_its_yaw_rate(direction: float, yaw_rate: float) -> None:
    """At the largest speed the fastest steered wheel, told by its kinematics, runs at its limit."""
    speed = float(rb.limits.max_speed(SWERVE, direction, yaw_rate=yaw_rate))
    twist = [speed * math.cos(direction), speed * math.sin(direction), yaw_rate]
    _, speeds = rb.WheelKinematics(SWERVE).steering(twist)
    assert np.max(np.abs(speeds) / MAX_SPEEDS[:4]) == pytest.approx(1.0, rel=1e-9)
    inside = rb.limits.speed_polygon(SWERVE, yaw_rate).vertices
    _, speeds = rb.WheelKinematics(SWERVE).steering(np.column_stack([inside, np.full(len(inside), yaw_rate)]))
    # Corners lie on the limit or, where two circles cross, up to a chord's height inside.
    share = np.max(np.abs(speeds) / MAX_SPEEDS[:4], axis=1)
    assert (share <= 1 + 1e-9).all()
    assert (share >= 1 - 2e-4).all()


def test_a_cart_has_a_segment() -> None:
    polygon = rb.limits.speed_polygon(CART)
    assert polygon.dimension == 1
    assert sorted(polygon.vertices[:, 0]) == pytest.approx([-0.9, 0.9], abs=1e-12)
    assert polygon.vertices[:, 1] == pytest.approx([0, 0], abs=1e-12)
    assert polygon.edge_wheels == (("right",), ("right",))
    turning = rb.limits.speed_polygon(CART, 1.0)
    # The left wheel drives at vx - 0.2, the right one at vx + 0.2.
    assert sorted(turning.vertices[:, 0]) == pytest.approx([-1.0, 0.7], abs=1e-12)
    limit = rb.limits.max_speed(CART, np.radians([0, 90, 180]))
    assert limit.value == pytest.approx([0.9, np.nan, 0.9], nan_ok=True)
    assert limit.cause.tolist() == ["speed", "tyres", "speed"]
    assert limit.wheels(0) == ("right",)
    assert limit.wheels(1) == ("left", "right")
    with pytest.raises(rb.KinematicsError, match=r"tyres would skid sideways \(left, right\)"):
        float(rb.limits.max_speed(CART, math.pi / 2))


def test_centres_of_rotation() -> None:
    """A cart turns about points of its axle alone; about a wheel, the other one is twice as far."""
    limit = rb.limits.max_yaw_rate(CART, [[0.0, 0.0], [0.0, -0.2], [0.1, 0.3]])
    assert limit.value == pytest.approx([0.9 / 0.2, 1.2 / 0.4, np.nan], nan_ok=True)
    assert limit.cause.tolist() == ["speed", "speed", "tyres"]
    # The centre lies 1/curvature to the left of the travel.
    about = rb.limits.max_yaw_rate(KIWI, [0.0, 0.5])
    along = rb.limits.max_speed(KIWI, 0.0, curvature=2.0)
    assert float(along) == pytest.approx(0.5 * float(about))


def test_a_tyre_off_the_axle_allows_one_speed() -> None:
    """A fixed tyre 0.3 m ahead of Bo moves straight on only if its sideways speed vanishes: s sin(b) + 0.3 w = 0."""
    data = robots.kiwi()
    tyre = {**robots.TYRE, "name": "tyre", "radius": 0.06, "width": 0.02, "position": [0.3, 0.0], "driven": False}
    robot = limited({**data, "wheels": [*data["wheels"], tyre]})
    limit = rb.limits.max_speed(robot, [0.5, -0.5, 0.0], yaw_rate=-0.4)
    assert limit.value == pytest.approx([0.12 / math.sin(0.5), np.nan, np.nan], nan_ok=True)
    assert limit.cause.tolist() == ["tyres", "tyres", "tyres"]
    assert limit.wheels(0) == limit.wheels(2) == ("tyre",)


def test_what_no_wheel_limits_is_said() -> None:
    free = rb.load_robot(robots.kiwi())
    limit = rb.limits.max_speed(free, [0.0, 1.0])
    assert np.isnan(limit.value).all()
    assert (limit.cause == "unlimited").all()
    with pytest.raises(rb.KinematicsError, match="no wheel limits its speed"):
        rb.limits.speed_polygon(free)
    with pytest.raises(rb.KinematicsError, match="no wheel that turns has a max_speed"):
        float(rb.limits.max_yaw_rate(free))
    one = robots.kiwi()
    one["wheels"][0]["max_speed"] = 10.0
    # Its front wheel rolls along y alone.
    limit = rb.limits.max_speed(one, [0.0, math.pi / 2])
    assert limit.cause.tolist() == ["unlimited", "speed"]
    assert limit.value[1] == pytest.approx(0.6)
    assert rb.limits.isotropy(one).speed_ratio is None


def test_a_yaw_rate_beyond_the_wheels_is_said() -> None:
    fastest = float(rb.limits.max_yaw_rate(KIWI))
    with pytest.raises(rb.KinematicsError, match="a wheel would exceed its max_speed"):
        rb.limits.speed_polygon(KIWI, 2 * fastest)
    limit = rb.limits.max_speed(KIWI, 0.0, yaw_rate=2 * fastest)
    assert np.isnan(limit.value)
    assert limit.cause == "speed"
    turned = robots.kiwi()
    tyre = {**robots.TYRE, "radius": 0.06}
    tyres = [{**tyre, "name": name, "position": [x, 0.0]} for name, x in (("first", -0.45), ("second", 0.45))]
    stuck = limited({**turned, "wheels": tyres + turned["wheels"]})
    with pytest.raises(rb.KinematicsError, match=r"its tyres \(first, second\) would skid"):
        rb.limits.speed_polygon(stuck, 1.0)


def test_isotropy() -> None:
    even = rb.limits.isotropy(omni(90))
    assert even.speed_ratio == pytest.approx(2**0.5, rel=1e-12)
    uneven = rb.limits.isotropy(omni(30))
    # The rhombus' corner over its circle.
    assert uneven.speed_ratio == pytest.approx(1 / math.sin(math.radians(15)), rel=1e-12)
    assert uneven.condition_number > even.condition_number
    kiwi = rb.limits.isotropy(robots.kiwi(distance=0.2))
    # J^T J = diag(3/2, 3/2, 3) / R^2 with yaw rates by the distance.
    assert kiwi.manipulability == pytest.approx(0.06**3 / math.sqrt(1.5 * 1.5 * 3), rel=1e-12)
    assert kiwi.condition_number == pytest.approx(math.sqrt(2), rel=1e-12)
    assert rb.limits.isotropy(CART).speed_ratio == math.inf


def test_results_are_arrays_for_numpy() -> None:
    limit = rb.limits.max_speed(KIWI, np.zeros((2, 3)))
    assert np.asarray(limit).shape == limit.cause.shape == (2, 3)
    assert limit.at_limit.shape == (2, 3, 3)
    assert rb.limits.max_speed(KIWI, np.zeros((0,))).value.shape == (0,)
    with pytest.raises(rb.KinematicsError, match=r"shape \(2, 3\)"):
        float(limit)


@pytest.mark.parametrize("bad", [np.nan, [0.0, np.inf], "north"])
def test_bad_directions_are_refused(bad: Any) -> None:
    with pytest.raises(rb.KinematicsError, match="direction"):
        rb.limits.max_speed(KIWI, bad)


def test_bad_turns_are_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="accepted: one of them"):
        rb.limits.max_speed(KIWI, 0.0, yaw_rate=1.0, curvature=1.0)
    with pytest.raises(rb.KinematicsError, match="yaw_rate"):
        rb.limits.speed_polygon(KIWI, np.nan)
    with pytest.raises(rb.KinematicsError, match="p_BoICR_B"):
        rb.limits.max_yaw_rate(KIWI, [1.0, 2.0, 3.0])
