"""Walking on ideal legs: nothing jumps, feet stand where they stand, commands are followed or refused in words."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

import robots
import rollerbench as rb
from rollerbench.kinematics.gaits import GAITS, LegMode, LegPlanner
from rollerbench.kinematics.gaits.gait import gait_of, schedule
from walking import DT, Walk, asked, pieces, standing

HEXAPOD = LegPlanner(rb.load_robot("wheel_leg_hexapod"))
INSECT = LegMode(posture="insect")
STAND = asked([0, 0, 0], INSECT)


def feet_speeds(walk: Walk):
    return np.linalg.norm(np.diff(walk.feet, axis=0), axis=2) / np.diff(walk.time)[:, np.newaxis]


def fastest_swing(walk: Walk, stride: float) -> float:
    """A bound on a foot's speed: 15/8 of the mean one of the quintic, 3.44 of the bump's, and the body's own [m/s]."""
    plans = walk.plans
    time = min((1 - plan.schedule.duty) * plan.schedule.gait.period for plan in plans)
    lift = max(plan.schedule.gait.lift for plan in plans)
    body = max(np.abs(walk.twist) @ [1.0, 1.0, 0.6])
    return (1.875 * stride + 3.44 * lift) / time + body


def on_the_ground(walk: Walk):
    """Which feet (n - 1, k) stood throughout a tick."""
    return (walk.swing[1:] < 0) & (walk.swing[:-1] < 0)


@pytest.mark.parametrize("gait", GAITS)
@pytest.mark.parametrize("v_xyw_B", [[0.1, 0.0, 0.0], [0.0, 0.08, 0.0], [0.0, 0.0, 0.3], [0.06, 0.05, -0.15]], ids=str)
def test_standing_feet_do_not_move(gait: str, v_xyw_B: list[float]) -> None:
    """With the tibia upright wheels do not lean, and so do not roll."""
    mode = LegMode(posture="insect", gait=gait)
    walk = standing(HEXAPOD, mode).go(3.0, asked(v_xyw_B, mode)).go(2.5, asked([0, 0, 0], mode))
    assert not walk.faults
    assert_allclose(np.diff(walk.feet, axis=0)[on_the_ground(walk)], 0.0, atol=1e-11)
    assert walk.misses.max() < 2e-5  # what the inverse leaves in a period
    assert walk.feet[..., 2].min() >= 0.0
    assert walk.margins.min() > 0.05
    # Feet come home after the stop.
    last = walk.plans[-1]
    cos, sin = np.cos(last.q_xyt[2]), np.sin(last.q_xyt[2])
    home = HEXAPOD.stances.home("insect") @ np.array([[cos, sin], [-sin, cos]]) + last.q_xyt[:2]
    assert np.hypot(*(last.feet_P[:, :2] - home).T).max() < 0.002
    assert last.at_rest
    assert last.load.tolist() == [1.0] * 6


def test_a_walk_is_as_long_as_its_twist_lasts() -> None:
    """The twist rises within 1.45 periods and falls within 0.8, on cubics of mean one half."""
    walk = standing(HEXAPOD, INSECT).go(5.0, asked([0.2, 0, 0], INSECT)).go(2.0, STAND)
    assert_allclose(walk.plans[-1].reference, [0.2 * (5.0 - 1.45 / 2 + 0.8 / 2), 0.0, 0.0], atol=1e-9)


def test_the_reference_is_the_integral_of_the_accepted_twist() -> None:
    course = pieces([(2.0, asked([0.1, 0.05, 0.2], INSECT)), (4.0, asked([0.0, -0.08, 0.3], INSECT)), (6.0, STAND)])
    walk = standing(HEXAPOD, INSECT).go(6.0, course)
    rates = np.array([plan.twist.rate for plan in walk.plans])
    twist = CubicHermiteSpline(walk.time, walk.twist, rates)

    def motion(time, pose):
        v, yaw = twist(time), pose[2]
        return [np.cos(yaw) * v[0] - np.sin(yaw) * v[1], np.sin(yaw) * v[0] + np.cos(yaw) * v[1], v[2]]

    exact = solve_ivp(motion, (0, 6.0), np.zeros(3), t_eval=[6.0], rtol=1e-10, atol=1e-12, max_step=0.02).y[:, -1]
    # 1e-4: the mean twist of each of 300 periods of 20 ms.
    assert_allclose(walk.plans[-1].reference, exact, atol=1e-4)
    assert_allclose(walk.plans[-1].q_xyt, walk.plans[-1].reference, atol=1e-12)


@pytest.mark.parametrize("after", GAITS)
@pytest.mark.parametrize("before", GAITS)
def test_gaits_change_without_a_jump(before: str, after: str) -> None:
    first, second = (LegMode(posture="insect", gait=gait) for gait in (before, after))
    speed = [0.08, 0.0, 0.1]
    walk = standing(HEXAPOD, first).go(2.3, asked(speed, first)).go(4.5, asked(speed, second))
    assert not walk.faults
    assert walk.plans[-1].schedule.gait.name == after
    assert_allclose(walk.plans[-1].twist.value, speed, atol=1e-12)
    # Strides of the period of 1 s: as long as the body goes in it, half as much again while it speeds up.
    assert feet_speeds(walk).max() < fastest_swing(walk, 1.5 * np.hypot(0.08, 0.06))
    assert_allclose(np.diff(walk.feet, axis=0)[on_the_ground(walk)], 0.0, atol=1e-11)
    bodies = np.array([plan.X_PB for plan in walk.plans])
    assert np.linalg.norm(np.diff(bodies[:, :3, 3], axis=0), axis=1).max() <= 0.08 * DT * (1 + 1e-6)
    assert walk.margins.min() > 0.05


