"""The engines that are installed."""

import importlib.util

from .engine import Engine

FAMILIES = ("rollerbench windowed", "rollerbench full", "MuJoCo elliptic", "MuJoCo pyramidal", "PyBullet")

MISSING = {
    "mujoco": "MuJoCo is not installed (pip install mujoco): the comparison goes on without it",
    "pybullet": "PyBullet is not installed (pip install pybullet, Python 3.11): the comparison goes on without it",
}


def available() -> tuple[list[Engine], list[str]]:
    """The engines, and a message for each that is missing."""
    engines, missing = [engine_of("rollerbench")], []
    for module, message in MISSING.items():
        if importlib.util.find_spec(module) is None:
            missing.append(message)
        else:
            engines.append(engine_of(module))
    return engines, missing


def engine_of(family: str) -> Engine:
    """The engine of a family of settings; only this one is imported."""
    name = family.lower()
    if name.startswith("mujoco"):
        from .mujoco_engine import MujocoEngine

        return MujocoEngine()
    if name.startswith("pybullet"):
        from .bullet_engine import BulletEngine

        return BulletEngine()
    from .rollerbench_engine import RollerbenchEngine

    return RollerbenchEngine()
