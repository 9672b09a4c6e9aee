"""The equations of motion of a base that accelerates without slip, along a straight line or along any path.

The base moves at the twist v = b s', with b per unit of the way s. Everything is an affine map of x = [s'', F] on a
straight line without turning, and of x = [s'', s'^2, F] on a path whose b changes by db/ds = c: of the acceleration
[m/s2] and the contact forces F [N] that the equations of the single wheels leave open. A wheel with the
roller axis e1 at the angle g from its heading t, and e2 a quarter turn to the left of e1 (for a tyre e1 = t), feels the
ground's force f1 e1 + f2 e2. With row(t) @ v the speed of its reference point along t:

    hub       J_d q'' = T - R (f1 cos g - f2 sin g) - sgn(q') k N R,     R q'' = (row(t) + tan g row(n)) @ v'
    roller    J_p v_r' = -r^2 (f2 + sgn(v_r) k N),                       v_r' = row(n) @ v' / cos g
    body      sum f = m a_com,     sum (p - com) x f = I_com w'

where v' = b s'' + c s'^2 in B, and a_com = v'_xy + w x v_xy + w' x com - w^2 com. Here T is the effort, N the load, k
the coefficient of rolling resistance, R and r are radii, and J_d and J_p the rotational inertias of the wheel about its
axle and of the touching roller about its axis. The resisting moments act between hub and body, and roller and hub. f1
is open for driven wheels, f2 for tyres whose axle the body or a steering motor holds; a castor trails behind the way
of its swivel axis and feels nothing sideways; a steered tyre is steered along its way. What it costs to swivel them is
left out. A wheel that stands still resists neither way.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Robot
from rollerbench.description.inertia import GRAVITY
from rollerbench.description.mass import axle_inertia, hub_inertia, roller_inertia
from rollerbench.description.wheels import RollerWheel
from rollerbench.kinematics.limits.loads import spring_loads, supporting_wheels
from rollerbench.kinematics.rows import wheel_rows

Array = NDArray[np.float64]

STILL = 1e-9
"""Speed over that of the body under which a wheel or roller stands still [-]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Affine:
    """constant (d, ...) + slope (d, ..., n_x) @ x, for d motions."""

    constant: Array
    slope: Array

    def at(self, x: Array) -> Array:
        """Its value (d, ...) at x (d, n_x)."""
        spread = x.reshape(len(x), *(1,) * (self.slope.ndim - 2), x.shape[1])
        return self.constant + np.sum(self.slope * spread, axis=-1)


