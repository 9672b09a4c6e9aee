"""MuJoCo, from the MJCF that rollerbench exports."""

import itertools
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rollerbench as rb
from rollerbench.sdf import robot_to_mjcf

from .engine import Run, Setting
from .motions import Motion

SETTLE_TIME = 0.25
"""Time that a robot stands before it moves [s]."""

CONES = {"MuJoCo elliptic": "elliptic", "MuJoCo pyramidal": "pyramidal"}

BASE: Mapping[str, Any] = {"impratio": 100.0, "jacobian": "sparse"}
"""What `robot_to_mjcf` writes, but for the cone; and sparse matrices, which MuJoCo chooses by itself from 60 degrees
of freedom on (the base with 12 rollers a wheel has 58)."""

CHOICES: Sequence[Mapping[str, Any]] = (
    *({"integrator": name} for name in ("implicitfast", "discrete")),
    *({"impratio": value} for value in (1.0, 10.0, 1000.0)),
    *({"solimp": value} for value in (0.9, 0.95, 0.999)),
    *({"solref": value} for value in (3.0, 5.0)),
    *({"tolerance": value} for value in (1e-6, 1e-4)),
    {"impratio": 10.0, "solimp": 0.95},
    {"impratio": 1.0, "noslip": 3},
    {"impratio": 1.0, "noslip": 10},
    {"integrator": "discrete", "solref": 1.0},
    {"integrator": "discrete", "solref": 0.5},
    {"integrator": "discrete", "impratio": 10.0},
    {"solver": "CG"},
    {"solver": "PGS"},
    {"solver": "PGS", "impratio": 1.0, "noslip": 3},
    {"jacobian": "dense"},
    {"jacobian": "dense", "solver": "CG"},
    {"disable": "eulerdamp"},
    {"disable": "island"},
    {"disable": "eulerdamp island"},
    {"disable": "warmstart"},
    {"iterations": 10},
    {"ls_iterations": 10},
)
"""What the search tries on top: integrators, friction impedance, stiffness, solvers, accuracy of the solve, noslip
passes, and features that this model may not need. solref is in steps: MuJoCo takes two at least, unless its integrator
is discrete."""


class MujocoEngine:
    """MuJoCo with elliptic and pyramidal cones.

    Every step is taken in C (`mujoco.rollout`, one thread), with the wheel speeds computed before. Only the ground
    collides with the robot. The velocity servos are implicit: by armature (see `robot_to_mjcf`), and with the
    integrator "discrete" by that integrator.
    """

    name = "MuJoCo"
    notes = "all rollers; steps in C by mujoco.rollout on one thread; the robot collides with the ground only"

    def __init__(self) -> None:
        self.version = version("mujoco")

    def reference(self, effort: str) -> tuple[Setting, Setting]:
        """The exported contact (elliptic, 2 ms, 0.99) with stiffer friction, at a small step."""
        step = {"smoke": 1e-3}.get(effort, 2.5e-4)
        options = {**BASE, "impratio": 1000.0, "solref_time": 0.002}
        fine = Setting(family="MuJoCo elliptic", time_step=step, options=options)
        return fine, fine.with_step(2 * step)

    def ladder(self, effort: str) -> list[Setting]:
        """Both cones at several steps."""
        steps = {"smoke": (4e-3,), "quick": (2e-3, 4e-3, 5e-3)}.get(
            effort, (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 7e-3, 8e-3)
        )
        return [
            Setting(family=family, time_step=step, options=BASE) for family, step in itertools.product(CONES, steps)
        ]

    def refinements(self, effort: str) -> Sequence[Mapping[str, Any]]:
        """All choices, or the few that mattered most."""
        few = CHOICES[:4]
        return {"smoke": (), "quick": few}.get(effort, CHOICES)

    def prepare(self, robot: rb.Robot, motions: Sequence[Motion], setting: Setting) -> "MujocoRunner":
        """Compiles the model and lets the robot settle."""
        return MujocoRunner(model_of(robot_to_mjcf(robot, time_step=setting.time_step), setting), motions)


