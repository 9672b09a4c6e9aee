"""The motion of a recording, at the times of a picture's frames."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rollerbench.description import Robot
from rollerbench.recording import Recording
from rollerbench.sdf import names
from rollerbench.visualization.model import transform

Array = NDArray[np.float64]


LARGEST_TURN = 2.0
"""Of a joint between two frames [rad]; viewers go the shorter way from one to the next."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Where a robot was.

    Attributes:
        time: Times (n,) [s].
        samples: Indices (n,) of the recording's samples.
        X_WB: Poses (n, 4, 4) of its body.
        X_WR: Poses (n, 4, 4) of its body as the equations predict them.
        angles: Angles (n,) by joint [rad].
    """

    time: Array
    samples: NDArray[np.int64]
    X_WB: Array
    X_WR: Array
    angles: Mapping[str, Array]


def motion_of(recording: Recording, robot: Robot, frames_per_second: float) -> Motion:
    """The motion at the samples next to the times of frames, first and last included."""
    time = recording.time
    count = max(1, round((time[-1] - time[0]) * frames_per_second))
    wanted = np.linspace(time[0], time[-1], count + 1)
    samples = np.unique(np.clip(np.searchsorted(time, wanted - 1e-9), 0, len(time) - 1))
    joints = {names.drive_joint(wheel.name): f"{wheel.name}.angle" for wheel in robot.wheels}
    joints |= {names.swivel_joint(wheel.name): f"{wheel.name}.swivel" for wheel in robot.wheels if wheel.swivels}
    for leg in robot.legs:
        joints |= {names.leg_joint(leg.name, k + 1): f"{leg.name}.joint_{k + 1}" for k in range(len(leg.links))}
        joints |= {names.drive_joint(leg.name): f"{leg.name}.wheel"}
    samples = _fine_enough(samples, [recording.columns[name] for name in joints.values() if name in recording.columns])
    columns = {name: values[samples] for name, values in recording.columns.items()}
    legs = bool(robot.legs)
    height = columns["desired_z"] if legs else np.full(len(samples), -robot.ground_height)
    tilt = [columns[f"desired_{name}"] if legs else np.zeros(len(samples)) for name in ("roll", "pitch")]
    reference = [*tilt, columns["reference_yaw"]]
    return Motion(
        time=time[samples],
        samples=samples,
        X_WB=_poses([columns[name] for name in ("roll", "pitch", "yaw")], [columns[name] for name in "xyz"]),
        X_WR=_poses(reference, [columns["reference_x"], columns["reference_y"], height]),
        angles={joint: columns[column] for joint, column in joints.items() if column in columns},
    )


def _fine_enough(samples: NDArray[np.int64], angles: list[Array]) -> NDArray[np.int64]:
    """Samples with more between them where a joint turns so far that one could not tell which way it went."""
    while True:
        turns = np.max([np.abs(np.diff(angle[samples])) for angle in angles], axis=0, initial=0.0)
        coarse = (turns > LARGEST_TURN) & (np.diff(samples) > 1)
        if not coarse.any():
            return samples
        samples = np.union1d(samples, (samples[:-1] + samples[1:])[coarse] // 2)


def _poses(rpy: list[Array], position: list[Array]) -> Array:
    return transform(Rotation.from_euler("xyz", np.column_stack(rpy)).as_matrix(), np.column_stack(position))
