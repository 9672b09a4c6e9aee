"""What a hand asks for becomes what wheels are told: limits, round trips, projections; and who may ask."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import robots
import rollerbench as rb
from rollerbench.resources import robot_names
from rollerbench.simulation.teleop.desk import Desk, Message
from rollerbench.simulation.teleop.driver import Told, WheelDriver, Wish
from rollerbench.simulation.teleop.ranges import plant_step
from rollerbench.simulation.teleop.session import PERIOD, teleop_scenario

SHIPPED = [name for name in robot_names() if not rb.load_robot(name).legs]
OWN = {**robots.ALL, "car": robots.car}
DRIVERS = {name: WheelDriver(rb.WheelKinematics(name), PERIOD) for name in SHIPPED}
DRIVERS |= {name: WheelDriver(rb.WheelKinematics(make()), PERIOD) for name, make in OWN.items()}
UNSTEERED = [name for name, driver in DRIVERS.items() if not driver.kinematics.robot.steered_wheels]

everyone = pytest.mark.parametrize("name", DRIVERS)


def wish(driver: WheelDriver, mode="twist", twist=(0.0, 0.0, 0.0), wheels=None, angles=None) -> Wish:
    """A wish in shares of the largest values."""
    largest = np.array([axis.largest for axis in driver.ranges.axes])
    count, steered = len(driver.ranges.wheel_speeds), len(driver.ranges.steering_speeds)
    return Wish(
        mode=mode,
        v_xyw_B=np.array(twist) * largest,
        wheel_speeds=(np.zeros(count) if wheels is None else np.array(wheels)[:count]) * driver.ranges.wheel_speeds,
        steering_angles=np.zeros(steered) if angles is None else np.array(angles)[:steered],
    )


def after(driver: WheelDriver, told: Told, asked: Wish, time: float) -> Told:
    for _ in range(round(time / PERIOD)):
        told = driver.step(told, asked)
    return told


share = st.floats(-2, 2)
wishes = st.tuples(
    st.sampled_from(["twist", "wheels"]),
    st.tuples(share, share, share),
    st.lists(share, min_size=6, max_size=6),
    st.lists(st.floats(-4, 4), min_size=4, max_size=4),
)


@settings(max_examples=60)
@given(st.sampled_from(sorted(DRIVERS)), st.lists(st.tuples(wishes, st.integers(1, 4)), min_size=1, max_size=6))
def test_limits_hold_whatever_is_asked_for(name: str, course) -> None:
    driver = DRIVERS[name]
    told, ranges = driver.start(), driver.ranges
    for asked, periods in course:
        for _ in range(periods):
            before, told = told, driver.step(told, wish(driver, *asked))
            assert (np.abs(told.wheel_speeds) <= ranges.wheel_speeds * (1 + 1e-12)).all()
            change = np.abs(told.wheel_speeds - before.wheel_speeds)
            assert (change <= ranges.wheel_accelerations * PERIOD * (1 + 1e-9)).all()
            assert (np.abs(told.steering_rates) <= ranges.steering_speeds * (1 + 1e-9)).all()
            assert np.isfinite(told.ghost).all()


@everyone
def test_a_twist_and_the_wheel_speeds_it_means_are_one_motion(name: str) -> None:
    """The two panels agree: wheels asked for what a twist made of them lead to that twist, without contradiction."""
    driver = DRIVERS[name]
    told = driver.start()
    by_twist = driver.preview(told, wish(driver, twist=(0.4, 0.3, -0.2)))
    by_wheels = driver.preview(
        told,
        Wish(
            mode="wheels",
            v_xyw_B=np.zeros(3),
            wheel_speeds=by_twist.wheel_speeds,
            steering_angles=by_twist.steering_angles,
        ),
    )
    assert_allclose(by_wheels.v_xyw_B, by_twist.v_xyw_B, atol=1e-9)
    assert_allclose([by_twist.contradiction, by_wheels.contradiction], 0.0, atol=1e-9)


@everyone
def test_what_is_told_becomes_what_was_asked_for_and_the_ghost_drives_its_arc(name: str) -> None:
    driver = DRIVERS[name]
    asked = wish(driver, twist=(0.4, 0.3, -0.2))
    told = after(driver, driver.start(), asked, 3.0)
    preview = driver.preview(told, asked)
    assert_allclose(told.v_xyw_B, preview.v_xyw_B, atol=1e-9)
    assert_allclose(told.wheel_speeds, preview.wheel_speeds, atol=1e-9)
    later = after(driver, told, asked, 1.0)
    assert_allclose(later.ghost, rb.odometry.integrate(told.ghost, preview.v_xyw_B, 1.0), atol=1e-9)


@everyone
def test_without_a_command_the_robot_comes_to_rest_as_it_is_steered(name: str) -> None:
    driver = DRIVERS[name]
    for mode in ("twist", "wheels"):
        asked = wish(driver, mode, (1, 1, 1), [1, -1, 0.5, 1, -0.3, 1], [1, -1, 2, 0.5])
        told = after(driver, driver.start(), asked, 0.6)
        slowest = (np.abs(told.wheel_speeds) / driver.ranges.wheel_accelerations).max()
        # Twice that, as a twist's wheels brake together, and as wheels asked for may contradict each other.
        for _ in range(math.ceil(2 * slowest / PERIOD) + 2):
            told = driver.step(told, driver.rest(told))
        assert not told.wheel_speeds.any()
        assert not told.steering_rates.any()
        assert_allclose(after(driver, told, driver.rest(told), 1.0).ghost, told.ghost, atol=1e-12)


def test_one_wheel_alone_contradicts_the_other_three() -> None:
    """Four Mecanum wheels have one motion too many: a quarter of the speed of one is slip at each."""
    driver = DRIVERS["youbot_base"]
    preview = driver.preview(driver.start(), wish(driver, "wheels", wheels=[1, 0, 0, 0]))
    assert preview.contradiction == pytest.approx(0.0475 * 30.0 / 4)


def test_the_impossible_is_projected_and_named() -> None:
    cart = DRIVERS["differential_cart"]
    sideways = cart.preview(cart.start(), wish(cart, twist=(0.5, 1, 0)))
    assert_allclose(sideways.v_xyw_B, wish(cart, twist=(0.5, 0, 0)).v_xyw_B, atol=1e-12)
    assert "left, right" in sideways.notes[0]
    youbot = DRIVERS["youbot_base"]
    fast = youbot.preview(youbot.start(), wish(youbot, twist=(1, 1, 0)))
    assert_allclose(fast.v_xyw_B, wish(youbot, twist=(0.5, 0.5, 0)).v_xyw_B, atol=1e-12)
    assert "50 % of the twist" in fast.notes[0]
    assert not youbot.preview(youbot.start(), wish(youbot, twist=(1, 0, 0))).notes


def test_sliders_go_as_far_as_the_robot_can() -> None:
    reasons = {name: [bool(axis.reason) for axis in driver.ranges.axes] for name, driver in DRIVERS.items()}
    for name in ("differential_cart", "six_wheel", "cart", "car"):
        assert reasons[name] == [False, True, False], name
    for name in ("kiwi", "omni_platform", "mecanum_platform", "swerve_base", "youbot_base", "swerve"):
        assert reasons[name] == [False, False, False], name
    youbot = DRIVERS["youbot_base"].ranges
    assert youbot.axes[0].largest == pytest.approx(30.0 * 0.0475)
    # Without limits of its wheels: a body length a second.
    assert DRIVERS["cart"].ranges.axes[0].largest == pytest.approx(0.4)


@everyone
def test_the_plant_follows_the_rollers_at_full_speed(name: str) -> None:
    driver = DRIVERS[name]
    step = plant_step(driver.kinematics, driver.ranges)
    assert PERIOD / step == pytest.approx(round(PERIOD / step))
    for wheel, speed in zip(driver.kinematics.robot.driven_wheels, driver.ranges.wheel_speeds, strict=True):
        if wheel.ring is not None:
            assert speed * step <= wheel.ring.pitch / 6 * (1 + 1e-9)


def test_who_touched_last_drives_until_silence_or_goodbye() -> None:
    desk = Desk(timeout=0.5)
    assert desk.order(0.0).message is None
    first, second = Message(touch=1, twist=(1, 0, 0)), Message(touch=1, twist=(0, 1, 0))
    desk.receive(1, Message(touch=0, twist=(9, 0, 0)), 0.0)
    assert desk.order(0.0).driver is None
    desk.receive(1, first, 0.0)
    desk.receive(2, second, 0.1)
    desk.receive(1, first, 0.2)
    assert (desk.order(0.2).driver, desk.order(0.2).message) == (2, second)
    assert desk.order(0.6).message == second
    late = desk.order(0.6 + 1e-6)
    assert (late.message, late.driver, late.late, late.lapses) == (None, None, True, 1)
    # What went on by itself, or was held back on the way, does not drive again.
    for held_back in (second, second.model_copy(update={"touch": 2})):
        desk.receive(2, held_back, 0.7)
        assert desk.order(0.7).driver is None
    second = second.model_copy(update={"touch": 3, "lapses": 1})
    desk.receive(2, second, 0.7)
    assert (desk.order(0.7).message, desk.order(0.7).late) == (second, False)
    # Also if nobody asked for orders meanwhile.
    desk.receive(2, second, 1.3)
    assert desk.order(1.3).message is None
    second = second.model_copy(update={"touch": 4, "lapses": 2})
    desk.receive(2, second, 1.4)
    desk.leave(1)
    assert desk.order(1.4).driver == 2
    desk.leave(2)
    assert (desk.order(1.4).driver, desk.order(1.4).message) == (None, None)
    desk.receive(3, Message(touch=0, action="reset"), 0.8)
    assert [desk.order(0.8).actions, desk.order(0.8).actions] == [("reset",), ()]


@pytest.mark.parametrize("text", ["", "[]", '{"touch": 1, "twist": [NaN, 0, 0]}', '{"touch": 1, "fast": 1}'])
def test_what_no_page_would_send_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="validation error"):
        Message.model_validate_json(text)


def test_scenarios_take_overrides_and_refuse_what_cannot_be_driven() -> None:
    assert teleop_scenario("youbot_base").plant.time_step <= math.radians(5) / 30.0
    assert teleop_scenario("kiwi", ["ground.friction=0.2"]).ground.friction == 0.2
    with pytest.raises(rb.DescriptionError, match="engine = mujoco"):
        teleop_scenario("kiwi", ["engine=mujoco"])
    loose = robots.kiwi()
    loose["wheels"] = [{**wheel, "driven": index == 0} for index, wheel in enumerate(loose["wheels"])]
    with pytest.raises(rb.KinematicsError, match="leave a motion of the body open"):
        teleop_scenario(loose)
