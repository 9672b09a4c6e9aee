"""Laws and published numbers of the largest accelerations and of wheel efforts."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

import robots
import rollerbench as rb
from rollerbench.description.inertia import GRAVITY
from rollerbench.description.mass import axle_inertia, roller_inertia
from rollerbench.kinematics.limits.cone_program import Cones, maximize, slack
from rollerbench.studies.omni_anisotropy import paper_robot

angles = st.floats(-7.0, 7.0)
resistances = st.floats(0.0, 0.3)
EFFORTS = (3.0, 2.0, 4.0, 2.5, 3.5)
ROBOTS = {name: rb.load_robot(make()) for name, make in robots.ALL.items()}
PAPER = paper_robot(60.0)
EQUAL = [49.0] * 4


def weakened(data: dict[str, Any]) -> rb.Robot:
    """The robot with unequal friction and largest efforts."""
    wheels = [
        {**wheel, "friction": 0.5 + 0.1 * i, **({"max_effort": EFFORTS[i]} if wheel["type"] != "castor" else {})}
        for i, wheel in enumerate(data["wheels"])
    ]
    return rb.load_robot({**data, "wheels": wheels})


# Published numbers


def test_accelerations_of_leng_and_cao() -> None:
    """Section 3.3 with the parameters of section 3.4: weight 196 N, equal loads, adhesion along and across apart."""
    limit = rb.limits.max_acceleration(
        PAPER, np.radians([0, 30, 90]), roll_resistance=0.2, adhesion="independent", loads=EQUAL
    )
    assert limit.value == pytest.approx([3.20, 2.77, 7.51], abs=0.005)
    # By hand: wheels at +-30 deg push 49 N at 60 deg to the travel, and their rollers hold back 9.8 N at 30 deg to it.
    roller = 5.235e-7 / 0.0125**2 * 0.75
    assert limit.value[0] == pytest.approx(4 * (49 * 0.5 - 9.8 * 0.75**0.5) / (20 + 4 * roller), rel=1e-8)
    circle = rb.limits.max_acceleration(PAPER, np.radians([0, 30, 90]), roll_resistance=0.2, loads=EQUAL)
    assert 1 - circle.value / limit.value == pytest.approx([0.031, 0.031, 0.023], abs=0.001)
    assert (limit.cause == "adhesion").all()
    # Where the best sharing may undo it, weight transfer costs next to nothing; with equal sharing it costs much.
    best = rb.limits.max_acceleration(PAPER, np.radians([0, 30, 90]), roll_resistance=0.2)
    shared = rb.limits.max_acceleration(PAPER, np.radians([0, 30, 90]), roll_resistance=0.2, sharing="least_norm")
    assert best.value == pytest.approx(circle.value, rel=2e-3)
    assert (shared.value < 0.8 * best.value)[[0, 2]].all()


def test_efforts_of_leng_and_cao() -> None:
    efforts = rb.limits.wheel_efforts(PAPER, np.radians([45, -45]), 1.0, roll_resistance=0.2, loads=EQUAL)
    t13, t24 = np.abs(efforts[:, 0]), np.abs(efforts[:, 1])
    assert t13 == pytest.approx([0.904, 3.453], abs=5e-4)
    assert t24 == pytest.approx([3.453, 0.904], abs=5e-4)
    # Opposite wheels do the same.
    assert efforts[:, 2:] == pytest.approx(-efforts[:, :2], abs=1e-12)


def test_jumps_of_the_efforts_of_leng_and_cao() -> None:
    """At alpha = 30 deg wheels 1 and 3 change the sense in which they turn, at 60 deg the rollers of 2 and 4 do."""
    near = np.radians([30 - 1e-6, 30 + 1e-6, 60 - 1e-6, 60 + 1e-6])
    t13 = rb.limits.wheel_efforts(PAPER, near, 1.0, roll_resistance=0.2, loads=EQUAL)[:, 2]
    assert t13[0] - t13[1] == pytest.approx(2 * 9.8 * 0.09, abs=1e-6) == pytest.approx(1.764, abs=1e-6)
    assert t13[2] > 0 > t13[3]


@given(angles)
@settings(max_examples=20)
def test_symmetries_of_leng_and_cao(beta: float) -> None:
    for options in ({}, {"loads": EQUAL}):
        limit = rb.limits.max_acceleration(PAPER, [beta, -beta, math.pi - beta], roll_resistance=0.2, **options)
        assert limit.value[1:] == pytest.approx(limit.value[0], rel=1e-7)
        efforts = rb.limits.wheel_efforts(PAPER, [beta, -beta], 1.0, roll_resistance=0.2, **options)
        # Mirrored left to right, wheels 1 and 4, 2 and 3 change places and senses.
        assert efforts[1] == pytest.approx(-efforts[0, ::-1], abs=1e-9)


def test_the_paper_robot_has_the_printed_inertias() -> None:
    wheel = PAPER.wheels[0]
    assert PAPER.mass * 9.8 == pytest.approx(196.0)
    assert axle_inertia(wheel) == pytest.approx(3.669e-3, rel=1e-9)
    assert roller_inertia(wheel).moment[0, 0] == pytest.approx(5.235e-7, rel=1e-9)


# Laws


@given(angles, resistances)
@settings(max_examples=10)
def test_friction_bounds_the_acceleration(direction: float, resistance: float) -> None:
    """The ground's forces add up to mu m g at the most, in whichever way the wheels share the load."""
    for robot in ROBOTS.values():
        for sharing in ("best", "least_norm"):
            limit = rb.limits.max_acceleration(robot, direction, roll_resistance=resistance, sharing=sharing)
            assert not limit.feasible or 0 <= limit.value <= 0.8 * GRAVITY * (1 + 1e-7)
            independent = rb.limits.max_acceleration(
                robot, direction, roll_resistance=resistance, sharing=sharing, adhesion="independent"
            )
            if limit.feasible:
                assert limit.value <= independent.value * (1 + 1e-7) <= math.sqrt(2) * 0.8 * GRAVITY * (1 + 2e-7)


