"""All speeds of a base at once: the polygon of velocities that its wheels' speed limits leave."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection

from rollerbench.description import Robot
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits.result import finite_number
from rollerbench.kinematics.limits.speed import SpeedRows, speed_rows
from rollerbench.kinematics.rows import wheeled

Array = NDArray[np.float64]

CHORDS = 720
"""Chords that stand for the circle of a steered wheel: up to 1 - cos(pi/720), that is 1e-5, are cut off."""

SAME = 1e-9
"""Distance under which two vertices are one, over the size of the polygon [-]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedPolygon:
    """The convex set of velocities of Bo that the wheels allow at one yaw rate.

    Attributes:
        vertices: Corners (n, 2) [m/s] in B, counter-clockwise; two for a segment, one for a point.
        edge_wheels: Names of the wheels at their limit along each edge, from a corner to the next; for a segment at
            each of its ends.
        yaw_rate: The yaw rate [rad/s].
        exact: Whether the corners are exact; with driven steered wheels, whose limits are circles, these are replaced
            by chords, which stay inside by 1e-5 of the radius at the most.
    """

    vertices: Array
    edge_wheels: tuple[tuple[str, ...], ...]
    yaw_rate: float
    exact: bool

    @property
    def dimension(self) -> int:
        """2 for a polygon, 1 for a segment, 0 for a single velocity."""
        return min(len(self.vertices) - 1, 2)


def speed_polygon(robot: Robot | str | Path, yaw_rate: float = 0.0) -> SpeedPolygon:
    """Velocities (vx, vy) with |J v| <= max_speed and C v = 0 at a yaw rate: the corners of their polytope.

    Args:
        robot: Robot, name of a shipped one, or path to a robot.yaml.
        yaw_rate: Yaw rate [rad/s].

    Raises:
        KinematicsError: the limits of the wheels leave a speed unlimited, or forbid the yaw rate.
    """
    robot = wheeled(robot)
    yaw_rate = finite_number("yaw_rate", yaw_rate)
    rows = speed_rows(robot)
    origin, basis = _tyres_allow(robot, rows, yaw_rate)
    normals, offsets, owners = _half_planes(rows, yaw_rate)
    # In coordinates t of the velocities origin + basis @ t that the tyres allow.
    offsets = offsets - normals @ origin
    normals = normals @ basis
    if basis.shape[1] and (not len(normals) or np.linalg.matrix_rank(normals, tol=SAME) < basis.shape[1]):
        raise KinematicsError(
            f"{robot.name}: no wheel limits its speed in some direction; accepted: robots whose driven wheels have a "
            "max_speed, enough of them for every direction of travel"
        )
    corners = _corners(robot, normals, offsets, yaw_rate)
    middles = corners if len(corners) < 3 else 0.5 * (corners + np.roll(corners, -1, axis=0))
    slack = offsets - middles @ normals.T
    size = float(np.max(np.abs(offsets), initial=0.0))
    names = [
        tuple(robot.wheels[i].name for i in dict.fromkeys(owners[np.flatnonzero(row <= SAME * size)].tolist()))
        for row in slack
    ]
    return SpeedPolygon(
        vertices=origin + corners @ basis.T,
        edge_wheels=tuple(names),
        yaw_rate=yaw_rate,
        exact=not len(rows.steered),
    )


def _tyres_allow(robot: Robot, rows: SpeedRows, yaw_rate: float) -> tuple[Array, Array]:
    """Velocities origin (2,) + basis (2, k) @ t at which no fixed tyre skids."""
    matrix, wanted = rows.tyre_rows[:, :2], -yaw_rate * rows.tyre_rows[:, 2]
    if not len(matrix):
        return np.zeros(2), np.eye(2)
    _, values, vt = np.linalg.svd(matrix)
    rank = int(np.sum(values > SAME))
    origin = np.asarray(np.linalg.pinv(matrix, rcond=SAME) @ wanted, dtype=np.float64)
    if np.max(np.abs(matrix @ origin - wanted)) > SAME * abs(yaw_rate) * rows.length:
        names = ", ".join(robot.wheels[i].name for i in rows.tyres)
        raise KinematicsError(f"{robot.name} cannot turn at yaw_rate = {yaw_rate:g}: its tyres ({names}) would skid")
    return origin, vt[rank:].T


