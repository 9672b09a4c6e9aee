"""What differs from robot.yaml in the simulated robot; the controller keeps believing robot.yaml."""

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from rollerbench.description import Robot
from rollerbench.description.files import validate
from rollerbench.description.part import NonNegative, Number, Part, Positive, PositiveInt, Vector3
from rollerbench.description.problems import Problem
from rollerbench.errors import DescriptionError, RollerbenchWarning
from rollerbench.kinematics.bumps import Bumps, scattered_caps
from rollerbench.kinematics.drivetrain import WheelDrive

OF_THE_ROBOT = ("radius_scale", "position_offset", "heading_offset_deg", "friction", "center_of_mass")
"""Fields of `Errors` that change the robot's description."""

OF_THE_KINEMATICS = ("radius_scale", "position_offset", "heading_offset_deg")
"""Those of them that change the wheels' equations."""

OF_THE_DRIVETRAIN = ("gear_error", "backlash_deg", "encoder_counts")
"""Fields of `Errors` that driven wheels have."""

LARGEST_GEAR_ERROR = 0.5
LARGEST_BACKLASH_DEG = 90.0
MOST_COUNTS = 10**7
MOST_BUMPS = 2000
"""The time of a plant's step grows with their square where they lie close together: 0.2 s for a thousand on 0.5 m2."""

FLATTEST = 1e-4
"""Least height of a bump over its width: flatter ones are spheres too large to compute with [-]."""

LOW_BUMP = 0.25
"""Largest height of a bump over the radius of the smallest wheel [-]."""


class GearError(Part):
    """Relative error eps of a gear: true wheel speed is (1 + eps) times motor speed times the described gear_ratio.

    eps = constant + amplitude sin(cycles s + phase), s the motor's angle from the start times the described gear_ratio.

    Attributes:
        constant: Mean error [-].
        amplitude: Amplitude of its wave [-].
        cycles: Periods of the wave in one turn of the wheel [-].
        phase_deg: Phase of the wave at the start [deg].
    """

    constant: Number = 0.0
    amplitude: Number = 0.0
    cycles: Annotated[Positive, Field(le=1000)] = 1.0
    phase_deg: Number = 0.0

    @model_validator(mode="after")
    def _stays_small(self) -> Self:
        if abs(self.constant) + abs(self.amplitude) > LARGEST_GEAR_ERROR:
            raise ValueError(
                f"constant = {self.constant:g}, amplitude = {self.amplitude:g}: "
                f"accepted: sizes that add up to at most {LARGEST_GEAR_ERROR:g}"
            )
        return self


class GroundBumps(Part):
    """Uneven ground: spherical caps at places and of heights that follow from the scenario's seed.

    Attributes:
        height: Largest height [m]; heights are uniform in (0, height].
        width: Width of every cap's base [m]. No cap is within a width of where a wheel stands at the start.
        density: Caps per area [1/m2], around the reference path.
    """

    height: Positive
    width: Positive
    density: Positive

    @model_validator(mode="after")
    def _is_flat(self) -> Self:
        low, high = FLATTEST * self.width, 0.5 * self.width
        if not low <= self.height < high:
            raise ValueError(f"height = {self.height:g}: accepted: from {low:g} to less than {high:g}, for this width")
        return self

    def scattered(self, robot: Robot, q_xyt: NDArray[np.float64], seed: int) -> Bumps:
        """The bumps in the bounding box of reference poses (n, 3), widened by the robot's reach.

        Raises:
            DescriptionError: there would be too many.
        """
        low, high = q_xyt[:, :2].min(axis=0) - robot.reach, q_xyt[:, :2].max(axis=0) + robot.reach
        area = float(np.prod(high - low))
        count = round(self.density * area)
        if count > MOST_BUMPS:
            message = (
                f"that makes {count} bumps on the {area:.4g} m2 around the reference path; "
                f"accepted: up to {MOST_BUMPS}, so at most {MOST_BUMPS / area:.4g} per m2"
            )
            raise DescriptionError(str(Problem(("errors", "ground_bumps", "density"), message, self.density)))
        # Where the wheels stand at the start: the first reference pose is the origin.
        standing = robot.contact_points_B[:, :2]
        bumps = scattered_caps(
            low, high, count=count, height=self.height, width=self.width, clear_of=standing, seed=seed
        )
        if not len(bumps.radii):
            warnings.warn(
                f"errors.ground_bumps: the ground stays flat: density = {self.density:g} makes {count} bumps on the "
                f"{area:.3g} m2 around the reference path, and none is farther than width = {self.width:g} m from "
                "where the wheels stand at the start",
                RollerbenchWarning,
                stacklevel=2,
            )
        return bumps


