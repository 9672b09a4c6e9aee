"""Base of all described parts, and the number types that their fields use."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

LARGEST = 1e6
"""Larger numbers are slips of the pen, and would overflow in squares and cubes."""

Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, gt=0, le=LARGEST)]
NonNegative = Annotated[float, Field(strict=True, ge=0, le=LARGEST)]
PositiveInt = Annotated[int, Field(strict=True, gt=0)]
Flag = Annotated[bool, Field(strict=True)]
Vector3 = tuple[Number, Number, Number]
Name = Annotated[str, Field(strict=True, max_length=100, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


class Part(BaseModel):
    """A piece of a description: immutable, no unknown keys, no infinities or NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
