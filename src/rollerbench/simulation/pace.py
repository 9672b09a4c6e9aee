"""Simulated time beside a clock."""

from collections.abc import Callable

LATEST = 0.1
"""A simulation that is slower than the clock does not make up for more than this [s]."""


class Pace:
    """Keeps simulated time to a clock, without running after it for long."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """Starts at the clock's present time [s]."""
        self._clock, self._due = clock, clock()

    def add(self, simulated: float, speed: float) -> None:
        """Counts simulated time [s] that shall take 1 / speed times as long."""
        self._due = max(self._due + simulated / speed, self._clock() - LATEST)

    def ahead(self) -> float:
        """How long to wait [s]."""
        return self._due - self._clock()

    def restart(self) -> None:
        """Forgets what is due."""
        self._due = self._clock()
