"""Finds the shipped models and scenarios, in a checkout as well as in an installed wheel."""

import difflib
from pathlib import Path

from rollerbench.errors import ResourceError


def models_dir() -> Path:
    """Folder of the shipped models: the one with package.xml, inside the package or at the checkout's top.

    Raises:
        ResourceError: neither place holds the models, so the installation is broken.
    """
    package = Path(__file__).resolve().parent
    candidates = (package / "models", package.parent.parent / "models")
    for folder in candidates:
        if (folder / "package.xml").is_file():
            return folder
    places = " nor ".join(str(folder) for folder in candidates)
    raise ResourceError(f"the models of rollerbench are in neither {places}: install it again")


def robot_names() -> list[str]:
    """Names of the shipped robots, sorted."""
    return sorted(path.parent.name for path in models_dir().glob("*/robot.yaml"))


def robot_file(name_or_path: str | Path) -> Path:
    """Path to the robot.yaml of a shipped robot's name, or of a file or folder of the user's.

    Raises:
        ResourceError: there is no such robot.
    """
    return _find(name_or_path, "robot", {name: models_dir() / name / "robot.yaml" for name in robot_names()})


def scenario_files() -> dict[str, Path]:
    """Shipped scenarios by name, sorted by robot and name."""
    return {path.stem: path for path in sorted(models_dir().glob("*/scenarios/*.yaml"))}


def scenario_file(name_or_path: str | Path) -> Path:
    """Path to a shipped scenario's name, or to a file of the user's.

    Raises:
        ResourceError: there is no such scenario.
    """
    return _find(name_or_path, "scenario", scenario_files())


def _find(name_or_path: str | Path, kind: str, shipped: dict[str, Path]) -> Path:
    text = str(name_or_path)
    if text in shipped:
        return shipped[text]
    try:
        path = Path(name_or_path).expanduser()
        if path.is_dir() and (path / f"{kind}.yaml").is_file():
            return path / f"{kind}.yaml"
        if path.is_file():
            return path
    except (OSError, RuntimeError, ValueError) as error:
        raise ResourceError(f"no {kind} '{text}': not a path that can be read: {error}") from error
    close = difflib.get_close_matches(text, shipped, n=3)
    hint = f"did you mean {' or '.join(close)}? " if close else ""
    raise ResourceError(
        f"no {kind} '{text}': {hint}accepted: a path to a {kind}.yaml, or one of those listed by `rollerbench {kind}s`"
    )
