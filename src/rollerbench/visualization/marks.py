"""What is drawn beside the robot: ghost, trails, skid marks, forces, feet."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from rollerbench import palette
from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.kinematics.odometry import rotate
from rollerbench.palette import LIFT, Color
from rollerbench.recording import Recording
from rollerbench.visualization.model import transform
from rollerbench.visualization.motion import Motion
from rollerbench.visualization.shapes import Box, Cylinder, Item, Mesh, disc, merged, polygon, ribbon

Array = NDArray[np.float64]

LAYERS = ("ground", "fine_grid", "grid", "footholds", "reference", "simulated", "skid", "support")
"""What lies on the ground, from below."""

TRAIL_POINTS = 500
AXLE = Rotation.from_euler("x", 90, degrees=True).as_matrix()
BEARS = 0.005
"""Share of the weight from which a foot counts as bearing a load [-]."""

BURIED = -1000.0
"""Height at which what is not to be seen waits, over the size of the robot [-]."""


def size_of(robot: Robot) -> float:
    """Largest horizontal extent of a robot [m]."""
    return max(2 * robot.reach, *robot.body.size[:2])


def height_of(layer: str, size: float) -> float:
    """Height of a layer on the ground [m]."""
    return (LAYERS.index(layer) - 1) * LIFT * size


def ghost(robot: Robot, frame: str) -> list[Item]:
    """A translucent body with wheels, a little larger than the robot's; wheels that swivel are left out."""
    margin = palette.GHOST_MARGIN * size_of(robot)
    look: dict[str, Any] = {"frame": frame, "color": palette.REFERENCE, "opacity": palette.GHOST_OPACITY}
    x, y, z = (side + 2 * margin for side in robot.body.size)
    items = [Item(name="body", shape=Box(size=(x, y, z)), X_FG=_at(robot.body.box_center), **look)]
    for wheel in robot.wheels:
        if not wheel.swivels:
            turn = Rotation.from_euler("z", wheel.heading_degrees, degrees=True).as_matrix() @ AXLE
            shape = Cylinder(radius=wheel.radius + 0.3 * margin, length=wheel.width + 2 * margin)
            items.append(Item(name=wheel.name, shape=shape, X_FG=transform(turn, wheel.center_B), **look))
    return [*items, heading(robot, frame, palette.REFERENCE)]


def heading(robot: Robot, frame: str, color: Color) -> Item:
    """An arrow over the body that looks ahead; that of a ghost lies a little lower."""
    size = size_of(robot)
    length, width = palette.ARROW_LENGTH * size, palette.ARROW_WIDTH * size
    outline = np.array(
        [[1.0, 0.0], [0.35, 1.0], [0.35, 0.35], [-1.0, 0.35], [-1.0, -0.35], [0.35, -0.35], [0.35, -1.0]]
    )
    above = 0.018 if color == palette.REFERENCE else 0.026
    top = robot.body.box_center[2] + 0.5 * robot.body.size[2] + above * size
    x, y, _ = robot.body.box_center
    vertices = np.column_stack([x + 0.5 * length * outline[:, 0], y + 0.5 * width * outline[:, 1], np.full(7, top)])
    faces = np.array([[0, 1, 6], [2, 3, 4], [2, 4, 5]])
    return Item(frame=frame, name="heading", shape=Mesh(vertices=vertices, faces=faces), color=color, lit=False)


def trail(points: Array, layer: str, color: Color, size: float, name: str) -> list[Item]:
    """A band along a path (n, 3) on the ground; of the reference a wider one."""
    width = palette.REFERENCE_TRAIL_WIDTH if layer == "reference" else palette.TRAIL_WIDTH
    chosen = points[np.unique(np.linspace(0, len(points) - 1, TRAIL_POINTS).astype(int))]
    mesh = ribbon(chosen[:, :2], width * size, chosen[:, 2] + height_of(layer, size))
    return [] if mesh is None else [Item(frame="trails", name=name, shape=mesh, color=color, lit=False)]


