"""Why the simulated robot is not where the equations say: the pose error, split into parts that add up."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from rollerbench.analysis.pose_error import last_direction
from rollerbench.description import Robot
from rollerbench.errors import ResourceError
from rollerbench.kinematics import WheelKinematics
from rollerbench.kinematics.odometry import accumulate, displacement
from rollerbench.recording import Recording

Array = NDArray[np.float64]

SMALL = 1e-6
"""Errors below this are not shared out among parts [m, rad]."""

LARGEST_SHARE = 10.0
"""Where parts that cancel are larger than this times the error, as with feedback, shares would say nothing [-]."""

MEANINGS = {
    "feedback": "what feedback added to the command; it works against the other parts",
    "servo": "wheels that did not turn as commanded",
    "drivetrain": "gears, play and encoders between motors and wheels",
    "radius_scale": "injected: wheel radii",
    "position_offset": "injected: places of the wheels",
    "heading_offset_deg": "injected: headings of the wheels",
    "geometry": "contacts and rolling radii that the equations do not have",
    "slip": "wheels sliding over the ground",
    "rest": "step size, tilt and solver",
}
"""What each part of a budget is, in its order."""


CONTACT = ("drive_x", "drive_y", "slip_x", "slip_y", "contact_x", "contact_y", "depth", "rolling_radius")
"""Columns of a wheel's contact."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorBudget:
    """The pose error over time as a sum of parts.

    Attributes:
        time: Times (n,) [s].
        parts: Parts (n, 3) of the pose error [m, m, rad] in W by name, those of `MEANINGS`; what was not injected is
            left out.
        direction: Direction of the reference's last travel in W [rad].
    """

    time: Array
    parts: Mapping[str, Array]
    direction: float

    @property
    def total(self) -> Array:
        """The pose error (n, 3): the sum of all parts [m, m, rad]."""
        return np.asarray(sum(self.parts.values()))

    def to_dict(self) -> dict[str, dict[str, float | None]]:
        """The parts of the final pose error by name, as in summary.json.

        x, y [m] and yaw [rad] in W; along_track and cross_track [m] as in `PoseError`; position_share is the part of
        the error vector's length that this part makes up, yaw_share that of the yaw error: each adds up to 1. They are
        None where the error is too small to be shared out: below a micrometre or microradian, or where parts cancel.
        """
        total, last = self.total[-1], np.array([part[-1] for part in self.parts.values()])
        length, turn = float(np.hypot(*total[:2])), abs(float(total[2]))
        shared = length > SMALL and np.hypot(*last[:, :2].T).max() < LARGEST_SHARE * length
        yaw_shared = turn > SMALL and np.abs(last[:, 2]).max() < LARGEST_SHARE * turn
        ahead = np.array([np.cos(self.direction), np.sin(self.direction)])
        left = np.array([-ahead[1], ahead[0]])
        return {
            name: {
                "x": float(part[-1, 0]),
                "y": float(part[-1, 1]),
                "yaw": float(part[-1, 2]),
                "along_track": float(part[-1, :2] @ ahead),
                "cross_track": float(part[-1, :2] @ left),
                "position_share": float(part[-1, :2] @ total[:2]) / length**2 if shared else None,
                "yaw_share": float(part[-1, 2] / total[2]) if yaw_shared else None,
            }
            for name, part in self.parts.items()
        }


def error_budget(recording: Recording) -> ErrorBudget:
    """Splits a recording's pose error; needs nothing else, for the recording tells its robot.

    The reference pose follows the commanded twist. Replacing, one after the other, the twist by that of the commanded
    wheel speeds (only where feedback of the pose changes these), of the wheels' measured speeds, of their true speeds,
    of the robot with its injected errors, of the contacts that it really had (`WheelContact.drive_W`,
    `rolling_radius`), and of these with their slip leads step by step to the simulated pose. The difference that each
    step makes at the end of the integration is a part; so the parts add up to the pose error.

    Raises:
        ResourceError: the recording lacks columns or the description of its robot.
    """
    robot, injected, rollers = _robots(recording)
    _require_columns(recording)
    dt = np.diff(recording.time)[:, np.newaxis]
    stages: dict[str, Array] = {"reference": _steps(recording.reference_q_xyt)}
    kinematics = WheelKinematics(robot, rollers=rollers)
    measured, speeds = (_driven(recording, robot, column)[1:] for column in ("measured", "speed"))
    angles = recording.wheels("swivel")[:-1]
    if recording.metadata.get("feedback"):
        stages["feedback"] = dt * _forward(kinematics, _driven(recording, robot, "command")[:-1], angles)
    stages["servo"] = dt * _forward(kinematics, measured, angles)
    if recording.metadata.get("drivetrain"):
        stages["drivetrain"] = dt * _forward(kinematics, speeds, angles)
    for name, changed in injected.items():
        kinematics = WheelKinematics(changed, rollers=rollers)
        stages[name] = dt * _forward(kinematics, speeds, angles)
    without, with_slip = _contact_twists(recording, kinematics.robot, speeds)
    stages["geometry"], stages["slip"] = dt * without, dt * with_slip
    stages["rest"] = _steps(recording.q_xyt)
    start = recording.reference_q_xyt[0]
    poses = {name: accumulate(start, steps) for name, steps in stages.items()}
    names = list(poses)
    parts = {now: poses[now] - poses[before] for before, now in itertools.pairwise(names)}
    # The robot may rest a hair beside the start of the reference.
    parts["rest"] = parts["rest"] + (recording.q_xyt[0] - start)
    return ErrorBudget(time=recording.time, parts=parts, direction=last_direction(recording))


