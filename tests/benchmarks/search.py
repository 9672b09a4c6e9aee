"""Looks for the fastest settings of an engine at each accuracy."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rollerbench as rb

from .engine import Engine, Setting
from .machine import Yardstick
from .motions import Motion

TARGET = 0.5
"""Error at which engines are compared [%]."""

HOPELESS = 10.0
"""Error from which a setting is not tried on the remaining motions [%]."""

GAIN = 1.03
"""By which factor a setting must be faster to become the base of further ones."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One setting, run once.

    Attributes:
        setting: The setting.
        errors: Error by motion [%], as far as it was tried.
        speed: Real-time factor over all motions, corrected by the machine's slowness; 0 if it failed.
        failure: Why it failed, or "".
    """

    setting: Setting
    errors: dict[str, float]
    speed: float
    failure: str = ""

    @property
    def worst(self) -> float:
        """Largest error [%]; infinite if it failed."""
        return float("inf") if self.failure else max(self.errors.values())


@dataclass(frozen=True, kw_only=True)
class Reference:
    """What an engine converges to.

    Attributes:
        setting: How it was computed.
        poses: Final poses (3,) by motion.
        remaining: Difference to the result of twice the step, by motion [%].
    """

    setting: Setting
    poses: dict[str, NDArray[np.float64]]
    remaining: dict[str, float]


def final_poses(
    engine: Engine, robot: rb.Robot, motions: Sequence[Motion], setting: Setting
) -> dict[str, NDArray[np.float64]]:
    """Final poses (3,) by motion."""
    runner = engine.prepare(robot, motions, setting)
    try:
        return {motion.name: runner.run(index).q_xyt for index, motion in enumerate(motions)}
    finally:
        runner.close()


def reference(engine: Engine, robot: rb.Robot, motions: Sequence[Motion], effort: str) -> Reference:
    """The engine's own result at a small step, compared with that at twice the step."""
    fine, coarse = engine.reference(effort)
    poses, other = (final_poses(engine, robot, motions, setting) for setting in (fine, coarse))
    remaining = {m.name: m.error_percent(other[m.name], poses[m.name]) for m in motions}
    return Reference(setting=fine, poses=poses, remaining=remaining)


class Search:
    """Tries settings of one engine: a ladder of steps, then one option after the other where it stands best.

    For each family it starts from the fastest setting of the ladder within the target (or else the most accurate one).
    Every option is tried on top of that, at its step and at the next larger and smaller ones of the ladder; an option
    that makes it faster stays. This is repeated until nothing helps, and what was found is then tried at all steps.
    """

    def __init__(
        self,
        engine: Engine,
        robot: rb.Robot,
        motions: Sequence[Motion],
        of: Reference,
        yardstick: Yardstick,
        progress: Callable[[str], None],
    ) -> None:
        self._engine, self._robot, self._motions, self._of = engine, robot, motions, of
        self._yardstick, self._progress = yardstick, progress
        self._trials: dict[str, Trial] = {}

    def run(self, effort: str) -> list[Trial]:
        """All trials."""
        ladder = self._engine.ladder(effort)
        for setting in ladder:
            self._try(setting)
        choices = self._engine.refinements(effort)
        for family in dict.fromkeys(setting.family for setting in ladder):
            if choices:
                self._refine(family, ladder, choices, passes=2 if effort == "full" else 1)
        return list(self._trials.values())

    def _refine(self, family: str, ladder: Sequence[Setting], choices: Sequence[Any], passes: int) -> None:
        steps = sorted({setting.time_step for setting in ladder if setting.family == family})
        best = _best([trial for trial in self._trials.values() if trial.setting.family == family])
        if best is None:
            return
        for _ in range(passes):
            before = best
            for choice in choices:
                for step in _around(steps, best.setting.time_step):
                    trial = self._try(best.setting.with_options(**choice).with_step(step))
                    if _better(trial, best):
                        best = trial
            if best is before:
                break
        for step in steps:
            self._try(best.setting.with_step(step))

    def _try(self, setting: Setting) -> Trial:
        key = f"{setting.family}: {sorted(map(str, setting.with_options().options.items()))} {setting.time_step}"
        if key not in self._trials:
            self._progress(f"{setting.family}, {setting.label}")
            self._trials[key] = self._run(setting)
        return self._trials[key]

    def _run(self, setting: Setting) -> Trial:
        errors: dict[str, float] = {}
        wall_time = simulated = 0.0
        try:
            runner = self._engine.prepare(self._robot, self._motions, setting)
        except Exception as error:  # Engines refuse settings in their own ways.
            return Trial(setting=setting, errors={}, speed=0.0, failure=_first_line(error))
        slowness = self._yardstick.slowness()
        try:
            for index, motion in enumerate(self._motions):
                run = runner.run(index)
                errors[motion.name] = motion.error_percent(run.q_xyt, self._of.poses[motion.name])
                wall_time, simulated = wall_time + run.wall_time, simulated + motion.duration
                if not errors[motion.name] < HOPELESS:
                    break
        except Exception as error:  # So do simulations that leave reality.
            return Trial(setting=setting, errors=errors, speed=0.0, failure=_first_line(error))
        finally:
            runner.close()
        slowness = 0.5 * (slowness + self._yardstick.slowness())
        return Trial(setting=setting, errors=errors, speed=simulated * slowness / wall_time)


def front(trials: Sequence[Trial], *, slack: float = 1.25, most: int = 8) -> list[Trial]:
    """The trials worth timing again: none is both more accurate and faster by more than `slack`.

    Single wall times are uncertain by the slack; of too many the fastest within the target stay, and some others.
    """
    good = [trial for trial in trials if trial.worst < HOPELESS]
    kept = [a for a in good if not any(b.worst <= a.worst and b.speed > slack * a.speed for b in good)]
    within = sorted((trial for trial in kept if trial.worst <= TARGET), key=lambda trial: -trial.speed)
    others = sorted((trial for trial in kept if trial not in within[: most // 2]), key=lambda trial: trial.worst)
    picked = np.unique(np.linspace(0, len(others) - 1, most - most // 2).astype(int)) if others else []
    return [*within[: most // 2], *(others[index] for index in picked)]


def _best(trials: Sequence[Trial]) -> Trial | None:
    best = None
    for trial in trials:
        if best is None or _better(trial, best, gain=1.0):
            best = trial
    return best


def _better(trial: Trial, than: Trial, gain: float = GAIN) -> bool:
    if trial.worst <= TARGET and than.worst <= TARGET:
        return trial.speed > gain * than.speed
    return trial.worst < than.worst


def _around(steps: Sequence[float], step: float) -> Iterator[float]:
    index = steps.index(step)
    yield from steps[max(0, index - 1) : index + 2]


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0][:200]
