"""A body on its feet: pose, margin and forces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import rollerbench as rb
from rollerbench.description.layout import support_margin

INSECT = np.array([[x, y, -0.2] for x in (-0.33, 0.0, 0.33) for y in (-0.45, 0.45)])


def random_pose(rng):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix()
    pose[:3, 3] = rng.uniform(-1, 1, 3)
    return pose


def stance(rng, count, noise=0.0, slip=0.0):
    """Feet in the body and in the world, the pose, and the index of the foot that slipped."""
    pose = random_pose(rng)
    body = INSECT[rng.permutation(6)[:count]] + rng.uniform(-0.05, 0.05, (count, 3))
    world = body @ pose[:3, :3].T + pose[:3, 3]
    foot, direction = rng.integers(count), rng.uniform(0, 2 * np.pi)
    world[foot, :2] += slip * np.array([np.cos(direction), np.sin(direction)])
    return body + noise * rng.standard_normal(body.shape), world, pose, foot


@pytest.mark.parametrize("count", [3, 4, 5, 6])
@pytest.mark.parametrize("robust", [True, False])
def test_exact_feet_give_the_exact_pose(count, robust) -> None:
    rng = np.random.default_rng(count)
    for _ in range(50):
        body, world, pose, _ = stance(rng, count)
        found = rb.legs.body_pose_from_stance(body, world, robust=robust)
        assert_allclose(found.X_WB, pose, atol=1e-10)
        assert np.linalg.det(found.X_WB[:3, :3]) == pytest.approx(1.0)
        assert np.max(found.residuals) < 1e-10
        assert not found.slipped.any()
        assert_allclose(found.weights, 1.0)


@pytest.mark.parametrize("count", [5, 6])
def test_the_foot_that_slipped_is_named(count) -> None:
    rng = np.random.default_rng(count)
    named, off = 0, []
    for _ in range(300):
        body, world, pose, foot = stance(rng, count, noise=0.001, slip=0.03)
        found = rb.legs.body_pose_from_stance(body, world)
        named += np.flatnonzero(found.slipped).tolist() == [foot]
        off.append(np.linalg.norm(found.X_WB[:3, 3] - pose[:3, 3]))
    assert named >= 297
    assert np.median(off) < 0.002  # as if the foot were not there; with it, 5 mm


@pytest.mark.parametrize("count", [4, 5, 6])
def test_no_foot_is_named_without_a_slip(count) -> None:
    rng = np.random.default_rng(10 + count)
    for _ in range(300):
        body, world, _, _ = stance(rng, count, noise=0.001)
        assert not rb.legs.body_pose_from_stance(body, world).slipped.any()


def test_two_of_six_slip() -> None:
    rng = np.random.default_rng(20)
    body, world, pose, _ = stance(rng, 6)
    world[[1, 4], 0] += [0.05, -0.04]
    found = rb.legs.body_pose_from_stance(body, world)
    assert np.flatnonzero(found.slipped).tolist() == [1, 4]
    assert_allclose(found.X_WB, pose, atol=1e-10)


def test_circumcenter_is_exact_but_ill_conditioned() -> None:
    rng = np.random.default_rng(30)
    body = np.array([[0.33, 0.2, -0.3], [0.0, 0.24, -0.3], [-0.33, 0.2, -0.3]])  # three feet of one side: obtuse
    errors = {"circumcenter": [], "stance": []}
    for _ in range(200):
        pose = random_pose(rng)
        world = body @ pose[:3, :3].T + pose[:3, 3]
        assert_allclose(rb.legs.body_pose_from_circumcenter(body, world), pose, atol=1e-10)
        noisy = body + 0.001 * rng.standard_normal((3, 3))
        middle = body.mean(axis=0)
        for name, found in (
            ("circumcenter", rb.legs.body_pose_from_circumcenter(noisy, world)),
            ("stance", rb.legs.body_pose_from_stance(noisy, world).X_WB),
        ):
            # Where the middle of the feet comes to lie: for the best pose within the noise of their mean.
            errors[name].append(np.linalg.norm((found - pose)[:3, :3] @ middle + (found - pose)[:3, 3]))
    assert np.mean(errors["stance"]) < 0.0012
    assert np.mean(errors["circumcenter"]) > 10 * np.mean(errors["stance"])


@pytest.mark.parametrize("function", [rb.legs.body_pose_from_stance, rb.legs.body_pose_from_circumcenter])
def test_feet_that_fix_no_pose_are_refused(function) -> None:
    with pytest.raises(rb.KinematicsError, match="accepted: 3 or more"):
        function(INSECT[:2], INSECT[:2])
    line = np.outer([0.0, 1.0, 3.0], [1.0, 2.0, 0.5])
    with pytest.raises(rb.KinematicsError, match="on one line"):
        function(line, line)
    with pytest.raises(rb.KinematicsError, match="accepted"):
        function(INSECT[:3], INSECT[:4])


SQUARE = np.array([[1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])


def test_margin_of_a_square() -> None:
    assert rb.legs.static_margin(SQUARE, [0, 0, 5]) == pytest.approx(1.0)
    assert rb.legs.static_margin(SQUARE, [0.7, 0.2, 5]) == pytest.approx(0.3)
    assert rb.legs.static_margin(SQUARE, [1.5, 0.2, 5]) == pytest.approx(-0.5)
    assert rb.legs.static_margin(SQUARE, [4.0, 5.0, 5]) == pytest.approx(-5.0)  # to the corner
    assert rb.legs.support_polygon([*SQUARE, [0.1, 0.2, 0.0], [1.0, 0.0, 0.0]]).tolist() == [1, 2, 0, 3]


def test_margin_of_too_few_contacts() -> None:
    for contacts in (np.zeros((0, 3)), SQUARE[:2], np.outer([0.0, 1.0, 3.0], [1.0, 2.0, 0.5])):
        assert rb.legs.static_margin(contacts, [0, 0, 1]) == -np.inf
        assert rb.legs.support_polygon(contacts).tolist() == []


@given(st.integers(0, 10_000))
def test_margin_agrees_with_the_half_planes_inside(seed) -> None:
    rng = np.random.default_rng(seed)
    contacts, center = rng.uniform(-1, 1, (rng.integers(3, 9), 3)), rng.uniform(-0.5, 0.5, 3)
    ours, other = rb.legs.static_margin(contacts, center), support_margin(contacts[:, :2], center[:2])
    assert np.sign(ours) == np.sign(other)
    if other > 0:
        assert ours == pytest.approx(other, abs=1e-12)
    else:
        assert ours <= other + 1e-12  # beyond a corner it is farther than from either edge


@given(st.integers(0, 10_000))
def test_margin_does_not_depend_on_the_frame(seed) -> None:
    rng = np.random.default_rng(seed)
    contacts, center = rng.uniform(-1, 1, (5, 3)), rng.uniform(-0.5, 0.5, 3)
    turn, shift = Rotation.random(random_state=seed), rng.uniform(-1, 1, 3)
    turned = rb.legs.static_margin(turn.apply(contacts) + shift, turn.apply(center) + shift, turn.apply([0, 0, -9.81]))
    assert turned == pytest.approx(rb.legs.static_margin(contacts, center), abs=1e-12)


def test_margin_on_a_slope() -> None:
    # The ground rises along x by 20 deg; the centre of mass is 0.3 m above it, and gravity moves it downhill.
    angle = np.radians(20)
    gravity = 9.81 * np.array([-np.sin(angle), 0, -np.cos(angle)])
    margin = rb.legs.static_margin(SQUARE, [0, 0, 0.3], gravity)
    assert margin == pytest.approx((1.0 - 0.3 * np.tan(angle)) * np.cos(angle), abs=1e-14)


def test_wrong_gravity_is_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="gravity"):
        rb.legs.static_margin(SQUARE, [0, 0, 1], [0, 0, 0])


def balance(feet, forces):
    return np.concatenate([np.cross(feet, forces).sum(axis=0), forces.sum(axis=0)])


def test_forces_of_standing() -> None:
    forces = rb.legs.foot_forces(INSECT, [0, 0, 0, 0, 0, 294.3], 0.8)
    assert_allclose(forces, np.tile([0, 0, 49.05], (6, 1)), atol=1e-10)


@given(st.integers(0, 10_000), st.integers(3, 6))
def test_forces_balance_within_the_cones(seed, count) -> None:
    rng = np.random.default_rng(seed)
    feet = INSECT[rng.permutation(6)[:count]] + rng.uniform(-0.05, 0.05, (count, 3))
    # A wrench of forces in the cones has such forces.
    pushes = rng.uniform(0, 100, count) * rng.integers(0, 2, count)
    slides = 0.95 * 0.6 * pushes * rng.uniform(0, 1, count)
    directions = rng.uniform(0, 2 * np.pi, count)
    given_forces = np.stack([slides * np.cos(directions), slides * np.sin(directions), pushes], axis=-1)
    wrench = balance(feet, given_forces)
    forces = rb.legs.foot_forces(feet, wrench, 0.6)
    size = np.linalg.norm(wrench) + 1e-9
    assert_allclose(balance(feet, forces), wrench, atol=1e-11 * size)
    assert np.all(np.hypot(forces[:, 0], forces[:, 1]) <= 0.6 * forces[:, 2] + 1e-7 * size)  # of the balance's weight
    assert np.sum(forces**2) <= np.sum(given_forces**2) + 1e-7 * size**2
    least = np.linalg.pinv(np.array([balance(feet, unit.reshape(-1, 3)) for unit in np.eye(3 * count)]).T) @ wrench
    assert np.sum(forces**2) >= np.sum(least**2) - 1e-9 * size**2
    least = least.reshape(-1, 3)
    if np.all(np.hypot(least[:, 0], least[:, 1]) <= 0.6 * least[:, 2]):
        assert_allclose(forces, least, atol=1e-10 * size)


def test_forces_on_a_slope() -> None:
    # At rest on a slope within the cone of friction, each foot pushes straight against gravity.
    angle = np.radians(25)
    weight = 100 * np.array([np.sin(angle), 0, np.cos(angle)])
    feet = INSECT - [0.0, 0, 0.1]
    center = np.cross(feet.mean(axis=0), weight)
    forces = rb.legs.foot_forces(feet, [*center, *weight], 0.5)
    assert_allclose(balance(feet, forces), [*center, *weight], atol=1e-11)
    tilted = rb.legs.foot_forces(feet, [*center, *weight], 0.01, up=weight)
    assert_allclose(tilted, np.tile(weight / 6, (6, 1)), atol=1e-11)
    with pytest.raises(rb.KinematicsError, match="cannot give the wrench"):
        rb.legs.foot_forces(feet, [*center, *weight], np.tan(angle) - 0.01)


@pytest.mark.parametrize(
    "wrench", [[0, 0, 0, 0, 0, -10.0], [0, 0, 0, 9.0, 0, 10.0], [8.0, 0, 0, 0, 0, 10.0]], ids=["pull", "slide", "tip"]
)
def test_forces_that_do_not_exist(wrench) -> None:
    with pytest.raises(rb.KinematicsError, match="cannot give the wrench"):
        rb.legs.foot_forces(INSECT, wrench, 0.8)


def test_two_feet_carry_what_is_between_them() -> None:
    forces = rb.legs.foot_forces(INSECT[:2], np.r_[np.cross([-0.33, 0, -0.2], [0, 0, 10.0]), 0, 0, 10.0], 0.8)
    assert_allclose(forces, np.tile([0, 0, 5.0], (2, 1)), atol=1e-12)
    with pytest.raises(rb.KinematicsError, match="cannot give the wrench"):
        rb.legs.foot_forces(INSECT[:2], [0, 1.0, 0, 0, 0, 10.0], 0.8)