class ContactForces:
    """What the wheels of a robot do when it accelerates along given directions or paths; see the module.

    Attributes:
        robot: The robot.
        u: Velocities (d, 2) of Bo per unit of the way, in B.
        accelerations: Number of the unknowns before F: 1 for s'', or 2 for s'' and s'^2.
        carrying: Which wheels (n_wheels,) carry the robot.
        unknowns: Wheel and axis (0 along e1, 1 along e2) of each open force F.
    """

    def __init__(
        self, robot: Robot, u: Array, roll_resistance: float, loads: Array | None, bend: Array | None = None
    ) -> None:
        """Prepares the geometry.

        Args:
            robot: The robot.
            u: Unit vectors (d, 2) of travel; or with bend, twists b (d, 3) per unit of the way.
            roll_resistance: Coefficient k [-].
            loads: Loads (n_wheels,) to take as constant [N]; None for those of equilibrium.
            bend: How the twists b change along the way, c (d, 3); None for straight lines.
        """
        self.robot, self.u, self._c, self._given = robot, u[:, :2], roll_resistance, loads
        self._b = np.column_stack([self.u, u[:, 2] if u.shape[1] == 3 else np.zeros(len(u))])
        # v' per s'' and, on a path, per s'^2.
        self._rates = np.stack([self._b] if bend is None else [self._b, bend], axis=-1)
        self.accelerations = self._rates.shape[-1]
        wheels = robot.wheels
        self.carrying = supporting_wheels(robot) if loads is None else loads > 0
        self.unknowns = [
            (i, axis)
            for i, wheel in enumerate(wheels)
            for axis, is_open in enumerate((wheel.driven, wheel.ring is None and wheel.swivel_offset == 0))
            if is_open and self.carrying[i]
        ]
        places = np.array([wheel.p_BoHo_B[:2] for wheel in wheels])
        way = self.u[:, np.newaxis] + _turned(self._b[:, 2, np.newaxis, np.newaxis] * places)
        size = np.hypot(way[..., 0], way[..., 1])
        heading, swivels = np.array([w.heading for w in wheels]), np.array([w.swivels for w in wheels])
        moving = size > STILL
        travel = np.where(moving, np.arctan2(way[..., 1], way[..., 0]), heading)
        self._along_rows, self._left_rows = wheel_rows(robot, places, np.where(swivels, travel - heading, 0.0))
        self._travel = np.stack([np.cos(travel), np.sin(travel)], axis=-1)
        self._t, self._n = self._along_rows[..., :2], self._left_rows[..., :2]
        self._slope = np.array([wheel.roller_slope for wheel in wheels])
        self._cos = 1.0 / np.hypot(1.0, self._slope)
        self._radius = np.array([wheel.radius for wheel in wheels])
        self._J_d = np.array([axle_inertia(wheel) for wheel in wheels])
        # J_p / r^2: the mass that a roller's spin adds across its axis; none for tyres.
        self._roller_mass = np.array([_roller_mass(wheel) for wheel in wheels])
        self._roller_radius = np.array([_roller_radius(wheel) for wheel in wheels])

    @property
    def size(self) -> int:
        """Number of unknowns x."""
        return self.accelerations + len(self.unknowns)

    # Motion per unit of speed, and per unit of the accelerations

    @cached_property
    def _surface_rows(self) -> Array:
        """R q' (d, n_wheels, 3) per twist."""
        return self._along_rows + self._slope[:, np.newaxis] * self._left_rows

    @cached_property
    def _rolling_rows(self) -> Array:
        """Speed v_r (d, n_wheels, 3) of the rollers per twist; 0 for tyres."""
        has_rollers = np.array([wheel.ring is not None for wheel in self.robot.wheels])
        return self._left_rows * (has_rollers / self._cos)[:, np.newaxis]

    @cached_property
    def _surface(self) -> Array:
        """R q' (d, n_wheels) per speed."""
        return _clean(np.einsum("dnj,dj->dn", self._surface_rows, self._b))

    @cached_property
    def _rolling(self) -> Array:
        """Speed v_r (d, n_wheels) of the rollers per speed."""
        return _clean(np.einsum("dnj,dj->dn", self._rolling_rows, self._b))

    @cached_property
    def surface_rates(self) -> Array:
        """R q'' (d, n_wheels, accelerations) per acceleration."""
        return _clean(self._surface_rows @ self._rates)

    @cached_property
    def _rolling_rates(self) -> Array:
        """v_r' (d, n_wheels, accelerations) per acceleration."""
        return _clean(self._rolling_rows @ self._rates)

    @cached_property
    def _com_rates(self) -> Array:
        """Acceleration (d, 2, accelerations) of the mass centre per acceleration."""
        w_rate = self._rates[:, np.newaxis, 2]
        rates = self._rates[:, :2] + _turned(self._com)[..., np.newaxis] * w_rate
        if self.accelerations == 2:
            w = self._b[:, 2:]
            rates[..., 1] += w * (_turned(self.u) - w * self._com)
        return rates

    @cached_property
    def axes(self) -> Array:
        """e1 and e2 (d, n_wheels, 2, 2) in B; the last but one axis counts them."""
        cos, sin = self._cos[:, np.newaxis], (self._cos * self._slope)[:, np.newaxis]
        return np.stack([cos * self._t + sin * self._n, cos * self._n - sin * self._t], axis=-2)

    @cached_property
    def places(self) -> Array:
        """Contact points (d, n_wheels, 2) from the mass centre [m]; castors trail behind, and their mass with them."""
        return self._points - self._com[:, np.newaxis]

    @cached_property
    def _points(self) -> Array:
        """Contact points (d, n_wheels, 2) from Bo [m]."""
        trail = np.array([wheel.swivel_offset for wheel in self.robot.wheels])[:, np.newaxis]
        return np.array([wheel.p_BoHo_B[:2] for wheel in self.robot.wheels]) - trail * self._travel

    @cached_property
    def _com(self) -> Array:
        """Mass centre (d, 2) from Bo [m]."""
        wheels = self.robot.wheels
        hubs = np.array([hub_inertia(wheel).mass if wheel.swivel_offset else 0.0 for wheel in wheels])
        moved = self._points - np.array([wheel.center_B[:2] for wheel in wheels])
        return self.robot.inertia.com[:2] + np.einsum("i,dij->dj", hubs, moved) / self.robot.mass

    # Forces

    @cached_property
    def loads(self) -> Affine:
        """Loads N (d, n_wheels) [N]."""
        count = len(self.robot.wheels)
        slope = np.zeros((len(self.u), count, self.size))
        if self._given is not None:
            return Affine(constant=np.broadcast_to(self._given, (len(self.u), count)), slope=slope)
        inertia = self.robot.inertia
        height = inertia.com[2] - self.robot.ground_height
        # A wheel that rolls along d turns about z x d.
        of_hubs, of_rollers = self._J_d / self._radius, self._roller_mass * self._roller_radius
        per_hub, per_roller = of_hubs[:, np.newaxis] * self._t, of_rollers[:, np.newaxis] * self.axes[:, :, 1]
        spin = np.einsum("dnj,dnk->djk", per_hub, self.surface_rates)
        spin += np.einsum("dnj,dnk->djk", per_roller, self._rolling_rates)
        if self.accelerations == 2:
            momentum = np.einsum("dnj,dn->dj", per_hub, self._surface)
            momentum += np.einsum("dnj,dn->dj", per_roller, self._rolling)
            spin[..., 1] += self._b[:, 2:] * _turned(momentum)
        moments = -self.robot.mass * height * self._com_rates - spin
        rest = spring_loads(self.places, self.carrying, np.array(self.robot.mass * GRAVITY), np.zeros(2))
        for k in range(self.accelerations):
            slope[..., k] = spring_loads(self.places, self.carrying, np.array(0.0), moments[..., k])
        return Affine(constant=np.broadcast_to(rest, slope.shape[:-1]), slope=slope)

    @cached_property
    def forces(self) -> Affine:
        """Contact forces f1, f2 (d, n_wheels, 2) [N]."""
        drag, hub_drag, rates = self._resistance(self._rolling), self._resistance(self._surface), self.accelerations
        constant = np.zeros((len(self.u), len(self.robot.wheels), 2))
        slope = np.zeros((*constant.shape, self.size))
        constant[..., 1] = -drag.constant
        slope[..., 1, :] = -drag.slope
        slope[..., 1, :rates] -= self._roller_mass[:, np.newaxis] * self._rolling_rates
        passive = np.array([not wheel.driven for wheel in self.robot.wheels])
        tan, cos = self._slope, self._cos
        constant[..., 0] = passive * (tan * constant[..., 1] - hub_drag.constant / cos)
        slope[..., 0, :] = passive[:, np.newaxis] * (
            tan[:, np.newaxis] * slope[..., 1, :] - hub_drag.slope / cos[:, np.newaxis]
        )
        spin_up = passive * self._J_d / (self._radius**2 * cos)
        slope[..., 0, :rates] -= spin_up[:, np.newaxis] * self.surface_rates
        constant[:, ~self.carrying] = 0.0
        slope[:, ~self.carrying] = 0.0
        for column, (wheel, axis) in enumerate(self.unknowns, start=rates):
            slope[:, wheel, axis, column] = 1.0
        return Affine(constant=constant, slope=slope)

    @cached_property
    def efforts(self) -> Affine:
        """Efforts T (d, n_driven) [N m]."""
        driven = [i for i, wheel in enumerate(self.robot.wheels) if wheel.driven]
        drag, radius, cos = self._resistance(self._surface), self._radius, self._cos
        sin = cos * self._slope
        push = cos * self.forces.constant[..., 0] - sin * self.forces.constant[..., 1]
        slope = cos[:, np.newaxis] * self.forces.slope[..., 0, :] - sin[:, np.newaxis] * self.forces.slope[..., 1, :]
        slope = radius[:, np.newaxis] * (slope + drag.slope)
        slope[..., : self.accelerations] += (self._J_d / radius)[:, np.newaxis] * self.surface_rates
        return Affine(constant=(radius * (push + drag.constant))[:, driven], slope=slope[:, driven])

    @cached_property
    def balance(self) -> Affine:
        """What must vanish (d, 3): force on the body less m a_com [N], and moment about it less I_com w' [N m]."""
        arm = np.stack([-self.places[..., 1], self.places[..., 0]], axis=-1)
        turn = np.einsum("dnj,dnij->dni", arm, self.axes)
        rows = np.concatenate([self.axes, turn[..., np.newaxis]], axis=-1)
        slope = np.einsum("dnik,dnix->dkx", rows, self.forces.slope)
        rates = self.accelerations
        slope[:, :2, :rates] -= self.robot.mass * self._com_rates
        slope[:, 2, :rates] -= self.robot.inertia.moment[2, 2] * self._rates[:, 2]
        return Affine(constant=np.einsum("dnik,dni->dk", rows, self.forces.constant), slope=slope)

    @cached_property
    def side_speeds(self) -> Array:
        """Sideways speeds (d, n_wheels) of the wheels per speed."""
        return np.einsum("dnj,dj->dn", self._left_rows, self._b)

    @cached_property
    def skids(self) -> NDArray[np.bool_]:
        """Whether (d, n_wheels) a fixed tyre would skid."""
        fixed = np.array([wheel.ring is None and not wheel.swivels for wheel in self.robot.wheels])
        return fixed & (np.abs(self.side_speeds) > STILL)

    def _resistance(self, speed: Array) -> Affine:
        """sgn(speed) k N (d, n_wheels)."""
        pull = self._c * np.sign(speed)
        return Affine(constant=pull * self.loads.constant, slope=pull[..., np.newaxis] * self.loads.slope)


def _clean(speed: Array) -> Array:
    return np.where(np.abs(speed) <= STILL, 0.0, speed)


def _turned(vector: Array) -> Array:
    """Vectors (..., 2), a quarter turn to the left."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def _roller_radius(wheel: object) -> float:
    return wheel.rollers.radius if isinstance(wheel, RollerWheel) else 0.0


def _roller_mass(wheel: object) -> float:
    if not isinstance(wheel, RollerWheel):
        return 0.0
    return float(roller_inertia(wheel).moment[0, 0]) / wheel.rollers.radius**2
