"""When legs lift, for robots of four, six and eight legs."""

from itertools import pairwise

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.kinematics.gaits import GAITS, LegMode, LegPlanner
from rollerbench.kinematics.gaits.gait import gait_of, schedule
from walking import DT, asked, standing

ROBOTS = {"quadruped": robots.quadruped, "hexapod": lambda: "wheel_leg_hexapod", "octopod": robots.octopod}
every_robot = pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
every_gait = pytest.mark.parametrize("gait", GAITS)


def in_the_air(gait: str, robot: rb.Robot, count: int = 4800):
    """Which legs (count, k) are in the air, over a period."""
    plan = schedule(gait_of(gait), robot)
    time = (np.arange(count) + 0.5) / count
    return (time[:, np.newaxis] + plan.phases) % 1.0 >= plan.duty


@every_robot
def test_the_wave_always_has_one_leg_in_the_air_at_the_most(make) -> None:
    robot = rb.load_robot(make())
    flying = in_the_air("wave", robot)
    assert flying.sum(axis=1).max() == 1
    # Every leg has its turn, and there is no pause.
    assert flying.sum(axis=1).min() == 1
    assert schedule(gait_of("wave"), robot).duty == pytest.approx(1 - 1 / len(robot.legs))


@every_robot
def test_the_wave_runs_ahead_along_each_side(make) -> None:
    """McGhee and Frank: the leg ahead of one that lands lifts next."""
    robot = rb.load_robot(make())
    flying = in_the_air("wave", robot)
    for side in (1, -1):
        legs = sorted(
            (i for i, leg in enumerate(robot.legs) if leg.hip[1] * side > 0), key=lambda i: robot.legs[i].hip[0]
        )
        lands = {i: int(np.flatnonzero(flying[:, i] & ~np.roll(flying[:, i], -1))[0]) for i in legs}
        lifts = {i: int(np.flatnonzero(flying[:, i] & ~np.roll(flying[:, i], 1))[0]) for i in legs}
        for behind, ahead in pairwise(legs):
            assert lifts[ahead] == (lands[behind] + 1) % len(flying)


@every_robot
def test_the_tripod_has_two_groups_that_take_turns(make) -> None:
    robot = rb.load_robot(make())
    plan = schedule(gait_of("tripod"), robot)
    assert sorted(set(plan.phases.tolist())) == [0.0, 0.5]
    for i, one in enumerate(robot.legs):
        for j, other in enumerate(robot.legs):
            across = one.hip[0] == other.hip[0] and i != j
            places = sorted({leg.hip[0] for leg in robot.legs})
            beside = one.hip[1] == other.hip[1] and abs(places.index(one.hip[0]) - places.index(other.hip[0])) == 1
            if across or beside:
                assert plan.phases[i] != plan.phases[j]
    flying = in_the_air("tripod", robot)
    assert flying.sum(axis=1).max() == len(robot.legs) / 2


@pytest.mark.parametrize("gait", ["ripple", "amble"])
def test_ripple_and_amble_keep_four_of_six_feet_on_the_ground(gait: str) -> None:
    flying = in_the_air(gait, rb.load_robot("wheel_leg_hexapod"))
    assert flying.sum(axis=1).max() == 2


@pytest.mark.parametrize("gait", ["tripod", "amble"])
def test_groups_that_change_over_stand_together_for_a_moment(gait: str) -> None:
    # Otherwise too few feet would stand in two plans in a row to tell where the body is.
    flying = in_the_air(gait, rb.load_robot("wheel_leg_hexapod"))
    assert flying.sum(axis=1).min() == 0


def test_the_amble_lifts_pairs_and_the_ripple_overlaps() -> None:
    robot = rb.load_robot("wheel_leg_hexapod")
    assert np.unique(schedule(gait_of("amble"), robot).phases).size == 3
    assert np.unique(schedule(gait_of("ripple"), robot).phases).size == 6


@every_robot
@every_gait
def test_feet_are_on_the_ground_for_their_share_and_lift_once_a_period(make, gait: str) -> None:
    robot = rb.load_robot(make())
    planner = LegPlanner(robot)
    mode = LegMode(posture=robot.standing[0].name, gait=gait)
    walk = standing(planner, mode).go(4.6, asked([0.03, 0.0, 0.0], mode))
    assert not walk.faults
    duty = schedule(gait_of(gait), robot).duty
    flying = walk.swing[(walk.time > 2.0 + 1e-9) & (walk.time < 4.0 + 1e-9)] >= 0
    # Legs lift and land at full periods of control.
    assert np.abs((~flying).mean(axis=0) - duty).max() <= DT + 1e-9
    lifts = (walk.swing[1:] >= 0) & (walk.swing[:-1] < 0)
    for leg in range(len(robot.legs)):
        times = walk.time[1:][lifts[:, leg]]
        assert len(times) >= 4
        assert np.diff(times) == pytest.approx(1.0, abs=1.01 * DT)


def test_an_unknown_gait_is_refused() -> None:
    with pytest.raises(rb.KinematicsError, match=r"gait = 'hop': accepted: tripod, ripple, amble, wave"):
        gait_of("hop")
