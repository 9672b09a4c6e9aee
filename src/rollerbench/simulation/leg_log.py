"""From what a station of a robot on legs logged to a recording."""

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context
from scipy.spatial.transform import Rotation

from rollerbench.description import Robot
from rollerbench.kinematics.legs.chain import geometric_jacobian
from rollerbench.kinematics.legs.group import LegGroup
from rollerbench.kinematics.legs.stance import stance_next, stance_start
from rollerbench.kinematics.odometry import rotate
from rollerbench.recording import Recording
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.log import ground_of, versions
from rollerbench.simulation.scenario import Scenario

Array = NDArray[np.float64]


def leg_recording(station: LegStation, scenario: Scenario, context: Context) -> Recording:
    """Everything that a station logged, up to the first sample that is not finite."""
    logs = {name: sink.FindLog(context) for name, sink in station.parts.logs.items()}
    data = {name: log.data().T for name, log in logs.items()}
    time, state = logs["state"].sample_times(), data["state"]
    finite = np.isfinite(state).all(axis=1) & np.isfinite(data["motor_efforts"][: len(state)]).all(axis=1)
    end = len(time) if finite.all() else int(np.argmin(finite))
    time, state = time[:end], state[:end]
    slow = logs["reference_pose"].sample_times()

    def resampled(values: Array) -> Array:
        return np.array([np.interp(time, slow, column) for column in values.T]).T.reshape(len(time), -1)

    model = station.parts.model
    q, v = model.body_position_index, model.plant.num_positions(model.model_instance) + model.body_velocity_index
    rotation = Rotation.from_quat(state[:, q : q + 4], scalar_first=True)
    rpy, p_WB = rotation.as_euler("xyz"), state[:, q + 4 : q + 7]
    w_WB, v_WB = state[:, v : v + 3], state[:, v + 3 : v + 6]
    yaw = np.unwrap(rpy[:, 2])
    twist = resampled(data["reference_twist"])
    joints = state @ model.leg_state_matrix().T
    stance, desired = resampled(data["stance"]), resampled(data["desired"])
    reference = desired[:, [0, 1, 5]]
    planar = np.column_stack([rotate(-yaw, v_WB[:, :2]), w_WB[:, 2]])
    if "odometry" in data:
        odometry = data["odometry"].copy()
        odometry[:, 2] = np.unwrap(odometry[:, 2])
        odometry = resampled(odometry)
    else:
        odometry = _odometry(scenario, joints, stance, desired[0], time)
    columns = {"time": time}
    columns |= dict(zip("xyz", p_WB.T, strict=True)) | {"roll": rpy[:, 0], "pitch": rpy[:, 1], "yaw": yaw}
    columns |= _named(("vx", "vy", "wz"), planar)
    columns |= _named(("reference_x", "reference_y", "reference_yaw"), reference)
    columns |= _named(("reference_vx", "reference_vy", "reference_wz"), twist)
    columns |= _named(("odometry_x", "odometry_y", "odometry_yaw"), odometry)
    columns |= _named(("desired_z", "desired_roll", "desired_pitch"), desired[:, 2:5])
    rates = model.leg_state_matrix()[len(joints[0]) // 2 :, model.plant.num_positions(model.model_instance) :]
    pressed = data["contact_efforts"][:end] @ rates.T
    columns |= _leg_columns(scenario.robot, rotation.as_matrix(), (p_WB, w_WB, v_WB), joints, pressed)
    columns |= _effort_columns(scenario.robot, data["motor_efforts"][:end], stance)
    return Recording(columns=columns, wheel_names=(), metadata=_provenance(scenario))


def _provenance(scenario: Scenario) -> dict[str, object]:
    return {
        "robot": scenario.robot.name,
        "scenario": scenario.name,
        "engine": "drake",
        **versions(),
        "robot_description": scenario.robot.model_dump(mode="json", exclude_none=True),
        "legs": [leg.name for leg in scenario.robot.legs],
        "ground": ground_of(scenario),
    }


def _odometry(scenario: Scenario, joints: Array, stance: Array, desired: Array, time: Array) -> Array:
    """Poses (n, 3) from the joints of the legs that stand, once in a period of control."""
    group, period = LegGroup(scenario.robot), scenario.leg_control.period
    every = max(1, round(period / scenario.plant.time_step))
    chosen = np.arange(0, len(time), every)
    angles, rates = np.split(joints, 2, axis=1)
    pose = np.eye(4)
    pose[2, 3] = desired[2]
    estimate = stance_start(group, group.from_vector(angles[0])[0], pose)
    poses = [pose]
    ground = None if scenario.ground.steps else np.zeros(len(scenario.robot.legs))
    for row in chosen[1:]:
        (q, _), (q_rate, wheel) = group.from_vector(angles[row]), group.from_vector(rates[row])
        estimate = stance_next(group, estimate, (q, q_rate), wheel, stance[row] > 0.5, period, ground)
        poses.append(estimate.X_WB)
    found = np.array(poses)
    yaw = np.unwrap(np.arctan2(found[:, 1, 0], found[:, 0, 0]))
    planar = np.column_stack([found[:, 0, 3], found[:, 1, 3], yaw])
    return np.array([np.interp(time, time[chosen], column) for column in planar.T]).T


def _leg_columns(
    robot: Robot, R_WB: Array, body: tuple[Array, Array, Array], joints: Array, pressed: Array
) -> dict[str, Array]:
    """Feet, joints, slip and loads; the contacts press on joints and wheels by pressed (n, ...) [N m]."""
    group = LegGroup(robot)
    columns: dict[str, Array] = {}
    p_WB, w_WB, v_WB = body
    angles, rates = np.split(joints, 2, axis=1)
    first = 0
    for index, leg in enumerate(robot.legs):
        count = len(leg.links)
        own = slice(first, first + count)
        frames = group.leg_frames(index, angles[:, own])
        jacobian = geometric_jacobian(frames)
        turn = np.einsum("nij,nj->ni", jacobian[:, :3], rates[:, own])
        turn = turn + rates[:, first + count, np.newaxis] * frames[:, -1, :3, 2]
        slide = np.einsum("nij,nj->ni", jacobian[:, 3:], rates[:, own])
        center = np.einsum("nij,nj->ni", R_WB, frames[:, -1, :3, 3])
        turn_W = np.einsum("nij,nj->ni", R_WB, turn) + w_WB
        velocity = np.einsum("nij,nj->ni", R_WB, slide) + v_WB + np.cross(w_WB, center)
        # The ball's lowest point moves over the ground at v - w x R z.
        slip = velocity - leg.wheel.radius * np.cross(turn_W, [0.0, 0.0, 1.0])
        place = p_WB + center - [0.0, 0.0, leg.wheel.radius]
        values = dict(zip(("foot_x", "foot_y", "foot_z"), place.T, strict=True))
        values |= {"slip_x": slip[:, 0], "slip_y": slip[:, 1]}
        # The force f of the ground turns the joints by J^T f.
        down = leg.wheel.radius * R_WB[:, np.newaxis, 2, :]
        arms = frames[:, -1:, :3, 3] - down - frames[:, :-1, :3, 3]
        lever = np.cross(frames[:, :-1, :3, 2], arms)
        force = (np.linalg.pinv(lever, rcond=1e-6) @ pressed[:, own, np.newaxis])[..., 0]
        values |= {"load": np.einsum("nj,nj->n", R_WB[:, 2, :], force)}
        values |= {f"joint_{k + 1}": angles[:, first + k] for k in range(count)}
        values |= {"wheel": angles[:, first + count], "wheel_speed": rates[:, first + count]}
        columns |= {f"{leg.name}.{name}": value for name, value in values.items()}
        first += count + 1
    return columns


def _effort_columns(robot: Robot, efforts: Array, stance: Array) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    first = 0
    for index, leg in enumerate(robot.legs):
        names = [*(f"effort_{k + 1}" for k in range(len(leg.links))), "wheel_effort"]
        columns |= {f"{leg.name}.{name}": efforts[:, first + k] for k, name in enumerate(names)}
        columns |= {f"{leg.name}.stance": stance[:, index]}
        first += len(names)
    return columns


def _named(names: tuple[str, ...], columns: Array) -> dict[str, Array]:
    return dict(zip(names, columns.T, strict=True))
