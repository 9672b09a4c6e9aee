"""The ground that is drawn: its grid, bumps and steps."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rollerbench import palette
from rollerbench.visualization.marks import height_of
from rollerbench.visualization.model import transform
from rollerbench.visualization.shapes import Box, Ellipsoid, Item, Mesh, merged, ribbon

Array = NDArray[np.float64]

WORLD = "ground"
"""Path of what does not move."""

PITCHES = tuple(10.0**power for power in range(-3, 7))
"""Distances that a grid's lines may have [m]."""

FINE_LINES = 160
"""Most lines of a grid, each way."""


def ground(low: Array, high: Array, size: float) -> list[Item]:
    """Ground with a grid (`grid_pitches`), reaching beyond paths from low (2,) to high (2,)."""
    low, high = np.floor(low - palette.GROUND_MARGIN * size), np.ceil(high + palette.GROUND_MARGIN * size)
    extent, center = high - low, 0.5 * (low + high)
    thickness = palette.GROUND_THICKNESS * size
    slab = Box(size=(extent[0], extent[1], thickness))
    pose = transform(np.eye(3), np.array([*center, height_of("ground", size) - 0.5 * thickness]))
    items = [Item(frame=WORLD, name="slab", shape=slab, color=palette.GROUND, X_FG=pose, lit=False)]
    for layer, pitch, width, color in zip(
        ("grid", "fine_grid"),
        reversed(grid_pitches(low, high, size)),
        (0.008 * size, 0.004 * size),
        (palette.GRID, palette.FINE_GRID),
        strict=False,
    ):
        mesh = _lines(low, high, pitch, width, height_of(layer, size))
        items.append(Item(frame=WORLD, name=layer, shape=mesh, color=color, lit=False))
    return items


def grid_pitches(low: Array, high: Array, size: float) -> list[float]:
    """Distances of the grid's lines on ground from low (2,) to high (2,), at most two, the finer one first [m]."""
    extent = float(np.max(np.subtract(high, low)))
    return [pitch for pitch in PITCHES if pitch >= 0.1 * size and extent / pitch <= FINE_LINES][:2]


def bumps(centers: Array, half_widths: Array, heights: Array) -> list[Item]:
    """Caps on the ground at places (k, 2), as flat ellipsoids of their half widths and heights (k,) [m]."""
    return [
        Item(
            frame=WORLD,
            name=f"bump_{index}",
            shape=Ellipsoid(radii=(half_width, half_width, height)),
            color=palette.BUMP,
            X_FG=transform(np.eye(3), np.array([*center, 0.0])),
        )
        for index, (center, half_width, height) in enumerate(zip(centers, half_widths, heights, strict=True))
    ]


def steps(places: Sequence[Mapping[str, float]], width: float) -> list[Item]:
    """Steps across the way with start, end and height, of a width [m]."""
    return [
        Item(
            frame=WORLD,
            name=f"step_{index}",
            shape=Box(size=(step["end"] - step["start"], width, step["height"])),
            color=palette.STEP,
            lit=False,
            X_FG=transform(np.eye(3), np.array([0.5 * (step["start"] + step["end"]), 0.0, 0.5 * step["height"]])),
        )
        for index, step in enumerate(places)
    ]


def _lines(low: Array, high: Array, pitch: float, width: float, height: float) -> Mesh:
    """Grid lines as thin bands."""
    found = []
    for axis in (0, 1):
        first, last = math.ceil(low[axis] / pitch - 1e-9), math.floor(high[axis] / pitch + 1e-9)
        for offset in pitch * np.arange(first, last + 1):
            ends = np.array([low, high], dtype=np.float64)
            ends[:, axis] = offset
            mesh = ribbon(ends, width, height)
            found += [] if mesh is None else [mesh]
    joined = merged(found)
    assert joined is not None
    return joined