@given(angles)
@settings(max_examples=20)
def test_steered_bases_use_all_friction(direction: float) -> None:
    """All wheels drive and steer, so all the ground's friction may point ahead: a = mu g, however the load shifts."""
    limit = rb.limits.max_acceleration(ROBOTS["swerve"], direction)
    assert limit.value == pytest.approx(0.8 * GRAVITY, rel=1e-7)
    assert limit.at_limit.all()


@given(angles, st.floats(-3.0, 3.0))
@settings(max_examples=10)
def test_a_turned_robot_has_turned_limits(direction: float, turn: float) -> None:
    cos, sin = math.cos(turn), math.sin(turn)
    for make in (robots.mecanum, robots.kiwi):
        data = make()
        wheels = [
            {
                **wheel,
                "position": [cos * wheel["position"][0] - sin * wheel["position"][1],
                             sin * wheel["position"][0] + cos * wheel["position"][1]],
                "heading_deg": wheel.get("heading_deg", 0.0) + math.degrees(turn),
                "max_speed": 5.0,
            }
            for wheel in data["wheels"]
        ]  # fmt: skip
        straight = rb.load_robot({**data, "wheels": [{**wheel, "max_speed": 5.0} for wheel in data["wheels"]]})
        turned = rb.load_robot({**data, "wheels": wheels})
        for limit in (rb.limits.max_speed, rb.limits.max_acceleration):
            assert limit(turned, direction + turn).value == pytest.approx(limit(straight, direction).value, rel=1e-6)


