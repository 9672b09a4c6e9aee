"""Simulates a scenario with MuJoCo: an independent second opinion on open-loop commands."""

import importlib.util
import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import DescriptionError, ResourceError, SimulationError
from rollerbench.kinematics.contact import RobotMotion
from rollerbench.sdf import names
from rollerbench.sdf.mjcf import DEFAULT_STEP, robot_to_mjcf
from rollerbench.sdf.servo import ServoGains, servo_gains
from rollerbench.simulation.log import Progress, Samples, Simulated, odometry_poses, provenance, recording_of
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.watch import CHUNK, NOT_FINITE, SETTLE_TIME, wrong_pose

Array = NDArray[np.float64]


def check(scenario: Scenario) -> None:
    """Checks that MuJoCo can simulate a scenario.

    Raises:
        ResourceError: MuJoCo is not installed.
        DescriptionError: the scenario has what only Drake simulates here.
    """
    if importlib.util.find_spec("mujoco") is None:
        raise ResourceError(f"engine = {scenario.engine!r}: MuJoCo is missing: pip install 'rollerbench[mujoco]'")
    if scenario.motion.wheel_efforts is not None or scenario.wheel_control.servo != "implicit":
        raise DescriptionError(
            f"engine = {scenario.engine!r}: torques of wheels are commanded in Drake only; accepted: engine: drake, or "
            "another command, with servo: implicit"
        )
    if scenario.engine == "mujoco" and scenario.recording.forces:
        raise DescriptionError(
            f"engine = {scenario.engine!r}: recording.forces = True: forces of the ground are recorded by Drake only; "
            "accepted: engine: drake or both, or forces: false"
        )
    if scenario.ground.roll_resistance:
        raise DescriptionError(
            f"engine = {scenario.engine!r}: ground.roll_resistance is simulated by Drake only; accepted: engine: "
            "drake, or roll_resistance: 0"
        )
    if scenario.errors.drives(scenario.robot) is not None or scenario.errors.ground_bumps is not None:
        raise DescriptionError(
            f"engine = {scenario.engine!r}: gear_error, backlash_deg, encoder_counts and ground_bumps under errors are "
            "simulated by Drake only; accepted: engine: drake, or a scenario without them"
        )


def time_step(scenario: Scenario) -> float:
    """MuJoCo's step: the plant's, cut so that it is a millisecond or less [s]."""
    step = scenario.plant.time_step
    return step / math.ceil(step / DEFAULT_STEP - 1e-9)


def simulate(scenario: Scenario, *, progress: Progress | None = None) -> Simulated:
    """Runs a scenario in MuJoCo.

    Raises:
        SimulationError: the robot cannot stand.
    """
    import mujoco

    step = time_step(scenario)
    model = mujoco.MjModel.from_xml_string(_mjcf(scenario, step))
    data = mujoco.MjData(model)
    _stand_at_rest(model, data, scenario)
    count = math.floor(scenario.duration / step + 1e-6)
    times = step * np.arange(count + 1, dtype=np.float64)
    command, control, motors = scenario.motion.wheel_speeds(times), _control(scenario, times), _Motors(model, scenario)
    q, v = np.zeros((count + 1, model.nq)), np.zeros((count + 1, model.nv))
    effort = np.zeros((count + 1, command.shape[1]))
    started, failure, done = time.perf_counter(), None, count
    try:
        for index in range(count + 1):
            q[index], v[index] = data.qpos, data.qvel
            if index % max(1, round(CHUNK / step)) == 0:
                failure = _fault(scenario, times[index], q[index], v[index])
                if progress is not None:
                    progress(times[index])
                if failure is not None:
                    done = index
                    break
            data.ctrl[:] = control[index]
            effort[index] = motors.step(model, data)
    except KeyboardInterrupt:
        failure, done = f"interrupted at t = {times[index]:.3f} s", index
    wall_time = time.perf_counter() - started
    kept = slice(0, done + 1 if failure is None else max(1, done))
    motion = _motion(model, scenario, q[kept], v[kept])
    driven = [index for index, wheel in enumerate(scenario.robot.wheels) if wheel.driven]
    measured = motion.wheel_speeds[:, driven]
    samples = Samples(
        time=times[kept],
        motion=motion,
        command=command[kept],
        measured=measured,
        effort=effort[kept],
        odometry=odometry_poses(scenario, measured, motion, step),
    )
    recording = recording_of(samples, scenario, provenance(scenario, "mujoco"))
    return Simulated(recording=recording, failure=failure, wall_time=wall_time)


def _gains(scenario: Scenario) -> ServoGains:
    return servo_gains(scenario.robot, time_constant=scenario.wheel_control.servo_time_constant)


def _control(scenario: Scenario, times: Array) -> Array:
    """What the actuators are told (n, n_driven + n_steered): see `robot_to_mjcf`."""
    motion, gains = scenario.motion, _gains(scenario)
    lead = np.array(
        [gains.steering_damping[w.name] / gains.steering_stiffness[w.name] for w in scenario.robot.steered_wheels]
    )
    angles = motion.steering_angles
    return np.hstack([motion.wheel_speeds(times), angles(times) + lead * angles.rate(times)])


