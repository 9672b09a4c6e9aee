"""Times that compare although the machine's speed swings: runs in rounds, ratios within a round."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Spread:
    """A median and its quartiles."""

    median: float
    low: float
    high: float

    @staticmethod
    def of(values: list[float]) -> "Spread":
        """The quartiles of some values."""
        low, median, high = np.percentile(values, [25, 50, 75])
        return Spread(median=float(median), low=float(low), high=float(high))

    def text(self, digits: int = 3) -> str:
        """Median and quartiles."""
        return f"{self.median:.{digits}g} ({self.low:.{digits}g} to {self.high:.{digits}g})"


def timed_rounds(
    works: Mapping[str, Callable[[], float]], rounds: int, progress: Callable[[str], None]
) -> dict[str, list[float]]:
    """Values of all works in each round: A, B, C, A, B, C, ...

    Args:
        works: Functions that run something once and return its time, or a speed.
        rounds: Number of rounds; one more comes first, to warm up.
        progress: Called with the name of each.
    """
    values: dict[str, list[float]] = {name: [] for name in works}
    for count in range(rounds + 1):
        for name, work in works.items():
            progress(f"round {count} of {rounds}: {name}")
            value = work()
            if count:
                values[name].append(value)
    return values


def ratio(first: list[float], second: list[float]) -> Spread:
    """Ratio of two values within a round, over the rounds."""
    return Spread.of([a / b for a, b in zip(first, second, strict=True)])
