"""The wheel types: fixed, steered and castor tyres, omni and Mecanum wheels with rollers."""

import math
from dataclasses import replace
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator
from scipy.special import cosdg, cotdg, sindg

from rollerbench.description.part import Flag, Name, NonNegative, Number, Part, Positive, PositiveInt
from rollerbench.description.problems import Problem, refuse
from rollerbench.description.rollers import RollerRing, largest_count, largest_radius, roller_clearance

FORK_MASS_FRACTION = 0.1
"""Share of a steered or castor wheel's mass that its fork holds."""


class Rollers(Part):
    """Passive rollers round the rim.

    Attributes:
        count: Rollers of all rows together.
        radius: Largest radius of the barrel-shaped roller [m].
        rows: Rows side by side; rollers of neighbouring rows alternate.
        mass: Mass of one roller [kg]; by default hub and rollers share one density.
        damping: Viscous friction of a roller's bearing [N m s].
    """

    count: Annotated[PositiveInt, Field(ge=4, le=200)]
    radius: Positive
    rows: Annotated[PositiveInt, Field(le=2)] = 1
    mass: Positive | None = None
    damping: NonNegative = 1e-5

    @model_validator(mode="after")
    def _rows_share_the_rollers(self) -> Self:
        if self.count % self.rows:
            raise ValueError(f"count = {self.count}: must be a multiple of rows = {self.rows}")
        return self


class Wheel(Part):
    """What all wheel types share.

    Attributes:
        name: Unique name of the wheel.
        position: p_BoHo_B [m]: x forward, y left, and optionally z up. For a castor and a steered wheel the point
            where the swivel axis meets axle height.
        distance: Distance of the wheel from Bo at axle height, with azimuth_deg instead of position [m].
        azimuth_deg: Direction from Bo to the wheel about +z from body x.
        heading_deg: Rolling direction about +z from body x; for a castor and a steered wheel at swivel angle 0. By
            default 0; with azimuth_deg along the circle about Bo, counter-clockwise.
        radius: Radius of the wheel [m], to the envelope of its rollers if it has any.
        width: Width along the axle [m].
        mass: Mass of the whole wheel [kg], rollers and fork included.
        gear_ratio: Wheel speed over motor speed [-].
        driven: Whether a motor drives it.
        max_speed: Largest wheel speed [rad/s]; None for no limit.
        max_effort: Largest torque at the wheel [N m]; None for no limit.
        friction: Coefficient of friction of tyre or rollers [-].
    """

    name: Name
    type: str
    position: Annotated[tuple[Number, ...] | None, Field(min_length=2, max_length=3)] = None
    distance: Positive | None = None
    azimuth_deg: Number | None = None
    heading_deg: Number | None = None
    radius: Positive
    width: Positive
    mass: Positive
    gear_ratio: Positive = 1.0
    driven: Flag = True
    max_speed: Positive | None = None
    max_effort: Positive | None = None
    friction: Positive = 0.8

    @property
    def p_BoHo_B(self) -> NDArray[np.float64]:
        """Position (3,) of the wheel's reference point from Bo, in B [m]."""
        if self.position is not None:
            return np.array([*self.position, 0.0][:3])
        distance, azimuth = self.distance or 0.0, self.azimuth_deg or 0.0
        return np.array([distance * cosdg(azimuth), distance * sindg(azimuth), 0.0])

    @property
    def heading_degrees(self) -> float:
        """Rolling direction about +z from body x [deg], given or by default."""
        if self.heading_deg is not None:
            return self.heading_deg
        return 0.0 if self.azimuth_deg is None else self.azimuth_deg + 90.0

    @property
    def heading(self) -> float:
        """Rolling direction about +z from body x [rad]."""
        return math.radians(self.heading_degrees)

    @property
    def swivel_offset(self) -> float:
        """Distance of the wheel's centre behind its swivel axis [m]; 0 for all but castors."""
        return 0.0

    @property
    def swivels(self) -> bool:
        """Whether the wheel turns about a vertical axis, by a motor or by itself."""
        return False

    @property
    def steered(self) -> bool:
        """Whether a motor sets the swivel angle."""
        return False

    @property
    def roller_slope(self) -> float:
        """tan(g) of the angle g from the rolling direction to the ground-contact roller's axis [-].

        The axle is a quarter turn left of the rolling direction, so tan(g) = -cot(roller_angle): 0 for an omni
        wheel, -1 for a Mecanum wheel with roller_angle_deg: 45. A tyre counts as 0.
        """
        return 0.0

    @property
    def ring(self) -> RollerRing | None:
        """Shape and places of the rollers, None for a tyre."""
        return None

    @property
    def center_B(self) -> NDArray[np.float64]:
        """Position (3,) of the wheel's centre from Bo, in B, at swivel angle 0 [m]."""
        behind = np.array([math.cos(self.heading), math.sin(self.heading), 0.0])
        return self.p_BoHo_B - self.swivel_offset * behind

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        polar = [field for field in ("distance", "azimuth_deg") if getattr(self, field) is not None]
        if self.position is None and len(polar) < 2:
            refuse([Problem(("position",), "this field is required (or distance and azimuth_deg instead of it)")])
        if self.position is not None and polar:
            message = f"given besides {' and '.join(polar)}; accepted: one or the other"
            refuse([Problem(("position",), message, self.position)])
        return self


