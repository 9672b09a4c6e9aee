"""A robot: its body and wheels, validated as a whole."""

import itertools
from collections.abc import Iterator
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from scipy.spatial.transform import Rotation

from rollerbench.description.body import Body
from rollerbench.description.inertia import RigidInertia, combined
from rollerbench.description.layout import support_margin, wheels_overlap
from rollerbench.description.legs import Leg, Posture
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
        legs: Wheel-legs, instead of wheels.
        postures: How a robot with legs can stand, the one in which it starts first. By default those of the first leg.
    """

    name: Name
    summary: str = ""
    source: str = ""
    body: Body
    wheels: tuple[AnyWheel, ...] = ()
    legs: tuple[Leg, ...] = ()
    postures: tuple[Posture, ...] = ()

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
    def standing(self) -> tuple[Posture, ...]:
        """The postures, given or by default."""
        if self.postures or not self.legs:
            return self.postures
        return tuple(Posture(name=name) for name in self.legs[0].postures)

    def feet_B(self, posture: str | None = None) -> NDArray[np.float64]:
        """Centres (n_legs, 3) of the feet's wheels from Bo, in B [m], in a posture, by default the first."""
        name = posture or self.standing[0].name
        return np.array([leg.frames_B(leg.posture(name))[-1, :3, 3] for leg in self.legs]).reshape(-1, 3)

    @property
    def reach(self) -> float:
        """Radius of a vertical cylinder about Bo that holds all wheels [m], whichever way they swivel.

        Of a robot with legs, one that holds the feet in all postures.
        """
        if self.legs:
            feet = np.concatenate([self.feet_B(posture.name) for posture in self.standing])
            return float(np.hypot(*feet[:, :2].T).max()) + max(leg.wheel.radius for leg in self.legs)
        return max(float(np.hypot(*wheel.p_BoHo_B[:2])) + wheel.swivel_offset + wheel.radius for wheel in self.wheels)

    @property
    def ground_height(self) -> float:
        """Height of level ground from Bo [m], negative: where the lowest wheel touches it."""
        return float(self.contact_points_B[:, 2].min())

    @property
    def contact_points_B(self) -> NDArray[np.float64]:
        """Points (n, 3) where the wheels meet level ground, in B, at swivel angle 0 and in the first posture [m]."""
        if self.legs:
            return self.feet_B() - np.array([[0.0, 0.0, leg.wheel.radius] for leg in self.legs])
        return np.array([[*wheel.center_B[:2], wheel.center_B[2] - wheel.radius] for wheel in self.wheels])

    @cached_property
    def inertia(self) -> RigidInertia:
        """Mass distribution of the whole robot in B, at wheel and swivel angles 0 and in the first posture."""
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
        for leg in self.legs:
            frames = leg.frames_B(leg.posture(self.standing[0].name))
            pieces = [*(link.inertia for link in leg.links), leg.wheel.inertia]
            parts += [piece.moved(frame[:3, :3], frame[:3, 3]) for piece, frame in zip(pieces, frames, strict=True)]
        return combined(parts)

    @property
    def mass(self) -> float:
        """Mass of the whole robot [kg]."""
        return self.body.mass + sum(part.mass for part in (*self.wheels, *self.legs))

    @model_validator(mode="after")
    def _wheels_carry_the_body(self) -> Self:
        refuse(list(_kind_problems(self)))
        refuse(list(_leg_problems(self)))
        refuse(list(_posture_problems(self)))
        refuse([*_name_problems(self), *_room_problems(self), *_support_problems(self)])
        return self


def _place(wheel: Wheel) -> tuple[float, ...]:
    return tuple(round(float(value), 9) for value in wheel.p_BoHo_B)