def model_of(text: str, setting: Setting) -> Any:
    """The compiled model of an MJCF text, with a setting's options."""
    import mujoco

    mujoco.set_mju_user_warning(lambda _: None)
    model = mujoco.MjModel.from_xml_string(text)
    options, step = setting.options, setting.time_step
    opt = model.opt
    opt.timestep = step
    opt.cone = int(getattr(mujoco.mjtCone, f"mjCONE_{CONES[setting.family].upper()}"))
    opt.jacobian = int(getattr(mujoco.mjtJacobian, f"mjJAC_{options.get('jacobian', 'auto').upper()}"))
    opt.solver = int(getattr(mujoco.mjtSolver, f"mjSOL_{options.get('solver', 'Newton').upper()}"))
    opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{options.get('integrator', 'Euler').upper()}"))
    opt.impratio = options.get("impratio", 1.0)
    opt.tolerance = options.get("tolerance", opt.tolerance)
    opt.iterations = options.get("iterations", opt.iterations)
    opt.ls_iterations = options.get("ls_iterations", opt.ls_iterations)
    opt.noslip_iterations = options.get("noslip", 0)
    for name in options.get("disable", "").split():
        opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}"))
    if options.get("integrator") == "discrete":
        # It is implicit in the servos' damping itself.
        model.dof_armature[:] = 0.0
    model.geom_solref[:, 0] = options.get("solref_time", options.get("solref", 2.0) * step)
    model.geom_solimp[:, :2] = options.get("solimp", 0.99)
    return model


class MujocoRunner:
    """A compiled model, its state at rest, and the wheel speeds of each motion."""

    def __init__(self, model: Any, motions: Sequence[Motion], copies: int = 1) -> None:
        """Lets the robots settle.

        Args:
            model: The compiled model; the first `copies` free bodies are the robots.
            motions: What the robots do, all the same.
            copies: How many robots there are.
        """
        import mujoco
        from mujoco import rollout

        self._mujoco, self._rollout = mujoco, rollout.rollout
        self._model, self._data = model, mujoco.MjData(model)
        step = model.opt.timestep
        self._control = [np.tile(motion.wheel_speeds(step), (1, copies)) for motion in motions]
        start = self._data.qpos.copy()
        mujoco.mj_step(model, self._data, nstep=round(SETTLE_TIME / step))
        free = [int(model.jnt_qposadr[j]) for j in range(model.njnt) if model.jnt_type[j] == 0]
        for address in free:
            # At rest where it started, sunk in as it settled.
            self._data.qpos[address : address + 2] = start[address : address + 2]
            self._data.qpos[address + 3 : address + 7] = (1.0, 0.0, 0.0, 0.0)
        self._data.qvel[:] = 0.0
        self._data.time = 0.0
        spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self._start = np.zeros((1, mujoco.mj_stateSize(model, spec)))
        mujoco.mj_getState(model, self._data, self._start[0], spec)

    def run(self, index: int) -> Run:
        """Simulates the motion of this index."""
        import time

        control = self._control[index][np.newaxis]
        states = np.empty((1, control.shape[1], self._start.shape[1]))
        self._data.qacc_warmstart[:] = 0.0
        started = time.perf_counter()
        self._rollout(self._model, self._data, self._start, control, state=states)
        wall_time = time.perf_counter() - started
        return Run(q_xyt=_planar(states[0, -1, 1:8]), wall_time=wall_time)

    def close(self) -> None:
        """Nothing is held."""


def copies_of(robot: rb.Robot, setting: Setting, count: int, spacing: float) -> Any:
    """The compiled model of several robots in a row along y, `spacing` [m] apart."""
    import mujoco

    text = robot_to_mjcf(robot, time_step=setting.time_step)
    world = mujoco.MjSpec.from_string(text)
    for index in range(1, count):
        other = mujoco.MjSpec.from_string(text)
        other.delete(other.geom("ground"))
        frame = world.worldbody.add_frame(pos=[0.0, index * spacing, 0.0])
        world.attach(other, frame=frame, prefix=f"robot{index}_")
    return model_of(world.to_xml(), setting)


def _planar(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Planar pose (3,) of position and quaternion (7,)."""
    w, x, y, z = pose[3:]
    return np.array([pose[0], pose[1], np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))])
