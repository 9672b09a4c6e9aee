"""The answer to a question for a limit, with what sets it; and the check of its arguments."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.errors import KinematicsError

Array = NDArray[np.float64]

CAUSES = {
    "speed": "a driven wheel reaches its max_speed",
    "adhesion": "a wheel needs all its friction",
    "effort": "a driven wheel reaches its max_effort",
    "lift-off": "a wheel loses its load",
    "tyres": "tyres would skid sideways",
    "drive": "the driven wheels cannot push this way",
    "unlimited": "no wheel that turns has a max_speed",
}
"""What a limit comes from, or why there is none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limit:
    """A limit for each direction; numpy takes it as its value, and float() refuses it where there is none.

    Attributes:
        value: The limit (...), in the unit that the function says; NaN where there is none.
        cause: Key (...) of `CAUSES`: what sets the limit, or why there is none.
        at_limit: Which wheels (..., n_wheels) are at their limit, in the order of robot.wheels.
        wheel_names: Names of the wheels.
    """

    value: Array
    cause: NDArray[np.str_]
    at_limit: NDArray[np.bool_]
    wheel_names: tuple[str, ...]

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Where (...) there is a limit, and so a motion."""
        return np.isfinite(self.value)

    def wheels(self, index: Any = ()) -> tuple[str, ...]:
        """Names of the wheels at their limit, for one index into value."""
        return tuple(name for name, at in zip(self.wheel_names, self.at_limit[index], strict=True) if at)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.value, dtype=dtype)

    def __float__(self) -> float:
        """The value of one direction.

        Raises:
            KinematicsError: there is none, or there are several.
        """
        if self.value.size != 1:
            raise KinematicsError(f"limits of shape {self.value.shape} are no single number: accepted: one direction")
        value = self.value.item()
        if math.isnan(value):
            cause = str(self.cause.item())
            names = self.wheels((0,) * self.value.ndim)
            wheels = f" ({', '.join(names)})" if names else ""
            raise KinematicsError(f"there is no limit in this direction: {CAUSES[cause]}{wheels}")
        return float(value)


def finite(name: str, value: ArrayLike) -> Array:
    """The argument as an array.

    Raises:
        KinematicsError: it holds something else than finite numbers.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise KinematicsError(f"{name} = {value!r}: accepted: a number or an array of numbers") from None
    if not np.isfinite(array).all():
        raise KinematicsError(f"{name} holds NaN or infinite values: accepted: finite numbers")
    return array


def finite_number(name: str, value: float, *, smallest: float = -math.inf) -> float:
    """The argument as one number.

    Raises:
        KinematicsError: it is none, or less than smallest.
    """
    array = finite(name, value)
    if array.ndim or array < smallest:
        least = "" if smallest == -math.inf else f" of {smallest:g} or more"
        raise KinematicsError(f"{name} = {value!r}: accepted: a number{least}")
    return float(array)


def unit_vectors(direction: ArrayLike) -> tuple[tuple[int, ...], Array]:
    """Shape of an array of directions [rad], and their unit vectors (n, 2).

    Raises:
        KinematicsError: direction is not finite.
    """
    angles = finite("direction", direction)
    return angles.shape, np.stack([np.cos(angles).ravel(), np.sin(angles).ravel()], axis=-1)
