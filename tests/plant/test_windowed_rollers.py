"""Windowed rollers are the same robot: same motion, same mass, same looks; and nothing goes wrong silently."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest

import robots
import rollerbench as rb
from rollerbench.simulation.drake_engine import simulate
from rollerbench.simulation.watch import fault

MOTIONS = {
    "sideways": [0.0, 0.4, 0.0],
    "combined": [0.2, 0.2, 0.6],
    "turn": [0.0, 0.0, 1.5],
}
SMALL_ROLLERS = {8: 0.007, 12: 0.007, 16: 0.006, 24: 0.004}


def mecanum(count: int) -> Any:
    return robots.mecanum(count=count, radius=SMALL_ROLLERS[count])


def scenario(robot: Any, v_xyw_B: list[float], **plant: Any) -> rb.Scenario:
    content = {
        "name": "windowed",
        "robot": robot,
        "duration": 0.8,
        "command": {"type": "twist", "v_xyw_B": v_xyw_B, "ramp": 0.2},
        "plant": plant,
    }
    return rb.load_scenario(content)


@cache
def ran(count: int, motion: str, model: str) -> Any:
    """A run of a robot on Mecanum wheels, in one of the motions, with all rollers or those near the ground."""
    return simulate(scenario(mecanum(count), MOTIONS[motion], roller_model=model))


def apart(first: Any, second: Any) -> float:
    """How far two recordings end apart, over the way that they went, or over the turn, whichever is more [-]."""
    way, turn = (np.abs(np.diff(first.q_xyt, axis=0)) @ weights for weights in ([1, 1, 0], [0, 0, 1]))
    off = first.q_xyt[-1] - second.q_xyt[-1]
    # A turn on the spot goes no way but that of its wheels, 0.4 m from the middle.
    return max(np.hypot(*off[:2]) / max(way.sum(), 0.4 * turn.sum()), abs(off[2]) / max(turn.sum(), 1.0))


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("count", SMALL_ROLLERS)
def test_windowed_mecanum_wheels_move_the_robot_as_full_ones_do(count: int, motion: str) -> None:
    runs = [ran(count, motion, model) for model in ("full", "windowed")]
    assert [run.failure for run in runs] == [None, None]
    assert apart(*(run.recording for run in runs)) < 2e-4
    first = runs[1].recording.wheels("first_roller")
    assert np.ptp(first) >= 2
    assert np.isnan(runs[0].recording.wheels("first_roller")).all()


@pytest.mark.parametrize("motion", MOTIONS)
def test_so_do_double_row_omni_wheels(motion: str) -> None:
    runs = [simulate(scenario("omni_platform", MOTIONS[motion], roller_model=model)) for model in ("full", "windowed")]
    assert apart(*(run.recording for run in runs)) < 2e-4


@pytest.mark.parametrize("size", [3, 4, 11])
def test_the_size_of_the_window_does_not_matter(size: int) -> None:
    plant = {"roller_model": "windowed", "roller_window": size}
    windowed = simulate(scenario(mecanum(12), MOTIONS["combined"], **plant)).recording
    full = ran(12, "combined", "full").recording
    assert apart(full, windowed) < 2e-5


def test_a_window_of_all_rollers_is_the_full_model() -> None:
    plant = {"roller_model": "windowed", "roller_window": 12}
    recordings = [simulate(scenario(mecanum(12), [0.3, 0.1, 0.2], **p)).recording for p in (plant, {})]
    assert np.isnan(recordings[0].wheels("first_roller")).all()
    assert not np.isnan(recordings[1].wheels("first_roller")).any()


def test_recordings_agree_column_by_column() -> None:
    full, windowed = (ran(12, "combined", model).recording for model in ("full", "windowed"))
    for column in ("angle", "speed", "effort", "contact_x", "contact_y", "depth", "slip_x", "slip_y", "drive_y"):
        one, other = full.wheels(column), windowed.wheels(column)
        assert np.sqrt(np.mean((one - other) ** 2)) < 2e-3 * np.sqrt(np.mean(one**2)), column


def test_rollers_that_are_not_simulated_are_remembered() -> None:
    """While the robot turns and speeds up, the speeds of all rollers follow those of the full model."""
    full, windowed = (ran(12, "combined", model).recording for model in ("full", "windowed"))
    names = [f"fl.roller_{k:02d}" for k in range(12)]
    truth, remembered = (np.column_stack([r.columns[name] for name in names]) for r in (full, windowed))
    assert np.sqrt(np.mean((truth - remembered) ** 2)) < 0.03 * np.sqrt(np.mean(truth**2))


class Drive:
    """A robot in a user's own diagram."""

    def __init__(self, *descriptions: Any, follow: bool = True, servo: bool = True, **options: Any) -> None:
        from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder

        builder = DiagramBuilder()
        config = MultibodyPlantConfig(time_step=0.005, contact_model="point", use_sampled_output_ports=False)
        self.plant, self.scene_graph = AddMultibodyPlant(config, builder)
        options = {"roller_model": "windowed", "builder": builder, **options}
        gains = None if servo else rb.plant.servo_gains(rb.load_robot(descriptions[0]), time_constant=1e9)
        self.models = [rb.add_robot(self.plant, robot, gains=gains, **options) for robot in descriptions]
        rb.add_ground(self.plant)
        self.plant.Finalize()
        self.simulator = Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        for model in self.models:
            port = self.plant.get_desired_state_input_port(model.model_instance)
            port.FixValue(self.context, np.zeros(port.size()))
        if follow:
            rb.follow_rollers(self.simulator)

    def drive(self, index: int, v_xyw_B: list[float], q_xyt: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Lets a robot roll at a twist from the start."""
        from pydrake.multibody.math import SpatialVelocity

        model, context = self.models[index], self.context
        speeds = rb.WheelKinematics(model.robot).inverse(v_xyw_B)
        model.set_pose(context, q_xyt)
        port = self.plant.get_desired_state_input_port(model.model_instance)
        port.FixValue(context, model.desired_state_matrix() @ speeds)
        for wheel, speed in zip(model.robot.wheels, speeds, strict=True):
            model.drive_joint(wheel).set_angular_rate(context, speed)
        vx, vy, wz = v_xyw_B
        self.plant.SetFreeBodySpatialVelocity(context, model.body, SpatialVelocity([0, 0, wz], [vx, vy, 0]))

    def q_xyt(self, index: int = 0) -> Any:
        pose = self.plant.EvalBodyPoseInWorld(self.context, self.models[index].body)
        forward = pose.rotation().matrix()[:, 0]
        return np.array([*pose.translation()[:2], np.arctan2(forward[1], forward[0])])


@pytest.mark.parametrize("v_xyw_B", [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.25, 0.25, 0.5], [0.0, 0.0, 1.5]])
def test_coasting_robots_roll_as_far(v_xyw_B: list[float]) -> None:
    """Without servos: what keeps them rolling is the momentum of all parts, and the rollers' damping slows them."""
    poses = []
    for model in ("full", "windowed"):
        coasting = Drive(mecanum(12), servo=False, roller_model=model)
        coasting.drive(0, v_xyw_B)
        coasting.simulator.AdvanceTo(1.0)
        poses.append(coasting.q_xyt())
    full, windowed = poses
    assert np.linalg.norm(full[:2] - windowed[:2]) < 5e-3 * max(np.linalg.norm(full[:2]), 0.4 * abs(full[2]))
    assert full[2] == pytest.approx(windowed[2], rel=0.01, abs=1e-3)


def test_hubs_carry_the_mass_of_the_rollers_that_are_not_simulated() -> None:
    """At every angle of the wheels, mass, mass centre, and what moving the body carries along."""
    states = np.random.default_rng(1).uniform(-20, 20, (5, 4))
    full, windowed = Drive(mecanum(12), roller_model="full"), Drive(mecanum(12))
    for angles in states:
        found = []
        for drive in (full, windowed):
            plant, context, model = drive.plant, drive.context, drive.models[0]
            for wheel, angle in zip(model.robot.wheels, angles, strict=True):
                model.drive_joint(wheel).set_angle(context, angle)
            drive.simulator.Initialize()
            body = model.body_velocity_index
            inertia = plant.CalcMassMatrix(context)[body : body + 6, body : body + 6]
            found.append(
                [plant.CalcTotalMass(context), *plant.CalcCenterOfMassPositionInWorld(context), inertia[3:, :3]]
            )
        for one, other in zip(*found, strict=True):
            assert one == pytest.approx(other, abs=1e-12)


def geometry_poses(drive: Drive) -> Iterator[Any]:
    """Poses of everything that is drawn."""
    from pydrake.geometry import Role

    context = drive.scene_graph.GetMyContextFromRoot(drive.simulator.get_context())
    query = drive.scene_graph.get_query_output_port().Eval(context)
    inspector = drive.scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds(Role.kIllustration):
        matrix = query.GetPoseInWorld(geometry).GetAsMatrix34()
        # Adding 0 turns -0 into 0, so that sorting pairs the same poses.
        yield [*(np.round(matrix, 6).ravel() + 0.0), type(inspector.GetShape(geometry)).__name__]


def test_a_windowed_robot_looks_the_same() -> None:
    """Every drawn shape is where the full model has it, at every angle of a wheel."""
    full, windowed = Drive(mecanum(8), roller_model="full"), Drive(mecanum(8))
    for angle in (0.0, 0.3, 2.9, -40.0):
        for drive in (full, windowed):
            for wheel in drive.models[0].robot.wheels:
                drive.models[0].drive_joint(wheel).set_angle(drive.context, angle)
            drive.simulator.Initialize()
        first, second = (sorted(geometry_poses(drive)) for drive in (full, windowed))
        assert len(first) > 100
        assert first == second


def test_forgetting_to_follow_the_wheels_is_said() -> None:
    forgotten = Drive(mecanum(12), follow=False)
    forgotten.drive(0, [0.5, 0.0, 0.0])
    with pytest.raises(rb.SimulationError, match=r"follow_rollers\(simulator\)"):
        forgotten.simulator.AdvanceTo(1.0)
    assert forgotten.simulator.get_context().get_time() < 0.11


def test_a_monitor_that_replaces_the_follower_is_noticed() -> None:
    from pydrake.systems.framework import EventStatus

    replaced = Drive(mecanum(12))
    replaced.simulator.AdvanceTo(0.2)
    replaced.simulator.set_monitor(lambda context: EventStatus.DidNothing())
    with pytest.raises(rb.SimulationError, match="follow_rollers"):
        replaced.simulator.AdvanceTo(1.0)


def test_a_monitor_of_the_users_is_still_called_and_following_twice_does_no_harm() -> None:
    from pydrake.systems.framework import EventStatus

    drives = [Drive(mecanum(12), follow=False) for _ in range(2)]
    seen = []

    def monitor(context: Any) -> Any:
        seen.append(context.get_time())
        return EventStatus.DidNothing()

    drives[0].simulator.set_monitor(monitor)
    for drive in drives:
        rb.follow_rollers(drive.simulator)
    rb.follow_rollers(drives[0].simulator)
    for drive in drives:
        drive.drive(0, [0.3, 0.2, 0.5])
        drive.simulator.AdvanceTo(0.6)
    assert np.unique(np.round(seen, 6)) == pytest.approx(np.arange(121) * 0.005)
    assert (drives[0].q_xyt() == drives[1].q_xyt()).all()


def test_a_simulation_that_starts_later_or_with_turned_wheels_is_followed() -> None:
    late = Drive(mecanum(12))
    late.drive(0, [0.4, 0.0, 0.0])
    for wheel in late.models[0].robot.wheels:
        late.models[0].drive_joint(wheel).set_angle(late.context, 7.5)
    late.simulator.get_mutable_context().SetTime(5.0)
    late.simulator.AdvanceTo(5.5)
    assert late.q_xyt() == pytest.approx([0.2, 0.0, 0.0], abs=2e-3)


def test_a_saved_state_goes_on_bit_for_bit() -> None:
    """Angles, speeds, window and remembered rollers are all in the discrete state."""
    drive = Drive(mecanum(12))
    drive.drive(0, [0.3, 0.2, 0.6])
    drive.simulator.AdvanceTo(0.5)
    root = drive.simulator.get_mutable_context()
    state = root.get_discrete_state()
    saved = [state.get_vector(k).CopyToVector() for k in range(state.num_groups())]
    drive.simulator.AdvanceTo(1.0)
    end = drive.plant.GetPositionsAndVelocities(drive.context).copy()

    drive.simulator.AdvanceTo(1.33)
    root.SetTime(0.5)
    for k, values in enumerate(saved):
        root.get_mutable_discrete_state(k).SetFromVector(values)
    drive.simulator.Initialize()
    drive.simulator.AdvanceTo(1.0)
    assert (drive.plant.GetPositionsAndVelocities(drive.context) == end).all()


def test_an_episode_starts_again_from_time_zero() -> None:
    """Rollers that are remembered from later times are not run backwards."""
    drive = Drive(mecanum(12))
    ends = []
    for _ in range(2):
        root = drive.simulator.get_mutable_context()
        root.SetTime(0.0)
        still = np.r_[drive.plant.GetDefaultPositions(), np.zeros(drive.plant.num_velocities())]
        drive.plant.SetPositionsAndVelocities(drive.context, still)
        drive.drive(0, [0.0, 0.3, 0.0])
        drive.simulator.Initialize()
        drive.simulator.AdvanceTo(1.5)
        ends.append(drive.q_xyt())
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


def test_a_robot_on_a_test_stand_turns_its_wheels() -> None:
    from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.005), builder)
    model = rb.add_robot(plant, mecanum(12), roller_model="windowed", builder=builder)
    plant.WeldFrames(plant.world_frame(), model.body.body_frame())
    plant.Finalize()
    simulator = Simulator(builder.Build())
    rb.follow_rollers(simulator)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    port = plant.get_desired_state_input_port(model.model_instance)
    port.FixValue(context, model.desired_state_matrix() @ np.full(4, 5.0))
    simulator.AdvanceTo(1.0)
    assert model.drive_joint(model.robot.wheels[0]).get_angle(context) == pytest.approx(5.0, rel=0.01)


