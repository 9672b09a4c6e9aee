"""Short runs, simulated once for all tests of reports."""

from pathlib import Path

import pytest

import rollerbench as rb


def _saved(folder: Path, name: str, **overrides: object) -> Path:
    scenario = rb.load_scenario(name, overrides={"duration": 0.5, **overrides})
    result = rb.run(scenario, output=folder)
    assert result.folder is not None
    return result.folder


@pytest.fixture(scope="session")
def youbot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four Mecanum wheels, with a recording."""
    return _saved(tmp_path_factory.mktemp("runs") / "straight", "youbot_plus_y", **{"command.ramp": 0.1})


@pytest.fixture(scope="session")
def large_wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same scenario with a wheel that is too large, and no recording."""
    errors = {"errors.radius_scale.front_left": 1.03, "command.ramp": 0.1, "recording.html": False}
    return _saved(tmp_path_factory.mktemp("runs") / "large", "youbot_plus_y", **errors)


@pytest.fixture(scope="session")
def hexapod(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six legs that stand."""
    return _saved(
        tmp_path_factory.mktemp("runs") / "legs",
        "hexapod_stand",
        **{"recording.html": False, "command.pieces": [{"duration": 0.3}]},
    )
