"""The station as a part of other diagrams: its ports, and what comes in and out of them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import robots
import rollerbench as rb
from ports import documented_ports, ports
from rollerbench.description.inertia import GRAVITY
from rollerbench.simulation.station import Station

TWIST = {"type": "twist", "v_xyw_B": [0.2, 0.0, 0.1], "ramp": 0.2}
WHEELS = {"type": "wheel_speeds", "wheel_speeds": {}}
EFFORTS = {"type": "wheel_efforts", "wheel_efforts": {}}
TRACKING = {"type": "pose_tracking"}


def scenario(robot, command=TWIST, **settings) -> rb.Scenario:
    return rb.load_scenario({"name": "ports", "robot": robot, "duration": 1.0, "command": command, **settings})


def started(station):
    """A simulator of a station, and its context."""
    simulator = Simulator(station)
    rb.follow_rollers(simulator)
    return simulator, simulator.get_mutable_context()


def test_ports_are_the_documented_ones() -> None:
    found: tuple[set[str], set[str]] = (set(), set())
    for each in (
        scenario("kiwi"),
        scenario("kiwi", WHEELS),
        scenario("kiwi", EFFORTS),
        scenario("swerve_base"),
        scenario("kiwi", controller=TRACKING),
    ):
        for command in ("scenario", "external", "rest", "wheels"):
            inputs, outputs = ports(rb.build_station(each, command=command))
            assert bool(inputs) == (command in ("external", "wheels"))
            found = (found[0] | inputs, found[1] | outputs)
    assert found == documented_ports(Station)


def test_a_wheel_command_from_outside_turns_the_wheels() -> None:
    station = rb.build_station(scenario("kiwi", WHEELS), command="external")
    simulator, context = started(station)
    speeds = [1.0, -2.0, 0.5]
    station.GetInputPort("wheel_command").FixValue(context, speeds)
    simulator.AdvanceTo(0.5)
    state = station.GetOutputPort("wheel_state").Eval(context)
    assert state[3:] == pytest.approx(speeds, rel=1e-3)
    # 0.05 rad: the wheels had to come up to speed.
    assert state[:3] == pytest.approx(0.5 * np.array(speeds), abs=0.05)
    assert_allclose(station.GetOutputPort("wheel_speeds").Eval(context), state[3:], rtol=1e-12)


def test_an_effort_command_from_outside_accelerates() -> None:
    each = scenario("differential_cart", EFFORTS)
    station = rb.build_station(each, command="external")
    simulator, context = started(station)
    station.GetInputPort("effort_command").FixValue(context, [0.3, 0.3])
    simulator.AdvanceTo(0.5)
    assert station.GetOutputPort("net_actuation").Eval(context) == pytest.approx([0.3, 0.3])
    expected = rb.run(
        {
            **each.model_dump(),
            "robot": each.robot,
            "duration": 0.5,
            "command": {**EFFORTS, "wheel_efforts": {"left": 0.3, "right": 0.3}},
        },
        save=False,
    )
    assert station.GetOutputPort("twist").Eval(context)[0] == pytest.approx(expected.recording.v_xyw_B[-1, 0], rel=0.05)


def test_a_twist_from_outside_steers_wheels_and_odometry_follows() -> None:
    station = rb.build_station(scenario("swerve_base"), command="external")
    simulator, context = started(station)
    twist = station.GetInputPort("twist_command")
    for time, value in ((0.5, [0.2, 0.0, 0.0]), (1.0, [0.0, 0.2, 0.0]), (1.5, [0.1, 0.1, 0.4])):
        twist.FixValue(context, value)
        simulator.AdvanceTo(time)
    assert station.GetOutputPort("twist").Eval(context) == pytest.approx([0.1, 0.1, 0.4], abs=5e-3)
    pose, odometry = (station.GetOutputPort(name).Eval(context) for name in ("pose", "odometry"))
    # 1 cm, 0.6 deg: wheels are turned by a quarter at once, while the robot moves on.
    assert odometry == pytest.approx(pose, abs=0.01)
    model = station.parts.model
    plant_context = model.plant.GetMyContextFromRoot(context)
    angles = [model.swivel_joint(wheel).get_angle(plant_context) for wheel in model.robot.steered_wheels]
    assert_allclose(station.GetOutputPort("steering_state").Eval(context)[:4], angles, atol=1e-15)


def test_loads_add_up_to_the_weight_and_nothing_slips_at_rest() -> None:
    station = rb.build_station(scenario(robots.cart()), command="rest")
    simulator, context = started(station)
    simulator.AdvanceTo(0.5)
    loads, slip = (station.GetOutputPort(name).Eval(context) for name in ("normal_forces", "slip"))
    assert loads.sum() == pytest.approx(station.parts.model.robot.mass * GRAVITY, rel=1e-3)
    assert np.abs(slip).max() < 1e-3


def test_a_reference_from_outside_is_tracked_as_one_of_the_scenario() -> None:
    each = scenario("youbot_base", controller=TRACKING)
    inside = rb.build_station(each)
    simulator, context = started(inside)
    simulator.AdvanceTo(0.6)
    expected = inside.GetOutputPort("pose").Eval(context)

    builder = DiagramBuilder()
    station = builder.AddSystem(rb.build_station(each, command="external"))
    reference = builder.AddSystem(rb.systems.ReferenceSource(each.motion.twist))
    # The scenario's feed-forward is half a period of control ahead, as it is held for one.
    twist = replace(each.motion.twist, breaks=each.motion.twist.breaks - 0.5 * each.tracking.period)
    ahead = builder.AddSystem(rb.systems.ReferenceSource(twist))
    builder.Connect(reference.GetOutputPort("q_xyt"), station.GetInputPort("reference_pose"))
    builder.Connect(ahead.GetOutputPort("v_xyw_B"), station.GetInputPort("reference_twist"))
    simulator, context = started(builder.Build())
    simulator.AdvanceTo(0.6)
    assert_allclose(station.GetOutputPort("pose").Eval(station.GetMyContextFromRoot(context)), expected, atol=1e-12)


@pytest.mark.parametrize(("robot", "command"), [("kiwi", "other"), ("wheel_leg_hexapod", "rest")])
def test_unknown_commands_are_refused(robot: str, command: str) -> None:
    each = "hexapod_stand" if robot == "wheel_leg_hexapod" else scenario(robot)
    with pytest.raises(rb.SimulationError, match=f"command = '{command}': accepted: 'scenario', 'external'"):
        rb.build_station(each, command=command)
