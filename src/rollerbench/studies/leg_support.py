"""Figures 6 and 7 of Song et al.: three legs on fixed feet, and where the body is by its joints alone."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.kinematics.legs import LegKinematics
from rollerbench.kinematics.legs.body_pose import circumcenter_pose, least_squares_pose
from rollerbench.report.drawing import COLORS, Curve, SpaceCurve, curves, space
from rollerbench.studies import song
from rollerbench.studies.paper import Picture, Result

Array = NDArray[np.float64]

SAMPLES = 121
"""Poses along the motion."""

LARGEST_ANGLES = (60.0, 120.0, 150.0, 165.0)
"""Largest angles of the triangles of feet [deg]; the first is equilateral."""

NOISE, DRAWS, SEED = 1e-3, 1000, 7
"""Standard deviation of each coordinate of a foot [m], number of draws, and their seed."""

RADIUS, HEIGHT = 0.25, 0.15
"""Circle on which the feet of the noisy triangles stand, and height of Bo over their middle [m]."""

Errors = Mapping[float, Mapping[str, Array]]
"""By largest angle [deg] and method, errors (draws, 2) of the middle of the feet and of Bo above it [m]."""

METHODS = ("circumcentre", "least squares")


def motion() -> tuple[Array, Array, Array]:
    """A smooth motion of the body over feet that stand, and the joints for it.

    Returns:
        Shares of the motion (n,), poses X_GB (n, 4, 4) of the body over the ground, and joint angles (n, 3, 4) [rad].
        The fourth joint has a motion of its own; the other three follow from the feet.
    """
    robot, share = song.three_legs(), np.linspace(0.0, 1.0, SAMPLES)
    turn = 2 * np.pi * share
    home = robot.feet_B()
    angles = np.radians([7.0, 6.0, 12.0]) * np.column_stack([np.sin(2 * turn), np.sin(turn), np.sin(turn)])
    poses = np.tile(np.eye(4), (SAMPLES, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    poses[:, 0, 3], poses[:, 1, 3] = 0.025 * np.sin(turn), 0.02 * np.sin(2 * turn)
    poses[:, 2, 3] = -0.01 * (1 - np.cos(turn)) - home[:, 2].mean()
    feet = _seen(poses, ground_feet())
    q = np.empty((SAMPLES, 3, 4))
    for index, leg in enumerate(robot.legs):
        base = leg.X_BL
        targets = (feet[:, index] - base[:3, 3]) @ base[:3, :3]
        deformation = np.radians(15.0) * np.sin(turn + 2 * np.pi * index / 3)
        q[:, index] = LegKinematics(leg).inverse(targets, hold="joint_4", value=deformation)
    return share, poses, q


def ground_feet() -> Array:
    """The three feet (3, 3) in G [m]: G lies in the middle of the circle through them, on the height of their axles."""
    feet = song.three_legs().feet_B()
    return np.asarray(feet - [0.0, 0.0, feet[:, 2].mean()])


def figure_7() -> tuple[list[Result], list[Picture]]:
    """The mechanism through its motion: poses from the joints alone, by both methods."""
    share, poses, q = motion()
    robot, standing = song.three_legs(), ground_feet()
    from_joints = np.stack(
        [LegKinematics(leg).position(q[:, i]) @ leg.X_BL[:3, :3].T + leg.hip for i, leg in enumerate(robot.legs)],
        axis=1,
    )
    in_drake = song.feet_in_drake(robot, q)
    found = {method: _poses(method, from_joints, standing) for method in METHODS}
    drakes = {method: _poses(method, in_drake, standing) for method in METHODS}
    results = [
        Result(item="Figure 7", quantity="largest change of a distance between two feet, of the legs' joints",
               unit="mm", theory=_stretch(from_joints), simulated=_stretch(in_drake)),
    ]  # fmt: skip
    for method in METHODS:
        off = [_off(each[method], poses) for each in (found, drakes)]
        results += [
            Result(item="Figure 7", quantity=f"largest error of the body's position by {method}", unit="mm",
                   theory=off[0][0], simulated=off[1][0]),
            Result(item="Figure 7", quantity=f"largest error of its attitude by {method}", unit="deg",
                   theory=off[0][1], simulated=off[1][1]),
        ]  # fmt: skip
    return results, [_mechanism(poses, q), _coordinates(share, poses, drakes["circumcentre"]), _joints(share, q)]


def _poses(method: str, p_BF: Array, p_GF: Array) -> Array:
    """Poses X_GB (n, 4, 4) from feet (n, 3, 3) in B that stand at (3, 3) in G."""
    if method == "circumcentre":
        return circumcenter_pose(p_BF, p_GF)
    return least_squares_pose(p_BF, p_GF, np.ones(p_BF.shape[:-1]))


def _seen(poses: Array, p_GF: Array) -> Array:
    """Feet (n, k, 3) in B, of feet (k, 3) in G, at poses X_GB (n, 4, 4)."""
    return np.asarray((p_GF - poses[:, np.newaxis, :3, 3]) @ poses[:, :3, :3])


def _inverse(poses: Array) -> Array:
    """Poses X_BG (n, 4, 4) from X_GB."""
    return np.asarray(np.linalg.inv(poses), dtype=np.float64)


def _stretch(feet: Array) -> float:
    """Largest change of the distances between feet (n, 3, 3) [mm]."""
    sides = np.linalg.norm(feet - np.roll(feet, 1, axis=1), axis=2)
    return float(1e3 * np.abs(sides - sides[0]).max())


def _off(found: Array, poses: Array) -> tuple[float, float]:
    """Largest errors of position [mm] and attitude [deg]."""
    away = np.linalg.norm(found[:, :3, 3] - poses[:, :3, 3], axis=1)
    return float(1e3 * away.max()), float(np.degrees(_angles(found, poses).max()))


def _angles(found: Array, poses: Array) -> Array:
    """Angles (n,) between attitudes [rad]."""
    # The arc sine keeps its digits at small angles, where the arc cosine of the trace loses half of them.
    apart = np.linalg.norm(found[..., :3, :3] - poses[..., :3, :3], axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(2 * np.arcsin(np.minimum(1.0, apart)))


def _mechanism(poses: Array, q: Array) -> Picture:
    """Figure 7 in the paper's frame: the body is fixed, the ground moves."""
    robot, ground = song.three_legs(), _inverse(poses)
    feet = 1e3 * _seen(poses, ground_feet())
    hips = 1e3 * np.array([leg.hip for leg in robot.legs])
    lines = [SpaceCurve(label="body (fixed)", points=hips[[0, 1, 2, 0]], color="black", width=2.5)]
    for index, leg in enumerate(robot.legs):
        bones = 1e3 * song.bones_B(leg, q[0, index])
        lines.append(SpaceCurve(label="" if index else "legs at the start", points=bones, color="0.6", width=2.5))
    lines += [
        SpaceCurve(label=f"foot {index + 1}", points=feet[:, index], color=COLORS[index], width=1.8)
        for index in range(3)
    ]
    lines.append(SpaceCurve(label="origin O'", points=1e3 * ground[:, :3, 3], color=COLORS[3], width=1.8))
    for count, sample in enumerate((0, SAMPLES // 4, 3 * SAMPLES // 4)):
        triangle = np.take(feet[sample], [0, 1, 2, 0], axis=0)
        lines.append(SpaceCurve(label="" if count else "ground", points=triangle, color="0.55", style=":", width=0.9))
        for axis, (name, style) in enumerate((("x'", "-"), ("y'", "--"), ("z'", ":"))):
            origin = 1e3 * ground[sample, :3, 3]
            arrow = np.stack([origin, origin + 110.0 * ground[sample, :3, axis]])
            label = "" if count else f"axis {name}"
            lines.append(SpaceCurve(label=label, points=arrow, color=COLORS[4], style=style, width=1.6))
    return Picture(
        name="figure_07",
        title="Figures 6 and 7.",
        caption="The support mechanism of three legs, seen from the body as in the paper: paths of the feet, which are "
        "the corners of the moving platform, and of its origin; its triangle and axes at three moments.",
        svg=space(("x [mm]", "y [mm]", "z [mm]"), lines, elevation=38.0, azimuth=-75.0),
    )


def _coordinates(share: Array, poses: Array, found: Array) -> Picture:
    """Pose of the platform in the body over the motion."""
    panels: dict[str, list[Curve]] = {"position of O' [mm]": [], "attitude [deg]": []}
    for label, style, color, each in (("prescribed", "-", None, poses), ("from the joints", "o", COLORS[6], found)):
        ground, kept = _inverse(each), slice(None, None, 1 if color is None else 8)
        places = 1e3 * ground[kept, :3, 3]
        turns = Rotation.from_matrix(ground[kept, :3, :3]).as_euler("xyz", degrees=True)
        for panel, names, values in (
            ("position of O' [mm]", ("x", "y", "z"), places),
            ("attitude [deg]", ("roll", "pitch", "yaw"), turns),
        ):
            # The marks of all three are alike: one of them stands in the legend.
            labels = [f"{name}, {label}" for name in names] if color is None else [label, "", ""]
            panels[panel] += [
                Curve(label=labels[index], x=share[kept], y=values[:, index], style=style, color=color)
                for index in range(3)
            ]
    return Picture(
        name="figure_07_pose",
        title="Figure 7, pose of the platform.",
        caption="Pose of the ground in the body, as prescribed and as recovered by the circumcentre from the feet that "
        "Drake finds for the joints' angles.",
        svg=curves("share of the motion [-]", panels),
    )


def _joints(share: Array, q: Array) -> Picture:
    panels = {
        f"joint {joint + 1} [deg]": [
            Curve(label=f"leg {leg + 1}", x=share, y=np.degrees(q[:, leg, joint]), style=("-", "--", "-.")[leg])
            for leg in range(3)
        ]
        for joint in range(4)
    }
    return Picture(
        name="figure_07_joints",
        title="Figure 7, joints.",
        caption="Angles of the joints from which the pose is found; that of joint 4 was chosen, the others follow.",
        svg=curves("share of the motion [-]", panels),
    )


def noisy_errors() -> Errors:
    """Errors of the pose with noisy feet, for all largest angles."""
    return {angle: _noisy_errors(angle) for angle in LARGEST_ANGLES}


def _noisy_errors(largest_deg: float) -> dict[str, Array]:
    """Errors of the pose with noisy feet, on an isosceles triangle whose largest angle is given [deg].

    Returns:
        By method (draws, 2): how far the middle of the feet, and Bo above it, are from where they are [m].
    """
    azimuth = np.radians([0.0, 180.0 - largest_deg, largest_deg - 180.0])
    feet = RADIUS * np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(3)])
    feet -= feet.mean(axis=0)
    # The body's axes are the ground's: the true pose is a rise of Bo by its height.
    in_body = feet - [0.0, 0.0, HEIGHT]
    points = np.array([[0.0, 0.0, -HEIGHT], [0.0, 0.0, 0.0]])
    noise = np.random.default_rng(SEED).normal(0.0, NOISE, (DRAWS, 3, 3))
    errors = {}
    for method in METHODS:
        poses = _poses(method, in_body + noise, feet)
        placed = points @ poses[:, :3, :3].swapaxes(1, 2) + poses[:, np.newaxis, :3, 3]
        errors[method] = np.asarray(np.linalg.norm(placed - points - [0.0, 0.0, HEIGHT], axis=2))
    return errors