def _robots(recording: Recording) -> tuple[Robot, dict[str, Robot], Literal["textbook", "finite"]]:
    """The robot as the controller knows it, with injected errors one after the other, and the kind of its rollers."""
    if "legs" in recording.metadata:
        raise ResourceError(
            "the recording is of a robot on legs, whose error has no budget; accepted: robots on wheels"
        )
    try:
        robot = Robot.model_validate(recording.metadata["robot_description"])
        injected = {name: Robot.model_validate(data) for name, data in recording.metadata["injected"].items()}
        return robot, injected, recording.metadata["rollers"]
    except (KeyError, ValidationError) as error:
        raise ResourceError(f"the recording does not tell its robot, so its error has no budget: {error}") from error


def _require_columns(recording: Recording) -> None:
    needed = [f"{wheel}.{column}" for wheel in recording.wheel_names for column in (*CONTACT, "speed", "measured")]
    missing = [name for name in needed if name not in recording.columns]
    if missing:
        raise ResourceError(f"the recording lacks {', '.join(missing[:3])} and so has no error budget: run it again")
    if not len(recording.time):
        raise ResourceError("the recording has no samples, so its error has no budget")


def _driven(recording: Recording, robot: Robot, column: str) -> Array:
    return np.column_stack([recording.columns[f"{wheel.name}.{column}"] for wheel in robot.driven_wheels])


def _forward(kinematics: WheelKinematics, speeds: Array, angles: Array) -> Array:
    """Twists (n, 3) of wheel speeds (n, n_driven), at the angles (n, n_wheels) of steered wheels."""
    if kinematics.robot.steered_wheels:
        return kinematics.forward_at(speeds, angles)
    return kinematics.forward(speeds)


def _steps(q_xyt: Array) -> Array:
    """Body displacements (n - 1, 3) from pose to pose."""
    return displacement(q_xyt[:-1], q_xyt[1:])


def _contact_twists(recording: Recording, robot: Robot, speeds: Array) -> tuple[Array, Array]:
    """Twists (n - 1, 3) of the wheel speeds by the equations of the contacts: without slip, and with it.

    The rows are those of `WheelKinematics.forward` at the place, along the direction and with the rolling radius that
    each contact had, solved by least squares with the load as weight. With the slip they contradict each other no more.
    """
    rows, rolling, slipping, depths = [], [], [], []
    driven = [wheel.name for wheel in robot.driven_wheels]
    for wheel in robot.wheels:
        get = {name: recording.columns[f"{wheel.name}.{name}"][:-1] for name in CONTACT}
        drive = np.column_stack([get["drive_x"], get["drive_y"]])
        slip = np.column_stack([get["slip_x"], get["slip_y"]])
        place = np.column_stack([get["contact_x"], get["contact_y"]])
        if wheel.driven:
            turned = speeds[:, driven.index(wheel.name)] * get["rolling_radius"]
            rows.append(_row(drive, place) / wheel.radius)
            rolling.append(turned / wheel.radius)
            slipping.append(np.sum(drive * slip, axis=1) / wheel.radius)
            depths.append(get["depth"])
        if wheel.ring is None and wheel.swivel_offset == 0:
            side = np.column_stack([-drive[:, 1], drive[:, 0]])
            rows.append(_row(side, place))
            rolling.append(np.zeros(len(side)))
            slipping.append(np.sum(side * slip, axis=1))
            depths.append(get["depth"])
    # A wheel holds the ground as its load does, to which the depth is proportional; in the air it says nothing, unless
    # the other wheels alone do not determine the twist.
    weights = np.sqrt(np.maximum(0.0, np.stack(depths, axis=1)))
    weights /= np.maximum(np.max(weights, axis=1, keepdims=True), np.finfo(float).tiny)
    matrix = np.stack(rows, axis=1)
    undetermined = np.linalg.matrix_rank(matrix * weights[..., np.newaxis], tol=1e-3) < matrix.shape[-1]
    weights[undetermined] = 1.0
    inverse = np.linalg.pinv(matrix * weights[..., np.newaxis]) * weights[:, np.newaxis]
    without, slip_alone = (np.einsum("nij,nj->ni", inverse, np.column_stack(right)) for right in (rolling, slipping))
    return without, without + slip_alone


def _row(direction: Array, place: Array) -> Array:
    """Rows (n, 3) [d_x, d_y, x d_y - y d_x] of directions (n, 2) at places (n, 2)."""
    x, y = place.T
    return np.column_stack([direction, x * direction[:, 1] - y * direction[:, 0]])
