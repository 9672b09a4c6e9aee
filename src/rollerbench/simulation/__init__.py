"""Scenarios, the diagram that simulates them, and runs."""

from rollerbench.simulation.live import Live
from rollerbench.simulation.runner import RunResult, run
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.station import Station, build_station

__all__ = ["Live", "RunResult", "Scenario", "Station", "build_station", "load_scenario", "run"]
