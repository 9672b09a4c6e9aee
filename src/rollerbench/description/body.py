"""The rigid body that carries the wheels."""

from typing import Self

from pydantic import model_validator

from rollerbench.description.part import Part, Positive, Vector3


class Body(Part):
    """Chassis: a box with a mass.

    Attributes:
        size: Extent along x, y, z of the body frame [m].
        mass: Mass without wheels [kg].
        center_of_mass: p_BoBcm_B [m], from Bo at axle height.
        center: Centre of the box from Bo [m]; by default the centre of mass.
        inertia: Principal moments about the centre of mass along x, y, z [kg m2]; by default those of
            the homogeneous box.
    """

    size: tuple[Positive, Positive, Positive]
    mass: Positive
    center_of_mass: Vector3 = (0.0, 0.0, 0.0)
    center: Vector3 | None = None
    inertia: tuple[Positive, Positive, Positive] | None = None

    @property
    def box_center(self) -> Vector3:
        """Centre of the box from Bo, in B [m]."""
        return self.center_of_mass if self.center is None else self.center

    @model_validator(mode="after")
    def _inertia_is_physical(self) -> Self:
        if self.inertia is not None:
            largest = max(self.inertia)
            if largest > sum(self.inertia) - largest:
                raise ValueError("inertia: the largest moment must not exceed the sum of the other two")
        return self
