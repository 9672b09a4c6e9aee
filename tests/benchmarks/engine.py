"""What the benchmark asks of an engine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import rollerbench as rb

from .motions import Motion


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One way to set an engine.

    Attributes:
        family: What it is compared as: "rollerbench windowed", "MuJoCo elliptic", ...
        time_step: Step [s].
        options: Further settings, by their names in the engine.
    """

    family: str
    time_step: float
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The setting in a few words."""
        options = ", ".join(f"{name} {_short(value)}" for name, value in self.options.items())
        return f"{1e3 * self.time_step:g} ms" + (f", {options}" if options else "")

    def with_options(self, **options: Any) -> "Setting":
        """The same with some options replaced; the value None removes one."""
        merged = {name: value for name, value in {**self.options, **options}.items() if value is not None}
        return Setting(family=self.family, time_step=self.time_step, options=merged)

    def with_step(self, time_step: float) -> "Setting":
        """The same with another step [s]."""
        return Setting(family=self.family, time_step=time_step, options=self.options)


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A simulation of one motion.

    Attributes:
        q_xyt: Final pose (3,) [m, m, rad].
        wall_time: Time of the steps alone, without building, settling and reading the pose [s].
    """

    q_xyt: NDArray[np.float64]
    wall_time: float


class Runner(Protocol):
    """An engine ready to run some motions, again and again, from rest."""

    def run(self, index: int) -> Run:
        """Simulates the motion of this index."""

    def close(self) -> None:
        """Gives back what it holds."""


class Engine(Protocol):
    """A simulator.

    Attributes:
        name: Its name.
        version: Its version.
        notes: What a reader must know of how it is used here.
    """

    name: str
    version: str
    notes: str

    def reference(self, effort: str) -> tuple[Setting, Setting]:
        """A setting that counts as exact, and the same with twice the step."""

    def ladder(self, effort: str) -> list[Setting]:
        """Settings to try, from which the search starts."""

    def refinements(self, effort: str) -> Sequence[Mapping[str, Any]]:
        """Options to try one after the other on top of the ladder's, see `search.py`."""

    def prepare(self, robot: rb.Robot, motions: Sequence[Motion], setting: Setting) -> Runner:
        """Builds the robot and lets it settle.

        Raises:
            Exception: the engine refuses the setting.
        """