def skid_marks(recording: Recording, robot: Robot, prefix: str) -> list[Item]:
    """Bands on the ground where wheels slid, coloured by how fast (`palette.SLIP_SPEEDS`)."""
    size, height = size_of(robot), height_of("skid", size_of(robot))
    pieces: list[list[Mesh]] = [[] for _ in palette.SLIP_SPEEDS]
    for place, slip in _contacts(recording, robot):
        rank = np.searchsorted(palette.SLIP_SPEEDS, slip, side="right")
        starts = np.flatnonzero(np.diff(rank, prepend=-1))
        for start, end in zip(starts, [*starts[1:], len(rank)], strict=True):
            if rank[start]:
                points = place[start : end + 1]
                thin = points[np.unique(np.linspace(0, len(points) - 1, TRAIL_POINTS).astype(int))]
                mesh = ribbon(thin[:, :2], palette.SKID_WIDTH * size, thin[:, 2] + height)
                pieces[rank[start] - 1] += [] if mesh is None else [mesh]
    meshes = [merged(each) for each in pieces]
    return [
        Item(frame=f"{prefix}slip", name=f"above_{1e3 * speed:g}_mm_s", shape=mesh, color=color, lit=False)
        for speed, color, mesh in zip(palette.SLIP_SPEEDS, palette.SLIP_COLORS, meshes, strict=True)
        if mesh is not None
    ]


def force_length(robot: Robot) -> float:
    """Length of the arrow of a wheel or foot that carries its share of the weight [m]: no wheel hides it."""
    radius = max(part.radius for part in (*robot.wheels, *(leg.wheel for leg in robot.legs)))
    return max(palette.FORCE_LENGTH * size_of(robot), palette.FORCE_REACH * 2 * radius)


def has_forces(recording: Recording, robot: Robot) -> bool:
    """Whether a recording tells the contacts' forces; those of feet it always does."""
    return bool(robot.legs) or f"{robot.wheels[0].name}.force_z" in recording.columns


def forces(recording: Recording, robot: Robot, motion: Motion, prefix: str) -> tuple[list[Item], dict[str, Array]]:
    """Arrows of the ground's forces on wheels, or loads on feet, coloured by slip; their items and tracks."""
    size = size_of(robot)
    parts = robot.wheels or robot.legs
    longest, items, tracks = 0.0, [], {}
    scale = force_length(robot) * len(parts) / (robot.mass * GRAVITY)
    for part, (place, slip) in zip(parts, _contacts(recording, robot), strict=True):
        force = _force(recording, robot, part.name)[motion.samples]
        length = scale * np.linalg.norm(force, axis=1)
        longest = max(longest, float(length.max()))
        up = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-9)
        tip = place[motion.samples] + length[:, np.newaxis] * up
        rank = np.searchsorted(palette.SLIP_SPEEDS, slip[motion.samples], side="right")
        for index in range(len(palette.SLIP_SPEEDS) + 1):
            shown = (rank == index) & (length > 0.02 * palette.FORCE_LENGTH * size)
            if shown.any():
                position = np.where(shown[:, np.newaxis], tip, [0.0, 0.0, BURIED * size])
                tracks[f"{prefix}forces/{part.name}_{index}"] = transform(towards(up), position)
    colors = (palette.FORCE, *palette.SLIP_COLORS)
    shape = arrow(longest, palette.FORCE_WIDTH * size)
    items = [
        Item(frame=frame, name="arrow", shape=shape, color=colors[int(frame.rpartition("_")[2])]) for frame in tracks
    ]
    return items, tracks


def footholds(recording: Recording, robot: Robot, prefix: str) -> list[Item]:
    """Discs where feet were put down."""
    size, discs = size_of(robot), []
    for leg in robot.legs:
        stands = recording.columns[f"{leg.name}.stance"] > 0.5
        for index in np.flatnonzero(stands & ~np.concatenate([[False], stands[:-1]])):
            x, y, z = (recording.columns[f"{leg.name}.foot_{axis}"][index] for axis in "xyz")
            lift = height_of("footholds", size)
            discs.append(disc(np.array([x, y, max(z, 0.0) + lift]), 0.025 * size))
    mesh = merged(discs)
    return (
        []
        if mesh is None
        else [Item(frame=f"{prefix}feet", name="footholds", shape=mesh, color=palette.FOOTHOLD, lit=False)]
    )


def support(recording: Recording, robot: Robot, motion: Motion, prefix: str) -> tuple[list[Item], dict[str, Array]]:
    """The polygon of the feet that bear a load, a new one whenever it changes; items and tracks."""
    size = size_of(robot)
    names = [leg.name for leg in robot.legs]
    loads = np.column_stack([recording.columns[f"{name}.load"] for name in names])[motion.samples]
    stands = loads > BEARS * robot.mass * GRAVITY
    feet = np.stack(
        [np.column_stack([recording.columns[f"{name}.foot_{axis}"] for axis in "xyz"]) for name in names], axis=1
    )[motion.samples]
    items: list[Item] = []
    tracks: dict[str, Array] = {}
    since = 0
    for index in range(1, len(stands) + 1):
        if index < len(stands):
            both = stands[index] & stands[since]
            moved = np.linalg.norm((feet[index] - feet[since])[both], axis=-1).max(initial=0.0)
            if (stands[index] == stands[since]).all() and moved < 0.02 * size:
                continue
        corners = hull(feet[since][stands[since]])
        if corners is not None:
            frame = f"{prefix}support/{len(tracks)}"
            shape = polygon(corners + np.array([0.0, 0.0, height_of("support", size)]))
            look: dict[str, Any] = {"color": palette.SUPPORT, "opacity": palette.SUPPORT_OPACITY, "lit": False}
            items.append(Item(frame=frame, name="polygon", shape=shape, **look))
            track = np.tile(_at((0.0, 0.0, BURIED * size)), (len(stands), 1, 1))
            track[since:index] = np.eye(4)
            tracks[frame] = track
        since = index
    return items, tracks


