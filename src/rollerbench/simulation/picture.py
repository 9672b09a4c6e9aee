"""A picture of the diagram that a scenario simulates."""

import importlib.util
import re

from rollerbench.errors import ResourceError
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.station import build_station


def check() -> None:
    """Checks that diagrams can be drawn.

    Raises:
        ResourceError: pygraphviz is not installed.
    """
    if importlib.util.find_spec("pygraphviz") is None:
        raise ResourceError(
            "recording.diagram: pygraphviz, which draws diagrams, is missing: pip install 'rollerbench[diagram]'"
        )


def diagram_svg(scenario: Scenario) -> str:
    """The station of a scenario as SVG: its systems by class and name, with their ports and wires."""
    import pygraphviz

    station = build_station(scenario)
    station.set_name(scenario.name)
    graph = pygraphviz.AGraph(string=station.GetGraphvizString(max_depth=1))
    svg: bytes = graph.draw(format="svg", prog="dot")
    # Without a size of its own the picture takes that of the window.
    return re.sub(r'(<svg) width="[^"]*" height="[^"]*"', r"\1", svg.decode("utf-8"), count=1)
