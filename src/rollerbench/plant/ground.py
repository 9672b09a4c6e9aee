"""The ground under the robot."""

import logging
import math

from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant

from rollerbench.errors import SimulationError

RIGID = 1e12
"""Stiffness of ground that does not give [N/m]: the wheels' own stiffness then decides."""


def add_ground(plant: MultibodyPlant, *, friction: float = 0.8, slope_deg: float = 0.0) -> None:
    """Registers level, rigid ground at z = 0 of the world with a plant that is not finalized.

    A slope tilts gravity instead of the ground: x points uphill.

    Args:
        plant: The plant, connected to a scene graph.
        friction: Coefficient of friction of the ground; with a wheel's it combines to 2ab/(a+b).
        slope_deg: Inclination along x [deg].
    """
    if not plant.geometry_source_is_registered():
        raise SimulationError("add_ground: the plant has no scene graph; accepted: AddMultibodyPlantSceneGraph")
    properties = ProximityProperties()
    AddContactMaterial(point_stiffness=RIGID, friction=CoulombFriction(friction, friction), properties=properties)
    logging.getLogger("drake").addFilter(_not_about_deformables)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", properties)
    if slope_deg:
        slope = math.radians(slope_deg)
        strength = plant.gravity_field().gravity_vector()[2]
        plant.mutable_gravity_field().set_gravity_vector([strength * math.sin(slope), 0.0, strength * math.cos(slope)])


def _not_about_deformables(record: logging.LogRecord) -> bool:
    """False for the warning of Drake 1.51, when it makes a context, that half spaces do not touch deformable bodies."""
    return "half spaces are not currently supported for deformable contact" not in record.getMessage()
