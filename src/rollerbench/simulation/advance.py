"""What the simulations of wheels and of legs share: Drake's settings, the recorded scene, the way to the end."""

import math
from collections.abc import Callable

from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from rollerbench.errors import DescriptionError, SimulationError
from rollerbench.simulation.drake_config import simulator_config
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


def advance(
    simulator: Simulator, scenario: Scenario, check: Callable[[], str | None], progress: Progress | None
) -> str | None:
    """Simulates to the end, with a look at the robot now and then; returns what went wrong, or None."""
    step, duration = scenario.plant.time_step, scenario.duration
    # Times are multiples of the step, as Drake counts them, so that the last sample is part of the log.
    steps, chunk = math.floor(duration / step + 1e-6), max(1, round(CHUNK / step))
    context = simulator.get_context()
    try:
        for count in [*range(chunk, steps, chunk), steps]:
            now = count * step
            simulator.AdvanceTo(now)
            what = check()
            if what is not None:
                return f"at t = {now:.3f} s {what}"
            if progress is not None:
                progress(now)
    except KeyboardInterrupt:
        return f"interrupted at t = {context.get_time():.3f} s"
    except SimulationError as error:
        return str(error)
    except (RuntimeError, SystemExit) as error:
        return f"at t = {context.get_time():.3f} s Drake stopped: {error}"
    return None
