"""Courses without jumps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from rollerbench.kinematics.gaits.smooth import Follower, bump, quintic


@pytest.mark.parametrize(("course", "end"), [(quintic, 1.0), (bump, 0.0)])
def test_courses_begin_and_end_at_rest(course, end: float) -> None:
    u = np.linspace(0, 1, 1001)
    values = course(u)
    assert values[[0, -1]].tolist() == [0.0, end]
    rate = np.gradient(values, u, edge_order=2)
    # The third derivative is 60 and 384: a step of 1e-3 beside the ends the slope is 3e-5 and 2e-4, at most.
    assert_allclose(rate[[0, -1]], 0.0, atol=1e-3)
    assert_allclose(np.gradient(rate, u, edge_order=2)[[0, -1]], 0.0, atol=2.0)
    assert course(np.array([-1.0, 2.0])).tolist() == [0.0, end]


def test_a_bump_is_highest_in_the_middle_and_a_quintic_is_odd_about_it() -> None:
    assert bump(0.5) == 1.0
    u = np.linspace(0, 1, 101)
    assert_allclose(bump(u), bump(1 - u), atol=1e-15)
    assert_allclose(quintic(u) + quintic(1 - u), 1.0, atol=1e-15)
    assert (np.diff(quintic(u)) >= 0).all()


def followed(steps: np.ndarray, target: np.ndarray, start: Follower, duration: float) -> list[Follower]:
    course = [start]
    for step in steps:
        course.append(course[-1].follow(target, float(step), duration))
    return course


vectors = st.lists(st.floats(-5, 5), min_size=3, max_size=3).map(np.array)


@given(vectors, vectors, st.floats(0.1, 3), st.integers(1, 50))
def test_the_target_is_reached_in_time_and_kept(start, target, duration, count) -> None:
    steps = np.full(count, duration / count)
    end = followed(steps, target, Follower.resting(start), duration)[-1]
    assert_allclose(end.value, target, atol=1e-9)
    assert not end.rate.any()
    assert_allclose(end.follow(target, 0.3, duration).value, end.value, atol=1e-9)


@given(vectors, vectors, st.floats(0.1, 3), st.integers(0, 10_000))
def test_the_way_does_not_depend_on_the_steps(start, target, duration, seed) -> None:
    rng = np.random.default_rng(seed)
    parts = rng.dirichlet(np.ones(7)) * 0.8 * duration
    begin = Follower(start, rng.uniform(-1, 1, 3), start)
    fine = followed(parts, target, begin, duration)[-1]
    once = followed(np.array([0.8 * duration]), target, begin, duration)[-1]
    assert_allclose(fine.value, once.value, atol=1e-9)
    assert_allclose(fine.rate, once.rate, atol=1e-8)
    assert fine.remaining == pytest.approx(once.remaining, abs=1e-12)


@given(vectors, vectors, vectors, st.floats(0.5, 3), st.floats(0.0, 1.2))
def test_value_and_rate_do_not_jump_at_a_new_target(start, target, other, duration, share) -> None:
    now = Follower.resting(start).follow(target, share * duration, duration)
    step = 1e-6
    following = now.follow(other, step, duration)
    size = np.abs([start, target, other]).max() + 1
    assert_allclose(following.value, now.value + step * now.rate, atol=100 * size * step**2 / duration**2 + 1e-12)
    assert_allclose(following.rate, now.rate, atol=100 * size * step / duration**2)


@given(vectors, vectors, st.floats(0.5, 3), st.floats(0.05, 0.9))
def test_the_rate_is_the_derivative_of_the_value(start, target, duration, share) -> None:
    begin = Follower.resting(start)
    now, later, sooner = (begin.follow(target, share * duration + d, duration) for d in (0.0, 1e-5, -1e-5))
    # 1e-5: the central difference over 2e-5 s of values of up to 5.
    assert_allclose(now.rate, (later.value - sooner.value) / 2e-5, atol=1e-5)
