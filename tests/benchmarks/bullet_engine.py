"""PyBullet, from a URDF of the same robot."""

import math
import tempfile
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import rollerbench as rb
from rollerbench.description.wheels import RollerWheel
from rollerbench.sdf import names

from .bullet_model import write_urdf
from .engine import Run, Setting
from .motions import Motion

SETTLE_TIME = 0.25
"""Time that a robot stands before it moves [s]."""

FAMILY = "PyBullet"
BASE: Mapping[str, Any] = {"iterations": 50, "rollers": "spheres 11"}

CHOICES: Sequence[Mapping[str, Any]] = (
    {"iterations": 10},
    {"iterations": 25},
    {"iterations": 100},
    {"iterations": 200},
    {"rollers": "hull 9x20"},
    {"rollers": "hull 21x48"},
    {"rollers": "spheres 7"},
    {"rollers": "hull 15x32"},
    {"rollers": "spheres 21"},
    {"contact_erp": 0.2},
    {"contact_erp": 0.8},
    {"cone_friction": 1},
    {"ground": "box"},
    {"residual_threshold": 0.0},
)
"""What the search tries on top: solver iterations, finer and coarser rollers, stiffness, friction cone, ground."""


class BulletEngine:
    """Bullet's articulated bodies, in this process (DIRECT).

    The ground is a plane, or the top of a box, which only the lowest rollers' bounding boxes touch. Motors are Bullet's
    own velocity motors; speeds of joints are not clamped, and nothing is damped but the rollers, as robot.yaml says.
    """

    name = FAMILY
    notes = (
        "rollers are convex hulls of the ellipsoids, or rows of spheres in them: Bullet knows no ellipsoids; "
        "one call from Python a step, and one more while the command changes"
    )

    def __init__(self) -> None:
        self.version = version("pybullet")

    def reference(self, effort: str) -> tuple[Setting, Setting]:
        """Many iterations and fine rollers, at a small step."""
        step = {"smoke": 2e-3, "quick": 1e-3}.get(effort, 2.5e-4)
        fine = Setting(family=FAMILY, time_step=step, options={"iterations": 200, "rollers": "spheres 21"})
        return fine, fine.with_step(2 * step)

    def ladder(self, effort: str) -> list[Setting]:
        """Several steps."""
        steps = {"smoke": (4e-3,), "quick": (2e-3, 4e-3)}.get(effort, (5e-4, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3))
        return [Setting(family=FAMILY, time_step=step, options=BASE) for step in steps]

    def refinements(self, effort: str) -> Sequence[Mapping[str, Any]]:
        """All choices, or few."""
        return {"smoke": (), "quick": CHOICES[1:3]}.get(effort, CHOICES)

    def prepare(self, robot: rb.Robot, motions: Sequence[Motion], setting: Setting) -> "BulletRunner":
        """Loads the robot and lets it settle."""
        return BulletRunner(robot, motions, setting)


