"""Rigid-body dynamics of a base whose wheels roll without slip on level ground."""

import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rollerbench.description.mass import axle_inertia, roller_inertia
from rollerbench.description.wheels import RollerWheel
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.limits import wheel_loads
from rollerbench.kinematics.mobility import null_space
from rollerbench.kinematics.profile import Profile
from rollerbench.kinematics.wheels import WheelKinematics

Array = NDArray[np.float64]

SLOW = 1e-3
"""Speed below which rolling resistance falls off [m/s]: a tanh instead of a sign."""


class RollingDynamics:
    """How a base accelerates under the torques of its wheels.

    With the twist v, the drive matrix J, the tyres' constraint C v = 0 and its multipliers l,

        M v' + b(v) = J^T tau - d(v) - D v + C^T l

    where M is the inertia of the robot about Bo and that of its turning wheels and touching rollers; b = [-w p_y,
    w p_x, v_x p_y - v_y p_x] with the linear momentum p comes from the turning of B; and d is rolling resistance:
    f N_i along the rolling of each wheel and of the roller on which it stands, under its static load N_i. D comes from
    the damping of these rollers' bearings. Castors trail behind: they resist along the way of their swivel axis, and
    their turning counts there as a mass J / R^2. What the equations leave out: each roller has to be spun up as it
    touches the ground, which costs Mecanum wheels some percent of their drive.

    Attributes:
        kinematics: The equations of the wheels.
        roll_resistance: Rolling resistance over load f [-].
    """

    def __init__(self, kinematics: WheelKinematics, roll_resistance: float = 0.0) -> None:
        """Prepares the matrices.

        Args:
            kinematics: The equations of the wheels.
            roll_resistance: Rolling resistance over load [-].
        """
        self.kinematics, self.roll_resistance = kinematics, roll_resistance

    @cached_property
    def static_loads(self) -> Array:
        """Loads (n_wheels,) at rest [N], castors behind (`limits.wheel_loads`)."""
        return wheel_loads(self.kinematics.robot, 0.0, 0.0)

    @cached_property
    def mass_matrix(self) -> Array:
        """M (3, 3) for twists [kg, kg m, kg m2]."""
        rows, masses, _ = self._rolling
        matrix = self._body + rows.T @ (masses[:, np.newaxis] * rows)
        for (x, y), mass, _ in self._castors:
            at_castor = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
            matrix += mass * at_castor.T @ at_castor
        return matrix

    def acceleration(self, v_xyw_B: ArrayLike, wheel_efforts: ArrayLike, slow: float = SLOW) -> Array:
        """Rate of the twist (..., 3) [m/s2, m/s2, rad/s2] under torques (..., n_driven) at the wheels [N m].

        Args:
            v_xyw_B: Feasible twists (..., 3) [m/s, m/s, rad/s].
            wheel_efforts: Torques [N m], positive where they drive forward.
            slow: Speed below which rolling resistance falls off [m/s].
        """
        v, efforts = np.asarray(v_xyw_B, np.float64), np.asarray(wheel_efforts, np.float64)
        px, py = np.moveaxis(v @ self._body[:2].T, -1, 0)
        w = v[..., 2]
        bias = np.stack([-w * py, w * px, v[..., 0] * py - v[..., 1] * px], axis=-1)
        rows, _, drags = self._rolling
        drag = (drags * np.tanh(v @ rows.T / slow)) @ rows
        for (x, y), _, size in self._castors:
            vx, vy = v[..., 0] - w * y, v[..., 1] + w * x
            share = size * np.tanh(np.hypot(vx, vy) / slow) / np.maximum(np.hypot(vx, vy), np.finfo(float).tiny)
            drag = drag + np.stack([share * vx, share * vy, share * (x * vy - y * vx)], axis=-1)
        force = efforts @ self.kinematics.drive_matrix - drag - v @ self._damping - bias
        free = self._free
        rates: Array = force @ free @ np.linalg.inv(free.T @ self.mass_matrix @ free) @ free.T
        return rates

    def twist(self, wheel_efforts: Profile, duration: float, time_step: float) -> Profile:
        """The twist (3) over time that torques (n_driven) over time lead to from rest, by the Runge-Kutta method.

        Rolling resistance falls off as far from rest as the time step needs for a stable integration.

        Raises:
            KinematicsError: the torques spin the base so fast that the time step cannot follow.
        """
        rows, _, drags = self._rolling
        rates = np.linalg.eigvals(np.linalg.inv(self.mass_matrix) @ rows.T @ (drags[:, np.newaxis] * rows))
        slow = max(SLOW, 0.5 * time_step * float(np.max(rates.real, initial=0.0)))
        times = np.linspace(0.0, duration, max(2, math.ceil(duration / time_step) + 1))
        values = np.zeros((len(times), 3))
        slopes = np.zeros_like(values)
        efforts, between = wheel_efforts(times), wheel_efforts(0.5 * (times[1:] + times[:-1]))
        slopes[0] = self.acceleration(values[0], efforts[0], slow)
        with np.errstate(over="ignore", invalid="ignore"):
            for k, h in enumerate(np.diff(times)):
                k1 = slopes[k]
                k2 = self.acceleration(values[k] + 0.5 * h * k1, between[k], slow)
                k3 = self.acceleration(values[k] + 0.5 * h * k2, between[k], slow)
                k4 = self.acceleration(values[k] + h * k3, efforts[k + 1], slow)
                values[k + 1] = values[k] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                slopes[k + 1] = self.acceleration(values[k + 1], efforts[k + 1], slow)
        if not (np.isfinite(values).all() and np.isfinite(slopes).all()):
            raise KinematicsError(
                f"{self.kinematics.robot.name}: the torques spin the base faster than steps of {time_step:g} s can "
                "follow; accepted: smaller torques, a shorter duration, or a smaller plant.time_step"
            )
        return Profile(breaks=times, values=values, slopes=slopes)

    @cached_property
    def _body(self) -> Array:
        """Inertia (3, 3) of the robot as one rigid body about Bo."""
        inertia = self.kinematics.robot.inertia
        m, (x, y, _) = inertia.mass, inertia.com
        about_Bo = inertia.moment[2, 2] + m * (x * x + y * y)
        return np.array([[m, 0.0, -m * y], [0.0, m, m * x], [-m * y, m * x, about_Bo]])

    @cached_property
    def _rolling(self) -> tuple[Array, Array, Array]:
        """Of every wheel but castors, and of the roller under it: surface speeds (k, 3), masses I / r^2, and drags."""
        wheels, loads = self.kinematics.robot.wheels, self.static_loads
        held = [i for i, wheel in enumerate(wheels) if wheel.type != "castor"]
        with_rollers = [i for i, wheel in enumerate(wheels) if isinstance(wheel, RollerWheel)]
        rows = np.vstack([self.kinematics.rolling_matrix[held], self.kinematics.roller_matrix])
        masses = [axle_inertia(wheels[i]) / wheels[i].radius ** 2 for i in held]
        masses += [
            float(roller_inertia(wheel).moment[0, 0]) / wheel.rollers.radius**2
            for wheel in wheels
            if isinstance(wheel, RollerWheel)
        ]
        return rows, np.array(masses), self.roll_resistance * loads[[*held, *with_rollers]]

    @cached_property
    def _castors(self) -> list[tuple[Array, float, float]]:
        """Places (2,) of the castors' swivel axes [m], masses J / R^2 [kg], drags [N]."""
        return [
            (wheel.p_BoHo_B[:2], axle_inertia(wheel) / wheel.radius**2, self.roll_resistance * float(load))
            for wheel, load in zip(self.kinematics.robot.wheels, self.static_loads, strict=True)
            if wheel.type == "castor"
        ]

    @cached_property
    def _damping(self) -> Array:
        """D (3, 3) of the bearings of the rollers that touch the ground."""
        wheels = [wheel for wheel in self.kinematics.robot.wheels if isinstance(wheel, RollerWheel)]
        damping = np.array([wheel.rollers.damping / wheel.rollers.radius**2 for wheel in wheels])
        rows = self.kinematics.roller_matrix
        matrix: Array = rows.T @ (damping[:, np.newaxis] * rows)
        return matrix

    @cached_property
    def _free(self) -> Array:
        """Orthonormal basis (3, m) of the feasible twists."""
        return null_space(self.kinematics.constraint_matrix)
