"""Drake's configuration structs from scenarios, checked before Drake sees them."""

from collections.abc import Mapping
from typing import Any, TypeVar

from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import DiagramBuilder

from rollerbench.description.problems import Problem
from rollerbench.errors import DescriptionError
from rollerbench.simulation.scenario import Scenario

Config = TypeVar("Config", MultibodyPlantConfig, SimulatorConfig)

NEAR_RIGID = 0.1
"""Drake's sap_near_rigid_threshold of the fast contact approximation: contacts stiffer than the step resolves [-]."""

OURS = {
    "discrete_contact_approximation": "use plant.contact_approximation",
    "start_time": "a run starts at 0",
}
"""Fields of Drake's that a scenario says otherwise."""


def plant_config(scenario: Scenario) -> MultibodyPlantConfig:
    """Settings of the plant: the scenario's, and for the rest those that rollers need.

    Raises:
        DescriptionError: an unknown field, or a value of the wrong kind.
    """
    settings = scenario.plant
    fast = settings.contact_approximation == "fast"
    config = MultibodyPlantConfig(
        time_step=settings.time_step,
        contact_model="point",
        discrete_contact_approximation="sap" if fast else settings.contact_approximation,
        use_sampled_output_ports=False,
    )
    if fast:
        config.sap_near_rigid_threshold = NEAR_RIGID
    return _apply("plant", config, settings.model_extra or {})


def add_plant(builder: DiagramBuilder, scenario: Scenario) -> tuple[MultibodyPlant, SceneGraph]:
    """Adds a scenario's plant, connected to a scene graph.

    Raises:
        DescriptionError: Drake refuses a setting.
    """
    config = plant_config(scenario)
    try:
        return AddMultibodyPlant(config, builder)
    except (RuntimeError, SystemExit) as error:
        raise DescriptionError(f"plant: Drake refuses these settings: {error}") from error


def simulator_config(scenario: Scenario) -> SimulatorConfig:
    """Settings of the simulator.

    Raises:
        DescriptionError: an unknown field, or a value of the wrong kind.
    """
    return _apply("simulator", SimulatorConfig(), scenario.simulator.model_extra or {})


def _apply(section: str, config: Config, extra: Mapping[str, Any]) -> Config:
    names = [field.name for field in type(config).__fields__]
    for name, value in extra.items():
        accepted = f"accepted: {', '.join(sorted(set(names) - OURS.keys()))}"
        if name in OURS:
            raise DescriptionError(str(Problem((section, name), OURS[name], value)))
        if name not in names:
            raise DescriptionError(str(Problem((section, name), f"not a field of Drake's; {accepted}", value)))
        kind = type(getattr(config, name)).__name__
        if isinstance(value, bool) and kind != "bool":
            raise DescriptionError(str(Problem((section, name), f"accepted: {kind}", value)))
        try:
            setattr(config, name, value)
        except TypeError as error:
            raise DescriptionError(str(Problem((section, name), f"accepted: {kind}", value))) from error
    return config
