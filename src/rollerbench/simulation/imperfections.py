"""What differs from robot.yaml in the simulated robot; the controller keeps believing robot.yaml."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import Field

from rollerbench.description import Robot
from rollerbench.description.files import validate
from rollerbench.description.part import Number, Part, Positive, Vector3
from rollerbench.description.problems import Problem
from rollerbench.errors import DescriptionError


class Errors(Part):
    """Imperfections of the simulated robot; wheels by name, or "all" for every wheel not named.

    Attributes:
        radius_scale: True over described wheel radius [-]; rollers grow with their wheel.
        position_offset: True minus described position of wheels, x and y [m].
        heading_offset_deg: True minus described heading of wheels [deg].
        friction: True coefficient of friction of wheels [-].
        center_of_mass: True minus described centre of mass of the body [m].
    """

    radius_scale: dict[str, Positive] = Field(default_factory=dict)
    position_offset: dict[str, tuple[Number, Number]] = Field(default_factory=dict)
    heading_offset_deg: dict[str, Number] = Field(default_factory=dict)
    friction: dict[str, Positive] = Field(default_factory=dict)
    center_of_mass: Vector3 = (0.0, 0.0, 0.0)

    def problems(self, robot: Robot) -> Iterator[Problem]:
        """Names that are no wheels of the robot."""
        accepted = [*robot.wheel_names, "all"]
        for field in ("radius_scale", "position_offset", "heading_offset_deg", "friction"):
            for name in getattr(self, field):
                if name not in accepted:
                    message = f"not a wheel of {robot.name}; accepted: {', '.join(accepted)}"
                    yield Problem(("errors", field, name), message)

    def applied(self, robot: Robot) -> Robot:
        """The robot as it truly is.

        Raises:
            DescriptionError: such a robot cannot stand.
        """
        if self == Errors():
            return robot
        data = robot.model_dump(mode="json", exclude_none=True)
        body = data["body"]
        # The box stays where it is; only the mass in it is elsewhere.
        body["center"] = list(robot.body.box_center)
        body["center_of_mass"] = _added(body["center_of_mass"], self.center_of_mass)
        for wheel, described in zip(data["wheels"], robot.wheels, strict=True):
            self._apply_to(wheel, described.name)
            x, y, z = (float(value) for value in described.p_BoHo_B)
            dx, dy = _of(self.position_offset, described.name, (0.0, 0.0))
            wheel["position"] = [x + dx, y + dy, z]
            wheel.pop("distance", None)
            wheel.pop("azimuth_deg", None)
            wheel["heading_deg"] = described.heading_degrees + _of(self.heading_offset_deg, described.name, 0.0)
        try:
            return validate(Robot, data)
        except DescriptionError as error:
            raise DescriptionError(f"errors: the robot cannot be like that: {error}") from error

    def _apply_to(self, wheel: dict[str, Any], name: str) -> None:
        scale = _of(self.radius_scale, name, 1.0)
        wheel["radius"] *= scale
        if "rollers" in wheel:
            wheel["rollers"]["radius"] *= scale
        wheel["friction"] = _of(self.friction, name, wheel["friction"])


def _of(values: Mapping[str, Any], name: str, default: Any) -> Any:
    return values.get(name, values.get("all", default))


def _added(first: list[float], second: Vector3) -> list[float]:
    return [a + b for a, b in zip(first, second, strict=True)]