class BulletRunner:
    """A Bullet server in this process with one robot, and its state at rest."""

    def __init__(self, robot: rb.Robot, motions: Sequence[Motion], setting: Setting) -> None:
        import pybullet

        self._bullet, self._client = pybullet, pybullet.connect(pybullet.DIRECT)
        self._commands = [motion.wheel_speeds(setting.time_step) for motion in motions]
        self._set_engine(setting)
        self._body = self._load(robot, setting)
        joints = {self._ask("getJointInfo", self._body, j)[1].decode(): j for j in range(self._joint_count)}
        self._drives = [joints[names.drive_joint(wheel.name)] for wheel in robot.driven_wheels]
        self._forces = [math.inf if w.max_effort is None else w.max_effort for w in robot.driven_wheels]
        self._forces = [min(force, 1e6) for force in self._forces]
        self._command(np.zeros(len(self._drives)))
        for _ in range(round(SETTLE_TIME / setting.time_step)):
            pybullet.stepSimulation(physicsClientId=self._client)
        position, _ = self._ask("getBasePositionAndOrientation", self._body)
        offset = self._ask("getDynamicsInfo", self._body, -1)[3]
        self._offset = np.array(offset)
        start = (offset[0], offset[1], position[2])
        self._ask("resetBasePositionAndOrientation", self._body, start, (0, 0, 0, 1))
        self._ask("resetBaseVelocity", self._body, (0, 0, 0), (0, 0, 0))
        for joint in range(self._joint_count):
            self._ask("resetJointState", self._body, joint, self._ask("getJointState", self._body, joint)[0], 0.0)
        self._start = self._ask("saveState")

    def run(self, index: int) -> Run:
        """Simulates the motion of this index."""
        self._ask("restoreState", stateId=self._start)
        command, step, client = self._commands[index], self._bullet.stepSimulation, self._client
        changes = np.concatenate([[True], (np.diff(command, axis=0) != 0).any(axis=1)]).tolist()
        rows = command.tolist()
        started = time.perf_counter()
        for row, changed in zip(rows, changes, strict=True):
            if changed:
                self._command(row)
            step(physicsClientId=client)
        wall_time = time.perf_counter() - started
        position, quaternion = self._ask("getBasePositionAndOrientation", self._body)
        x, y, z, w = quaternion
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        # Bullet's base is the centre of mass.
        turned = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]) @ self._offset[:2]
        return Run(q_xyt=np.array([position[0] - turned[0], position[1] - turned[1], yaw]), wall_time=wall_time)

    def close(self) -> None:
        """Ends the server."""
        self._bullet.disconnect(self._client)

    def _ask(self, name: str, *arguments: Any, **named: Any) -> Any:
        return getattr(self._bullet, name)(*arguments, physicsClientId=self._client, **named)

    @property
    def _joint_count(self) -> int:
        return int(self._ask("getNumJoints", self._body))

    def _command(self, wheel_speeds: Sequence[float]) -> None:
        self._bullet.setJointMotorControlArray(
            self._body,
            self._drives,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=wheel_speeds,
            forces=self._forces,
            physicsClientId=self._client,
        )

    def _set_engine(self, setting: Setting) -> None:
        options = setting.options
        self._ask("setGravity", 0, 0, -9.81)
        settings: dict[str, Any] = {
            "fixedTimeStep": setting.time_step,
            "numSolverIterations": options["iterations"],
            "contactBreakingThreshold": 1e-3,
            "enableConeFriction": options.get("cone_friction", 0),
            "solverResidualThreshold": options.get("residual_threshold", 1e-7),
        }
        if "contact_erp" in options:
            settings["contactERP"] = options["contact_erp"]
        self._ask("setPhysicsEngineParameter", **settings)

    def _load(self, robot: rb.Robot, setting: Setting) -> int:
        bullet = self._bullet
        if setting.options.get("ground") == "box":
            shape = self._ask("createCollisionShape", bullet.GEOM_BOX, halfExtents=(20, 20, 0.5))
            ground = self._ask("createMultiBody", 0, shape, basePosition=(0, 0, -0.5))
        else:
            shape = self._ask("createCollisionShape", bullet.GEOM_PLANE)
            ground = self._ask("createMultiBody", 0, shape)
        # Bullet multiplies the two coefficients of friction: the wheels carry the combined one.
        self._ask("changeDynamics", ground, -1, lateralFriction=1.0, restitution=0.0)
        with tempfile.TemporaryDirectory() as folder:
            path = write_urdf(robot, Path(folder), rollers=setting.options["rollers"])
            body = self._ask(
                "loadURDF", str(path), (0, 0, -robot.ground_height), flags=bullet.URDF_USE_INERTIA_FROM_FILE
            )
        wheel = robot.wheels[0]
        damping = wheel.rollers.damping if isinstance(wheel, RollerWheel) else 0.0
        for link in range(-1, int(self._ask("getNumJoints", body))):
            roller = link >= 0 and "roller" in self._ask("getJointInfo", body, link)[1].decode()
            self._ask(
                "changeDynamics",
                body,
                link,
                lateralFriction=wheel.friction,
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=damping if roller else 0.0,
                maxJointVelocity=1e5,
            )
            if roller:
                self._ask("setJointMotorControl2", body, link, bullet.VELOCITY_CONTROL, force=0.0)
        return int(body)
