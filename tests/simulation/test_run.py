"""A run leaves a complete folder whose numbers can be checked, also when it fails."""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from ruamel.yaml import YAML

import robots
import rollerbench as rb
from contacts import steps_with_contacts

TURNING = {
    "name": "turning",
    "robot": "youbot_base",
    "duration": 1.0,
    "command": {"type": "twist", "v_xyw_B": [0.2, 0.1, 0.6], "ramp": 0.2},
    "recording": {"html": False},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("runs") / "turning"
    result = rb.run({**TURNING, "recording": {"html": True}}, output=target)
    assert result.folder == target
    return target


def test_the_folder_is_complete(folder: Path) -> None:
    files = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert files == {
        "scenario.yaml",
        "robot.yaml",
        "model.sdf",
        "recording.parquet",
        "summary.json",
        "recording.html",
        "preview.png",
        "report.html",
        "figures/trajectory.svg",
        "figures/pose_error.svg",
        "figures/wheel_speeds.svg",
        "figures/wheel_efforts.svg",
        "figures/wheel_slip.svg",
        "figures/error_budget.svg",
    }
    assert not list(folder.parent.glob(".*"))


def test_pose_error_agrees_with_an_independent_computation(folder: Path) -> None:
    table = pq.read_table(folder / "recording.parquet").to_pydict()
    summary = json.loads((folder / "summary.json").read_text())
    # The reference, by brute force: the ramped twist integrated in small Euler steps.
    x = y = yaw = length = 0.0
    n = 20_000
    vx, vy, w = TURNING["command"]["v_xyw_B"]  # type: ignore[index]
    for i in range(n):
        t = (i + 0.5) / n
        s = min(t, 1 - t) / 0.2
        scale = 1.0 if s >= 1 else s * s * (3 - 2 * s)
        middle = yaw + 0.5 * scale * w / n
        x += scale * (math.cos(middle) * vx - math.sin(middle) * vy) / n
        y += scale * (math.sin(middle) * vx + math.cos(middle) * vy) / n
        yaw += scale * w / n
        length += scale * math.hypot(vx, vy) / n
    error = summary["pose_error"]
    dx, dy = table["x"][-1] - x, table["y"][-1] - y
    assert summary["reference_final_pose"] == pytest.approx([x, y, yaw], abs=1e-8)
    assert error["final_position"] == pytest.approx(math.hypot(dx, dy), abs=1e-8)
    assert error["final_yaw"] == pytest.approx(table["yaw"][-1] - yaw, abs=1e-8)
    assert error["percent_of_path"] == pytest.approx(100 * math.hypot(dx, dy) / length, rel=1e-4)
    direction = yaw + math.atan2(vy, vx)
    assert error["along_track"] == pytest.approx(dx * math.cos(direction) + dy * math.sin(direction), abs=1e-7)
    assert error["cross_track"] == pytest.approx(dy * math.cos(direction) - dx * math.sin(direction), abs=1e-7)
    worst = max(
        math.hypot(a - c, b - d)
        for a, b, c, d in zip(table["x"], table["y"], table["reference_x"], table["reference_y"], strict=True)
    )
    assert error["max_position"] == pytest.approx(worst, abs=1e-12)


def test_summary_has_the_keys_of_the_contract(folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text())
    assert {
        *("robot", "scenario", "seed", "versions", "duration", "wall_time", "realtime_factor", "path_length"),
        *("rotation", "reference_final_pose", "simulated_final_pose", "odometry_final_pose", "pose_error"),
        *("wheel_slip", "height_ripple", "error_budget", "status"),
    } <= summary.keys()
    assert summary["status"] == "ok"
    assert set(summary["versions"]) == {"rollerbench", "drake", "python"}
    assert summary["realtime_factor"] == pytest.approx(summary["duration"] / summary["wall_time"])


@pytest.mark.usefixtures("undrawn")
def test_the_folder_reproduces_itself_to_the_bit(folder: Path, tmp_path: Path) -> None:
    again = rb.run(folder / "scenario.yaml", output=tmp_path / "again")
    assert again.folder is not None
    for name in ("scenario.yaml", "robot.yaml", "model.sdf", "recording.parquet"):
        assert (again.folder / name).read_bytes() == (folder / name).read_bytes()


def test_the_recording_reads_back_without_drake(folder: Path) -> None:
    code = (
        "import sys, rollerbench as rb\n"
        f"recording = rb.Recording.read({str(folder)!r})\n"
        "print(repr(rb.pose_error(recording).final_position))\n"
        "assert not any(name.startswith('pydrake') for name in sys.modules)\n"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    summary = json.loads((folder / "summary.json").read_text())
    assert float(out) == summary["pose_error"]["final_position"]


def test_slip_and_contacts_are_those_of_drake() -> None:
    """Contact points within the penetration, slip within 10 micrometres a second of Drake's contact results."""
    from rollerbench.kinematics.contact import wheel_contact

    scenario = rb.load_scenario("youbot_turn_clockwise", overrides={"plant.roller_model": "full"})
    compared = 0
    for plant, motion, results in steps_with_contacts(scenario, range(160, 200)):
        found = [results.point_pair_contact_info(i) for i in range(results.num_point_pair_contacts())]
        found.sort(key=lambda info: info.point_pair().depth)
        deepest = {
            wheel: info
            for info in found
            for wheel in scenario.robot.wheel_names
            if plant.get_body(info.bodyB_index()).name().startswith(wheel)
            or plant.get_body(info.bodyA_index()).name().startswith(wheel)
        }
        for wheel in scenario.robot.wheels:
            contact = wheel_contact(scenario.robot, wheel, motion)
            info = deepest[wheel.name]
            # Drake moves its point by half of the depth, not quite along the vertical.
            assert contact.p_WC[0] == pytest.approx(info.contact_point(), abs=contact.depth[0])
            assert contact.depth[0] == pytest.approx(info.point_pair().depth, abs=1e-9)
            assert np.linalg.norm(contact.slip_W[0][:2]) == pytest.approx(info.slip_speed(), abs=1e-5)
            compared += 1
    assert compared == 160


def test_wheel_speeds_command_and_pose_by_forward_kinematics() -> None:
    speeds = dict(zip(("front_left", "front_right", "rear_left", "rear_right"), (4, 6, 4, 6), strict=True))
    command = {"type": "wheel_speeds", "wheel_speeds": speeds, "ramp": 0.2}
    result = rb.run({**TURNING, "command": command}, save=False)
    kinematics = rb.WheelKinematics("youbot_base")
    expected = rb.odometry.integrate([0, 0, 0], kinematics.forward(list(speeds.values())), 0.8)
    assert result.summary["reference_final_pose"] == pytest.approx(expected, abs=1e-9)
    assert result.recording.wheels("command")[100] == pytest.approx(list(speeds.values()))
    assert result.recording.odometry_q_xyt[-1] == pytest.approx(expected, abs=1e-3)  # the servo's lag


@pytest.mark.parametrize(
    ("make", "v_xyw_B"),
    [
        (robots.cart, [0.3, 0.0, 0.5]),
        (robots.kiwi, [0.1, 0.3, 0.5]),
        (robots.swerve, [0.2, 0.2, 0.5]),
        (robots.mixed, [0.3, 0.0, 0.0]),
    ],
)
def test_any_robot_runs(make: Any, v_xyw_B: list[float], tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """A robot.yaml of the user's own, of any wheel types, beside its scenario."""
    if make is not robots.mixed:
        request.getfixturevalue("undrawn")
    (tmp_path / "mine").mkdir()
    with (tmp_path / "mine" / "robot.yaml").open("w") as stream:
        YAML().dump(make(), stream)
    scenario = {
        **{"name": "own", "robot": "mine/robot.yaml", "duration": 2.0, "recording": {"html": False}},
        "command": {"type": "twist", "v_xyw_B": v_xyw_B},
    }
    with (tmp_path / "scenario.yaml").open("w") as stream:
        YAML().dump(scenario, stream)
    result = rb.run(tmp_path / "scenario.yaml", output=tmp_path / "run")
    error = result.summary["pose_error"]
    assert error["percent_of_path"] < 0.3
    assert error["max_yaw"] < math.radians(0.3)
    again = rb.run(tmp_path / "run" / "scenario.yaml", save=False)
    assert again.summary["simulated_final_pose"] == result.summary["simulated_final_pose"]


def test_on_a_slope_the_weight_pulls_back() -> None:
    """Held wheels on a 5 deg slope stay, but for the servos' creep; efforts balance the pull m g sin(slope)."""
    scenario = {**TURNING, "command": {"type": "twist", "v_xyw_B": [0.2, 0.0, 0.0]}, "ground": {"slope_deg": 5.0}}
    result = rb.run(scenario, save=False)
    robot = rb.load_robot("youbot_base")
    effort = result.recording.wheels("effort")[95:105].sum(axis=1).mean()
    expected = robot.mass * 9.81 * math.sin(math.radians(5)) * 0.0475
    assert effort == pytest.approx(expected, rel=0.05)  # the rollers' bearings and the ripple take the rest


def _tall(data: robots.Data) -> robots.Data:
    data["body"] = {"size": [0.3, 0.2, 1.5], "mass": 10.0, "center_of_mass": [0.0, 0.0, 1.0], "center": [0, 0, 0.8]}
    return data


@pytest.mark.usefixtures("undrawn")
def test_a_robot_that_tips_over_fails_and_keeps_what_was_computed(tmp_path: Path) -> None:
    scenario = {
        **TURNING,
        "robot": _tall(robots.mecanum()),
        "duration": 3.0,
        "command": {"type": "twist", "v_xyw_B": [2.0, 0.0, 0.0], "ramp": 0.1},
    }
    with (
        pytest.warns(rb.RollerbenchWarning, match="fine: up to"),
        pytest.raises(rb.SimulationError, match=r"tipped over|left the ground") as caught,
    ):
        rb.run(scenario, output=tmp_path / "run")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["status"] == "failed"
    assert "at t = " in summary["failure"]
    recording = rb.Recording.read(tmp_path / "run")
    assert 0.1 < recording.time[-1] < 2.9
    assert caught.value.result.recording.time[-1] == recording.time[-1]


def test_a_state_that_is_not_finite_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """NaN in the plant's state is found at the next look; the samples before it are kept."""
    from pydrake.systems.analysis import Simulator

    class Poisoned(Simulator):
        def AdvanceTo(self, time: float) -> None:  # Drake's name
            super().AdvanceTo(time)
            if time > 0.5:
                station = self.get_system()
                plant = station.parts.model.plant
                context = plant.GetMyMutableContextFromRoot(self.get_mutable_context())
                state = context.get_mutable_discrete_state_vector()
                state.SetFromVector(np.full(state.size(), np.nan))

    monkeypatch.setattr("rollerbench.simulation.drake_engine.Simulator", Poisoned)
    with pytest.raises(rb.SimulationError, match="not finite") as caught:
        rb.run(TURNING, save=False)
    recording = caught.value.result.recording
    assert np.isfinite(recording.q_xyt).all()
    assert recording.time[-1] == pytest.approx(0.55, abs=0.011)


@pytest.mark.usefixtures("undrawn")
def test_an_interrupt_keeps_what_was_computed(tmp_path: Path) -> None:
    def stop(now: float) -> None:
        if now > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(rb.SimulationError, match=r"interrupted at t = 0.45"):
        rb.run(TURNING, output=tmp_path / "run", progress=stop)
    assert rb.Recording.read(tmp_path / "run").time[-1] == pytest.approx(0.45)


def test_a_foreign_folder_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(rb.ResourceError, match="holds something else than a run"):
        rb.run(TURNING, output=tmp_path)
    with pytest.raises(rb.ResourceError, match="is a file"):
        rb.run(TURNING, output=tmp_path / "thesis.tex")
    assert (tmp_path / "thesis.tex").read_text() == "precious"


@pytest.mark.usefixtures("undrawn")
def test_an_earlier_run_is_replaced_whole(tmp_path: Path) -> None:
    rb.run({**TURNING, "duration": 0.5, "recording": {"html": True}}, output=tmp_path / "run")
    rb.run({**TURNING, "duration": 0.5}, output=tmp_path / "run")
    assert not (tmp_path / "run" / "recording.html").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_the_station_takes_a_twist_from_outside() -> None:
    from pydrake.systems.analysis import Simulator

    station = rb.build_station(rb.load_scenario("youbot_plus_x"), command="external")
    simulator = Simulator(station)
    rb.follow_rollers(simulator)
    context = simulator.get_mutable_context()
    station.GetInputPort("twist_command").FixValue(context, [0.1, 0.0, 0.0])
    model = station.parts.model
    model.set_pose(model.plant.GetMyMutableContextFromRoot(context), [1.0, 2.0, math.pi / 2])
    simulator.AdvanceTo(1.0)
    # 1 mm: the robot starts from rest with its wheels at full speed.
    assert station.GetOutputPort("pose").Eval(context) == pytest.approx([1.0, 2.1, math.pi / 2], abs=1e-3)
    assert station.GetOutputPort("twist").Eval(context) == pytest.approx([0.1, 0, 0], abs=1e-3)
    assert station.GetOutputPort("wheel_speeds").Eval(context) == pytest.approx([0.1 / 0.0475] * 4, rel=1e-3)


def test_a_station_with_all_rollers_converts_to_autodiff() -> None:
    from pydrake.autodiffutils import AutoDiffXd

    station = rb.build_station(rb.load_scenario("youbot_plus_x", overrides={"plant.roller_model": "full"}), slip=False)
    assert station.ToScalarType[AutoDiffXd]().num_output_ports() == station.num_output_ports()


def test_a_station_starts_on_its_wheels() -> None:
    from pydrake.systems.analysis import Simulator

    station = rb.build_station("youbot_plus_x", command="external")
    simulator = Simulator(station)
    rb.follow_rollers(simulator)
    context = simulator.get_mutable_context()
    station.GetInputPort("twist_command").FixValue(context, [0.2, 0.0, 0.0])
    simulator.AdvanceTo(1.0)
    # 5 mm: it starts from rest with its wheels at full speed.
    assert station.GetOutputPort("pose").Eval(context) == pytest.approx([0.2, 0.0, 0.0], abs=5e-3)


def test_two_robots_share_a_users_plant() -> None:
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import ConstantVectorSource

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.005)
    models = [rb.add_robot(plant, robots.cart()), rb.add_robot(plant, robots.cart())]
    rb.add_ground(plant)
    plant.Finalize()
    kinematics = rb.WheelKinematics(robots.cart())
    for model, speed in zip(models, (0.2, -0.3), strict=True):
        desired = model.desired_state_matrix() @ kinematics.inverse([speed, 0.0, 0.0])
        source = builder.AddSystem(ConstantVectorSource(desired))
        builder.Connect(source.get_output_port(), plant.get_desired_state_input_port(model.model_instance))
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for model, y in zip(models, (-1.0, 1.0), strict=True):
        model.set_pose(context, [0.0, y, 0.0])
    simulator.AdvanceTo(1.0)
    for model, x in zip(models, (0.2, -0.3), strict=True):
        state = model.plant.GetPositionsAndVelocities(context, model.model_instance)
        body = model.body_state_matrix() @ state
        # 1 cm: they start from rest with their wheels at full speed, one with its castor the wrong way round.
        assert body[4] == pytest.approx(x, abs=0.01)
        assert model.wheel_speed_matrix() @ state == pytest.approx([x / 0.1] * 2, rel=0.01)
