"""Inverse kinematics: it undoes the forward one, stays within limits, and says how far targets are out of reach."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize

import rollerbench as rb
from rollerbench.description.legs import FootWheel, Leg, Link
from rollerbench.kinematics.legs.roots import real_roots

FAMILIES = ["joint_4", "joint_1", "inclination", "tibia"]
COUNT = 100_000


@pytest.fixture(scope="module")
def leg() -> Leg:
    return rb.load_robot("wheel_leg_hexapod").legs[0]


@pytest.fixture(scope="module")
def free(leg) -> rb.legs.LegKinematics:
    """The leg with joints that turn all round, so that no branch is beyond limits."""
    links = tuple(link.model_copy(update={"min_deg": -180.0, "max_deg": 180.0}) for link in leg.links)
    return rb.legs.LegKinematics(leg.model_copy(update={"links": links}))


def poses(leg, hold, count, seed=0):
    """Random joint angles within the limits, and what is held there."""
    low, high = leg.limits
    q = np.random.default_rng(seed).uniform(low, high, (count, 4))
    if hold == "tibia":
        q[:, 2] = -np.pi / 2 - q[:, 1]
        return q[(q[:, 2] >= low[2]) & (q[:, 2] <= high[2])], None
    return q, q[:, 1] + q[:, 2] if hold == "inclination" else q[:, int(hold[-1]) - 1]


def holds(q, hold, value):
    """How far the held angle is from its value [rad]."""
    angle = q[..., 1] + q[..., 2] if hold in ("tibia", "inclination") else q[..., int(hold[-1]) - 1]
    return np.abs(np.angle(np.exp(1j * (angle - (-np.pi / 2 if value is None else value)))))


@pytest.mark.parametrize("hold", FAMILIES)
def test_inverse_undoes_forward(leg, hold) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    q, value = poses(leg, hold, COUNT)
    target = kinematics.position(q)
    found = kinematics.inverse(target, hold=hold, value=value)
    assert np.max(np.abs(kinematics.position(found) - target)) < 1e-10
    assert np.max(holds(found, hold, value)) < 1e-10
    assert np.all((found >= leg.limits[0]) & (found <= leg.limits[1]))


@pytest.mark.parametrize("hold", FAMILIES)
def test_branches_are_distinct_and_complete(leg, hold) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    q, value = poses(leg, hold, 5000, seed=1)
    target = kinematics.position(q)
    branches = kinematics.inverse(target, hold=hold, value=value, all_branches=True)
    there = np.isfinite(branches).all(axis=-1)
    assert branches.shape[1] == (8 if hold == "inclination" else 4)
    error = np.linalg.norm(kinematics.position(np.nan_to_num(branches)) - target[:, np.newaxis], axis=-1)
    assert np.max(error[there]) < 1e-10
    turns = np.exp(1j * branches)
    apart = np.linalg.norm(turns[:, :, np.newaxis] - turns[:, np.newaxis], axis=-1)
    apart[:, range(branches.shape[1]), range(branches.shape[1])] = np.inf
    assert np.nanmin(apart) > 1e-6  # random targets come near to folds, where branches meet
    # The pose from which the target comes is one of them; near folds as exactly as the square root of rounding.
    original = np.nanmin(np.linalg.norm(turns - np.exp(1j * q)[:, np.newaxis], axis=-1), axis=1)
    assert np.quantile(original, 0.99) < 1e-10
    assert np.max(original) < 1e-6


@pytest.mark.parametrize("offset", [None, 0.0, 1e-10, 1e-7, 1e-3])
def test_up_to_eight_branches_at_an_inclination(free, offset) -> None:
    # A leg with a long foot, at any inclination and at and beside the vertical, where the quartic loses its degree.
    lengths = ({}, {"a": 0.3}, {}, {"a": 0.3, "d": -0.1})
    links = tuple(link.model_copy(update=update) for link, update in zip(free.leg.links, lengths, strict=True))
    kinematics = rb.legs.LegKinematics(free.leg.model_copy(update={"links": links}))
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20_000, 4))
    if offset is not None:
        q[:, 2] = offset - np.pi / 2 - q[:, 1]
    target, value = kinematics.position(q), q[:, 1] + q[:, 2]
    branches = kinematics.inverse(target, hold="inclination", value=value, all_branches=True)
    original = np.nanmin(np.linalg.norm(np.exp(1j * branches) - np.exp(1j * q)[:, np.newaxis], axis=-1), axis=1)
    assert np.max(original) < 1e-6  # none is lost; near folds a branch is known to the square root of rounding
    count = np.isfinite(branches).all(axis=-1).sum(axis=1)
    assert np.all(count % 2 == 0)  # joint 4 to either side
    assert np.max(count) == 8 or offset is not None


@pytest.mark.parametrize("hold", ["joint_4", "joint_1", "tibia"])
def test_inside_there_are_four_branches(free, hold) -> None:
    value = {"joint_4": 0.4, "joint_1": 0.2, "tibia": None}[hold]
    branches = free.inverse([0.2, 0.05, -0.12], hold=hold, value=value, all_branches=True)
    assert np.isfinite(branches).all()


def test_the_branch_nearest_to_near_is_taken(leg) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    q, value = poses(leg, "joint_4", 2000, seed=2)
    assert_allclose(kinematics.inverse(kinematics.position(q), hold="joint_4", value=value, near=q), q, atol=1e-6)
    insect = leg.posture("insect")
    assert_allclose(kinematics.inverse(kinematics.position(insect), hold="tibia"), insect, atol=1e-12)
    mammal = leg.posture("mammal")
    assert_allclose(kinematics.inverse(kinematics.position(mammal), hold="joint_1", near=mammal), mammal, atol=1e-10)


def test_full_turns_are_used(leg) -> None:
    # Joint 4 turns by -270 to 270 deg: the same foot, a full turn apart.
    kinematics = rb.legs.LegKinematics(leg)
    near = np.radians([0, 20, -110, 250])
    found = kinematics.inverse(kinematics.position(near), hold="tibia", near=near)
    assert_allclose(found, near, atol=1e-12)


@pytest.mark.parametrize("hold", FAMILIES)
def test_distance_out_of_reach(free, hold) -> None:
    """It is the least distance from all feet that the family reaches, found by minimisation."""
    rng = np.random.default_rng(4)
    value = {"joint_4": 0.5, "joint_1": 0.3, "inclination": -1.0, "tibia": None}[hold]
    targets = rng.uniform(-0.7, 0.7, (12, 3))
    excess = free.reach_excess(targets, hold=hold, value=value)
    assert np.any(excess > 0)
    # All feet of the family, by the two or three angles that it leaves free.
    grid = np.stack(np.meshgrid(*[np.linspace(-np.pi, np.pi, 37)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)

    def angles(u):
        u = np.asarray(u)
        a, b, c = u[..., 0], u[..., 1], u[..., 2]
        if hold == "joint_4":
            return np.stack([a, b, c, np.full_like(a, value)], axis=-1)
        if hold == "joint_1":
            return np.stack([np.full_like(a, value), a, b, c], axis=-1)
        inclination = -np.pi / 2 if value is None else value
        return np.stack([a, b, inclination - b, c], axis=-1)

    feet = free.position(angles(grid))
    for target, distance in zip(targets, excess, strict=True):
        starts = np.argsort(np.linalg.norm(feet - target, axis=1))[:5]
        fits = [
            minimize(lambda u, t=target: np.sum((free.position(angles(u)) - t) ** 2), grid[i], tol=1e-16)
            for i in starts
        ]
        least = np.sqrt(min(fit.fun for fit in fits))
        assert distance == pytest.approx(least, abs=1e-6)  # what the minimiser leaves


@pytest.mark.parametrize("hold", FAMILIES)
def test_out_of_reach_is_an_error(leg, hold) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    good = kinematics.position(leg.posture("insect"))
    value = None if hold in ("tibia", "inclination") else {"joint_4": np.pi / 2, "joint_1": 0.0}[hold]
    targets = np.array([good, good, [0.9, 0.0, -0.2]])
    with pytest.raises(
        rb.UnreachableTarget, match=r"target \[2\] of leg front_left: p_LF = \[0.9, 0, -0.2\]"
    ) as caught:
        kinematics.inverse(targets, hold=hold, value=value)
    assert caught.value.index == (2,)
    assert caught.value.limit_excess == 0
    assert caught.value.distance == kinematics.reach_excess(targets, hold=hold, value=value)[2]
    assert kinematics.reachable(targets, hold=hold, value=value).tolist() == [True, True, False]
    assert np.isnan(kinematics.inverse(targets, hold=hold, value=value, all_branches=True)[2]).all()


def test_straight_out_of_reach(leg) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    outstretched = 0.2 + np.hypot(0.22, 0.09)
    with pytest.raises(rb.UnreachableTarget, match=r"out of reach by 0\.1 m") as caught:
        kinematics.inverse([outstretched + 0.1, 0, 0], hold="joint_4")
    assert caught.value.index == ()
    assert caught.value.distance == pytest.approx(0.1, abs=1e-14)
    # On the edge itself it is reached.
    found = kinematics.inverse([outstretched, 0, 0], hold="joint_4")
    assert_allclose(kinematics.position(found), [outstretched, 0, 0], atol=1e-12)


def test_beyond_the_limits_is_an_error(leg) -> None:
    links = (leg.links[0].model_copy(update={"min_deg": -30.0, "max_deg": 30.0}), *leg.links[1:])
    narrow = rb.legs.LegKinematics(leg.model_copy(update={"links": links}))
    target = narrow.position(np.radians([40, 20, -110, 0]))
    # Backwards over the hip would do as well, were joint 2 free to.
    with pytest.raises(rb.UnreachableTarget, match="joint 1 10 deg beyond its limits") as caught:
        narrow.inverse(target, hold="joint_4")
    assert caught.value.limit_excess == pytest.approx(np.radians(10), abs=1e-12)
    assert caught.value.distance == 0
    assert not narrow.reachable(target, hold="joint_4")
    assert narrow.reach_excess(target, hold="joint_4") == 0
    with pytest.raises(rb.UnreachableTarget, match="joint 1 10 deg beyond"):
        narrow.inverse(target, hold="joint_1", value=np.radians(40))


def test_foot_under_the_hip(leg) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    near = np.array([0.7, -0.8, -1.7, 0.0])
    for hold in ("joint_4", "inclination"):
        value = {"joint_4": 0.0, "inclination": None}[hold]
        straight = kinematics.position(leg.posture("mammal")) * [0, 0, 1]
        if hold == "inclination":
            value = kinematics.inverse(straight, hold="joint_4", near=near)[1:3].sum()
        found = kinematics.inverse(straight, hold=hold, value=value, near=near)
        assert found[0] == pytest.approx(0.7, abs=1e-15)  # any angle would do
        assert_allclose(kinematics.position(found), straight, atol=1e-12)


@given(st.lists(st.floats(-0.99, 0.99), min_size=4, max_size=4), st.sampled_from([0.0, 1e-12, 1.0]))
def test_real_roots(roots, leading) -> None:
    # (x - a)(x - b)(x - c)(leading x - d), whose leading coefficient may vanish.
    roots = np.round(np.array(roots), 2)
    polynomial = np.polynomial.polynomial.polyfromroots(roots[:3])
    polynomial = np.polynomial.polynomial.polymul(polynomial, [-roots[3] if leading == 1 else 3.0, leading])
    expected = np.unique(roots if leading == 1 else roots[:3])
    found = real_roots(polynomial, -1.0, 1.0)
    found = found[np.isfinite(found)]
    values = np.polynomial.polynomial.polyval(found, polynomial)
    assert np.max(np.abs(values), initial=0.0) < 1e-12
    # Of multiple roots some copies may appear, spread as the root of rounding; none is missing.
    assert all(np.min(np.abs(found - root)) < 1e-3 for root in expected)


def make_leg(rows, limit) -> Leg:
    links = tuple(Link(a=a, alpha_deg=alpha, d=d, mass=0.5, min_deg=-limit, max_deg=limit) for a, alpha, d in rows)
    posture = (10.0, 20.0, -70.0, 30.0, 20.0)[: len(rows)]
    wheel = FootWheel(radius=0.05, width=0.03, mass=0.3)
    return Leg(name="leg", hip=(0, 0, 0), links=links, wheel=wheel, postures={"stand": posture})


THREE = make_leg([(0.05, 90, 0), (0.2, 0, 0), (0.25, 0, 0)], 150)
FIVE = make_leg([(0.03, 90, 0.02), (0.15, 5, 0), (0.12, -30, 0.01), (0.1, 20, 0), (0.05, 0, 0)], 100)


@pytest.mark.parametrize(("leg", "hold"), [(THREE, "least"), (FIVE, "least"), (FIVE, "joint_2"), (FIVE, "joint_5")])
def test_legs_of_other_kinds(leg, hold) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    q = np.random.default_rng(5).uniform(*leg.limits, (200, len(leg.links)))
    target, value = kinematics.position(q), None if hold == "least" else q[:, int(hold[-1]) - 1]
    found = kinematics.inverse(target, hold=hold, value=value)
    assert np.max(np.abs(kinematics.position(found) - target)) < 1e-10
    assert np.all((found >= leg.limits[0]) & (found <= leg.limits[1]))
    assert value is None or np.all(found[:, int(hold[-1]) - 1] == value)
    stay = kinematics.inverse(kinematics.position(leg.posture("stand")), hold=hold)
    assert_allclose(stay, leg.posture("stand"), atol=1e-9)


def test_least_motion_is_the_least(leg) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    near = leg.posture("insect")
    found = kinematics.inverse(kinematics.position(near) + np.array([0.03, 0.02, 0.04]), hold="least")
    # Motions that leave the foot where it is are square to what the joints have moved.
    free = np.linalg.svd(kinematics.jacobian(found)[3:])[2][3]
    assert free @ (found - near) == pytest.approx(0.0, abs=1e-8)  # to where the iteration rests


def test_distance_of_other_legs() -> None:
    # Joints within 150 deg: straight ahead the leg ends at 0.5 m.
    kinematics = rb.legs.LegKinematics(THREE)
    with pytest.raises(rb.UnreachableTarget) as caught:
        kinematics.inverse([[0.3, 0.0, -0.2], [0.8, 0.0, 0.0]])
    assert caught.value.index == (1,)
    assert caught.value.distance == pytest.approx(0.3, abs=1e-9)


def test_the_whole_leg_is_covered_by_least(leg) -> None:
    kinematics = rb.legs.LegKinematics(leg)
    q = np.random.default_rng(6).uniform(*leg.limits, (200, 4))
    target = kinematics.position(q)
    assert np.max(np.abs(kinematics.position(kinematics.inverse(target)) - target)) < 1e-10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"p_LF": [0.1, 0.2]}, "p_LF of shape"),
        ({"p_LF": [0.1, 0.2, np.nan]}, "p_LF holds NaN"),
        ({"p_LF": [0.1, 0.2, 0.0], "hold": "joint_5"}, "accepted: least, joint_1"),
        ({"p_LF": [0.1, 0.2, 0.0], "hold": "tibia", "value": 1.0}, "value = 1.0 with hold = 'tibia'"),
        ({"p_LF": [0.1, 0.2, 0.0], "near": [0.0]}, "near of shape"),
        ({"p_LF": np.zeros((2, 3)), "hold": "joint_1", "value": np.zeros(3)}, "leading axes"),
    ],
)
def test_wrong_arguments_are_refused(leg, arguments, message) -> None:
    with pytest.raises(rb.KinematicsError, match=message):
        rb.legs.LegKinematics(leg).inverse(**arguments)


def test_only_the_leg_of_song_has_a_tibia() -> None:
    with pytest.raises(rb.KinematicsError, match=r"accepted: least, joint_1, joint_2, joint_3$"):
        rb.legs.LegKinematics(THREE).inverse([0.3, 0.0, -0.2], hold="tibia")
