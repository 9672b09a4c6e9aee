"""A scene shows robots where their recordings say, and marks where it happened."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

import rollerbench as rb
from rollerbench import palette
from rollerbench.resources import robot_names
from rollerbench.visualization import floor, marks
from rollerbench.visualization.model import read_model
from rollerbench.visualization.motion import motion_of
from rollerbench.visualization.scenes import Scene, SeenRun, robot_of, scene_of
from rollerbench.visualization.shapes import Mesh, disc, polygon, ribbon

SLIDING = {
    "robot": "youbot_base",
    "name": "sliding",
    "duration": 1.0,
    "command": {"type": "twist", "v_xyw_B": [0.0, 0.3, 0.5], "ramp": 0.05},
    "ground": {"friction": 0.05},
    "recording": {"html": False, "forces": True},
}

WALKING = {
    "robot": "wheel_leg_hexapod",
    "name": "walking",
    "duration": 2.0,
    "command": {"type": "gait", "pieces": [{"duration": 2.0, "v_xyw_B": [0.2, 0.0, 0.0], "gait": "tripod"}]},
    "recording": {"html": False},
}


def seen(scenario: object) -> SeenRun:
    loaded = rb.load_scenario(scenario)
    result = rb.run(loaded, save=False)
    model = rb.sdf.robot_to_sdf(loaded.simulated_robot)
    return SeenRun(name=loaded.name, recording=result.recording, model=model, summary=result.summary)


@pytest.fixture(scope="module")
def sliding() -> SeenRun:
    return seen(SLIDING)


@pytest.fixture(scope="module")
def walking() -> SeenRun:
    return seen(WALKING)


@pytest.mark.parametrize("name", robot_names())
def test_frames_lie_where_drake_has_the_links(name: str) -> None:
    """At random joint angles, to 1e-12 m."""
    text = rb.sdf.robot_to_sdf(rb.load_robot(name))
    plant = MultibodyPlant(0.0)
    (instance,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    context, rng = plant.CreateDefaultContext(), np.random.default_rng(3)
    model = read_model(text)
    angles = {}
    for index in plant.GetJointIndices(instance):
        joint = plant.get_joint(index)
        if joint.num_positions() == 1:
            angles[joint.name()] = rng.uniform(-1.0, 1.0, 1)
            joint.set_angle(context, float(angles[joint.name()][0]))
    root = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(model.root)).GetAsMatrix4()
    for path, poses in model.tracks(root[np.newaxis], angles, "robot").items():
        body = plant.GetBodyByName(path.removeprefix("robot/"))
        expected = plant.EvalBodyPoseInWorld(context, body).GetAsMatrix4()
        np.testing.assert_allclose(poses[0], expected, atol=1e-12)


def test_links_of_joints_without_angles_are_part_of_the_link_that_carries_them() -> None:
    """Rollers turn with their wheel, and no visual is lost."""
    model = read_model(rb.sdf.robot_to_sdf(rb.load_robot("youbot_base")))
    items = model.items({"front_left_drive"}, "robot")
    assert {item.frame for item in items} == {"robot/body", "robot/front_left_hub"}
    assert len(items) == sum(map(len, model.visuals.values()))


@pytest.mark.parametrize("run", ["sliding", "walking"])
def test_robot_and_ghost_are_where_the_recording_says(run: str, request: pytest.FixtureRequest) -> None:
    """To 1e-9: every frame is a sample, the first and last included."""
    of: SeenRun = request.getfixturevalue(run)
    scene, recording = scene_of([of]), of.recording
    times = scene.times["robot/body"]
    at = np.searchsorted(recording.time, times)
    np.testing.assert_array_equal(recording.time[at], times)
    assert (times[0], times[-1]) == (recording.time[0], recording.time[-1])
    assert np.diff(times).max() < 1 / 30 + 0.01
    for path, prefix in (("robot/body", ""), ("ghost", "reference_")):
        poses = scene.tracks[path]
        x, y, yaw = (recording.columns[f"{prefix}{name}"][at] for name in ("x", "y", "yaw"))
        np.testing.assert_allclose(poses[:, :2, 3], np.column_stack([x, y]), atol=1e-12)
        heading = np.arctan2(poses[:, 1, 0], poses[:, 0, 0])
        np.testing.assert_allclose(np.exp(1j * heading), np.exp(1j * yaw), atol=1e-9)
    np.testing.assert_allclose(scene.tracks["robot/body"][:, 2, 3], recording.columns["z"][at], atol=1e-12)


def test_wheels_turn_by_their_angles(sliding: SeenRun) -> None:
    scene, recording = scene_of([sliding]), sliding.recording
    at = np.searchsorted(recording.time, scene.times["robot/body"])
    for wheel in recording.wheel_names:
        hub, body = scene.tracks[f"robot/{wheel}_hub"], scene.tracks["robot/body"]
        turn = np.linalg.solve(body, hub)[:, :3, :3]
        angle = recording.columns[f"{wheel}.angle"][at]
        np.testing.assert_allclose(turn[:, 0, 0], np.cos(angle), atol=1e-9)
        np.testing.assert_allclose(turn[:, 0, 2], np.sin(angle), atol=1e-9)


def test_wheels_faster_than_frames_are_seen_turning_the_right_way(sliding: SeenRun) -> None:
    """Viewers go the shorter way between two frames: there are as many as that needs."""
    columns = {
        name: 40 * values if name.endswith(".angle") else values for name, values in sliding.recording.columns.items()
    }
    fast = replace(sliding.recording, columns=columns)
    motion = motion_of(fast, robot_of(fast), frames_per_second=5)
    turns = [np.abs(np.diff(angle)).max() for angle in motion.angles.values()]
    assert 1.0 < max(turns) < math.pi
    assert max(np.abs(np.diff(angle)).max() for name, angle in columns.items() if name.endswith(".angle")) < math.pi
    assert len(motion.time) > 12


@pytest.mark.parametrize(
    ("size", "extent", "expected"),
    [(0.05, 2, [0.1, 1]), (0.6, 6, [0.1, 1]), (12, 80, [10, 100]), (1, 2000, [100, 1000])],
)
def test_the_grid_suits_robot_and_path(size: float, extent: float, expected: list[float]) -> None:
    """Neither finer than a tenth of the robot nor more lines than one can see."""
    assert floor.grid_pitches(np.zeros(2), np.array([extent, 1.0]), size) == pytest.approx(expected)


def test_forces_bear_the_weight_and_stand_where_wheels_touch(sliding: SeenRun) -> None:
    """The recorded forces of a robot on level ground carry its weight on the mean, and slide within friction."""
    recording, robot = sliding.recording, rb.load_robot("youbot_base")
    total = sum(recording.columns[f"{name}.force_z"] for name in recording.wheel_names)
    late = recording.time > 0.2
    assert total[late].mean() == pytest.approx(9.81 * robot.mass, rel=0.01)
    friction = 2 * 0.05 * robot.wheels[0].friction / (0.05 + robot.wheels[0].friction)
    for name in recording.wheel_names:
        load = recording.columns[f"{name}.force_z"]
        aside = np.hypot(recording.columns[f"{name}.force_x"], recording.columns[f"{name}.force_y"])
        slip = np.hypot(recording.columns[f"{name}.slip_x"], recording.columns[f"{name}.slip_y"])
        # Of single steps it is not true: Drake's lagged friction goes by the load of the step before.
        sliding_now = (slip > 0.02) & (load > 0)
        assert np.median(aside[sliding_now] / load[sliding_now]) == pytest.approx(friction, rel=0.1)
    scene = scene_of([sliding], forces=True)
    tips = [track[:, :3, 3] for path, track in scene.tracks.items() if path.startswith("forces/")]
    seen_tips = np.concatenate(tips)[np.concatenate(tips)[:, 2] > 0]
    assert len(seen_tips) >= 4
    assert np.linalg.norm(seen_tips[:, :2], axis=1).max() < 1.0


def test_slip_is_drawn_where_and_as_fast_as_wheels_slid(sliding: SeenRun) -> None:
    """Slippery ground makes marks of every colour that was reached, within the wheels' tracks; good ground none."""
    recording = sliding.recording
    fastest = max(
        np.hypot(recording.columns[f"{name}.slip_x"], recording.columns[f"{name}.slip_y"]).max()
        for name in recording.wheel_names
    )
    items = marks.skid_marks(recording, robot_of(recording), "")
    colors = {item.color for item in items}
    reached = [color for speed, color in zip(palette.SLIP_SPEEDS, palette.SLIP_COLORS, strict=True) if fastest >= speed]
    assert reached
    assert colors <= set(reached)
    assert reached[0] in colors
    for item in items:
        assert isinstance(item.shape, Mesh)
        assert np.linalg.norm(item.shape.vertices[:, :2], axis=1).max() < 1.0
    good = seen({**SLIDING, "ground": {"friction": 0.8}, "command": {**SLIDING["command"], "ramp": 0.4}})
    assert not marks.skid_marks(good.recording, robot_of(good.recording), "")


