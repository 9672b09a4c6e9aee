"""The equations of motion of a base that accelerates along a straight line without slip.

Per direction u of travel, everything is an affine map of x = [a, F]: the acceleration a [m/s2] and the contact forces
F [N] that the equations of the single wheels leave open. A wheel at angle k with the roller axis e1 at the angle g
from its heading t, and e2 a quarter turn to the left of e1 (for a tyre e1 = t), feels the ground's force f1 e1 + f2 e2:

    hub       J_d q'' = T - R (f1 cos g - f2 sin g) - sgn(q') c N R,     R q'' = a (u.t + tan g u.n)
    roller    J_p v'  = -r^2 (f2 + sgn(v) c N),                          v' = a (u.n) / cos g
    body      sum f = m a u,     sum (p - com) x f = 0

with the effort T, the load N, the coefficient c of rolling resistance, radii R and r, and the rotational inertias
J_d of the wheel about its axle and J_p of the touching roller about its axis. The resisting moments act between hub and
body, and roller and hub. f1 is open for driven wheels, f2 for tyres whose axle the body or a steering motor holds; a
castor trails behind and feels nothing sideways. A wheel that stands still resists neither way.
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
    """constant (d, ...) + slope (d, ..., n_x) @ x, for d directions."""

    constant: Array
    slope: Array

    def at(self, x: Array) -> Array:
        """Its value (d, ...) at x (d, n_x)."""
        spread = x.reshape(len(x), *(1,) * (self.slope.ndim - 2), x.shape[1])
        return self.constant + np.sum(self.slope * spread, axis=-1)


class ContactForces:
    """What the wheels of a robot do when it accelerates along given directions; see the module.

    Attributes:
        robot: The robot.
        u: Directions (d, 2) in B.
        carrying: Which wheels (n_wheels,) carry the robot.
        unknowns: Wheel and axis (0 along e1, 1 along e2) of each open force F.
    """

    def __init__(self, robot: Robot, u: Array, roll_resistance: float, loads: Array | None) -> None:
        """Prepares the geometry.

        Args:
            robot: The robot.
            u: Unit vectors (d, 2) of travel.
            roll_resistance: Coefficient c [-].
            loads: Loads (n_wheels,) to take as constant [N]; None for those of equilibrium.
        """
        self.robot, self.u, self._c, self._given = robot, u, roll_resistance, loads
        wheels = robot.wheels
        self.carrying = supporting_wheels(robot) if loads is None else loads > 0
        self.unknowns = [
            (i, axis)
            for i, wheel in enumerate(wheels)
            for axis, is_open in enumerate((wheel.driven, wheel.ring is None and wheel.swivel_offset == 0))
            if is_open and self.carrying[i]
        ]
        travel = np.arctan2(u[:, 1], u[:, 0])[:, np.newaxis]
        heading, swivels = np.array([w.heading for w in wheels]), np.array([w.swivels for w in wheels])
        swivel = np.where(swivels, travel - heading, 0.0)
        along, left = wheel_rows(robot, np.zeros((len(wheels), 2)), swivel)
        self._t, self._n = along[..., :2], left[..., :2]
        self._slope = np.array([wheel.roller_slope for wheel in wheels])
        self._cos = 1.0 / np.hypot(1.0, self._slope)
        self._radius = np.array([wheel.radius for wheel in wheels])
        self._J_d = np.array([axle_inertia(wheel) for wheel in wheels])
        # J_p / r^2: the mass that a roller's spin adds across its axis; none for tyres.
        self._roller_mass = np.array([_roller_mass(wheel) for wheel in wheels])

    @property
    def size(self) -> int:
        """Number of unknowns x."""
        return 1 + len(self.unknowns)

    # Motion per unit of acceleration, or per unit of speed

    @cached_property
    def _surface(self) -> Array:
        """R q' (d, n_wheels) per speed of the body."""
        forward, aside = self._along(self._t), self._along(self._n)
        return _clean(forward + self._slope * aside)

    @cached_property
    def _rolling(self) -> Array:
        """Speed v (d, n_wheels) of the rollers per speed of the body; 0 for tyres."""
        has_rollers = np.array([wheel.ring is not None for wheel in self.robot.wheels])
        return _clean(np.where(has_rollers, self._along(self._n) / self._cos, 0.0))

    @cached_property
    def axes(self) -> Array:
        """e1 and e2 (d, n_wheels, 2, 2) in B; the last but one axis counts them."""
        cos, sin = self._cos[:, np.newaxis], (self._cos * self._slope)[:, np.newaxis]
        return np.stack([cos * self._t + sin * self._n, cos * self._n - sin * self._t], axis=-2)

    @cached_property
    def places(self) -> Array:
        """Contact points (d, n_wheels, 2) from the mass centre [m]; castors trail behind, and their mass with them."""
        wheels, mass = self.robot.wheels, self.robot.mass
        trail = np.array([wheel.swivel_offset for wheel in wheels])[:, np.newaxis]
        points = np.array([wheel.p_BoHo_B[:2] for wheel in wheels]) - trail * self.u[:, np.newaxis]
        hubs = np.array([hub_inertia(wheel).mass if wheel.swivel_offset else 0.0 for wheel in wheels])
        moved = points - np.array([wheel.center_B[:2] for wheel in wheels])
        com = self.robot.inertia.com[:2] + np.einsum("i,dij->dj", hubs, moved) / mass
        return points - com[:, np.newaxis]

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
        spin = (self._J_d * self._surface / self._radius)[..., np.newaxis] * self._t
        rollers = np.array([_roller_radius(wheel) for wheel in self.robot.wheels])
        spin = spin + (self._roller_mass * rollers * self._rolling)[..., np.newaxis] * self.axes[:, :, 1]
        moments = -self.robot.mass * height * self.u - spin.sum(axis=1)
        rest = spring_loads(self.places, self.carrying, np.array(self.robot.mass * GRAVITY), np.zeros(2))
        slope[..., 0] = spring_loads(self.places, self.carrying, np.array(0.0), moments)
        return Affine(constant=np.broadcast_to(rest, slope.shape[:-1]), slope=slope)

    @cached_property
    def forces(self) -> Affine:
        """Contact forces f1, f2 (d, n_wheels, 2) [N]."""
        drag, hub_drag = self._resistance(self._rolling), self._resistance(self._surface)
        constant = np.zeros((len(self.u), len(self.robot.wheels), 2))
        slope = np.zeros((*constant.shape, self.size))
        constant[..., 1] = -drag.constant
        slope[..., 1, :] = -drag.slope
        slope[..., 1, 0] -= self._roller_mass * self._rolling
        passive = np.array([not wheel.driven for wheel in self.robot.wheels])
        tan, cos = self._slope, self._cos
        constant[..., 0] = passive * (tan * constant[..., 1] - hub_drag.constant / cos)
        slope[..., 0, :] = passive[:, np.newaxis] * (
            tan[:, np.newaxis] * slope[..., 1, :] - hub_drag.slope / cos[:, np.newaxis]
        )
        slope[..., 0, 0] -= passive * self._J_d * self._surface / (self._radius**2 * cos)
        constant[:, ~self.carrying] = 0.0
        slope[:, ~self.carrying] = 0.0
        for column, (wheel, axis) in enumerate(self.unknowns, start=1):
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
        slope[..., 0] += self._J_d * self._surface / radius
        return Affine(constant=(radius * (push + drag.constant))[:, driven], slope=slope[:, driven])

    @cached_property
    def balance(self) -> Affine:
        """What must vanish (d, 3): force on the body less m a u [N], and moment about the mass centre [N m]."""
        arm = np.stack([-self.places[..., 1], self.places[..., 0]], axis=-1)
        turn = np.einsum("dnj,dnij->dni", arm, self.axes)
        rows = np.concatenate([self.axes, turn[..., np.newaxis]], axis=-1)
        slope = np.einsum("dnik,dnix->dkx", rows, self.forces.slope)
        slope[:, :2, 0] -= self.robot.mass * self.u
        return Affine(constant=np.einsum("dnik,dni->dk", rows, self.forces.constant), slope=slope)

    @cached_property
    def side_speeds(self) -> Array:
        """Sideways speeds (d, n_wheels) of the wheels per speed of the body."""
        return self._along(self._n)

    @cached_property
    def skids(self) -> NDArray[np.bool_]:
        """Whether (d, n_wheels) a fixed tyre would skid."""
        fixed = np.array([wheel.ring is None and not wheel.swivels for wheel in self.robot.wheels])
        return fixed & (np.abs(self.side_speeds) > STILL)

    def _along(self, axis: Array) -> Array:
        return np.einsum("dj,dnj->dn", self.u, axis)

    def _resistance(self, speed: Array) -> Affine:
        """sgn(speed) c N (d, n_wheels)."""
        pull = self._c * np.sign(speed)
        return Affine(constant=pull * self.loads.constant, slope=pull[..., np.newaxis] * self.loads.slope)


def _clean(speed: Array) -> Array:
    return np.where(np.abs(speed) <= STILL, 0.0, speed)


def _roller_radius(wheel: object) -> float:
    return wheel.rollers.radius if isinstance(wheel, RollerWheel) else 0.0


def _roller_mass(wheel: object) -> float:
    if not isinstance(wheel, RollerWheel):
        return 0.0
    return float(roller_inertia(wheel).moment[0, 0]) / wheel.rollers.radius**2