def _kind_problems(robot: Robot) -> Iterator[Problem]:
    if not robot.wheels and not robot.legs:
        yield Problem(("wheels",), "this field is required (or legs instead of it)")
    if robot.wheels and robot.legs:
        message = "legs and wheels on one body; accepted: wheels, or legs with wheels at their feet"
        yield Problem(("legs",), message, tuple(leg.name for leg in robot.legs))


def _leg_problems(robot: Robot) -> Iterator[Problem]:
    names = [leg.name for leg in robot.legs]
    for index, leg in enumerate(robot.legs):
        if leg.name in names[:index]:
            message = f"another leg has this name: accepted: a name not among {', '.join(names[:index])}"
            yield Problem(("legs", index, "name"), message, leg.name)
        if not leg.postures:
            yield Problem(("legs", index, "postures"), "accepted: at least one posture", {})
        for posture in robot.standing:
            if posture.name not in leg.postures:
                message = f"no angles for the posture {posture.name}; accepted: angles for every posture"
                yield Problem(("legs", index, "postures"), message, tuple(leg.postures))
            if posture.hold != "least" and len(leg.links) != 4:
                message = f"leg {leg.name} has {len(leg.links)} joints; accepted: least"
                yield Problem(("postures", robot.standing.index(posture), "hold"), message, posture.hold)


def _posture_problems(robot: Robot) -> Iterator[Problem]:
    """Postures after the first in which feet hang in the air, or the body lies on the ground."""
    for posture in robot.standing[1:]:
        feet = robot.feet_B(posture.name)[:, 2] - [leg.wheel.radius for leg in robot.legs]
        ground = float(feet.min())
        for index, (leg, foot) in enumerate(zip(robot.legs, feet, strict=True)):
            if foot - ground > LIFT_TOLERANCE * leg.wheel.radius:
                message = f"the foot hangs {foot - ground:.4g} m above the ground; accepted: all feet on one level"
                yield Problem(("legs", index, "postures", posture.name), message, leg.postures[posture.name])
        if robot.body.box_center[2] - 0.5 * robot.body.size[2] <= ground:
            message = "the body reaches into the ground; accepted: feet below the body"
            yield Problem(("legs", 0, "postures", posture.name), message, robot.legs[0].postures[posture.name])


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
    ground, field, contacts = robot.ground_height, "legs" if robot.legs else "wheels", robot.contact_points_B
    parts = [(leg.name, leg.wheel.radius, leg.postures[robot.standing[0].name]) for leg in robot.legs]
    parts += [(wheel.name, wheel.radius, _place(wheel)) for wheel in robot.wheels]
    for index, ((name, radius, place), contact) in enumerate(zip(parts, contacts, strict=True)):
        lift = contact[2] - ground
        if lift > LIFT_TOLERANCE * radius:
            message = (
                f"{'the foot of leg' if robot.legs else 'wheel'} {name} hangs {lift:.4g} m above the ground; "
                f"accepted: a height within {LIFT_TOLERANCE * radius:.3g} m above {ground + radius:.4g}"
            )
            yield Problem((field, index, "postures" if robot.legs else "position"), message, place)
    bottom = robot.body.box_center[2] - 0.5 * robot.body.size[2]
    if bottom <= ground:
        message = (
            f"the body reaches {ground - bottom:.4g} m into the ground; accepted: a bottom above z = {ground:.4g} m"
        )
        yield Problem(("body", "size"), message, robot.body.size)
    com = robot.inertia.com[:2]
    margin = support_margin(robot.contact_points_B[:, :2], com)
    if margin == -np.inf:
        message = f"these {field} cannot support a base: accepted: three or more {field} that are not on one line"
        yield Problem((field,), message, tuple(name for name, *_ in parts))
    elif margin <= 0:
        message = (
            f"the robot tips over: its centre of mass, wheels included, at ({com[0]:.4g}, {com[1]:.4g}) lies "
            f"{-margin:.4g} m outside the support polygon of the {field}"
        )
        yield Problem(("body", "center_of_mass"), message, robot.body.center_of_mass)