@given(st.sampled_from(sorted(ROBOTS)), angles, st.floats(0.0, 3.0), resistances)
def test_efforts_make_the_acceleration(name: str, direction: float, acceleration: float, resistance: float) -> None:
    """Integrated equations of motion of the whole robot, written by kinetic energy and virtual power."""
    robot = ROBOTS[name]
    if rb.WheelKinematics(robot).mobility().degree_of_mobility < 3:
        direction = 0.0
    u = np.array([math.cos(direction), math.sin(direction)])
    efforts = rb.limits.wheel_efforts(robot, direction, acceleration, roll_resistance=resistance)
    loads = rb.limits.wheel_loads(robot, direction, acceleration)
    steered = {wheel.name: direction - wheel.heading for wheel in robot.steered_wheels}
    castors = {wheel.name: direction - wheel.heading for wheel in robot.wheels if wheel.swivels and not wheel.steered}
    rolling = rb.WheelKinematics(_all_driven(robot), swivel_angles={**steered, **castors})
    J, G, C = rolling.drive_matrix, rolling.roller_matrix, rolling.constraint_matrix[: _tyres(robot)]
    driven = np.array([wheel.driven for wheel in robot.wheels])
    radius = np.array([wheel.radius for wheel in robot.wheels])
    rings = [i for i, wheel in enumerate(robot.wheels) if wheel.ring]
    spin = np.array([axle_inertia(wheel) for wheel in robot.wheels])
    roller = [float(roller_inertia(robot.wheels[i]).moment[0, 0] / robot.wheels[i].rollers.radius ** 2) for i in rings]
    rest, com = robot.inertia, _mass_centre(robot, u)
    moved = np.array([[1, 0, -com[1]], [0, 1, com[0]], [0, 0, 1]])
    body = moved.T @ np.diag([rest.mass, rest.mass, rest.moment[2, 2]]) @ moved
    M = body + (J.T * spin) @ J + (G.T * roller) @ G
    sense = np.array([*u, 0.0])
    pull = np.zeros(len(driven))
    pull[driven] = efforts
    pull -= _sense(radius * (J @ sense)) * resistance * loads * radius
    force = J.T @ pull - G.T @ (_sense(G @ sense) * resistance * loads[rings])

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        twist = state[3:]
        # What spins is turned by its own axle, not by the body's yaw: it has no part in the body's swirl.
        momentum = body @ twist
        swirl = [-twist[2] * momentum[1], twist[2] * momentum[0], twist[0] * momentum[1] - twist[1] * momentum[0]]
        system = np.block([[M, C.T], [C, np.zeros((len(C), len(C)))]])
        change = np.linalg.lstsq(system, np.concatenate([force - swirl, np.zeros(len(C))]))[0][:3]
        cos, sin = math.cos(state[2]), math.sin(state[2])
        place = [cos * twist[0] - sin * twist[1], sin * twist[0] + cos * twist[1], twist[2]]
        return np.concatenate([place, change])

    end = solve_ivp(rate, (0.0, 0.5), np.zeros(6), rtol=1e-10, atol=1e-12).y[:, -1]
    assert end[:3] == pytest.approx([*(0.5 * acceleration * 0.5**2 * u), 0.0], abs=1e-8)


def _sense(speed: np.ndarray) -> np.ndarray:
    """Which way a wheel or roller rolls; those that stand still resist neither way."""
    return np.where(np.abs(speed) <= 1e-9, 0.0, np.sign(speed))


def _all_driven(robot: rb.Robot) -> rb.Robot:
    """Every wheel turns as its place moves, castors too: their rows are wanted here as well."""
    return robot.model_copy(
        update={"wheels": tuple(wheel.model_copy(update={"driven": True}) for wheel in robot.wheels)}
    )


def _tyres(robot: rb.Robot) -> int:
    return sum(wheel.ring is None and wheel.swivel_offset == 0 for wheel in robot.wheels)


def _mass_centre(robot: rb.Robot, u: np.ndarray) -> np.ndarray:
    """With castors trailing; a tenth of their mass is the fork, which stays."""
    shift = sum(
        (
            0.9 * wheel.mass * wheel.trail * (np.array([math.cos(wheel.heading), math.sin(wheel.heading)]) - u)
            for wheel in robot.wheels
            if isinstance(wheel, rb.CastorWheel)
        ),
        np.zeros(2),
    )
    return robot.inertia.com[:2] + shift / robot.mass


