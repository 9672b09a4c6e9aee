"""Kinematics of wheeled bases: one row equation for tyres, castors, omni and Mecanum wheels.

With the wheel at p = (x, y), rolling direction t at angle k from body x, axle n a quarter turn to its left, and
row(u) = [u_x, u_y, x u_y - y u_x], the velocity of the wheel's reference point along u is row(u) @ v_xyw_B. A wheel of
radius R turning at q' whose roller axis a makes the angle g with t (a tyre counts as g = 0) obeys

    R cos(g) q'      = row(a) @ v_xyw_B                      drive, as row(a) = cos(g) row(t) + sin(g) row(n)
    cos(g) v_roller  = row(n) @ v_xyw_B                      rollers
    0                = row(n) @ v_xyw_B                      fixed and steered tyres
    d (w + k')       = row(n) @ v_xyw_B                      castor of trail d

Source: Campion, Bastin, d'Andrea-Novel (1996), section II; Muir and Neuman (1987) for the rollers.
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description import Robot
from rollerbench.description.wheels import RollerWheel
from rollerbench.errors import InfeasibleTwist, KinematicsError
from rollerbench.kinematics.mobility import Mobility, degree_of_mobility, null_space
from rollerbench.kinematics.rows import finite_roller_slope, wheel_rows, wheeled

Array = NDArray[np.float64]
SKID_TOLERANCE = 1e-9
"""Sideways speed of a tyre that still counts as none, as a share of the twist's size [-]."""

STANDSTILL = 1e-9
"""Speed below which a steered wheel stands still [m/s]."""


