"""Drake's contacts beside the motion that they belong to."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

import rollerbench as rb


def steps_with_contacts(scenario: rb.Scenario, steps: Iterable[int]) -> Iterator[tuple[Any, Any, Any]]:
    """The plant, the motion of one step and Drake's ContactResults in it, for steps of 5 ms of a scenario."""
    from pydrake.systems.analysis import Simulator

    from rollerbench.simulation.log import robot_motion

    station = rb.build_station(scenario)
    simulator = Simulator(station)
    rb.follow_rollers(simulator)
    context, model = simulator.get_mutable_context(), station.parts.model
    model.set_pose(model.plant.GetMyMutableContextFromRoot(context), [0, 0, 0])
    nq = model.plant.num_positions()
    for step in steps:
        # Between two updates of the plant: times at an update leave open on which side of it they lie.
        simulator.AdvanceTo((step + 0.5) * 0.005)
        before = station.GetOutputPort("state").Eval(context)
        results = station.GetOutputPort("contact_results").Eval(context)
        simulator.AdvanceTo((step + 1.5) * 0.005)
        after = station.GetOutputPort("state").Eval(context)
        state = np.hstack([before[:nq], after[nq:]])[np.newaxis]
        remembered = station.GetOutputPort("rollers").Eval(context)[np.newaxis] if model.roller_window else None
        yield model.plant, robot_motion(model, state, np.array([context.get_time()]), remembered), results