def test_one_call_follows_all_robots_in_a_diagram() -> None:
    pair = Drive(mecanum(12), robots.kiwi())
    pair.drive(0, [0.3, 0.0, 0.0], (0.0, 2.0, 0.0))
    pair.drive(1, [0.0, -0.2, 0.0], (0.0, -2.0, 0.0))
    pair.simulator.AdvanceTo(1.0)
    assert pair.q_xyt(0) == pytest.approx([0.3, 2.0, 0.0], abs=2e-3)
    assert pair.q_xyt(1) == pytest.approx([0.0, -2.2, 0.0], abs=2e-3)


def test_a_wheel_that_leaps_over_its_rollers_is_named() -> None:
    fast = Drive(mecanum(12))
    fast.drive(0, [12.0, 0.0, 0.0])
    with pytest.raises(rb.SimulationError, match=r"wheel fl turned past its simulated rollers in one step"):
        fast.simulator.AdvanceTo(0.5)


def test_a_run_keeps_what_it_computed_until_a_wheel_leapt() -> None:
    content = {
        "name": "leap",
        "robot": mecanum(12),
        "duration": 1.0,
        "command": {"type": "twist", "v_xyw_B": [14.0, 0.0, 0.0], "ramp": 0.5},
    }
    with (
        pytest.warns(rb.RollerbenchWarning, match="sixth of its roller pitch"),
        pytest.raises(rb.SimulationError) as caught,
    ):
        rb.run(content, save=False)
    assert "turned past its simulated rollers" in str(caught.value)
    assert 10 < len(caught.value.result.recording.time) < 200


