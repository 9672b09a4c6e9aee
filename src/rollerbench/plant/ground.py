"""The ground under the robot."""

import logging
import math
from collections.abc import Sequence

from pydrake.geometry import AddContactMaterial, Box, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import RigidBody, SpatialInertia

from rollerbench import palette
from rollerbench.errors import SimulationError
from rollerbench.kinematics.bumps import STEP_WIDTH, Bumps

RIGID = 1e12
"""Stiffness of ground that does not give [N/m]: the wheels' own stiffness then decides."""


BUMPS = "ground_bumps"
"""Name of the body that carries the ground's bumps."""


STEPS = "ground_steps"
"""Name of the body that carries the ground's steps."""


def add_ground(
    plant: MultibodyPlant,
    *,
    friction: float = 0.8,
    slope_deg: float = 0.0,
    bumps: Bumps | None = None,
    steps: Sequence[tuple[float, float, float]] = (),
) -> RigidBody | None:
    """Registers level, rigid ground at z = 0 of the world with a plant that is not finalized.

    A slope tilts gravity instead of the ground: x points uphill.

    Args:
        plant: The plant, connected to a scene graph.
        friction: Coefficient of friction of the ground; with a wheel's it combines to 2ab/(a+b).
        slope_deg: Inclination along x [deg].
        bumps: What rises above the plane.
        steps: Start and end along x, and height [m], of steps across the way.

    Returns:
        The body that carries the bumps, if there are any.
    """
    if not plant.geometry_source_is_registered():
        raise SimulationError("add_ground: the plant has no scene graph; accepted: AddMultibodyPlantSceneGraph")
    properties = ProximityProperties()
    AddContactMaterial(point_stiffness=RIGID, friction=CoulombFriction(friction, friction), properties=properties)
    # Of Drake's SAP only, which otherwise lets contacts creep.
    properties.AddProperty("material", "relaxation_time", 0.0)
    logging.getLogger("drake").addFilter(_not_about_deformables)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", properties)
    if slope_deg:
        slope = math.radians(slope_deg)
        strength = plant.gravity_field().gravity_vector()[2]
        plant.mutable_gravity_field().set_gravity_vector([strength * math.sin(slope), 0.0, strength * math.cos(slope)])
    if steps:
        body = plant.AddRigidBody(STEPS, plant.AddModelInstance(STEPS), SpatialInertia.Zero())
        plant.WeldFrames(plant.world_frame(), body.body_frame())
        for index, (start, end, height) in enumerate(steps):
            # Reaching below the plane, so that no edge lies in it.
            box, place = Box(end - start, STEP_WIDTH, 2 * height), RigidTransform([0.5 * (start + end), 0.0, 0.0])
            plant.RegisterCollisionGeometry(body, place, box, f"step_{index}", properties)
            plant.RegisterVisualGeometry(body, place, box, f"step_{index}", [*palette.STEP, 1.0])
    return _add_bumps(plant, bumps, properties) if bumps is not None and len(bumps.radii) else None


def _add_bumps(plant: MultibodyPlant, bumps: Bumps, properties: ProximityProperties) -> RigidBody:
    # A body of their own, welded to the world: as geometry of the world they would share a search tree with the half
    # space, and Drake (FCL) crashes when it balances one that holds an infinite box.
    body = plant.AddRigidBody(BUMPS, plant.AddModelInstance(BUMPS), SpatialInertia.Zero())
    plant.WeldFrames(plant.world_frame(), body.body_frame())
    for index, (center, radius) in enumerate(zip(bumps.centers_W, bumps.radii, strict=True)):
        plant.RegisterCollisionGeometry(body, RigidTransform(center), Sphere(radius), f"bump_{index}", properties)
    return body


def _not_about_deformables(record: logging.LogRecord) -> bool:
    """False for the warning of Drake 1.51, when it makes a context, that half spaces do not touch deformable bodies."""
    return "half spaces are not currently supported for deformable contact" not in record.getMessage()