def conditioning(errors: Errors) -> tuple[list[Result], Picture]:
    """How noise of the feet shows in the pose, by the triangle's largest angle."""
    places = ("the middle of the feet", "Bo 150 mm above it")
    results = [
        Result(item="Section 2.2", quantity=f"{which} error of {place}, feet with an angle of {angle:g} deg, {method}",
               unit="mm", theory=1e3 * float(reduce(errors[angle][method][:, index])))
        for angle in (LARGEST_ANGLES[0], LARGEST_ANGLES[-1])
        for index, which, reduce in ((0, "mean", np.mean), (0, "largest", np.max), (1, "mean", np.mean))
        for place in (places[index],) for method in METHODS
    ]  # fmt: skip
    panels = {
        f"error of {place} [mm]": [
            Curve(label=f"{method}, {which}", x=np.array(LARGEST_ANGLES), style=mark + line,
                  y=1e3 * np.array([reduce(errors[angle][method][:, index]) for angle in LARGEST_ANGLES]))
            for method, mark in zip(METHODS, ("o", "s"), strict=True)
            for which, line, reduce in (("mean", "-", np.mean), ("largest", "--", np.max))
        ]
        for index, place in enumerate(places)
    }  # fmt: skip
    picture = Picture(
        name="section_2_2",
        title="Section 2.2, noise.",
        caption="Errors of the pose with 1 mm of noise in each coordinate of three feet on a circle of 250 mm, 1000 "
        "draws. The centre of the circle moves off an obtuse triangle, and its error grows; that of least squares in "
        "the middle of the feet does not. Both tilt alike where the triangle gets thin, which moves Bo.",
        svg=curves("largest angle of the triangle [deg]", panels, logarithmic=True),
    )
    return results, picture
