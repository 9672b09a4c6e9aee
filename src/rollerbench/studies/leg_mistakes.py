"""The mistakes of Song et al. (2012), each with numbers that decide."""

import numpy as np

from rollerbench.kinematics.legs import LegKinematics
from rollerbench.studies import leg_support, song
from rollerbench.studies.paper import Mistake


def mistakes(noise: leg_support.Errors) -> tuple[Mistake, ...]:
    """The mistakes, with errors of noisy feet."""
    return (*_pose(), *_agreement(), *_support(noise))


def _pose() -> tuple[Mistake, ...]:
    kinematics = LegKinematics(song.leg())
    x = 1e3 * float(kinematics.position(song.ANGLES)[0])
    other = 1e3 * float(kinematics.position(song.ANGLES * [1, 1, 1, -1])[0])
    first, *_ = np.sum(song.ROTATION**2, axis=1)
    zeroed = song.ROTATION * [[1, 1, 0], [1, 1, 1], [1, 1, 1]]
    fits = {twist: float(np.sum(song.entries_that_fit(twist))) for twist in (song.ALPHA_4, 0.0, 90.0, 180.0)}
    return (
        Mistake(
            where="Matrix (2.7), position",
            claim="The foot's x is +77.9423 mm.",
            correction="It is negative: at theta1 = 90 deg x is -l4 sin(theta4). The minus may have been lost in the "
            "copy of the text rather than in the paper.",
            proof={
                "x at (90, 30, 45, 60) deg": (x, "mm"),
                "x at (90, 30, 45, -60) deg": (other, "mm"),
            },
        ),
        Mistake(
            where="Matrix (2.7), rotation",
            claim="The foot's rotation has 0.2588 in its first row and third column.",
            correction="It is 0 there: with 0.2588 the first row is no unit vector, whatever the signs.",
            proof={
                "squares of the first row as printed, summed": (float(first), "-"),
                "largest entry of R R' - 1 with the best signs, as printed": (song.least_defect(song.ROTATION), "-"),
                "with 0 in that place": (song.least_defect(zeroed), "-"),
                "size of that entry with the twist alpha4 of 0 or 180 deg": (
                    float(np.abs(song.rotation_with(0.0)[0, 2])), "-"),
            },
        ),
        Mistake(
            where="Table 1 and matrix (2.7)",
            claim="Both have the same foot frame: alpha4 = -90 deg.",
            correction="The printed entries, but for the wrong one, are those of alpha4 = 0 or 180 deg. The position "
            "does not depend on alpha4.",
            proof={f"entries of nine whose size fits, alpha4 = {twist:g} deg": (n, "-") for twist, n in fits.items()},
        ),
    )  # fmt: skip


def _agreement() -> tuple[Mistake, ...]:
    # A rigid model's rotation is one: its rows are unit vectors. Rounding to four digits explains this much.
    rounding = 2 * np.abs(song.ROTATION).sum(axis=1).max() * 5e-5
    return (
        Mistake(
            where="Section 2, comparison",
            claim="The model in software agrees completely with the equations.",
            correction="The numbers in the text at hand, which lacks the figures, do not show it: a single matrix is "
            "printed, and no rigid model can have it. Its position, but for signs, is that of the equations.",
            proof={
                "what R R' - 1 of a rotation can show by rounding to four digits": (float(rounding), "-"),
                "what the printed one shows, with the best signs": (song.least_defect(song.ROTATION), "-"),
                "largest difference of the sizes in the position": (
                    float(np.abs(np.abs(1e3 * LegKinematics(song.leg()).position(song.ANGLES)) - song.POSITION).max()),
                    "mm"),
            },
        ),
    )  # fmt: skip


def _support(noise: leg_support.Errors) -> tuple[Mistake, ...]:
    feet = 1e3 * leg_support.ground_feet()
    distances = np.linalg.norm(feet - [0.0, 0.0, 100.0], axis=1)
    proof = {}
    for angle in (leg_support.LARGEST_ANGLES[0], leg_support.LARGEST_ANGLES[-1]):
        for method in leg_support.METHODS:
            middle = 1e3 * noise[angle][method][:, 0]
            where = f"error of the middle of feet with a largest angle of {angle:g} deg by {method}"
            proof[f"mean {where}"] = (float(middle.mean()), "mm")
            proof[f"largest {where}"] = (float(middle.max()), "mm")
    return (
        Mistake(
            where="Section 2.2, origin",
            claim="The platform's origin is the centre of the sphere through its three support points.",
            correction="Spheres through three points have centres all along a line; meant, and computed from the plane "
            "of the points, is the centre of their circle.",
            proof={
                "distance of the three feet from a point 100 mm over the circle's centre": (
                    float(distances.mean()), "mm"),
                "largest difference between these distances": (float(np.ptp(distances)), "mm"),
                "radius of the circle": (float(np.hypot(*feet[0, :2])), "mm"),
            },
        ),
        Mistake(
            where="Section 2.2, position",
            claim="The position of the platform follows from the centre of its circle.",
            correction="It does for exact feet; but on obtuse triangles the centre magnifies errors of the feet, here "
            "1 mm in each coordinate, 1000 draws. Least squares keep the middle of the feet; a thin triangle tilts "
            "either way.",
            proof=proof,
        ),
    )  # fmt: skip