def _half_planes(rows: SpeedRows, yaw_rate: float) -> tuple[Array, Array, NDArray[np.intp]]:
    """Unit normals (m, 2), offsets (m,) [m/s] and wheels (m,) of the half-planes normal @ v <= offset."""
    lengths = np.linalg.norm(rows.rows[:, :2], axis=1)
    normals = [sign * rows.rows[:, :2] / lengths[:, np.newaxis] for sign in (1.0, -1.0)]
    offsets = [(rows.speeds - sign * yaw_rate * rows.rows[:, 2]) / lengths for sign in (1.0, -1.0)]
    owners = [rows.driven, rows.driven]
    # Midpoints between the corners, which lie at whole multiples of the angle.
    angles = 2 * np.pi / CHORDS * (np.arange(CHORDS) + 0.5)
    chords = np.column_stack([np.cos(angles), np.sin(angles)])
    for wheel, place, speed in zip(rows.steered, rows.places, rows.steered_speeds, strict=True):
        center = yaw_rate * np.array([place[1], -place[0]])
        normals.append(chords)
        offsets.append(chords @ center + speed * np.cos(np.pi / CHORDS))
        owners.append(np.full(CHORDS, wheel))
    return np.concatenate(normals), np.concatenate(offsets), np.concatenate(owners)


def _corners(robot: Robot, normals: Array, offsets: Array, yaw_rate: float) -> Array:
    """Corners (n, k) of the bounded set normals @ t <= offsets in k <= 2 dimensions, counter-clockwise."""
    dimension = normals.shape[1]
    size = float(np.max(np.abs(offsets), initial=0.0)) or 1.0
    inside, depth = np.zeros(dimension), float(np.min(offsets, initial=np.inf))
    if dimension and yaw_rate:
        inside, depth = _deepest(normals, offsets / size)
        inside, depth = inside * size, depth * size
    if depth < -SAME * size:
        raise KinematicsError(
            f"{robot.name} cannot turn at yaw_rate = {yaw_rate:g}: a wheel would exceed its max_speed; "
            "rb.limits.max_yaw_rate tells what it can"
        )
    if dimension == 0:
        return np.zeros((1, 0))
    if depth <= SAME * size:
        return inside[np.newaxis]
    if dimension == 1:
        along = normals[:, 0]
        turned = np.abs(along) > SAME
        bounds = offsets[turned] / along[turned]
        return np.array([[np.max(bounds[bounds < inside])], [np.min(bounds[bounds > inside])]])
    scaled = np.column_stack([normals, -(offsets - normals @ inside) / size])
    found = HalfspaceIntersection(scaled, np.zeros(2)).intersections
    found = found[np.argsort(np.arctan2(found[:, 1], found[:, 0]))]
    apart = np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1) > SAME
    return inside + size * found[apart]


def _deepest(normals: Array, offsets: Array) -> tuple[Array, float]:
    """The point (k,) farthest inside all half-planes, and how far inside it lies; negative if there is none."""
    objective = np.zeros(normals.shape[1] + 1)
    objective[-1] = -1.0
    lengths = np.linalg.norm(normals, axis=1)
    # A wheel that no allowed velocity turns leaves no room by itself, or as much as its offset.
    lengths = np.where(lengths > SAME, lengths, 1.0)
    found = linprog(
        objective,
        A_ub=np.column_stack([normals, lengths]),
        b_ub=offsets,
        bounds=[(None, None)] * len(objective),
    )
    deepest = np.asarray(found.x, dtype=np.float64)
    return deepest[:-1], float(deepest[-1])
