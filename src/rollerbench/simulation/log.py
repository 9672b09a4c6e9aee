"""From what an engine simulated to a recording."""

import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import Any

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

Progress = Callable[[float], None]
"""Called with the simulated time now and then [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """What an engine simulated, one sample a step.

    Attributes:
        time: Times (n,) [s].
        motion: The robot's motion, with its imperfections.
        command: Commanded speeds (n, n_driven) of the driven wheels [rad/s].
        measured: Their measured speeds (n, n_driven) [rad/s].
        effort: Torques (n, n_driven) of their motors [N m].
        odometry: Poses (n, 3) from the measured speeds [m, m, rad].
        first_roller: First simulated rollers (n,) of wheels of whose rollers only some are, by name.
        contact_forces: Forces (n, 3 n_wheels) of the ground on the wheels in W [N], where they were recorded.
    """

    time: Array
    motion: RobotMotion
    command: Array
    measured: Array
    effort: Array
    odometry: Array
    first_roller: Mapping[str, Array] = field(default_factory=dict)
    contact_forces: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """What came out of an engine.

    Attributes:
        recording: Samples up to the end, or to where it failed.
        failure: Why it did not reach the end, or None.
        wall_time: Time that it took, without building and writing [s].
    """

    recording: Recording
    failure: str | None
    wall_time: float


def provenance(scenario: Scenario, engine: str) -> dict[str, Any]:
    """What a recording tells of the run that it comes from, so that it can be analysed alone."""
    injected = scenario.errors.stages(scenario.robot)
    return {
        "robot": scenario.robot.name,
        "scenario": scenario.name,
        "engine": engine,
        **versions(engine),
        "robot_description": scenario.robot.model_dump(mode="json", exclude_none=True),
        "injected": {name: robot.model_dump(mode="json", exclude_none=True) for name, robot in injected.items()},
        "rollers": scenario.wheel_control.rollers,
        "ground": ground_of(scenario),
        "feedback": scenario.tracking is not None,
        "drivetrain": scenario.errors.drives(scenario.robot) is not None,
    }


def ground_of(scenario: Scenario) -> dict[str, Any]:
    """What rises above the ground, so that it can be drawn."""
    bumps = scenario.bumps
    caps = None
    if bumps is not None:
        places = {"centers": bumps.centers_W[:, :2], "half_widths": bumps.half_widths, "heights": bumps.heights}
        caps = {name: values.tolist() for name, values in places.items()}
    return {
        "slope_deg": scenario.ground.slope_deg,
        "steps": [step.model_dump() for step in scenario.ground.steps],
        "bumps": caps,
    }


def versions(engine: str = "drake") -> dict[str, str]:
    """Versions of what computed a result with an engine: drake, mujoco or both."""
    second = {"mujoco": version("mujoco")} if engine in ("mujoco", "both") else {}
    own = {"rollerbench": version("rollerbench"), "drake": version("drake"), "python": platform.python_version()}
    return {**own, **second}


def station_samples(station: Station, scenario: Scenario, context: Context) -> Samples:
    """Everything that a station logged, up to the first sample that is not finite."""
    model = station.parts.model
    logs = {name: sink.FindLog(context) for name, sink in station.parts.logs.items()}
    time = logs["state"].sample_times()
    data = {name: log.data().T for name, log in logs.items()}
    # A failure may have left the logs of unequal length.
    count = min(len(rows) for rows in data.values())
    finite = np.all([np.isfinite(rows[:count]).all(axis=1) for rows in data.values()], axis=0)
    end = count if finite.all() else int(np.argmin(finite))
    data = {name: rows[:end] for name, rows in data.items()}
    motion, measured = robot_motion(model, data["state"], time[:end], data.get("rollers")), data["wheel_speeds"]
    actuated = [actuator.joint().name() for actuator in model.actuators]
    driven = [actuated.index(model.drive_joint(wheel).name()) for wheel in model.robot.driven_wheels]
    return Samples(
        time=time[:end],
        motion=motion,
        command=data["wheel_speed_command"],
        measured=measured,
        effort=data["net_actuation"][:, driven],
        odometry=data["odometry"],
        first_roller={}
        if model.roller_window is None
        else {name: data["rollers"][:, offset] for name, offset in model.roller_window.offsets.items()},
        contact_forces=data.get("contact_forces"),
    )


def odometry_poses(scenario: Scenario, measured: Array, motion: RobotMotion, time_step: float) -> Array:
    """Poses (n, 3) from measured wheel speeds (n, n_driven), and where wheels steer from their measured angles too."""
    kinematics = scenario.motion.kinematics
    if scenario.motion.steers:
        twist = kinematics.forward_at(measured, motion.swivel_angles)
    else:
        twist = kinematics.forward(measured)
    return accumulate(np.zeros(3), time_step * twist[:-1])


def recording_of(samples: Samples, scenario: Scenario, metadata: Mapping[str, Any]) -> Recording:
    """Samples beside the reference, with the contacts of the wheels."""
    time, motion = samples.time, samples.motion
    reference = scenario.motion.twist
    columns = {"time": time}
    columns |= dict(zip("xyz", motion.p_WB.T, strict=True))
    rpy = Rotation.from_matrix(motion.R_WB).as_euler("xyz")
    columns |= {"roll": rpy[:, 0], "pitch": rpy[:, 1], "yaw": motion.q_xyt[:, 2]}
    columns |= _named(("vx", "vy", "wz"), motion.v_xyw_B)
    columns |= _named(("reference_x", "reference_y", "reference_yaw"), reference_poses(reference, time))
    columns |= _named(("reference_vx", "reference_vy", "reference_wz"), reference(time))
    columns |= _named(("odometry_x", "odometry_y", "odometry_yaw"), samples.odometry)
    columns |= _wheel_columns(scenario.robot, samples)
    columns |= _contact_columns(scenario.simulated_robot, motion, scenario.bumps)
    if samples.contact_forces is not None:
        columns |= _force_columns(scenario.robot, motion, samples.contact_forces)
    return Recording(columns=columns, wheel_names=scenario.robot.wheel_names, metadata=metadata)


def robot_motion(
    model: RobotModel, state: Array, time: Array | None = None, remembered: Array | None = None
) -> RobotMotion:
    """The motion in states (n, nq + nv) of a robot's model instance.

    Of a robot with windowed rollers with the times (n,) and the states of its roller window.
    """
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
        window = model.roller_window
        if window is not None and wheel.name in window.windows and remembered is not None and time is not None:
            hub = np.array([angles[0][:, index], rates[0][:, index], v[:, iv + 2]])
            rollers[wheel.name] = window.roller_speeds(wheel.name, rollers[wheel.name], remembered, time, hub)
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


def _with_next_velocities(motion: RobotMotion) -> RobotMotion:
    """The motion with the velocities of the next sample at the positions of this one.

    Engines find them from the contacts at the present positions: a roller that has just touched the ground spins only
    in the next sample. So these, at these positions, are the velocities that show slip.
    """

    def shifted(values: Array) -> Array:
        return np.concatenate([values[1:], values[-1:]])

    names = ("v_WB", "w_WB", "wheel_speeds", "swivel_rates")
    rollers = {name: shifted(speeds) for name, speeds in motion.roller_speeds.items()}
    return replace(motion, roller_speeds=rollers, **{name: shifted(getattr(motion, name)) for name in names})


def _wheel_columns(robot: Robot, samples: Samples) -> dict[str, Array]:
    driven = [wheel.name for wheel in robot.driven_wheels]
    missing = np.full(len(samples.time), np.nan)
    columns: dict[str, Array] = {}
    for index, wheel in enumerate(robot.wheels):
        motor = {"measured": samples.measured, "command": samples.command, "effort": samples.effort}
        values = {
            "angle": samples.motion.wheel_angles[:, index],
            "speed": samples.motion.wheel_speeds[:, index],
            **{name: of[:, driven.index(wheel.name)] if wheel.driven else missing for name, of in motor.items()},
            "swivel": samples.motion.swivel_angles[:, index],
            "first_roller": samples.first_roller.get(wheel.name, missing),
        }
        if wheel.name in samples.motion.roller_speeds:
            speeds = samples.motion.roller_speeds[wheel.name]
            values |= {f"roller_{k:02d}": speeds[:, k] for k in range(speeds.shape[1])}
        columns |= {f"{wheel.name}.{name}": value for name, value in values.items()}
    return columns


def _contact_columns(robot: Robot, motion: RobotMotion, bumps: Bumps | None) -> dict[str, Array]:
    yaw, stepping = motion.q_xyt[:, 2], _with_next_velocities(motion)
    columns: dict[str, Array] = {}
    for wheel in robot.wheels:
        contact = wheel_contact(robot, wheel, stepping, bumps)
        place = rotate(-yaw, contact.p_WC[:, :2] - motion.p_WB[:, :2])
        slip, drive = (rotate(-yaw, vectors[:, :2]) for vectors in (contact.slip_W, contact.drive_W))
        values = {
            "contact_x": place[:, 0],
            "contact_y": place[:, 1],
            "depth": contact.depth,
            "slip_x": slip[:, 0],
            "slip_y": slip[:, 1],
            "drive_x": drive[:, 0],
            "drive_y": drive[:, 1],
            "rolling_radius": contact.rolling_radius,
        }
        columns |= {f"{wheel.name}.{name}": value for name, value in values.items()}
    return columns


def _force_columns(robot: Robot, motion: RobotMotion, forces: Array) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    for wheel, force in zip(robot.wheels, np.split(forces, len(robot.wheels), axis=1), strict=True):
        aside = rotate(-motion.q_xyt[:, 2], force[:, :2])
        along = np.column_stack([aside, force[:, 2]])
        columns |= _named(tuple(f"{wheel.name}.force_{axis}" for axis in "xyz"), along)
    return columns


def _named(names: tuple[str, ...], columns: Array) -> dict[str, Array]:
    return dict(zip(names, columns.T, strict=True))