class Errors(Part):
    """Imperfections of the simulated robot; wheels by name, or "all" for every wheel not named.

    Attributes:
        radius_scale: True over described wheel radius [-]; rollers grow with their wheel.
        position_offset: True minus described position of wheels, x and y [m].
        heading_offset_deg: True minus described heading of wheels [deg].
        friction: True coefficient of friction of wheels [-].
        center_of_mass: True minus described centre of mass of the body [m].
        gear_error: Relative errors of the gear ratios of driven wheels.
        backlash_deg: Play between motor and driven wheel, seen at the wheel [deg]; a run starts in the middle of it.
        encoder_counts: Counts in one turn of a driven wheel of the encoder on its motor; without it speeds are
            measured continuously.
        ground_bumps: What rises above the level ground.
        lost_legs: Legs whose motors give no torque any more, by name, and from when on [s].
    """

    radius_scale: dict[str, Positive] = Field(default_factory=dict)
    position_offset: dict[str, tuple[Number, Number]] = Field(default_factory=dict)
    heading_offset_deg: dict[str, Number] = Field(default_factory=dict)
    friction: dict[str, Positive] = Field(default_factory=dict)
    center_of_mass: Vector3 = (0.0, 0.0, 0.0)
    gear_error: dict[str, GearError] = Field(default_factory=dict)
    backlash_deg: dict[str, Annotated[NonNegative, Field(le=LARGEST_BACKLASH_DEG)]] = Field(default_factory=dict)
    encoder_counts: dict[str, Annotated[PositiveInt, Field(le=MOST_COUNTS)]] = Field(default_factory=dict)
    ground_bumps: GroundBumps | None = None
    lost_legs: dict[str, NonNegative] = Field(default_factory=dict)

    def problems(self, robot: Robot) -> Iterator[Problem]:
        """Names that are no wheels of the robot, or none with a motor, and bumps too high for it."""
        legs = [leg.name for leg in robot.legs]
        for name in self.lost_legs:
            if name not in legs:
                message = f"not a leg of {robot.name}; accepted: {', '.join(legs) or 'none, it has no legs'}"
                yield Problem(("errors", "lost_legs", name), message)
        if legs:
            yield from self._of_wheels(robot)
            return
        driven = [wheel.name for wheel in robot.driven_wheels]
        for field in (*OF_THE_ROBOT, *OF_THE_DRIVETRAIN):
            kind, names = ("driven wheel", driven) if field in OF_THE_DRIVETRAIN else ("wheel", robot.wheel_names)
            value = getattr(self, field)
            for name in value if isinstance(value, dict) else ():
                if name not in (*names, "all"):
                    message = f"not a {kind} of {robot.name}; accepted: {', '.join((*names, 'all'))}"
                    yield Problem(("errors", field, name), message)
        if self.ground_bumps is not None:
            limits = [LOW_BUMP * wheel.radius for wheel in robot.wheels]
            limits += [wheel.ring.roller_radius for wheel in robot.wheels if wheel.ring is not None]
            if self.ground_bumps.height > min(limits):
                message = f"too high for the wheels of {robot.name}; accepted: up to {min(limits):.4g}"
                yield Problem(("errors", "ground_bumps", "height"), message, self.ground_bumps.height)

    def _of_wheels(self, robot: Robot) -> Iterator[Problem]:
        """What a robot on legs cannot have."""
        for field in (*OF_THE_ROBOT, *OF_THE_DRIVETRAIN, "ground_bumps"):
            if field != "center_of_mass" and getattr(self, field):
                message = f"of wheels, and {robot.name} stands on legs; accepted: center_of_mass, lost_legs"
                yield Problem(("errors", field), message)

    def drives(self, robot: Robot) -> list[WheelDrive] | None:
        """Drivetrains of the driven wheels, in the order of robot.yaml; None if all are perfect."""
        drives = []
        for wheel in robot.driven_wheels:
            gear = _of(self.gear_error, wheel.name, GearError())
            drives.append(
                WheelDrive(
                    constant=gear.constant,
                    amplitude=gear.amplitude,
                    cycles=gear.cycles,
                    phase=math.radians(gear.phase_deg),
                    backlash=math.radians(_of(self.backlash_deg, wheel.name, 0.0)),
                    counts=_of(self.encoder_counts, wheel.name, None),
                )
            )
        return drives if any(getattr(self, field) for field in OF_THE_DRIVETRAIN) else None

    def applied(self, robot: Robot) -> Robot:
        """The robot as it truly is, but for its drivetrain, which no robot.yaml describes.

        Raises:
            DescriptionError: such a robot cannot stand.
        """
        if all(getattr(self, field) == getattr(Errors(), field) for field in OF_THE_ROBOT):
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

    def stages(self, robot: Robot) -> dict[str, Robot]:
        """The robot with one injected error of its wheels' geometry after the other, by the error's name."""
        robots, so_far = {}, Errors()
        for field in OF_THE_KINEMATICS:
            value = getattr(self, field)
            if value:
                so_far = so_far.model_copy(update={field: value})
                robots[field] = so_far.applied(robot)
        return robots

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
