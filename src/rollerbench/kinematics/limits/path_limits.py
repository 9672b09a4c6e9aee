"""Which accelerations and speeds along a path the limits of a robot allow.

At a point of a path with the twist v = b s' and c = db/ds, all that the wheels have to do is affine in u = s'' and
x = s'^2 (see `contact_forces`), so the pairs (u, x) within the limits form a convex set: between the largest speed and
u = 0 at rest, from a largest braking to a largest acceleration at each x.

Source: Verscheure et al. (2009), Time-optimal path tracking for robots: a convex optimization approach, section III.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.errors import InfeasibleTwist, KinematicsError
from rollerbench.kinematics.limits.cone_program import Cones, maximize, section
from rollerbench.kinematics.limits.contact_forces import Affine, ContactForces
from rollerbench.kinematics.limits.efforts import least_norm
from rollerbench.kinematics.limits.force_limits import friction_coefficients, joined, limit_cones, with_rates
from rollerbench.kinematics.limits.result import CAUSES
from rollerbench.kinematics.limits.speed import speed_rows

Array = NDArray[np.float64]
Sharing = Literal["least_norm", "best"]

LEVELS = 16
"""Steps from rest to the largest speed between which the set of (u, x) is taken as a polygon, from inside."""

INSIDE = 1e-4
"""How far below the tip of the set its highest level lies [-]."""

OPEN = 1e-9
"""Singular values and residuals below this count as zero, of equations scaled to 1."""

SLIGHT = 1e-100
"""Numbers below this count as no larger or smaller than it, so that their squares remain numbers."""

WORST = 100.0
"""Usage that is not told from larger ones [-]."""


class PathLimits:
    """The limits of a robot at points of a path.

    Attributes:
        robot: The robot.
        b: Twists (d, 3) per unit of the way.
        c: Their change per unit of the way (d, 3).
        kinds: What may limit: "speed", "steering", "adhesion", "lift-off" (the share of a wheel's load at rest that is
            gone), "effort", "wheel_acceleration".
    """

    def __init__(
        self,
        robot: Robot,
        b: Array,
        c: Array,
        *,
        margin: float = 1.0,
        sharing: Sharing = "least_norm",
        ground_friction: float | None = None,
        roll_resistance: float = 0.0,
        wheel_acceleration: float | None = None,
    ) -> None:
        """Prepares the equations.

        Args:
            robot: The robot.
            b: Twists (d, 3) per unit of the way, not 0.
            c: Their change per unit of the way (d, 3).
            margin: Share of each limit that may be used [-]; wheels keep 1 - margin of their load at rest.
            sharing: As in `max_acceleration`.
            ground_friction: As in `max_acceleration`.
            roll_resistance: As in `max_acceleration`.
            wheel_acceleration: Largest rate of the wheel speeds [rad/s2]; None for no limit.

        Raises:
            InfeasibleTwist: a fixed tyre would skid.
            KinematicsError: the driven wheels cannot push along the path.
        """
        self.robot, self.b, self.c, self._margin = robot, b, c, margin
        self._model = ContactForces(robot, b, roll_resistance, None, bend=c)
        _refuse_skids(self._model)
        x, able = least_norm(self._model) if sharing == "least_norm" else _balanced(self._model)
        if not able.all():
            raise KinematicsError(f"{robot.name} cannot follow the path: {CAUSES['drive']}")
        cones, _, kinds = limit_cones(self._model, friction_coefficients(robot, ground_friction), "circle")
        if wheel_acceleration is not None:
            cones, kinds = with_rates(self._model, wheel_acceleration, cones, kinds)
        self._force_kinds = kinds
        loads = self._model.loads
        # Of loads over those at rest; free forces do not change them.
        load = loads.constant + np.einsum("dwx,dx->dw", loads.slope, x.constant)
        change = np.einsum("dwx,dxk->dwk", loads.slope, x.slope)
        self._load_change = (change / np.where(load > 0, load, 1.0)[..., np.newaxis])[:, self._model.carrying]
        self._cones = Cones(
            constant=cones.constant + np.einsum("dmix,dx->dmi", cones.slope, x.constant),
            slope=np.einsum("dmix,dxk->dmik", cones.slope, x.slope),
        )

    @cached_property
    def speeds(self) -> dict[str, Array]:
        """Usages (d,) of limits per speed s', by kind."""
        found = {"speed": speed_usage(self.robot, self.b)}
        swivels = [w for w in self.robot.steered_wheels if getattr(w, "max_steering_speed", None) is not None]
        places = np.array([w.p_BoHo_B[:2] for w in swivels]).reshape(-1, 2)
        limits = np.array([getattr(w, "max_steering_speed", None) for w in swivels], dtype=np.float64)
        way, bend = _at(self.b, places), _at(self.c, places)
        turn = way[..., 0] * bend[..., 1] - way[..., 1] * bend[..., 0]
        found["steering"] = np.abs(turn) / np.maximum(np.sum(way**2, axis=-1), SLIGHT) / limits
        return {kind: usage.max(axis=1) for kind, usage in found.items() if usage.shape[1]}

    @property
    def kinds(self) -> tuple[str, ...]:
        """The limits that the robot has."""
        return (*self.speeds, *dict.fromkeys(self._force_kinds.tolist()), "lift-off")

    def ranges(self, cap: Array) -> tuple[Array, Array, Array]:
        """The set of (u, x) as a polygon, from inside.

        Args:
            cap: Squared speeds (d,) that are not exceeded anyway; finite.

        Returns:
            Levels x (d, LEVELS + 1), from 0 up; the smallest u there (d, LEVELS + 1), and the largest.

        Raises:
            KinematicsError: the robot cannot even creep along the path.
        """
        tops = [(self._margin / np.clip(usage, SLIGHT, 1 / SLIGHT)) ** 2 for usage in self.speeds.values()]
        cap = np.maximum(np.min([cap, *tops], axis=0), SLIGHT)
        # Lines and arcs are the same all along.
        data = np.column_stack([self.b, self.c, np.log(cap)])
        _, first, which = np.unique(np.round(data, 9), axis=0, return_index=True, return_inverse=True)
        cap, unit = cap[first], np.stack([np.full(len(first), GRAVITY), cap[first]], axis=-1)
        cones = self._scaled(first, unit)
        top = self._highest(cones)
        top = np.where(top < 1.0, (1.0 - INSIDE) * top, 1.0)
        levels = top[:, np.newaxis] * np.sin(np.linspace(0.0, 0.5 * np.pi, LEVELS + 1))
        low, high = self._extremes(cones, levels)
        return (levels * unit[:, 1:])[which], (low * GRAVITY)[which], (high * GRAVITY)[which]

    def usage(self, u: Array, x: Array) -> dict[str, Array]:
        """Shares (d,) of the limits that the accelerations u (d,) at squared speeds x (d,) take, by kind.

        Where forces can be shared in several ways they are such that the largest share is the smallest.
        """
        speed = np.sqrt(np.maximum(x, 0.0))
        found = {kind: per * speed for kind, per in self.speeds.items()}
        y = np.stack([u, x], axis=-1)
        w = self._cones.constant + np.einsum("dmik,dk->dmi", self._cones.slope[..., :2], y)
        if self._cones.slope.shape[-1] > 2:
            w = w + np.einsum("dmik,dk->dmi", self._cones.slope[..., 2:], self._fairest(w))
        size, room = np.hypot(w[..., 1], w[..., 2]), np.maximum(w[..., 0], np.finfo(float).tiny)
        shares = np.minimum(size / room, WORST)
        found |= {kind: shares[:, self._force_kinds == kind].max(axis=1) for kind in dict.fromkeys(self._force_kinds)}
        gone = -np.einsum("dwk,dk->dw", self._load_change[..., :2], y)
        return {str(kind): usage for kind, usage in found.items()} | {"lift-off": np.maximum(gone, 0.0).max(axis=1)}

    def _scaled(self, rows: NDArray[np.intp], unit: Array) -> Cones:
        """Cones at some points within the margin, over (u, x) in the units (d, 2)."""
        constant, slope = self._cones.constant[rows].copy(), self._cones.slope[rows].copy()
        slope[..., :2] *= unit[:, np.newaxis, np.newaxis]
        constant[..., 0] *= self._margin
        slope[..., 0, :] *= self._margin
        if self._margin == 1.0:
            # Adhesion keeps the loads from below 0 as it is.
            return Cones(constant=constant, slope=slope)
        change = self._load_change[rows].copy()
        change[..., :2] *= unit[:, np.newaxis]
        kept = Cones(constant=np.zeros((*change.shape[:2], 3)), slope=np.zeros((*change.shape[:2], 3, change.shape[2])))
        kept.constant[..., 0], kept.slope[..., 0, :] = self._margin, change
        return joined(Cones(constant=constant, slope=slope), kept)

    def _highest(self, cones: Cones) -> Array:
        """The largest x (d,) of the sets, up to 1."""
        count, size = cones.slope.shape[0], cones.slope.shape[-1]
        if size == 2:
            found = _bisected(lambda x: np.less_equal(*section(_at_level(cones, x), cones.slope[..., 0])), count)
        else:
            between = Cones(constant=np.zeros((count, 2, 3)), slope=np.zeros((count, 2, 3, size)))
            between.constant[:, :, 0] = [OPEN, 1.01]
            between.slope[:, :, 0, 1] = [1.0, -1.0]
            objective = np.zeros((count, size))
            objective[:, 1] = 1.0
            z, feasible = maximize(objective, joined(cones, between))
            found = np.where(feasible, np.minimum(z[:, 1], 1.0), 0.0)
        if not (found > OPEN).all():
            raise KinematicsError(f"{self.robot.name} cannot follow the path, however slowly")
        return found

    def _extremes(self, cones: Cones, levels: Array) -> tuple[Array, Array]:
        """The smallest and largest u (d, k) at levels x (d, k)."""
        count, depth = levels.shape
        constant = cones.constant[:, np.newaxis] + cones.slope[:, np.newaxis, ..., 1] * levels[..., None, None]
        if cones.slope.shape[-1] == 2:
            return section(constant, cones.slope[:, np.newaxis, ..., 0])
        others = np.delete(cones.slope, 1, axis=-1)
        both = (2, count, depth)
        constant = np.broadcast_to(constant, (*both, *constant.shape[2:])).reshape(-1, *constant.shape[2:])
        slope = np.broadcast_to(others[:, np.newaxis], (*both, *others.shape[1:])).reshape(-1, *others.shape[1:])
        objective = np.zeros((len(constant), others.shape[-1]))
        objective[:, 0] = np.repeat([-1.0, 1.0], count * depth)
        z, _ = maximize(objective, Cones(constant=constant, slope=slope))
        low, high = z[:, 0].reshape(both)
        return low, high

    def _fairest(self, w: Array) -> Array:
        """The free forces z (d, k) for which the largest |v| / s is smallest, with w = [s, v] at z = 0."""
        free = self._cones.slope[..., 2:]
        size = free.shape[-1]
        slope = np.zeros((*free.shape[:-1], 1 + size))
        slope[..., 1:, 1:] = free[..., 1:, :]
        slope[..., 0, 0] = np.maximum(w[..., 0], OPEN)
        constant = w.copy()
        constant[..., 0] = 0.0
        ceiling = Cones(constant=np.tile([WORST, 0.0, 0.0], (len(w), 1, 1)), slope=np.zeros((len(w), 1, 3, 1 + size)))
        ceiling.slope[:, 0, 0, 0] = -1.0
        objective = np.zeros((len(w), 1 + size))
        objective[:, 0] = -1.0
        z, _ = maximize(objective, joined(Cones(constant=constant, slope=slope), ceiling))
        return z[:, 1:]