class WheelKinematics:
    """What the wheels of a robot do when its body moves, and the other way round.

    Twists are v_xyw_B = [vx, vy, wz] of the reference point in B (m/s, m/s, rad/s; left and counter-clockwise
    positive). Wheel speeds [rad/s] are those of the driven wheels in the order of robot.yaml; positive drives towards
    +x of the wheel's heading. All functions broadcast over leading axes.

    Attributes:
        robot: The robot.
        p_BoCo_B: Reference point (2,) from Bo, in B [m].
        swivel_angles: Angle (n_wheels,) of every wheel about +z from its heading_deg [rad]; 0 if it cannot swivel.
        rollers: "textbook", or "finite" for the mean over a roller pitch (see `finite_roller_slope`).
    """

    def __init__(
        self,
        robot: Robot | str | Path | Mapping[str, Any],
        *,
        rollers: Literal["textbook", "finite"] = "textbook",
        p_BoCo_B: ArrayLike = (0.0, 0.0),
        swivel_angles: Mapping[str, float] | None = None,
    ) -> None:
        """Prepares the matrices.

        Args:
            robot: Robot, name of a shipped one, or path to a robot.yaml.
            rollers: Textbook rollers touch the ground under the wheel's centre; "finite" ones wander.
            p_BoCo_B: Reference point (2,) that twists refer to [m].
            swivel_angles: Angles from heading_deg by name of castors and steered wheels [rad]; 0 for those left out.

        Raises:
            KinematicsError: an argument does not fit the robot, or it stands on legs.
        """
        self.robot = wheeled(robot)
        if rollers not in ("textbook", "finite"):
            raise KinematicsError(f"rollers = {rollers!r}: accepted: 'textbook', 'finite'")
        self.rollers: Literal["textbook", "finite"] = rollers
        self.p_BoCo_B = _finite("p_BoCo_B", p_BoCo_B, 2)
        if self.p_BoCo_B.shape != (2,):
            raise KinematicsError(f"p_BoCo_B has shape {self.p_BoCo_B.shape}: accepted: (2,)")
        self.swivel_angles = _swivel_angles(self.robot, swivel_angles or {})

    # Matrices

    @cached_property
    def drive_matrix(self) -> Array:
        """J (n_driven, 3): wheel_speeds = J @ v_xyw_B. Columns [rad/m], [rad/m], [-]."""
        return self._drive_rows(*self._rows)

    @cached_property
    def constraint_matrix(self) -> Array:
        """C (m, 3): sideways speeds [m/s] of fixed and steered tyres, which must vanish: C @ v_xyw_B = 0."""
        return self._rows[1][self._tyre_indices]

    @cached_property
    def rolling_matrix(self) -> Array:
        """Surface speeds R q' (n_wheels, 3) of all wheels, driven or not: R q' = rolling_matrix @ v_xyw_B [m/s]."""
        along, left = self._rows
        slopes = np.array([[wheel.roller_slope] for wheel in self.robot.wheels])
        matrix: Array = along + slopes * left
        return matrix

    @cached_property
    def roller_matrix(self) -> Array:
        """G (k, 3): surface speeds of the touching rollers [m/s] = G @ v_xyw_B, one row for each wheel with rollers.

        Positive where the wheel's centre moves across the roller's axis towards +y of the wheel.
        """
        wheels = self.robot.wheels
        indices = [i for i, wheel in enumerate(wheels) if isinstance(wheel, RollerWheel)]
        stretch = np.array([math.hypot(1.0, wheels[i].roller_slope) for i in indices])
        return self._rows[1][indices] * stretch[:, np.newaxis]

    # Twist and wheel speeds

    def inverse(self, v_xyw_B: ArrayLike, *, strict: bool = True) -> Array:
        """Wheel speeds (..., n_driven) [rad/s] that move the body at v_xyw_B (..., 3).

        Raises:
            InfeasibleTwist: a tyre would skid (only if strict).
            KinematicsError: v_xyw_B is not finite or not of shape (..., 3).
        """
        v = _finite("v_xyw_B", v_xyw_B, 3)
        if strict:
            self.require_feasible(v)
        return v @ self.drive_matrix.T

    def forward(self, wheel_speeds: ArrayLike) -> Array:
        """Twist v_xyw_B (..., 3) of these wheel speeds (..., n_driven) [rad/s]: least squares of [J; C] v = [q'; 0].

        Raises:
            KinematicsError: the driven wheels and tyres do not determine the twist, or wheel_speeds is malformed.
        """
        q = _finite("wheel_speeds", wheel_speeds, len(self.drive_matrix))
        return q @ self.forward_matrix.T

    @cached_property
    def forward_matrix(self) -> Array:
        """Pseudo-inverse (3, n_driven) of [J; C] for wheel speeds: v_xyw_B = forward_matrix @ wheel_speeds.

        Raises:
            KinematicsError: the driven wheels and tyres do not determine the twist.
        """
        stacked = np.vstack([self.drive_matrix, self.constraint_matrix])
        scaled = stacked / self._scale
        if np.linalg.matrix_rank(scaled, tol=1e-9 * np.linalg.norm(scaled)) < 3:
            raise KinematicsError(
                f"{self.robot.name}: its driven wheels and tyres leave a motion of the body open, so wheel speeds do "
                "not determine the twist; accepted: robots with enough driven wheels (driven: true) or fixed tyres"
            )
        inverse = np.asarray(np.linalg.pinv(stacked), dtype=np.float64)
        return inverse[:, : len(self.drive_matrix)]

    def forward_at(self, wheel_speeds: ArrayLike, swivel_angles: ArrayLike) -> Array:
        """Twist v_xyw_B (..., 3) of wheel speeds (..., n_driven) [rad/s] while wheels steer.

        Args:
            wheel_speeds: Speeds of the driven wheels.
            swivel_angles: Angles (..., n_wheels) of all wheels from heading_deg [rad].
        """
        q = _finite("wheel_speeds", wheel_speeds, len(self.drive_matrix))
        angles = _finite("swivel_angles", swivel_angles, len(self.robot.wheels))
        along, left = wheel_rows(self.robot, self._positions, angles)
        stacked = np.concatenate([self._drive_rows(along, left), left[..., self._tyre_indices, :]], axis=-2)
        inverse = np.linalg.pinv(stacked)[..., : len(self.drive_matrix)]
        return np.einsum("...ij,...j->...i", inverse, q)

    def residual(self, wheel_speeds: ArrayLike) -> Array:
        """Part (..., n_driven) of the wheel speeds that no body motion explains [rad/s]: slip, or a wrong radius."""
        q = _finite("wheel_speeds", wheel_speeds, len(self.drive_matrix))
        return q - self.forward(q) @ self.drive_matrix.T

    # Feasibility

    def skid_speeds(self, v_xyw_B: ArrayLike) -> Array:
        """Sideways speeds (..., m) of the tyres at v_xyw_B (..., 3) [m/s]."""
        return _finite("v_xyw_B", v_xyw_B, 3) @ self.constraint_matrix.T

    def require_feasible(self, v_xyw_B: ArrayLike, wheels: Sequence[int] | None = None) -> None:
        """Checks that no tyre skids.

        Args:
            v_xyw_B: Twists (..., 3).
            wheels: Indices of the tyres to check; by default all.

        Raises:
            InfeasibleTwist: naming the tyres and how fast they would skid.
        """
        v = _finite("v_xyw_B", v_xyw_B, 3)
        tyres = self._tyre_indices if wheels is None else list(wheels)
        skid = v @ self._rows[1][tyres].T
        if not skid.size:
            return
        # Measured by the largest twist of a batch: at the ends of a ramp there is little but rounding.
        size = np.linalg.norm(v * self._scale, axis=-1).max(initial=0.0)
        flat = np.abs(skid).reshape(-1, skid.shape[-1])
        bad = (np.abs(skid) > SKID_TOLERANCE * size).reshape(flat.shape)
        if not bad.any():
            return
        worst = int(np.argmax(np.where(bad, flat, 0.0).max(axis=-1)))
        names = [self.robot.wheels[i].name for i, is_bad in zip(tyres, bad[worst], strict=True) if is_bad]
        speeds = skid.reshape(flat.shape)[worst][bad[worst]]
        twist = ", ".join(f"{x:.4g}" for x in v.reshape(-1, 3)[worst])
        skids = ", ".join(f"{name} at {speed:+.4g} m/s" for name, speed in zip(names, speeds, strict=True))
        raise InfeasibleTwist(
            f"{self.robot.name} cannot move at v_xyw_B = [{twist}]: its tyres would skid sideways ({skids}); "
            f"accepted: twists with C @ v_xyw_B = 0, that is combinations of {self._feasible_text(tyres)}",
            tuple(names),
            tuple(float(speed) for speed in speeds),
        )

    def project(self, v_xyw_B: ArrayLike, wheels: Sequence[int] | None = None) -> Array:
        """The closest twist (..., 3) at which no tyre skids; yaw rates count by the wheels' mean distance.

        Args:
            v_xyw_B: Twists (..., 3).
            wheels: Indices of the tyres that count; by default all.
        """
        v = _finite("v_xyw_B", v_xyw_B, 3) * self._scale
        tyres = self._tyre_indices if wheels is None else list(wheels)
        basis = null_space(self._rows[1][tyres] / self._scale)
        return (v @ basis @ basis.T) / self._scale

    # Steering

    def steering(self, v_xyw_B: ArrayLike, previous: ArrayLike | None = None) -> tuple[Array, Array]:
        """Angles and speeds of the steered wheels at v_xyw_B (..., 3).

        Args:
            v_xyw_B: Twists (..., 3).
            previous: Angles (..., n_steered) that the wheels have [rad]. If given, a wheel turns by a quarter turn at
                the most and drives backwards where that is shorter, and a wheel that need not move keeps its angle.

        Returns:
            steering_angles: (..., n_steered) from heading_deg [rad]; without previous in [-pi, pi], 0 at rest.
            wheel_speeds: (..., n_steered) [rad/s], as if each steered wheel were driven.
        """
        v = _finite("v_xyw_B", v_xyw_B, 3)
        indices = [i for i, wheel in enumerate(self.robot.wheels) if wheel.steered]
        heading = np.array([self.robot.wheels[i].heading for i in indices])
        radius = np.array([self.robot.wheels[i].radius for i in indices])
        x, y = self._positions[indices].T
        along = v[..., 0:1] - v[..., 2:3] * y
        left = v[..., 1:2] + v[..., 2:3] * x
        speed = np.hypot(along, left)
        size = np.linalg.norm(v * self._scale, axis=-1)[..., np.newaxis]
        still = speed <= np.maximum(SKID_TOLERANCE * size, STANDSTILL)
        angle = _wrap(np.arctan2(left, along) - heading)
        if previous is None:
            return np.where(still, 0.0, angle), speed / radius
        last = _finite("previous", previous, len(indices))
        turn = _wrap(angle - last)
        backwards = np.abs(turn) > 0.5 * np.pi
        turn = np.where(backwards, _wrap(turn - np.pi), turn)
        return np.where(still, last, last + turn), np.where(backwards, -speed, speed) / radius

    def castor_rates(self, v_xyw_B: ArrayLike) -> Array:
        """Swivel rates (..., n_castors) of the castors at v_xyw_B (..., 3) [rad/s], relative to the body."""
        v = _finite("v_xyw_B", v_xyw_B, 3)
        castors = [i for i, wheel in enumerate(self.robot.wheels) if wheel.swivel_offset > 0]
        trails = np.array([self.robot.wheels[i].swivel_offset for i in castors])
        return v @ self._rows[1][castors].T / trails - v[..., 2:3]

    # Measures

    def mobility(self) -> Mobility:
        """Degrees of mobility, steerability and manoeuvrability, whatever the present swivel angles."""
        fixed = [i for i in self._tyre_indices if not self.robot.wheels[i].swivels]
        steered = [i for i in self._tyre_indices if self.robot.wheels[i].swivels]
        return degree_of_mobility(self._rows[1][fixed] / self._scale, self._positions[steered] / self._scale[2])

    def icr(self, v_xyw_B: ArrayLike) -> Array:
        """Instantaneous centre of rotation p_CoICR_B (..., 2) from the reference point [m].

        In a translation it lies at infinity, perpendicular to the motion: the coordinates are +-inf or 0. At rest there
        is none: NaN.
        """
        v = _finite("v_xyw_B", v_xyw_B, 3)
        w = v[..., 2]
        numerator = np.stack([-v[..., 1], v[..., 0]], axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            center = numerator / w[..., np.newaxis]
        translating = (w == 0)[..., np.newaxis] & (numerator == 0)
        center = np.where(translating, 0.0, center)
        resting = (w == 0) & (numerator == 0).all(axis=-1)
        return np.where(resting[..., np.newaxis], np.nan, center)

    def condition_number(self, characteristic_length: float | None = None) -> float:
        """Ratio of the largest to the smallest singular value of J over the feasible twists [-]; 1 is isotropic.

        Args:
            characteristic_length: Length that makes yaw rates comparable with speeds [m]; by default the root mean
                square distance of the wheels from the reference point.

        Source: Salisbury and Craig (1982) for the measure, Angeles (2014) for the characteristic length.
        """
        scale = self._scale if characteristic_length is None else np.array([1.0, 1.0, characteristic_length])
        basis = null_space(self.constraint_matrix / scale)
        if not basis.size:
            return math.inf
        values = np.linalg.svd(self.drive_matrix / scale @ basis, compute_uv=False)
        rank_deficient = len(values) < basis.shape[1] or values[-1] < 1e-12 * values[0]
        return math.inf if rank_deficient else float(values[0] / values[-1])

    # The same robot, seen differently

    def at(self, p_BoCo_B: ArrayLike) -> "WheelKinematics":
        """The same robot with twists of another reference point, p_BoCo_B (2,) from Bo [m]."""
        return WheelKinematics(
            self.robot, rollers=self.rollers, p_BoCo_B=p_BoCo_B, swivel_angles=self._swivel_by_name()
        )

    def swivelled(self, swivel_angles: Mapping[str, float]) -> "WheelKinematics":
        """The same robot with other angles of some castors and steered wheels, by name [rad]."""
        return WheelKinematics(
            self.robot,
            rollers=self.rollers,
            p_BoCo_B=self.p_BoCo_B,
            swivel_angles={**self._swivel_by_name(), **swivel_angles},
        )

    @cached_property
    def _positions(self) -> Array:
        """Reference points (n_wheels, 2) of the wheels from the twists' reference point, in B [m]."""
        return np.array([wheel.p_BoHo_B[:2] for wheel in self.robot.wheels]) - self.p_BoCo_B

    @cached_property
    def _scale(self) -> Array:
        """Lengths (3,) that turn a twist into speeds: 1, 1 and the root mean square distance of the wheels [m]."""
        distance = math.sqrt(float(np.mean(np.sum(self._positions**2, axis=-1))))
        return np.array([1.0, 1.0, distance or 1.0])

    @cached_property
    def _tyre_indices(self) -> list[int]:
        """Wheels that must not skid sideways: tyres whose axle the body or a motor holds."""
        return [
            i
            for i, wheel in enumerate(self.robot.wheels)
            if not isinstance(wheel, RollerWheel) and wheel.swivel_offset == 0
        ]

    @cached_property
    def _rows(self) -> tuple[Array, Array]:
        """row(t) and row(n) (n_wheels, 3) of all wheels at their swivel angles."""
        return wheel_rows(self.robot, self._positions, self.swivel_angles)

    def _drive_rows(self, along: Array, left: Array) -> Array:
        """Drive rows (..., n_driven, 3) from row(t) and row(n) (..., n_wheels, 3)."""
        slope_of = finite_roller_slope if self.rollers == "finite" else (lambda wheel: wheel.roller_slope)
        driven = [i for i, wheel in enumerate(self.robot.wheels) if wheel.driven]
        slope = np.array([[slope_of(self.robot.wheels[i])] for i in driven]).reshape(-1, 1)
        radius = np.array([[self.robot.wheels[i].radius] for i in driven]).reshape(-1, 1)
        return (along[..., driven, :] + slope * left[..., driven, :]) / radius

    def _swivel_by_name(self) -> dict[str, float]:
        return {w.name: float(a) for w, a in zip(self.robot.wheels, self.swivel_angles, strict=True) if w.swivels}

    def _feasible_text(self, tyres: Sequence[int]) -> str:
        basis = null_space(self._rows[1][tyres] / self._scale) / self._scale[:, np.newaxis]
        if not basis.size:
            return "none: these tyres allow no motion as they look now"
        columns = [np.round(column / np.abs(column).max(), 12) for column in basis.T]
        return " and ".join("[" + ", ".join(f"{x:.3g}" for x in column + 0.0) + "]" for column in columns)


def _wrap(angle: Array) -> Array:
    """Angles [rad] brought into [-pi, pi]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _finite(name: str, value: ArrayLike, size: int) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != size:
        raise KinematicsError(f"{name} has shape {array.shape}: accepted: (..., {size})")
    if not np.isfinite(array).all():
        raise KinematicsError(f"{name} holds NaN or infinite values: accepted: finite numbers")
    return array


def _swivel_angles(robot: Robot, angles: Mapping[str, float]) -> Array:
    names = [wheel.name for wheel in robot.wheels if wheel.swivels]
    for name in angles:
        if name not in names:
            raise KinematicsError(
                f"swivel_angles[{name!r}]: {robot.name} has no such castor or steered wheel; accepted: {names}"
            )
    return np.array([float(angles.get(wheel.name, 0.0)) for wheel in robot.wheels])