@given(st.sampled_from(sorted(ROBOTS)), angles, st.floats(0.0, 5.0))
def test_loads_are_in_equilibrium(name: str, direction: float, acceleration: float) -> None:
    """Loads carry the weight, and their moment about the mass centre undoes that of the push and of the wheels."""
    robot = ROBOTS[name]
    loads = rb.limits.wheel_loads(robot, direction, acceleration)
    assert loads.sum() == pytest.approx(robot.mass * GRAVITY)
    u = np.array([math.cos(direction), math.sin(direction)])
    trail = np.array([[wheel.swivel_offset] for wheel in robot.wheels])
    places = np.array([wheel.p_BoHo_B[:2] for wheel in robot.wheels]) - trail * u - _mass_centre(robot, u)
    height = robot.inertia.com[2] - robot.ground_height
    shift = loads @ places + robot.mass * height * acceleration * u
    # What is left spins up wheels and rollers: at most as if all of them turned about one axis.
    spin = sum(axle_inertia(w) * 4 * acceleration / w.radius for w in robot.wheels)
    assert np.linalg.norm(shift) <= spin + 1e-9
    rest = rb.limits.wheel_loads(robot, direction, 0.0)
    assert rest @ places == pytest.approx([0, 0], abs=1e-9)


def test_loads_of_three_wheels_by_hand() -> None:
    """A kiwi's front wheel, which stands still as it accelerates ahead, loses m h a / (3 d/2) and the wheels' share."""
    robot = ROBOTS["kiwi"]
    front = rb.limits.wheel_loads(robot, 0.0, 1.0)[0]
    height = robot.inertia.com[2] + 0.06
    # Wheels at 120 and 240 deg turn at cos(30 deg) / R; their axles are 30 deg off the pitch axis.
    spin = 2 * axle_inertia(robot.wheels[1]) * math.cos(math.radians(30)) ** 2 / 0.06
    roller = roller_inertia(robot.wheels[0]).moment[0, 0] / 0.008 * (1 + 2 * 0.25)
    expected = robot.mass * GRAVITY / 3 - (robot.mass * height + spin + roller) / 0.3
    assert front == pytest.approx(expected, rel=1e-9)


def test_a_wheel_that_hangs_carries_nothing() -> None:
    data = robots.mecanum()
    data["wheels"].append({**robots.TYRE, "name": "high", "position": [0.0, 0.0, 0.051], "driven": False})
    loads = rb.limits.wheel_loads(data, 0.0, 1.0)
    assert loads[4] == 0
    assert loads[:4] == pytest.approx(rb.limits.wheel_loads({**data, "wheels": data["wheels"]}, 0.0, 1.0)[:4])
    efforts = rb.limits.wheel_efforts(data, 0.0, 1.0)
    limit = rb.limits.max_acceleration(data, 0.0)
    assert efforts.shape == (4,)
    assert limit.wheels() == ("fl", "fr", "rl", "rr")


# The cone program