def test_the_support_polygon_has_the_feet_that_stand(walking: SeenRun) -> None:
    """At every frame one polygon is seen, and its corners are feet that bear a load."""
    recording, robot = walking.recording, robot_of(walking.recording)
    motion = motion_of(recording, robot, 30.0)
    items, tracks = marks.support(recording, robot, motion, "")
    seen_now = np.array([track[:, 2, 3] == 0 for track in tracks.values()])
    assert (seen_now.sum(axis=0) <= 1).all()
    assert seen_now.sum(axis=0).mean() > 0.9
    for item, shown in zip(items, seen_now, strict=True):
        assert isinstance(item.shape, Mesh)
        first = motion.samples[np.argmax(shown)]
        feet = [
            [recording.columns[f"{leg.name}.foot_{axis}"][first] for axis in "xy"]
            for leg in robot.legs
            if recording.columns[f"{leg.name}.load"][first] > 1.0
        ]
        apart = np.linalg.norm(item.shape.vertices[:, np.newaxis, :2] - np.array(feet), axis=-1)
        assert apart.min(axis=1).max() < 1e-12


def test_the_ground_reaches_beyond_the_path_and_has_metres(sliding: SeenRun) -> None:
    scene = scene_of([sliding])
    slab = next(item for item in scene.items if item.name == "slab")
    grid = next(item for item in scene.items if item.name == "grid")
    assert isinstance(grid.shape, Mesh)
    # Lines at whole metres: each vertex lies within half a line's width of one.
    x, y, _ = grid.shape.vertices.T
    off = np.minimum(np.abs(x - np.round(x)), np.abs(y - np.round(y)))
    assert off.max() < 0.01
    low = slab.X_FG[:2, 3] - 0.5 * np.array(slab.shape.size[:2])
    assert (low < sliding.recording.q_xyt[:, :2].min(axis=0) - 1.0).all()


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_cameras_see_the_whole_path(sliding: SeenRun, aspect: float) -> None:
    scene = scene_of([sliding])
    for name in ("iso", "top"):
        camera = scene.cameras[name]
        eye = camera.eye(aspect)
        forward = (camera.target - eye) / np.linalg.norm(camera.target - eye)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        for place in sliding.recording.q_xyt[:, :2]:
            ray = np.array([*place, 0.0]) - eye
            depth, half = ray @ forward, math.tan(math.radians(20))
            assert abs(ray @ up) < depth * half
            assert abs(ray @ right) < depth * half * aspect


