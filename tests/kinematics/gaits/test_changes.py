"""Changes of posture, both ways and both methods; and random commands of every kind."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import rollerbench as rb
from rollerbench.kinematics.gaits import GAITS, LegMode, LegPlanner
from walking import DT, asked, standing

HEXAPOD = LegPlanner(rb.load_robot("wheel_leg_hexapod"))
WAYS = [("insect", "mammal"), ("mammal", "insect")]


def change(start: str, end: str, method: str):
    first, second = LegMode(posture=start), LegMode(posture=end, change=method)
    walk = standing(HEXAPOD, first).go(0.2, asked([0, 0, 0], first))
    return walk.go(10.0 if method == "rolling" else 4.0, asked([0, 0, 0], second))


@pytest.mark.parametrize("method", ["stepping", "rolling"])
@pytest.mark.parametrize(("start", "end"), WAYS)
def test_changes_end_in_the_posture_and_keep_their_balance(start: str, end: str, method: str) -> None:
    walk = change(start, end, method)
    assert not walk.faults
    last = walk.plans[-1]
    assert last.posture.name == end
    assert last.activity == "walk"
    assert last.height == pytest.approx(HEXAPOD.stances.height(end), abs=1e-9)
    assert walk.margins.min() > 0.05
    assert_allclose(last.q_xyt, 0.0, atol=1e-12)
    # What the inverse leaves in a period.
    assert_allclose(last.feet_P[:, :2], HEXAPOD.stances.home(end), atol=1e-4)
    assert_allclose(walk.q[-1], HEXAPOD.stances.joints(end), atol=1e-3)
    assert walk.feet[..., 2].min() > -1e-3
    assert np.abs(np.diff(np.array(walk.q), axis=0)).max() / DT < 10.0
    if method == "rolling":
        assert (walk.swing < 0).all()
    else:
        lifts = (walk.swing[1:] >= 0) & (walk.swing[:-1] < 0)
        assert lifts.sum(axis=0).tolist() == [1] * 6
        assert walk.feet[..., 2].max(axis=0) == pytest.approx(0.05, abs=5e-3)


@pytest.mark.parametrize("gait", GAITS)
def test_legs_step_into_a_posture_in_the_groups_of_the_gait(gait: str) -> None:
    mode = LegMode(posture="mammal", gait=gait)
    together, duration = {"tripod": (3, 3.8), "ripple": (1, 7.0), "amble": (2, 4.6), "wave": (1, 7.0)}[gait]
    walk = standing(HEXAPOD).go(duration, asked([0, 0, 0], mode))
    assert walk.plans[-1].posture.name == "mammal"
    assert (walk.swing >= 0).sum(axis=1).max() == together


def test_a_robot_walks_on_in_its_new_posture() -> None:
    insect, mammal = LegMode(posture="insect"), LegMode(posture="mammal")
    walk = standing(HEXAPOD, insect).go(2.3, asked([0.15, 0, 0], insect)).go(6.5, asked([0.15, 0, 0], mammal))
    assert not walk.faults
    last = walk.plans[-1]
    assert last.posture.name == "mammal"
    assert_allclose(last.twist.value, [0.15, 0, 0], atol=1e-12)
    # It has come to rest before the first leg changes.
    changing = np.array([plan.activity == "change" for plan in walk.plans])
    assert changing.any()
    assert not walk.twist[changing].any()


def test_no_wheel_rolls_between_postures_of_one_kind() -> None:
    """A change by rolling needs one posture with the feet under the hips."""
    data = rb.load_robot("wheel_leg_hexapod").model_dump(mode="json")
    data["postures"].append({"name": "low", "hold": "tibia"})
    for leg in data["legs"]:
        leg["postures"]["low"] = [*leg["postures"]["insect"][:1], 30, -120, leg["postures"]["insect"][3]]
    planner = LegPlanner(rb.load_robot(data))
    with pytest.raises(rb.KinematicsError, match="from insect to low no wheel can roll"):
        standing(planner).go(0.1, asked([0, 0, 0], LegMode(posture="low", change="rolling")))


modes = st.builds(
    LegMode,
    posture=st.sampled_from(["insect", "insect", "mammal"]),
    motion=st.sampled_from(["walk", "walk", "drive"]),
    gait=st.sampled_from(list(GAITS)),
    change=st.sampled_from(["stepping", "rolling"]),
)
twists = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1), st.sampled_from([0.0, 0.5, 1.0, 4.0])).map(
    lambda v: v[3] * np.array([0.2 * v[0], 0.1 * v[1], 0.3 * v[2]])
)
offsets = st.sampled_from([np.zeros(6), np.zeros(6), np.array([0.02, -0.02, 0.01, 0.03, -0.03, 0.05])])
courses = st.lists(st.tuples(st.floats(0.3, 3.0), twists, modes, offsets), min_size=1, max_size=4)


@settings(max_examples=20)
@given(courses)
def test_whatever_is_asked_nothing_jumps_or_breaks(course) -> None:
    """Any sequence of commands is followed, or the robot halts and says why."""
    walk, dt = standing(HEXAPOD, course[0][2]), 2 * DT
    for duration, twist, mode, offset in course:
        walk.go(duration, asked(twist, mode, offset), dt)
    q = np.array(walk.q)
    assert np.isfinite(q).all()
    assert np.isfinite(walk.feet).all()
    low, high = HEXAPOD.group.limits
    # 1e-3: by so much joints may be beyond their limits before a leg stops.
    assert (q >= low - 1.1e-3).all()
    assert (q <= high + 1.1e-3).all()
    # The fastest foot is that of a wave in 1/6 s; a jump of 0.1 m in a period would be 5 m/s.
    assert np.linalg.norm(np.diff(walk.feet, axis=0), axis=2).max() / dt < 5.0
    # Two iterations of the inverse turn a joint by 0.6 rad at the most.
    assert np.abs(np.diff(q, axis=0)).max() <= 0.6 + 1e-9
    assert walk.feet[..., 2].min() > -1e-3
    halted = [plan for plan in walk.plans if plan.activity == "halt"]
    assert all(plan.status for plan in halted)
    if not any(done.fault for done in walk.tracked):
        assert walk.misses.max() < 1e-3
        assert not halted
    else:
        assert halted or walk.tracked[-1].fault