@pytest.mark.parametrize("name", ["mecanum", "cart", "swerve", "mixed"])
@pytest.mark.parametrize("adhesion", ["circle", "independent"])
def test_the_optimum_equals_a_linear_program(name: str, adhesion: str) -> None:
    """Circles by 512 tangents: the linear program's optimum is larger, by 1 - cos(pi/512) of the forces at the most."""
    from rollerbench.kinematics.limits.contact_forces import ContactForces
    from rollerbench.kinematics.limits.force_limits import limit_cones

    robot = weakened(robots.ALL[name]())
    directions = np.array([0.0]) if name in ("cart", "mixed") else np.linspace(0.1, 3.0, 5)
    limit = rb.limits.max_acceleration(robot, directions, roll_resistance=0.05, adhesion=adhesion)
    friction = np.array([wheel.friction for wheel in robot.wheels])
    model = ContactForces(robot, np.column_stack([np.cos(directions), np.sin(directions)]), 0.05, None)
    cones, _, _ = limit_cones(model, friction, adhesion)
    angle = np.linspace(0, 2 * np.pi, 512, endpoint=False)
    tangents = np.column_stack([-np.ones(512), np.cos(angle), np.sin(angle)])
    for i, value in enumerate(limit.value):
        found = linprog(
            -np.eye(model.size)[0],
            A_ub=np.einsum("ti,mix->tmx", tangents, cones.slope[i]).reshape(-1, model.size),
            b_ub=-np.einsum("ti,mi->tm", tangents, cones.constant[i]).ravel(),
            A_eq=model.balance.slope[i],
            b_eq=-model.balance.constant[i],
            bounds=[(None, None)] * model.size,
        )
        # In radii; forces of about m g weigh a few times as much in the optimum.
        assert value == pytest.approx(-found.fun, rel=2e-4)
        assert value <= -found.fun * (1 + 1e-7)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_linear_objectives_over_balls(seed: int) -> None:
    """Max of c.z over |z - center| <= r is c.center + r |c|, many at once; empty intersections are told."""
    rng = np.random.default_rng(seed)
    count = 20
    center, radius, objective = rng.normal(size=(count, 2)), rng.uniform(0.01, 2, count), rng.normal(size=(count, 2))
    constant = np.concatenate([radius[:, np.newaxis], -center], axis=1)[:, np.newaxis]
    slope = np.zeros((count, 1, 3, 2))
    slope[:, 0, 1:] = np.eye(2)
    z, feasible = maximize(objective, Cones(constant=constant, slope=slope))
    assert feasible.all()
    expected = np.sum(objective * center, axis=1) + radius * np.linalg.norm(objective, axis=1)
    assert np.sum(objective * z, axis=1) == pytest.approx(expected, abs=1e-9)
    far = np.concatenate([constant, constant + np.array([0.0, 10.0, 0.0])], axis=1)
    far[:, :, 0] = 1.0
    both = Cones(constant=far, slope=np.concatenate([slope, slope], axis=1))
    z, feasible = maximize(objective, both)
    assert not feasible.any()
    # The least violation is in the middle, 4 beyond each ball.
    assert slack(both.at(z)) == pytest.approx(np.full((count, 2), -4.0), abs=1e-6)


# Causes and refusals


def test_weak_motors_limit() -> None:
    data = robots.cart()
    for wheel in data["wheels"][:2]:
        wheel["max_effort"] = 0.5
    limit = rb.limits.max_acceleration(data, 0.0)
    assert limit.cause == "effort"
    assert limit.wheels() == ("left", "right")
    assert rb.limits.wheel_efforts(data, 0.0, float(limit)) == pytest.approx([0.5, 0.5], rel=1e-7)
    stuck = rb.limits.max_acceleration(data, 0.0, roll_resistance=0.3)
    assert np.isnan(stuck.value)
    assert stuck.cause == "effort"
    with pytest.raises(rb.KinematicsError, match=r"max_effort \(left, right\)"):
        float(stuck)


def test_a_tall_base_lifts_a_wheel() -> None:
    data = {**robots.mecanum(), "body": {**robots.BODY, "center_of_mass": [0.0, 0.0, 0.8]}}
    limit = rb.limits.max_acceleration(data, [0.0, math.pi])
    assert (limit.cause == "lift-off").all()
    assert set(limit.wheels(0)) >= {"fl", "fr"}
    loads = rb.limits.wheel_loads(data, 0.0, limit.value[0])
    assert loads[:2] == pytest.approx([0, 0], abs=0.1)


def test_directions_that_a_base_cannot_take() -> None:
    cart = ROBOTS["cart"]
    limit = rb.limits.max_acceleration(cart, [0.0, 1.0])
    assert limit.feasible.tolist() == [True, False]
    assert limit.cause[1] == "tyres"
    with pytest.raises(rb.InfeasibleTwist, match=r"cannot travel at 57.2958 deg.*\(left, right\)"):
        rb.limits.wheel_efforts(cart, [0.0, 1.0], 1.0)
    loose = rb.limits.wheel_efforts(cart, [0.0, 1.0], 1.0, strict=False)
    assert np.isnan(loose[1]).all()
    assert np.isfinite(loose[0]).all()


