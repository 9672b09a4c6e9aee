"""The ten motions of Huai and Jin (2022) on the youBot; test_reproduce.py has those of the paper's size."""

import numpy as np
import pytest

import rollerbench as rb
from budgets import assert_parts_add_up
from motions import assert_translation, assert_turn
from rollerbench.resources import scenario_files

NAMES = [name for name in scenario_files() if name.startswith("youbot_") and "closed" not in name]
TRANSLATIONS = [name for name in NAMES if "turn" not in name]
TURNS = [name for name in NAMES if "turn" in name]


def test_there_are_ten() -> None:
    assert len(TRANSLATIONS) == 8
    assert len(TURNS) == 2


@pytest.mark.parametrize("name", TRANSLATIONS)
def test_translation(name: str) -> None:
    result = rb.run(name, save=False)
    assert_parts_add_up(result.recording)
    assert_translation(result)


@pytest.mark.parametrize("name", TURNS)
def test_turns_stay_on_the_spot_and_fall_short(name: str) -> None:
    result = rb.run(name, save=False)
    assert_parts_add_up(result.recording)
    assert_turn(result)


def test_a_heavy_robot_follows_as_well_as_a_light_one() -> None:
    """The servo's gain follows from mass and wheel radius: wheels lag the same way on 20 kg and on 200 kg."""
    lags = []
    for name in ("youbot_plus_x", "mecanum_plus_x"):
        recording = rb.run(name, save=False).recording
        command, speed = recording.wheels("command"), recording.wheels("speed")
        lags.append(np.abs(speed[1:] - command[:-1]).max() / command.max())
    assert max(lags) < 0.005
    assert lags[0] == pytest.approx(lags[1], rel=0.5)