def speed_usage(robot: Robot, v_xyw_B: Array) -> Array:
    """Speeds (d, k) of the driven wheels that have a max_speed over it, at twists (d, 3)."""
    rows = speed_rows(robot)
    driven = np.abs(v_xyw_B @ rows.rows.T) / rows.speeds
    steered = np.linalg.norm(_at(v_xyw_B, rows.places), axis=-1) / rows.steered_speeds
    return np.concatenate([driven, steered], axis=1)


def _refuse_skids(model: ContactForces) -> None:
    if model.skids.any():
        wheels = np.flatnonzero(model.skids.any(axis=0))
        names = tuple(model.robot.wheels[i].name for i in wheels)
        speeds = tuple(float(s) for s in np.abs(model.side_speeds[:, wheels]).max(axis=0))
        text = f"{model.robot.name} cannot follow the path: {CAUSES['tyres']} ({', '.join(names)})"
        raise InfeasibleTwist(f"{text}; accepted: paths that its tyres allow", names, speeds)


def _balanced(model: ContactForces) -> tuple[Affine, NDArray[np.bool_]]:
    """All unknowns (d, n_x) in balance, affine in (u, x) and in the forces that are free; and whether (d,) any are."""
    given, weight = model.accelerations, model.robot.mass * GRAVITY
    arm = float(np.max(np.abs(model.places))) or 1.0
    rows = 1.0 / np.array([1.0, 1.0, arm])
    matrix = model.balance.slope[..., given:] * rows[:, np.newaxis]
    wanted = np.concatenate([model.balance.constant[..., np.newaxis], model.balance.slope[..., :given]], axis=-1)
    wanted = -wanted * rows[:, np.newaxis]
    inverse = np.linalg.pinv(matrix, rcond=OPEN)
    forces = inverse @ wanted
    rank = int(np.linalg.matrix_rank(matrix, tol=OPEN).min())
    able = np.max(np.abs(matrix @ forces - wanted), axis=(1, 2)) < OPEN * weight
    free = np.swapaxes(np.linalg.svd(matrix)[2], 1, 2)[..., rank:] * weight
    constant, slope = np.zeros((len(matrix), model.size)), np.zeros((len(matrix), model.size, given + free.shape[-1]))
    constant[:, given:] = forces[..., 0]
    slope[:, range(given), range(given)] = 1.0
    slope[:, given:] = np.concatenate([forces[..., 1:], free], axis=-1)
    return Affine(constant=constant, slope=slope), able


def _at_level(cones: Cones, x: Array) -> Array:
    """Values (d, m, 3) of the cones at x (d,) and u = 0."""
    return cones.constant + cones.slope[..., 1] * x[:, np.newaxis, np.newaxis]


def _bisected(holds: Callable[[Array], NDArray[np.bool_]], count: int) -> Array:
    """The largest numbers (count,) in 0..1 up to which something holds."""
    low, high = np.zeros(count), np.ones(count)
    low[holds(high)] = 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        inside = holds(middle)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low


def _at(twist: Array, places: Array) -> Array:
    """Velocities (d, k, 2) of places (k, 2) at twists (d, 3)."""
    turn = np.column_stack([-places[:, 1], places[:, 0]])
    return twist[:, np.newaxis, :2] + twist[:, np.newaxis, 2:] * turn