class FixedWheel(Wheel):
    """A tyre whose axle is fixed to the body."""

    type: Literal["fixed"] = "fixed"


class SteeredWheel(Wheel):
    """A tyre that a second motor turns about a vertical axis through its centre.

    Attributes:
        max_steering_speed: Largest speed of the swivel [rad/s]; None for no limit.
        max_steering_effort: Largest torque about the swivel axis [N m]; None for no limit.
    """

    type: Literal["steered"] = "steered"
    max_steering_speed: Positive | None = None
    max_steering_effort: Positive | None = None

    @property
    def swivels(self) -> bool:
        """Always."""
        return True

    @property
    def steered(self) -> bool:
        """Always."""
        return True


class CastorWheel(Wheel):
    """A tyre that trails behind a free swivel axis.

    Attributes:
        trail: Distance of the wheel's centre behind the swivel axis [m].
    """

    type: Literal["castor"] = "castor"
    trail: Positive
    driven: Flag = False

    @field_validator("driven")
    @classmethod
    def _runs_free(cls, driven: bool) -> bool:
        if driven:
            raise ValueError("a castor's drive row changes as it swivels; accepted: false, or type: steered")
        return driven

    @property
    def swivel_offset(self) -> float:
        """The trail [m]."""
        return self.trail

    @property
    def swivels(self) -> bool:
        """Always."""
        return True


class RollerWheel(Wheel):
    """A wheel with passive rollers round its rim (Swedish wheel).

    Attributes:
        roller_angle_deg: Axis of the roller that touches the ground, from the axle (+y of the wheel),
            counter-clockwise seen from above.
        rollers: The rollers.
    """

    roller_angle_deg: Annotated[Number, Field(ge=-90, le=90)]
    rollers: Rollers

    @field_validator("roller_angle_deg")
    @classmethod
    def _can_drive(cls, angle: float) -> float:
        if abs(math.sin(math.radians(angle))) < 0.02:
            raise ValueError(
                "the roller axis is parallel to the axle, so the wheel could not drive; accepted: 2 to 90 or -90 to -2"
            )
        return angle

    @property
    def roller_slope(self) -> float:
        """tan(g) of the angle g from the rolling direction to the ground-contact roller's axis [-]."""
        return -float(cotdg(self.roller_angle_deg))

    @property
    def ring(self) -> RollerRing:
        """Shape and places of the rollers."""
        return RollerRing(
            wheel_radius=self.radius,
            wheel_width=self.width,
            roller_radius=self.rollers.radius,
            roller_angle=math.radians(self.roller_angle_deg),
            count=self.rollers.count,
            rows=self.rollers.rows,
        )

    @model_validator(mode="after")
    def _rollers_fit(self) -> Self:
        ring, rollers = self.ring, self.rollers
        if rollers.radius >= 0.5 * self.radius:
            raise ValueError(
                f"rollers.radius = {rollers.radius}: no room is left for a hub; "
                f"accepted: less than half of the wheel's radius, {0.5 * self.radius:g}"
            )
        clearance = roller_clearance(ring)
        if clearance < 0:
            count, radius = largest_count(ring), largest_radius(ring)
            ways = [f"at most {count} of this radius"] if count else []
            ways += [f"a radius up to {radius:.3g}"] if radius else []
            if rollers.rows == 1 and not rollers.count % 2 and roller_clearance(replace(ring, rows=2)) >= 0:
                ways.append("rows: 2")
            accepted = " or ".join(ways) or "another roller angle or a wider wheel"
            raise ValueError(
                f"rollers.count = {rollers.count}, rollers.radius = {rollers.radius}, rows = {rollers.rows}: "
                f"neighbouring rollers overlap by {-1e3 * clearance:.3g} mm; accepted: {accepted}"
            )
        if rollers.mass is not None and rollers.mass * rollers.count >= self.mass:
            raise ValueError(
                f"rollers.mass = {rollers.mass}: {rollers.count} rollers outweigh the wheel's mass of {self.mass} kg; "
                f"accepted: less than {self.mass / rollers.count:g}"
            )
        return self


class OmniWheel(RollerWheel):
    """A wheel whose rollers turn about the rim's tangent."""

    type: Literal["omni"] = "omni"
    roller_angle_deg: Annotated[Number, Field(ge=-90, le=90)] = 90.0


class MecanumWheel(RollerWheel):
    """A wheel whose rollers are inclined to the axle, most often by 45 deg."""

    type: Literal["mecanum"] = "mecanum"


AnyWheel = Annotated[FixedWheel | SteeredWheel | CastorWheel | OmniWheel | MecanumWheel, Field(discriminator="type")]
