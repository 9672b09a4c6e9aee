"""Where the body is, from the joints of the legs that stand."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import rollerbench as rb
from rollerbench.kinematics.gaits import LegMode, LegPlanner
from rollerbench.kinematics.legs.stance import stance_next, stance_start
from walking import DT, Walk, asked, standing

HEXAPOD = LegPlanner(rb.load_robot("wheel_leg_hexapod"))
GROUP = HEXAPOD.group
STILL = np.zeros(GROUP.shape)
ALL = np.ones(6, dtype=bool)


def estimates(walk: Walk, dt: float):
    """The odometry of a walk, with the mean speeds of each period."""
    found = [stance_start(GROUP, walk.q[0], walk.plans[0].X_PB)]
    for plan, q, done in zip(walk.plans[1:], walk.q[1:], walk.tracked, strict=True):
        found.append(stance_next(GROUP, found[-1], (q, done.q_rate), done.wheel_rate, plan.swing < 0, dt))
    return found


def farthest_off(walk: Walk, dt: float = DT) -> float:
    pairs = zip(estimates(walk, dt), walk.plans, strict=True)
    return max(float(np.linalg.norm(found.X_WB[:3, 3] - plan.X_PB[:3, 3])) for found, plan in pairs)


def test_the_body_moves_over_feet_that_stand() -> None:
    """Feet that rest in the world, wheels that do not turn: any motion of the body is found exactly."""
    rng = np.random.default_rng(1)
    q, pose = GROUP.posture("insect"), np.eye(4)
    estimate = stance_start(GROUP, q, pose)
    feet, hold = estimate.centers_W, HEXAPOD.stances.holds("insect")
    for _ in range(20):
        pose = pose.copy()
        pose[:3, :3] = Rotation.from_rotvec(rng.uniform(-0.05, 0.05, 3)).as_matrix()
        pose[:3, 3] = rng.uniform(-0.02, 0.02, 3)
        targets = (feet - pose[:3, 3]) @ pose[:3, :3]
        q, _, missed = GROUP.inverse(targets, replace(hold, near=q), iterations=40, tolerance=1e-13)
        assert missed.max() < 1e-11
        estimate = stance_next(GROUP, estimate, (q, STILL), np.zeros(6), ALL, 0.01)
        assert_allclose(estimate.X_WB, pose, atol=1e-9)
        assert not estimate.slipped.any()


@pytest.mark.parametrize("posture", ["insect", "mammal"])
def test_the_body_rolls_where_its_wheels_point(posture: str) -> None:
    """Joints at rest, wheels of radius R at w: the body has gone R w t."""
    q = GROUP.posture(posture).copy()
    if posture == "insect":
        q[:, 0] = 0.0  # legs straight to the side: all wheels point ahead
    heading = GROUP.headings(GROUP.frames(q))
    way = np.array([np.cos(heading[0]), np.sin(heading[0])])
    # Wheels of one direction, some of which turn the other way about.
    ahead = np.sign(np.cos(heading - heading[0]))
    assert_allclose(ahead * np.cos(heading - heading[0]), 1.0, atol=1e-12)
    estimate = stance_start(GROUP, q, np.eye(4))
    for _ in range(50):
        estimate = stance_next(GROUP, estimate, (q, STILL), 3.0 * ahead, ALL, 0.01)
    expected = np.eye(4)
    expected[:2, 3] = 0.06 * 3.0 * 0.5 * way
    assert_allclose(estimate.X_WB, expected, atol=1e-9)


@pytest.mark.parametrize("speed", [0.1, 0.2])
def test_a_tripod_walk_is_followed(speed: float) -> None:
    mode = LegMode(posture="insect")
    walk = standing(HEXAPOD, mode).go(5.0, asked([speed, 0, 0], mode)).go(2.0, asked([0, 0, 0], mode))
    assert not walk.faults
    assert walk.plans[-1].q_xyt[0] > 4 * speed
    # Upright tibias do not roll: what is left is what feet miss in a period, some micrometres.
    assert farthest_off(walk) < 1e-4


def test_a_drive_is_followed() -> None:
    """Castors swing into their trail and roll; 0.09 mm at 10 ms."""
    mode = LegMode(posture="insect", motion="drive")
    walk = standing(HEXAPOD, mode).go(4.0, asked([0.4, 0, 0], mode), 0.01).go(1.0, asked([0, 0, 0], mode), 0.01)
    assert not walk.faults
    assert walk.plans[-1].q_xyt[0] > 1.3
    assert farthest_off(walk, 0.01) < 1e-4


def test_errors_of_a_curved_drive_shrink_with_the_period() -> None:
    """Joints and wheels are measured at the end of a period: an error of first order, below 1 mm/m at 10 ms."""
    mode = LegMode(posture="mammal", motion="drive")
    errors = []
    for dt in (0.02, 0.01):
        walk = standing(HEXAPOD, mode).go(3.0, asked([0.4, 0, 0.2], mode), dt)
        assert not walk.faults
        errors.append(farthest_off(walk, dt) / np.hypot(*walk.plans[-1].q_xyt[:2]))
    assert errors[1] < 1.2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("foot", range(6))
def test_a_foot_that_slips_is_named(foot: int) -> None:
    q = GROUP.posture("insect")
    start = stance_start(GROUP, q, np.eye(4))
    centers = GROUP.frames(q)[:, -1, :3, 3].copy()
    centers[foot, :2] += [0.018, 0.024]
    moved, _, missed = GROUP.inverse(centers, HEXAPOD.stances.holds("insect"), iterations=40, tolerance=1e-12)
    assert missed.max() < 1e-10
    found = stance_next(GROUP, start, (moved, STILL), np.zeros(6), ALL, 0.01)
    assert np.flatnonzero(found.slipped).tolist() == [foot]
    assert_allclose(found.X_WB, np.eye(4), atol=1e-9)
    # From then on it stands where it slipped to.
    assert_allclose(found.centers_W, centers, atol=1e-9)
    again = stance_next(GROUP, found, (moved, STILL), np.zeros(6), ALL, 0.01)
    assert not again.slipped.any()
    assert_allclose(again.X_WB, np.eye(4), atol=1e-9)


def test_with_two_feet_nothing_is_known() -> None:
    q = GROUP.posture("insect")
    start = stance_start(GROUP, q, np.eye(4))
    stands = np.arange(6) < 2
    found = stance_next(GROUP, start, (q + 0.1, STILL), np.zeros(6), stands, 0.01)
    assert_allclose(found.X_WB, start.X_WB)
    assert not found.slipped.any()
    assert found.stood.tolist() == stands.tolist()
