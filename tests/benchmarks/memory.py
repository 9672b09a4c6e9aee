"""Peak memory of each engine: python -m tests.benchmarks.memory FAMILY prints it for a process of its own."""

import json
import resource
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rollerbench as rb

from .engines import engine_of
from .motions import motions, robot_with_rollers

ROOT = Path(__file__).resolve().parents[2]


def measure(families: Sequence[str], progress: Callable[[str], None]) -> list[dict[str, Any]]:
    """Peak memory of processes that simulate one second [MB], and what of it importing takes.

    Args:
        families: Families of settings, see `engine.Setting`.
        progress: Called with what is being done.
    """
    rows = []
    for family in families:
        progress(f"memory: {family}")
        command = [sys.executable, "-m", "tests.benchmarks.memory", family]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        lines = done.stdout.strip().splitlines()
        if done.returncode or not lines:
            rows.append({"family": family, "failure": (done.stderr.strip().splitlines() or ["no output"])[-1]})
        else:
            rows.append({"family": family, **json.loads(lines[-1])})
    return rows


def peak() -> float:
    """Largest resident memory of this process so far [MB]."""
    try:
        # getrusage counts what a parent held before this process was started from it.
        status = Path("/proc/self/status").read_text()
        (line,) = (line for line in status.splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 1024
    except (OSError, ValueError):
        size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return size / (1024 * 1024 if sys.platform == "darwin" else 1024)


@dataclass(frozen=True)
class Steady:
    """Constant wheel speeds in place of a `motions.Motion`, whose scenario would import Drake."""

    speeds: NDArray[np.float64]
    duration: float = 1.0

    def wheel_speeds(self, time_step: float) -> NDArray[np.float64]:
        """The speeds in each step."""
        return np.tile(self.speeds, (round(self.duration / time_step), 1))


def _probe(family: str) -> dict[str, float]:
    engine = engine_of(family)
    robot = robot_with_rollers()
    if family.startswith("rollerbench"):
        move: Any = motions(robot, duration=1.0, ramp=0.3, names=("diagonal",))
    else:
        move = [Steady(rb.WheelKinematics(robot).inverse((0.3, 0.3, 0.0)))]
    setting = next(setting for setting in engine.ladder("smoke") if setting.family == family)
    _import_engine(family)
    before = peak()
    engine.prepare(robot, move, setting).run(0)
    return {"imported_mb": before, "peak_mb": peak()}


def _import_engine(family: str) -> None:
    if family.startswith("MuJoCo"):
        import mujoco.rollout  # noqa: F401
    elif family.startswith("PyBullet"):
        import pybullet  # noqa: F401


if __name__ == "__main__":
    print(json.dumps(_probe(sys.argv[1])))