def test_a_robot_that_leans_beyond_its_rollers_is_a_fault() -> None:
    from pydrake.math import RigidTransform, RollPitchYaw

    tilted = Drive(mecanum(24))
    model = tilted.models[0]
    tilted.plant.SetFreeBodyPose(tilted.context, model.body, RigidTransform(RollPitchYaw(0, 0.2, 0), [0, 0, 0.05]))
    assert "roller_window" in str(fault(model, tilted.context))


def test_refused_with_what_is_accepted() -> None:
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.systems.framework import DiagramBuilder

    with pytest.raises(rb.SimulationError, match="builder="):
        rb.add_robot(MultibodyPlant(0.005), "youbot_base", roller_model="windowed")
    with pytest.raises(rb.SimulationError, match="positive time step"):
        rb.add_robot(MultibodyPlant(0.0), "youbot_base", roller_model="windowed", builder=DiagramBuilder())
    with pytest.raises(rb.SimulationError, match="window_size = 1: accepted: a whole number, 2 or more"):
        rb.add_robot(
            MultibodyPlant(0.005), "youbot_base", roller_model="windowed", builder=DiagramBuilder(), window_size=1
        )
    for name, reason in (("sap", "creep"), ("tamsi", "servos")):
        with pytest.raises(rb.DescriptionError, match=rf"contact_approximation.*{reason}.*accepted: lagged, similar"):
            scenario("youbot_base", [0.1, 0, 0], contact_approximation=name)


def test_fast_contacts_are_as_good_while_wheels_roll() -> None:
    first, second = (
        simulate(scenario("youbot_base", [0.3, 0.3, 0.3], contact_approximation=name)).recording
        for name in ("lagged", "fast")
    )
    # Nearly rigid contacts give a little while the robot speeds up and slows down.
    assert apart(first, second) < 2e-3


def test_bumps_widen_the_window() -> None:
    """A wheel meets a bump ahead of its bottom, where too small a window has no roller."""
    base = scenario("youbot_base", [0.3, 0.0, 0.0])
    bumps = {"height": 0.002, "width": 0.04, "density": 400.0}
    bumpy = rb.load_scenario(base, overrides={"errors.ground_bumps": bumps})
    assert base.window_size == 2
    assert bumpy.window_size >= 3
    full = rb.load_scenario(bumpy, overrides={"plant.roller_model": "full"})
    first, second = (simulate(run).recording for run in (full, bumpy))
    assert np.ptp(first.columns["z"]) > 5e-4
    assert apart(first, second) < 1e-3