def test_a_base_that_cannot_push_sideways() -> None:
    """Four parallel omni wheels let the base roll sideways, but none of them pushes it that way."""
    corners = {"fl": (1, 1), "fr": (1, -1), "rl": (-1, 1), "rr": (-1, -1)}
    wheels = [{**robots.OMNI, "name": name, "position": [0.2 * x, 0.2 * y]} for name, (x, y) in corners.items()]
    robot = rb.load_robot({"name": "parallel", "body": robots.BODY, "wheels": wheels})
    limit = rb.limits.max_acceleration(robot, [0.0, math.pi / 2, 0.5])
    assert limit.cause.tolist() == ["adhesion", "drive", "drive"]
    assert limit.value[0] == pytest.approx(0.8 * GRAVITY, rel=1e-7)
    with pytest.raises(rb.KinematicsError, match="cannot push this way"):
        float(rb.limits.max_acceleration(robot, math.pi / 2))
    with pytest.raises(rb.KinematicsError, match="cannot accelerate at 90 deg"):
        rb.limits.wheel_efforts(robot, math.pi / 2, 1.0)


def test_resistance_beyond_friction_keeps_wheels_from_rolling() -> None:
    limit = rb.limits.max_acceleration(ROBOTS["kiwi"], 0.0, roll_resistance=0.9)
    assert np.isnan(limit.value)
    assert limit.cause == "adhesion"


def test_the_ground_takes_part_in_friction() -> None:
    limit = rb.limits.max_acceleration(ROBOTS["swerve"], 0.0, ground_friction=0.2)
    assert limit.value == pytest.approx(2 * 0.8 * 0.2 / 1.0 * GRAVITY, rel=1e-7)


def test_functions_broadcast() -> None:
    directions, accelerations = np.linspace(0, 3, 4)[:, np.newaxis], np.linspace(0, 2, 3)
    efforts = rb.limits.wheel_efforts(ROBOTS["mecanum"], directions, accelerations, roll_resistance=0.1)
    loads = rb.limits.wheel_loads(ROBOTS["mecanum"], directions, accelerations)
    assert efforts.shape == loads.shape == (4, 3, 4)
    one = rb.limits.wheel_efforts(ROBOTS["mecanum"], 2.0, 1.0, roll_resistance=0.1)
    assert efforts[2, 1] == pytest.approx(one, abs=1e-12)
    assert rb.limits.max_acceleration(ROBOTS["mecanum"], directions).value.shape == (4, 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"direction": np.nan}, "direction holds NaN"),
        ({"roll_resistance": -0.1}, "roll_resistance = -0.1"),
        ({"adhesion": "square"}, "adhesion = 'square': accepted: circle, independent"),
        ({"sharing": "fair"}, "sharing = 'fair': accepted: best, least_norm"),
        ({"ground_friction": np.inf}, "ground_friction holds NaN or infinite"),
        ({"loads": [1.0, 2.0]}, "accepted: 3 loads"),
        ({"loads": [1.0, 2.0, -1.0]}, "accepted: 3 loads"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(rb.KinematicsError, match=words):
        rb.limits.max_acceleration(ROBOTS["kiwi"], **{"direction": 0.0, **arguments})


@pytest.mark.parametrize("bad", [-1.0, np.nan, "fast"])
def test_bad_accelerations_are_refused(bad: Any) -> None:
    for function in (rb.limits.wheel_efforts, rb.limits.wheel_loads):
        with pytest.raises(rb.KinematicsError, match="acceleration"):
            function(ROBOTS["kiwi"], 0.0, bad)


def test_slippery_ground_is_no_lift_off() -> None:
    for friction in (0.001, 0.01, 0.1):
        limit = rb.limits.max_acceleration("mecanum_platform", 0.0, ground_friction=friction)
        assert str(limit.cause) == "adhesion"
    kept = rb.limits.max_acceleration("mecanum_platform", 0.0, ground_friction=0.001, loads=[490.5] * 4)
    assert str(kept.cause) == "adhesion"
    assert str(rb.limits.max_acceleration("differential_cart", 0.0).cause) == "lift-off"
