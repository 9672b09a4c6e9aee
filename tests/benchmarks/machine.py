"""One core, one thread, and a measure of how fast the machine is at the moment."""

import os
import platform
import time
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def use_one_core(core: int | None = None) -> None:
    """Keeps this process, and those it starts, on one core; only before numpy is imported does it bind BLAS.

    Args:
        core: The core; by default the last of those allowed. Systems that cannot pin a process leave it free.
    """
    for name in THREADS:
        os.environ[name] = "1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0)) if core is None else core})


def describe() -> dict[str, str]:
    """The machine, for readers of a result."""
    return {"processor": _processor(), "system": f"{platform.system()} {platform.machine()}", "cores used": "1"}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


class Yardstick:
    """A fixed piece of work whose time tells how fast the machine is now.

    Machines that share their processor swing in speed. Where many settings are tried once each, wall times divided
    by `slowness` compare better; where it matters, runs are interleaved instead (`rounds.py`).
    """

    def __init__(self) -> None:
        import numpy as np

        self._matrix = np.eye(60) + 0.01 * np.arange(3600.0).reshape(60, 60) % 0.1
        self._solve = np.linalg.solve
        self._usual = min(self._time() for _ in range(20))

    def slowness(self) -> float:
        """Time that the work takes now over what it took at best when this was made [-]."""
        return sorted(self._time() for _ in range(3))[1] / self._usual

    def _time(self) -> float:
        started = time.perf_counter()
        for _ in range(20):
            self._solve(self._matrix, self._matrix)
        return time.perf_counter() - started
