"""What robots on legs cannot do is refused before it is simulated; at run time it stops them."""

import copy
from typing import Any

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator

import rollerbench as rb
from rollerbench.kinematics.gaits import Gait, LegMode


def scenario(pieces: list[dict[str, Any]], **more: Any) -> rb.Scenario:
    duration = sum(piece["duration"] for piece in pieces)
    command = {"type": "gait", "pieces": pieces}
    data = {"name": "asked", "robot": "wheel_leg_hexapod", "duration": duration, "command": command, **more}
    return rb.load_scenario(data)


@pytest.mark.parametrize(
    ("pieces", "words"),
    [
        ([{"duration": 4.0, "v_xyw_B": [3.0, 0.0, 0.0], "motion": "drive"}], ["wheel of leg", "max_speed = 20"]),
        (
            [{"duration": 2.0}, {"duration": 1.0, "posture": "mammal"}],
            ["t = 3 s", "posture mammal", "longer duration"],
        ),
        ([{"duration": 2.0, "body": {"z": 0.5}}], ["body's pose is beyond", "45%"]),
        ([{"duration": 2.0, "v_xyw_B": [2.0, 0.0, 0.0]}], ["beyond the legs' reach", "accepted: up to v_xyw_B"]),
    ],
)
def test_the_rehearsal_says_why(pieces: list[dict[str, Any]], words: list[str]) -> None:
    with pytest.raises(rb.DescriptionError) as caught:
        _ = scenario(pieces).rehearsal
    for word in words:
        assert word in str(caught.value)


def test_a_change_of_posture_first_takes_back_the_body() -> None:
    pieces = [{"duration": 1.5, "body": {"z": 0.02}}, {"duration": 8.0, "posture": "mammal", "body": {"z": 0.02}}]
    plans = scenario(pieces).rehearsal.plans
    assert plans[-1].posture.name == "mammal"
    assert plans[-1].offset.value[2] == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("step", "word"),
    [
        ({"start": -0.2, "end": 0.2, "height": 0.02}, "feet stand there"),
        ({"start": 0.6, "end": 1.0, "height": 0.2}, "lifted by 0.05 m"),
    ],
)
def test_steps_that_no_foot_can_take(step: dict[str, float], word: str) -> None:
    with pytest.raises(rb.DescriptionError, match=word):
        scenario([{"duration": 1.0}], ground={"steps": [step]})


@pytest.mark.parametrize("field", [{"duty": 1.0}, {"duty": -1.0}, {"period": 0.0}, {"lift": 0.0}, {"lag": 1.5}])
def test_gaits_that_are_none(field: dict[str, float]) -> None:
    good = {"name": "own", "duty": 0.8, "lag": 0.5, "offset": 0.5}
    with pytest.raises(rb.KinematicsError, match=next(iter(field))):
        Gait(**{**good, **field})


def test_a_second_posture_in_which_a_foot_hangs() -> None:
    data = copy.deepcopy(rb.load_robot("wheel_leg_hexapod").model_dump(mode="json", exclude_none=True))
    data["legs"][2]["postures"]["mammal"] = [90, -30, -100.7, 0]
    with pytest.raises(rb.DescriptionError, match=r"legs\[2\].postures.mammal.*hangs"):
        rb.load_robot(data)


@pytest.mark.parametrize("port", ["twist_command", "body_offset"])
def test_nan_on_a_port_stops_the_robot(port: str) -> None:
    station = rb.build_station(scenario([{"duration": 1.0}]), command="external")
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    twist = station.GetInputPort("twist_command")
    twist.FixValue(context, [0.1, 0.0, 0.0])
    simulator.AdvanceTo(0.3)
    size = station.GetInputPort(port).size()
    station.GetInputPort(port).FixValue(context, np.full(size, np.nan))
    if port != "twist_command":
        twist.FixValue(context, np.zeros(3))
    simulator.AdvanceTo(1.5)
    assert np.abs(station.GetOutputPort("twist").Eval(context)).max() < 0.005
    assert np.isfinite(station.GetOutputPort("motor_efforts").Eval(context)).all()


def test_an_unknown_posture_on_the_port_halts_the_robot() -> None:
    station = rb.build_station(scenario([{"duration": 1.0}]), command="external")
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    station.GetInputPort("twist_command").FixValue(context, np.zeros(3))
    station.GetInputPort("mode").FixValue(context, Value(LegMode(posture="reptile")))
    simulator.AdvanceTo(0.2)
    plan = station.GetOutputPort("plan").Eval(context)
    assert plan.activity == "halt"
    assert "accepted: insect, mammal" in plan.status
    assert station.GetOutputPort("pose").Eval(context) == pytest.approx(np.zeros(3), abs=1e-4)


def test_a_controller_may_leave_out_its_type() -> None:
    assert scenario([{"duration": 1.0}], controller={"closed_loop": True}).leg_control.closed_loop
    with pytest.raises(rb.DescriptionError, match=r"controller.*stands on legs"):
        scenario([{"duration": 1.0}], controller={"servo": "pid"})
