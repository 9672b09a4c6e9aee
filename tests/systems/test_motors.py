"""Wheels by torques: speed controllers, their limits, and what they read of contacts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

import robots
import rollerbench as rb
from rollerbench.systems import PidGains, RollResistance, SlipMonitor, WheelSpeedController, wheel_speed_gains


def cart(max_effort: float | None = None) -> rb.Robot:
    data = robots.cart()
    if max_effort is not None:
        for wheel in data["wheels"][:2]:
            wheel["max_effort"] = max_effort
    return rb.load_robot(data)


def torques(controller: WheelSpeedController, commands: list[float], speeds: list[float], dt: float) -> list[float]:
    """Torques of the first wheel, one a time step, for given commands and speeds."""
    simulator = Simulator(controller)
    context = simulator.get_mutable_context()
    found = []
    for step, (command, speed) in enumerate(zip(commands, speeds, strict=True)):
        controller.GetInputPort("wheel_speed_command").FixValue(context, [command, 0.0])
        controller.GetInputPort("wheel_speeds").FixValue(context, [speed, 0.0])
        found.append(float(controller.GetOutputPort("wheel_efforts").Eval(context)[0]))
        # Past the update at the end of the step, short of the next one.
        simulator.AdvanceTo((step + 0.5) * dt)
    return found


numbers = st.lists(st.floats(-10, 10), min_size=2, max_size=12)


@settings(max_examples=25, deadline=None)
@given(commands=numbers, limit=st.floats(0.1, 5.0), data=st.data())
def test_the_controller_is_its_difference_equation(commands: list[float], limit: float, data: st.DataObject) -> None:
    speeds = data.draw(st.lists(st.floats(-10, 10), min_size=len(commands), max_size=len(commands)))
    kp, ki, kd, dt = 0.4, 3.0, 0.002, 0.01
    controller = WheelSpeedController(cart(limit), dt, [PidGains(kp=kp, ki=ki, kd=kd)] * 2)
    integral = before = 0.0
    expected = []
    for command, speed in zip(commands, speeds, strict=True):
        wanted = kp * (command - speed) + integral - kd * (speed - before) / dt
        torque = min(limit, max(-limit, wanted))
        expected.append(torque)
        integral += dt * ki * (command - speed) + min(1.0, dt * ki / kp) * (torque - wanted)
        before = speed
    found = torques(controller, commands, speeds, dt)
    assert found == pytest.approx(expected, abs=1e-12)
    assert max(map(abs, found)) <= limit


def test_the_integral_does_not_wind_up() -> None:
    """After a long time at the limit, the torque leaves it as soon as the error changes its sign."""
    gains = [PidGains(kp=1.0, ki=10.0)] * 2
    commands, speeds = [100.0] * 50 + [0.0] * 3, [0.0] * 50 + [10.0] * 3
    found = torques(WheelSpeedController(cart(2.0), 0.01, gains), commands, speeds, 0.01)
    assert found[49] == 2.0
    assert found[51] == -2.0
    # Also where the tracking time kp / ki is shorter than a step.
    hard = torques(WheelSpeedController(cart(2.0), 0.01, [PidGains(kp=0.01, ki=50.0)] * 2), commands, speeds, 0.01)
    assert hard[49] == 2.0
    assert hard[52] == -2.0


@pytest.mark.parametrize("name", ["youbot_base", "mecanum_platform", "differential_cart", "kiwi"])
def test_default_gains_follow_a_command_on_light_and_heavy_robots(name: str) -> None:
    scenario = {
        "name": "by_torques",
        "robot": name,
        "duration": 2.0,
        "command": {"type": "twist", "v_xyw_B": [0.2, 0.0, 0.0], "ramp": 0.5},
        "controller": {"servo": "pid"},
    }
    result = rb.run(scenario, save=False)
    # It lags behind the ramps, and rolls on a little at the end.
    assert result.recording.q_xyt[-1] == pytest.approx([0.3, 0.0, 0.0], abs=0.015)
    speeds = result.recording.wheels("speed")[290]
    driven = [index for index, wheel in enumerate(rb.load_robot(name).wheels) if wheel.driven]
    assert speeds[driven] == pytest.approx(result.recording.wheels("command")[290][driven], rel=0.02, abs=1e-6)


@pytest.mark.parametrize(
    ("gains", "words"),
    [
        ([PidGains(kp=1.0, ki=0.0)], "1 for 2 driven wheels"),
        ([PidGains(kp=-1.0, ki=0.0)] * 2, "gains of left"),
        ([PidGains(kp=0.0, ki=1.0)] * 2, "ki only with kp"),
        ([PidGains(kp=float("nan"), ki=0.0)] * 2, "0 or more"),
    ],
)
def test_wrong_gains_are_refused(gains: list[PidGains], words: str) -> None:
    with pytest.raises(rb.KinematicsError, match=words):
        WheelSpeedController(cart(), 0.01, gains)


def test_gains_keep_a_slipping_wheel_stable() -> None:
    for name in ("youbot_base", "mecanum_platform", "omni_platform"):
        robot = rb.load_robot(name)
        for wheel, gain in zip(robot.driven_wheels, wheel_speed_gains(robot, 0.005), strict=True):
            assert 0.005 * gain.kp <= 1.001 * rb.description.mass.axle_inertia(wheel)


EFFORTS = {
    "youbot_base": {"front_left": 0.3, "front_right": 0.1, "rear_left": 0.1, "rear_right": 0.3},
    "omni_platform": {"front_left": -0.3, "rear_left": -0.3, "rear_right": 0.3, "front_right": 0.3},
    "differential_cart": {"left": 0.25, "right": 0.3},
    "six_wheel": {"right_middle": 0.5, "left_middle": 0.5},
}


@pytest.mark.parametrize("roll_resistance", [0.0, 0.005])
@pytest.mark.parametrize("name", ["youbot_base", "omni_platform", "differential_cart"])
def test_torques_accelerate_as_the_rigid_body_does(name: str, roll_resistance: float) -> None:
    """The reference of a torque command are the equations of motion; Drake ends near their path.

    Spinning up each roller that comes to the ground costs up to 3 % of it.
    """
    scenario = {
        "name": "torques",
        "robot": name,
        "duration": 1.0,
        "command": {"type": "wheel_efforts", "wheel_efforts": EFFORTS[name]},
        "ground": {"roll_resistance": roll_resistance},
        "plant": {"time_step": 0.002},
    }
    result = rb.run(scenario, save=False)
    assert result.summary["path_length"] > 0.1
    assert result.summary["pose_error"]["percent_of_path"] < (1.0 if name == "differential_cart" else 3.5)
    assert np.nanmax(np.abs(result.recording.wheels("effort")[100])) == max(map(abs, EFFORTS[name].values()))


def test_rolling_resistance_slows_a_coasting_cart_by_its_share_of_the_weight() -> None:
    """Without torques v' = -f m g / (m + J / R^2 of the wheels): Newton's second law."""
    from rollerbench.kinematics.dynamics import RollingDynamics

    dynamics = RollingDynamics(rb.WheelKinematics(robots.cart()), 0.02)
    left, right, castor = dynamics.static_loads
    assert left + right + castor == pytest.approx(9.81 * dynamics.kinematics.robot.mass)
    rate = dynamics.acceleration([0.5, 0.0, 0.0], [0.0, 0.0])
    assert rate[0] == pytest.approx(-0.02 * (left + right + castor) / dynamics.mass_matrix[0, 0])
    assert dynamics.mass_matrix[0, 0] > dynamics.kinematics.robot.mass


@pytest.mark.parametrize("roll_resistance", [0.02, 0.3])
def test_rolling_resistance_does_not_shake_a_robot_at_rest(roll_resistance: float) -> None:
    """A push that is far too weak: wheels and rollers, light as they are, stay at rest."""
    scenario = {
        "name": "rest",
        "robot": "youbot_base",
        "duration": 0.5,
        "command": {"type": "wheel_efforts", "wheel_efforts": {"front_left": 0.001}},
        "ground": {"roll_resistance": roll_resistance},
    }
    recording = rb.run(scenario, save=False).recording
    assert np.abs(recording.wheels("speed")[50:]).max() < 0.02
    assert np.abs(recording.reference_v_xyw_B).max() < 0.01


def test_slip_monitor_names_the_wheel_that_slides() -> None:
    from pydrake.systems.analysis import Simulator

    scenario = {
        "name": "spin",
        "robot": "youbot_base",
        "duration": 0.4,
        "command": {"type": "wheel_speeds", "wheel_speeds": {"front_left": 5.0}, "ramp": 0.1},
        "errors": {"friction": {"front_left": 0.05}},
    }
    station = rb.build_station(scenario)
    assert isinstance(station.GetSubsystemByName("slip_monitor"), SlipMonitor)
    simulator = Simulator(station)
    rb.follow_rollers(simulator)
    simulator.AdvanceTo(0.25)
    slip = station.GetOutputPort("slip").Eval(simulator.get_context())
    assert slip[0] > 0.1
    assert max(slip[1:]) < 0.2 * slip[0]


def test_bad_commands_of_torques_are_refused() -> None:
    base = {"name": "torques", "robot": "youbot_base", "duration": 1.0}
    for command, words in (
        ({"front": 1.0}, r"wheel_efforts.front: not a driven wheel.*front_left"),
        ({"front_left": 1e4}, r"wheel_efforts.front_left = 10000.*accepted: from -"),
    ):
        with pytest.raises(rb.DescriptionError, match=words):
            rb.load_scenario({**base, "command": {"type": "wheel_efforts", "wheel_efforts": command}})
    slope = {"command": {"type": "wheel_efforts", "wheel_efforts": {}}, "ground": {"slope_deg": 5.0}}
    with pytest.raises(rb.DescriptionError, match=r"ground.slope_deg = 5.*level ground only"):
        rb.load_scenario({**base, **slope})
    pid = {"command": {"type": "twist", "v_xyw_B": [0.1, 0, 0]}, "controller": {"pid": {"kp": 1.0}}}
    with pytest.raises(rb.DescriptionError, match=r"controller.pid.*accepted: with servo: pid"):
        rb.load_scenario({**base, **pid})
    with pytest.raises(rb.SimulationError, match="coefficient = -1"):
        RollResistance(rb.build_station("youbot_plus_x").parts.model, -1.0)
