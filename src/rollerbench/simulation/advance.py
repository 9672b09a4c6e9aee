"""What the simulations of wheels and of legs share: Drake's settings, the way to the end and back to the start."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pydrake.systems.analysis import ApplySimulatorConfig, Simulator
from pydrake.systems.primitives import VectorLogSink

from rollerbench.errors import DescriptionError, SimulationError
from rollerbench.simulation.drake_config import simulator_config
from rollerbench.simulation.live import LiveShow
from rollerbench.simulation.log import Progress
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.watch import CHUNK


def configure(simulator: Simulator, scenario: Scenario) -> None:
    """Applies a scenario's settings of the simulator.

    Raises:
        DescriptionError: Drake refuses them.
    """
    try:
        ApplySimulatorConfig(simulator_config(scenario), simulator)
    except (RuntimeError, ValueError, SystemExit) as error:
        raise DescriptionError(f"simulator: Drake refuses these settings: {error}") from error


class Restart:
    """Brings a simulation back to where it is when this is made, which is before the simulator is initialized."""

    def __init__(self, simulator: Simulator, logs: Iterable[VectorLogSink]) -> None:
        """Remembers the present of a simulator, and the logs to clear."""
        self._simulator, self._logs = simulator, list(logs)
        self._start = simulator.get_context().Clone()

    def __call__(self) -> None:
        """Goes back; whatever happens from here on is bitwise what happened the first time."""
        context = self._simulator.get_mutable_context()
        context.SetTimeStateAndParametersFrom(self._start)
        for sink in self._logs:
            sink.FindMutableLog(context).Clear()
        self._simulator.Initialize()


@dataclass(frozen=True, slots=True, kw_only=True)
class Advanced:
    """How far a simulation came.

    Attributes:
        failure: Why it did not reach the end, or None.
        wall_time: Time that it took, without that of showing it, of telling its progress, and of waiting for
            the clock or a user [s].
    """

    failure: str | None
    wall_time: float


def advance(
    simulator: Simulator,
    scenario: Scenario,
    check: Callable[[], str | None],
    progress: Progress | None,
    show: LiveShow | None = None,
) -> Advanced:
    """Simulates to the end, with a look at the robot now and then.

    Args:
        simulator: The simulator, initialized.
        scenario: What it simulates.
        check: What makes going on useless, in words, or None.
        progress: Called with the simulated time [s] now and then.
        show: Shows it meanwhile; it may hold the simulation up, and bring it back to the start.
    """
    step, context = scenario.plant.time_step, simulator.get_context()
    # Times are multiples of the step, as Drake counts them, so that the last sample is part of the log.
    steps, done, wall_time = math.floor(scenario.duration / step + 1e-6), 0, 0.0
    failure: str | None = None
    try:
        if show is not None:
            show.begin()
        while failure is None:
            done = min(steps, done + (max(1, round(CHUNK / step)) if show is None else show.piece()))
            started = time.perf_counter()
            simulator.AdvanceTo(done * step)
            what = check()
            wall_time += time.perf_counter() - started
            if what is not None:
                failure = f"at t = {done * step:.3f} s {what}"
            elif progress is not None:
                progress(done * step)
            over = done == steps or failure is not None
            if show is not None and show.frame(over=over):
                done, wall_time, failure = 0, 0.0, None
            elif over:
                break
    except KeyboardInterrupt:
        failure = f"interrupted at t = {context.get_time():.3f} s"
    except SimulationError as error:
        failure = str(error)
    except (RuntimeError, SystemExit) as error:
        failure = f"at t = {context.get_time():.3f} s Drake stopped: {error}"
    if show is not None:
        show.close()
    return Advanced(failure=failure, wall_time=wall_time)
