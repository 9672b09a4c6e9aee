"""A robot: its body and wheels, validated as a whole."""

import itertools
from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from scipy.spatial.transform import Rotation

from rollerbench.description.body import Body
from rollerbench.description.inertia import RigidInertia, combined
from rollerbench.description.layout import support_margin, wheels_overlap
from rollerbench.description.mass import (
    body_inertia,
    fork_inertia,
    hub_inertia,
    roller_inertia,
    roller_poses_H,
)
from rollerbench.description.part import Name, Part
from rollerbench.description.problems import Problem, refuse
from rollerbench.description.wheels import AnyWheel, RollerWheel, Wheel

LIFT_TOLERANCE = 0.05
"""A wheel may hang above the ground that the lowest one touches by this share of its radius."""


class Robot(Part):
    """One description from which equations, models and simulations follow.

    Attributes:
        name: Name of the robot.
        summary: One line for lists.
        source: Where the numbers come from.
        body: The chassis.
        wheels: The wheels, in the order in which vectors over wheels carry them.
        legs: Wheel-legs; none can be described yet.
    """

    name: Name
    summary: str = ""
    source: str = ""
    body: Body
    wheels: Annotated[tuple[AnyWheel, ...], Field(min_length=1)]
    legs: Annotated[tuple[()], Field()] = ()

    @property
    def wheel_names(self) -> tuple[str, ...]:
        """Names of all wheels."""
        return tuple(wheel.name for wheel in self.wheels)

    @property
    def driven_wheels(self) -> tuple[AnyWheel, ...]:
        """The wheels with a drive motor: what vectors of wheel_speeds refer to."""
        return tuple(wheel for wheel in self.wheels if wheel.driven)

    @property
    def steered_wheels(self) -> tuple[AnyWheel, ...]:
        """The wheels with a steering motor: what vectors of steering angles refer to."""
        return tuple(wheel for wheel in self.wheels if wheel.steered)

    @property
    def reach(self) -> float:
        """Radius of a vertical cylinder about Bo that holds all wheels [m], whichever way they swivel."""
        return max(float(np.hypot(*wheel.p_BoHo_B[:2])) + wheel.swivel_offset + wheel.radius for wheel in self.wheels)

    @property
    def ground_height(self) -> float:
        """Height of level ground from Bo [m], negative: where the lowest wheel touches it."""
        return float(min(wheel.center_B[2] - wheel.radius for wheel in self.wheels))

    @property
    def contact_points_B(self) -> NDArray[np.float64]:
        """Points (n, 3) where the wheels meet level ground, in B, at swivel angle 0 [m]."""
        return np.array([[*wheel.center_B[:2], wheel.center_B[2] - wheel.radius] for wheel in self.wheels])

    @cached_property
    def inertia(self) -> RigidInertia:
        """Mass distribution of the whole robot in B, at wheel and swivel angles 0."""
        parts = [body_inertia(self.body)]
        for wheel in self.wheels:
            rotation = Rotation.from_euler("z", wheel.heading).as_matrix()
            parts.append(hub_inertia(wheel).moved(rotation, wheel.center_B))
            if wheel.swivels:
                parts.append(fork_inertia(wheel).moved(rotation, wheel.p_BoHo_B))
            if isinstance(wheel, RollerWheel):
                parts += [
                    roller_inertia(wheel).moved(rotation @ roller_rotation, wheel.center_B + rotation @ center)
                    for roller_rotation, center in roller_poses_H(wheel)
                ]
        return combined(parts)

    @property
    def mass(self) -> float:
        """Mass of the whole robot [kg]."""
        return self.body.mass + sum(wheel.mass for wheel in self.wheels)

    @model_validator(mode="after")
    def _wheels_carry_the_body(self) -> Self:
        refuse([*_name_problems(self), *_room_problems(self), *_support_problems(self)])
        return self


def _place(wheel: Wheel) -> tuple[float, ...]:
    return tuple(round(float(value), 9) for value in wheel.p_BoHo_B)


def _name_problems(robot: Robot) -> Iterator[Problem]:
    if robot.name == "world":
        yield Problem(("name",), "simulators reserve this name; accepted: any other", robot.name)
    for index, name in enumerate(robot.wheel_names):
        if name in robot.wheel_names[:index]:
            message = f"another wheel has this name: accepted: a name not among {', '.join(robot.wheel_names[:index])}"
            yield Problem(("wheels", index, "name"), message, name)


def _room_problems(robot: Robot) -> Iterator[Problem]:
    for (i, first), (j, second) in itertools.combinations(enumerate(robot.wheels), 2):
        if wheels_overlap(first, second):
            swivels = " (a castor or steered wheel needs room to swivel)" if first.swivels or second.swivels else ""
            message = f"wheel {second.name} overlaps wheel {first.name} (wheels[{i}] at {_place(first)}){swivels}"
            yield Problem(("wheels", j, "position"), message, _place(second))


def _support_problems(robot: Robot) -> Iterator[Problem]:
    ground = robot.ground_height
    for index, (wheel, contact) in enumerate(zip(robot.wheels, robot.contact_points_B, strict=True)):
        lift = contact[2] - ground
        if lift > LIFT_TOLERANCE * wheel.radius:
            message = (
                f"wheel {wheel.name} hangs {lift:.4g} m above the ground; accepted: a height within "
                f"{LIFT_TOLERANCE * wheel.radius:.3g} m above {ground + wheel.radius:.4g}"
            )
            yield Problem(("wheels", index, "position"), message, _place(wheel))
    bottom = robot.body.box_center[2] - 0.5 * robot.body.size[2]
    if bottom <= ground:
        message = (
            f"the body reaches {ground - bottom:.4g} m into the ground; accepted: a bottom above z = {ground:.4g} m"
        )
        yield Problem(("body", "size"), message, robot.body.size)
    com = robot.inertia.com[:2]
    margin = support_margin(robot.contact_points_B[:, :2], com)
    if margin == -np.inf:
        message = "these wheels cannot support a base: accepted: three or more wheels that are not on one line"
        yield Problem(("wheels",), message, robot.wheel_names)
    elif margin <= 0:
        message = (
            f"the robot tips over: its centre of mass, wheels included, at ({com[0]:.4g}, {com[1]:.4g}) lies "
            f"{-margin:.4g} m outside the support polygon of the wheels"
        )
        yield Problem(("body", "center_of_mass"), message, robot.body.center_of_mass)
