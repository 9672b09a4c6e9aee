"""From a station's logs to a recording."""

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context
from scipy.spatial.transform import Rotation

from rollerbench.description import Robot
from rollerbench.kinematics.bumps import Bumps
from rollerbench.kinematics.contact import RobotMotion, wheel_contact
from rollerbench.kinematics.odometry import accumulate, rotate
from rollerbench.kinematics.profile import reference_poses
from rollerbench.plant import RobotModel
from rollerbench.recording import Recording
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.station import Station

Array = NDArray[np.float64]


def recording_of(station: Station, scenario: Scenario, context: Context, metadata: dict[str, str]) -> Recording:
    """Everything recorded, up to the first sample that is not finite."""
    parts = station.parts
    logs = {name: sink.FindLog(context) for name, sink in parts.logs.items()}
    time = logs["state"].sample_times()
    data = {name: log.data().T for name, log in logs.items()}
    # A failure may have left the logs of unequal length.
    count = min(len(rows) for rows in data.values())
    finite = np.all([np.isfinite(rows[:count]).all(axis=1) for rows in data.values()], axis=0)
    end = count if finite.all() else int(np.argmin(finite))
    time = time[:end]
    data = {name: rows[:end] for name, rows in data.items()}

    motion = robot_motion(parts.model, data["state"])
    reference = scenario.motion.twist
    columns = {"time": time}
    columns |= dict(zip("xyz", motion.p_WB.T, strict=True))
    rpy = Rotation.from_matrix(motion.R_WB).as_euler("xyz")
    columns |= {"roll": rpy[:, 0], "pitch": rpy[:, 1], "yaw": motion.q_xyt[:, 2]}
    columns |= _named(("vx", "vy", "wz"), motion.v_xyw_B)
    columns |= _named(("reference_x", "reference_y", "reference_yaw"), reference_poses(reference, time))
    columns |= _named(("reference_vx", "reference_vy", "reference_wz"), reference(time))
    columns |= _named(("odometry_x", "odometry_y", "odometry_yaw"), _odometry(scenario, motion, data))
    stepping = robot_motion(parts.model, _with_next_velocities(parts.model, data["state"]))
    columns |= _wheel_columns(parts.model, motion, data)
    columns |= _contact_columns(parts.model.robot, motion, stepping, scenario.bumps)
    return Recording(columns=columns, wheel_names=scenario.robot.wheel_names, metadata=metadata)


def _odometry(scenario: Scenario, motion: RobotMotion, data: dict[str, Array]) -> Array:
    """Poses (n, 3) from measured wheel speeds; where wheels steer on the way, from their measured angles too."""
    if not scenario.motion.steers:
        return data["odometry_q_xyt"]
    twist = scenario.motion.kinematics.forward_at(data["wheel_speeds"], motion.swivel_angles)
    return accumulate(np.zeros(3), scenario.plant.time_step * twist[:-1])


def robot_motion(model: RobotModel, state: Array) -> RobotMotion:
    """The motion in states (n, nq + nv) of a robot's model instance."""
    nq = model.plant.num_positions(model.model_instance)
    q, v = state[:, :nq], state[:, nq:]
    iq, iv = model.body_position_index, model.body_velocity_index
    n, wheels = len(state), model.robot.wheels
    angles, rates = np.zeros((2, n, len(wheels))), np.zeros((2, n, len(wheels)))
    rollers = {}
    for index, wheel in enumerate(wheels):
        joints = [model.drive_joint(wheel)] + ([model.swivel_joint(wheel)] if wheel.swivels else [])
        for row, joint in enumerate(joints):
            angles[row, :, index] = q[:, model.position_index(joint)]
            rates[row, :, index] = v[:, model.velocity_index(joint)]
        if wheel.ring:
            rollers[wheel.name] = v[:, [model.velocity_index(joint) for joint in model.roller_joints(wheel)]]
    return RobotMotion(
        p_WB=q[:, iq + 4 : iq + 7],
        R_WB=Rotation.from_quat(q[:, iq : iq + 4], scalar_first=True).as_matrix(),
        w_WB=v[:, iv : iv + 3],
        v_WB=v[:, iv + 3 : iv + 6],
        wheel_angles=angles[0],
        wheel_speeds=rates[0],
        swivel_angles=angles[1],
        swivel_rates=rates[1],
        roller_speeds=rollers,
    )


def _with_next_velocities(model: RobotModel, state: Array) -> Array:
    """States (n, nq + nv) whose velocities are those of the next sample.

    The discrete plant finds them from the contacts at the present positions: a roller that has just touched the ground
    spins only in the next sample. So these, at these positions, are the velocities that show slip.
    """
    nq = model.plant.num_positions(model.model_instance)
    return np.hstack([state[:, :nq], np.vstack([state[1:, nq:], state[-1:, nq:]])])


def _wheel_columns(model: RobotModel, motion: RobotMotion, data: dict[str, Array]) -> dict[str, Array]:
    robot = model.robot
    driven = [wheel.name for wheel in robot.driven_wheels]
    actuated = [actuator.joint().name() for actuator in model.actuators]
    missing = np.full(len(motion.p_WB), np.nan)
    columns: dict[str, Array] = {}
    for index, wheel in enumerate(robot.wheels):
        joint = model.drive_joint(wheel).name()
        values = {
            "angle": motion.wheel_angles[:, index],
            "speed": motion.wheel_speeds[:, index],
            "measured": data["wheel_speeds"][:, driven.index(wheel.name)] if wheel.driven else missing,
            "command": data["wheel_speed_command"][:, driven.index(wheel.name)] if wheel.driven else missing,
            "effort": data["net_actuation"][:, actuated.index(joint)] if wheel.driven else missing,
            "swivel": motion.swivel_angles[:, index],
        }
        columns |= {f"{wheel.name}.{name}": value for name, value in values.items()}
    return columns


def _contact_columns(robot: Robot, motion: RobotMotion, stepping: RobotMotion, bumps: Bumps | None) -> dict[str, Array]:
    yaw = motion.q_xyt[:, 2]
    columns: dict[str, Array] = {}
    for wheel in robot.wheels:
        contact = wheel_contact(robot, wheel, stepping, bumps)
        place = rotate(-yaw, contact.p_WC[:, :2] - motion.p_WB[:, :2])
        slip = rotate(-yaw, contact.slip_W[:, :2])
        values = {
            "contact_x": place[:, 0],
            "contact_y": place[:, 1],
            "depth": contact.depth,
            "slip_x": slip[:, 0],
            "slip_y": slip[:, 1],
        }
        columns |= {f"{wheel.name}.{name}": value for name, value in values.items()}
    return columns


def _named(names: tuple[str, ...], columns: Array) -> dict[str, Array]:
    return dict(zip(names, columns.T, strict=True))