def _contacts(recording: Recording, robot: Robot) -> list[tuple[Array, Array]]:
    """Where each wheel or foot touches the ground (n, 3), and how fast it slides there (n,); 0 in the air."""
    columns, found = recording.columns, []
    for leg in robot.legs:
        slip = np.hypot(columns[f"{leg.name}.slip_x"], columns[f"{leg.name}.slip_y"])
        place = np.column_stack([columns[f"{leg.name}.foot_{axis}"] for axis in "xyz"])
        place[:, 2] = np.maximum(place[:, 2], 0.0)
        found.append((place, np.where(columns[f"{leg.name}.load"] > 0, slip, 0.0)))
    for wheel in robot.wheels:
        slip = np.hypot(columns[f"{wheel.name}.slip_x"], columns[f"{wheel.name}.slip_y"])
        aside = np.column_stack([columns[f"{wheel.name}.contact_x"], columns[f"{wheel.name}.contact_y"]])
        place = recording.q_xyt[:, :2] + rotate(recording.q_xyt[:, 2], aside)
        place = np.column_stack([place, np.zeros(len(place))])
        found.append((place, np.where(columns[f"{wheel.name}.depth"] >= 0, slip, 0.0)))
    return found


def _force(recording: Recording, robot: Robot, name: str) -> Array:
    """Force (n, 3) of the ground on a wheel in W, or the load of a foot [N]."""
    if robot.legs:
        load = np.maximum(recording.columns[f"{name}.load"], 0.0)
        return np.column_stack([np.zeros_like(load), np.zeros_like(load), load])
    aside = np.column_stack([recording.columns[f"{name}.force_{axis}"] for axis in "xy"])
    return np.column_stack([rotate(recording.q_xyt[:, 2], aside), recording.columns[f"{name}.force_z"]])


def towards(up: Array) -> Array:
    """Rotations (n, 3, 3) whose z axis points along unit vectors (n, 3)."""
    side = np.cross(up, [1.0, 0.0, 0.0])
    small = np.linalg.norm(side, axis=1) < 1e-3
    side[small] = np.cross(up[small], [0.0, 1.0, 0.0])
    missing = np.linalg.norm(up, axis=1) < 0.5
    up, side = (
        np.where(missing[:, np.newaxis], [0.0, 0.0, 1.0], up),
        np.where(missing[:, np.newaxis], [0.0, 1.0, 0.0], side),
    )
    y = side / np.linalg.norm(side, axis=1, keepdims=True)
    return np.stack([np.cross(y, up), y, up], axis=-1)


def arrow(length: float, width: float, corners: int = 10) -> Mesh:
    """An arrow along z whose tip is the origin; the ground hides what of its shaft lies below."""
    angle = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    head = 3.0 * width
    rows = [(0.5 * width, -max(length, head)), (0.5 * width, -head), (1.2 * width, -head)]
    vertices = np.concatenate([np.column_stack([radius * ring, np.full(corners, z)]) for radius, z in rows])
    vertices = np.concatenate([vertices, [[0.0, 0.0, 0.0]]])
    here = np.arange(corners)
    after = (here + 1) % corners
    faces = [np.column_stack([here + k * corners, after + k * corners, after + (k + 1) * corners]) for k in (0, 1)]
    faces += [
        np.column_stack([here + k * corners, after + (k + 1) * corners, here + (k + 1) * corners]) for k in (0, 1)
    ]
    faces += [np.column_stack([here + 2 * corners, after + 2 * corners, np.full(corners, 3 * corners)])]
    return Mesh(vertices=vertices, faces=np.concatenate(faces))


def hull(points: Array) -> Array | None:
    """Corners (m, 3) of the convex hull of points (n, 3) seen from above, counter-clockwise; None on one line."""
    if len(points) < 3:
        return None
    try:
        return points[ConvexHull(points[:, :2]).vertices]
    except QhullError:
        return None


def _at(position: Sequence[float]) -> Array:
    return transform(np.eye(3), np.array(position, dtype=np.float64))