class _Motors:
    """The drive motors at their effort limits, where the armature of `robot_to_mjcf` must not act."""

    def __init__(self, model: Any, scenario: Scenario) -> None:
        wheels = scenario.robot.driven_wheels
        self.dofs = np.array([model.joint(names.drive_joint(wheel.name)).dofadr[0] for wheel in wheels])
        self.limits = np.array([math.inf if wheel.max_effort is None else wheel.max_effort for wheel in wheels])
        self.gains = np.array([_gains(scenario).drive_damping[wheel.name] for wheel in wheels])
        self.armature = model.dof_armature[self.dofs].copy()

    def step(self, model: Any, data: Any) -> Array:
        """Advances the simulation; returns the motors' torques (n_driven,) [N m]."""
        import mujoco

        n = len(self.dofs)
        wanted = self.gains * (data.ctrl[:n] - data.qvel[self.dofs])
        if (np.abs(wanted) <= self.limits).all():
            before = data.qvel[self.dofs].copy()
            mujoco.mj_step(model, data)
            return wanted - self.gains * (data.qvel[self.dofs] - before)
        # Which torques would be too large, if there were no limits?
        model.actuator_forcelimited[:n] = 0
        mujoco.mj_forward(model, data)
        saturated = np.abs(wanted - self.armature * data.qacc[self.dofs]) > self.limits
        model.actuator_forcelimited[:n] = saturated
        model.dof_armature[self.dofs] = np.where(saturated, 0.0, self.armature)
        before = data.qvel[self.dofs].copy()
        mujoco.mj_step(model, data)
        model.dof_armature[self.dofs] = self.armature
        free = wanted - self.gains * (data.qvel[self.dofs] - before)
        return np.where(saturated, np.clip(wanted, -self.limits, self.limits), free)


def _mjcf(scenario: Scenario, step: float) -> str:
    slope = math.radians(scenario.ground.slope_deg)
    return robot_to_mjcf(
        scenario.simulated_robot,
        friction=scenario.ground.friction,
        gravity=(-GRAVITY * math.sin(slope), 0.0, -GRAVITY * math.cos(slope)),
        gains=_gains(scenario),
        time_step=step,
    )


def _stand_at_rest(model: Any, data: Any, scenario: Scenario) -> None:
    """Leaves the robot at the origin, at rest, its weight on its wheels as a moment of standing still leaves it."""
    import mujoco

    data.ctrl[len(scenario.robot.driven_wheels) :] = scenario.motion.steering_angles(0.0)
    for wheel, angle in zip(scenario.robot.steered_wheels, scenario.motion.steering_angles(0.0), strict=True):
        data.joint(names.swivel_joint(wheel.name)).qpos[0] = angle
    for _ in range(round(SETTLE_TIME / model.opt.timestep)):
        mujoco.mj_step(model, data)
    what = _fault(scenario, 0.0, data.qpos, data.qvel)
    if what is not None:
        raise SimulationError(f"{scenario.name}: before it was to move, {what}")
    tilt = Rotation.from_quat(data.qpos[3:7], scalar_first=True).as_euler("xyz") * [1.0, 1.0, 0.0]
    data.qpos[:2] = 0.0
    data.qpos[3:7] = Rotation.from_euler("xyz", tilt).as_quat(scalar_first=True)
    data.qvel[:] = 0.0
    data.time = 0.0


def _fault(scenario: Scenario, now: float, q: Array, v: Array) -> str | None:
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return f"at t = {now:.3f} s {NOT_FINITE}"
    what = wrong_pose(scenario.simulated_robot, q[:3], Rotation.from_quat(q[3:7], scalar_first=True).as_matrix())
    return None if what is None else f"at t = {now:.3f} s {what}"


def _motion(model: Any, scenario: Scenario, q: Array, v: Array) -> RobotMotion:
    """The motion in MuJoCo's states: the free body first, its angular velocity in B."""
    R_WB = Rotation.from_quat(q[:, 3:7], scalar_first=True).as_matrix()
    wheels = scenario.robot.wheels
    angles, rates = np.zeros((2, len(q), len(wheels))), np.zeros((2, len(q), len(wheels)))
    rollers = {}
    for index, wheel in enumerate(wheels):
        joints = [names.drive_joint(wheel.name)] + ([names.swivel_joint(wheel.name)] if wheel.swivels else [])
        for row, name in enumerate(joints):
            angles[row, :, index] = q[:, model.joint(name).qposadr[0]]
            rates[row, :, index] = v[:, model.joint(name).dofadr[0]]
        if wheel.ring is not None:
            axes = [model.joint(names.roller_joint(wheel.name, k)).dofadr[0] for k in range(wheel.ring.count)]
            rollers[wheel.name] = v[:, axes]
    return RobotMotion(
        p_WB=q[:, :3],
        R_WB=R_WB,
        v_WB=v[:, :3],
        w_WB=np.einsum("nij,nj->ni", R_WB, v[:, 3:6]),
        wheel_angles=angles[0],
        wheel_speeds=rates[0],
        swivel_angles=angles[1],
        swivel_rates=rates[1],
        roller_speeds=rollers,
    )