def test_the_twist_takes_a_time_to_change() -> None:
    """No acceleration beyond that of a cubic over 0.8 periods, 1.5 v / T, also when it turns about."""
    course = pieces([(2.2, asked([0.15, 0, 0], INSECT)), (5.0, asked([-0.15, 0, 0], INSECT)), (7.0, STAND)])
    walk = standing(HEXAPOD, INSECT).go(7.0, course)
    assert not walk.faults
    change = np.abs(np.diff(walk.twist, axis=0)) / DT
    assert change[:, 0].max() < 1.5 * 0.3 / 0.8 * 1.01
    assert walk.margins.min() > 0.05


@pytest.mark.parametrize(("v_xyw_B", "posture"), [([1.0, 0, 0], "insect"), ([0, 0, 2.0], "mammal")])
def test_a_twist_beyond_reach_is_followed_as_far_as_the_legs_reach(v_xyw_B: list[float], posture: str) -> None:
    mode = LegMode(posture=posture)
    walk = standing(HEXAPOD, mode).go(4.0, asked(v_xyw_B, mode))
    assert not any(done.fault for done in walk.tracked)
    (status,) = walk.faults
    assert "the command is beyond the legs' reach; followed at" in status
    last = walk.plans[-1]
    share = last.accepted @ np.array(v_xyw_B) / (np.array(v_xyw_B) @ v_xyw_B)
    assert 0.05 < share < 1
    assert f"{share:.0%}" in status
    assert_allclose(last.accepted, share * np.array(v_xyw_B), atol=1e-12)
    assert_allclose(last.twist.value, last.accepted, atol=1e-12)
    plan = schedule(gait_of("tripod"), HEXAPOD.robot)
    # It is the largest share, but for seven bisections.
    assert HEXAPOD.stances.reachable_share(posture, plan, last.accepted, np.zeros(6)) == 1.0
    assert HEXAPOD.stances.reachable_share(posture, plan, last.accepted + 0.01 * np.array(v_xyw_B), np.zeros(6)) < 1.0
    assert walk.misses.max() < 2e-5


def test_body_offsets_are_reached_over_feet_that_stand() -> None:
    for offset in ([0.05, 0, 0, 0, 0, 0], [0, 0.04, 0.03, 0, 0, 0], [0.01, 0.01, -0.02, 0.05, -0.05, 0.1]):
        walk = standing(HEXAPOD, INSECT).go(1.5, asked([0, 0, 0], INSECT, offset))
        assert not walk.faults
        last = walk.plans[-1]
        assert_allclose(last.offset.value, offset, atol=1e-12)
        frames = HEXAPOD.group.frames(walk.q[-1])
        pose = last.X_PB
        feet = frames[:, -1, :3, 3] @ pose[:3, :3].T + pose[:3, 3] - [0, 0, 0.06]
        # 2e-5: what the inverse leaves in a period. As legs lean with the body, balls roll sideways.
        assert_allclose(feet, last.feet_P, atol=2e-5)
        assert_allclose(feet[:, 2], 0.0, atol=2e-5)
        assert np.hypot(*(feet - walk.plans[0].feet_P)[:, :2].T).max() <= 0.06 * np.abs(offset[3:]).sum() + 2e-5


def test_a_robot_walks_with_an_offset() -> None:
    offset = [0.02, -0.01, 0.02, 0.03, 0.03, 0.05]
    walk = standing(HEXAPOD, INSECT).go(1.0, asked([0, 0, 0], INSECT, offset))
    walk.go(4.0, asked([0.1, 0.0, 0.1], INSECT, offset))
    assert not walk.faults
    assert_allclose(walk.plans[-1].offset.value, offset, atol=1e-12)
    assert walk.misses.max() < 2e-5


def test_legs_of_three_joints_walk_as_well() -> None:
    for make in (robots.quadruped, robots.mixed_legs):
        planner = LegPlanner(rb.load_robot(make()))
        mode = LegMode(posture=planner.robot.standing[0].name, gait="wave")
        walk = standing(planner, mode).go(4.0, asked([0.02, 0.01, 0.05], mode)).go(2.5, asked([0, 0, 0], mode))
        assert not walk.faults
        assert walk.misses.max() < 2e-5
        assert walk.plans[-1].at_rest


def test_a_fault_lets_feet_sink_and_the_robot_stand() -> None:
    walk = standing(HEXAPOD, INSECT).go(2.3, asked([0.15, 0, 0], INSECT))
    assert (walk.plans[-1].swing >= 0).any()
    plan = walk.plans[-1]
    walk.fail("a leg does not follow").go(2.0, asked([0.15, 0, 0], INSECT))
    last = walk.plans[-1]
    assert last.activity == "halt"
    assert last.status == "a leg does not follow"
    assert (last.swing < 0).all()
    assert_allclose(last.feet_P[:, 2], 0.0, atol=1e-12)
    assert_allclose(last.twist.value, 0.0)
    # Half of 0.15 m/s over 0.8 s, the time of a stop.
    assert np.hypot(*(last.q_xyt - plan.q_xyt)[:2]) < 0.075
    assert_allclose(last.feet_P[plan.swing < 0], plan.feet_P[plan.swing < 0], atol=1e-11)