def test_several_runs_have_colours_of_their_own_and_one_ghost_if_the_equations_agree(sliding: SeenRun) -> None:
    scene: Scene = scene_of([sliding, sliding])
    boxes = [item for item in scene.items if item.name == "box"]
    assert [item.color for item in boxes] == list(palette.RUNS[:2])
    assert sum(item.frame.endswith("ghost") and item.name == "body" for item in scene.items) == 1
    np.testing.assert_array_equal(scene.tracks["run_1/ghost"], scene.tracks["run_2/ghost"])


def test_flat_shapes() -> None:
    """A band has its width and length, a disc its area, and what stays in place is no band."""

    def area(mesh: Mesh) -> float:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        return 0.5 * np.linalg.norm(normals, axis=1).sum()

    band = ribbon(np.column_stack([np.linspace(0, 2, 5), np.zeros(5)]), 0.1, 0.02)
    assert band is not None
    assert area(band) == pytest.approx(0.2)
    assert ribbon(np.ones((4, 2)), 0.1, 0.0) is None
    assert area(disc(np.zeros(3), 1.0, corners=200)) == pytest.approx(math.pi, rel=1e-3)
    assert area(polygon(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]))) == pytest.approx(1.0)


def test_what_is_no_model_is_refused(tmp_path: Path) -> None:
    for text in ("no xml", "<sdf/>", "<sdf><model><link name='a'><pose>x</pose></link></model></sdf>"):
        with pytest.raises(rb.ResourceError, match=r"model\.sdf"):
            read_model(text)
