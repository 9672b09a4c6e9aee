"""A Drake System that keeps a commanded twist within what the wheels can do."""

from collections.abc import Sequence
from functools import reduce
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake import symbolic
from pydrake.symbolic import Expression, Variable, cos, sin, sqrt
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    LinearSystem,
    Multiplexer,
)

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.given import AnyRobot, kinematics_of
from rollerbench.kinematics.limits.result import finite
from rollerbench.kinematics.twist_limits import PerWheel, TwistLimits, twist_limits
from rollerbench.systems.symbolic_block import symbolic_block, variables

Array = NDArray[np.float64]
Symbols: TypeAlias = Sequence[Variable | Expression]
"""Lists: in arithmetic of arrays of Expressions, numpy warns of invalid values."""

TIE = 1e-12
"""By how much equal loads of wheels are told apart: Drake's derivative of a maximum is NaN where two are equal [-]."""

LARGEST_TURN = 0.5 * np.pi
"""Largest turn of a commanded displacement in one time step [rad]; at a full turn no twist would give it."""

REFINEMENTS = 3
"""Steps to the scale of a displacement; each makes the error smaller about by half the turn [rad]."""


class TwistLimiter(Diagram):
    """Scales a commanded twist, and follows its changes, as far as the speeds of the wheels may go.

    Once a time step dt, with the limits of `TwistLimits` on the wheels' speeds |A_i v|:

        target = command / max(1, max_i |A_i command| / speed_i)
        change = target - w
        w_next = w + change / max(1, max_i |A_i change| / (acceleration_i dt))
        v      = mean of the last N twists w, N >= 2 acceleration_i / (jerk_i dt)

    All components are scaled alike, so the direction of the twist stays, on the ways from and to rest too. The allowed
    twists are a convex set: straight lines and means stay in it, so speed, acceleration and jerk (as differences of the
    held twists) are never exceeded, whatever the command does. The mean is (N - 1) dt / 2 late: a direction that is
    fixed in the world comes out turned by what the body turns in that time.

    The command at a time t_k sets the output from t_k to t_k + dt, without direct feedthrough. What is updated at the
    same t_k, as a discrete plant of the same time step, still reads the output of the step before.

    A twist that is held drives an arc. With hold="displacement" the command times dt is instead the displacement of a
    step, in the axes of the body at its start. The target is the twist that drives there, log(k dt command) / dt, with
    the scale k <= 1 such that the wheels can: a saturated step, too, ends on the commanded chord, and turns by k of the
    commanded turn. That is exact where the output is the target; on the straight way from rest to it, with the share s
    of it, the chord is off by (1 - s) of half the turn. A step turns by a quarter turn at the most.

    Twists at which a tyre would skid are not refused, and steering rates are not limited. As a symbolic system, one
    for displacements takes numbers only: in variables its expressions would outgrow every memory.

    Input ports:
        v_xyw_B (3): commanded twist of the point C, or displacement of C over dt [m/s, m/s, rad/s].
        p_BoCo_B (2): position of C from Bo, in B [m]; only with p_BoCo_B="port".
    Output ports:
        v_xyw_B (3): limited twist of Bo, or of the reference point of the WheelKinematics given [m/s, m/s, rad/s].
    """

    _HELD = "held"
    _MEAN = "mean"

    def __init__(
        self,
        robot: AnyRobot,
        time_step: float,
        *,
        max_wheel_speed: PerWheel = None,
        max_wheel_acceleration: PerWheel = None,
        max_wheel_jerk: PerWheel = None,
        hold: Literal["twist", "displacement"] = "twist",
        p_BoCo_B: ArrayLike | Literal["port"] | None = None,
    ) -> None:
        """Builds the diagram; it starts at rest (see `set_twist`).

        Args:
            robot: The robot, or its kinematics.
            time_step: Period of the updates [s].
            max_wheel_speed: Instead of the robot's max_speed: a number for all driven wheels, or by name [rad/s].
            max_wheel_acceleration: Likewise; None for no limit [rad/s2].
            max_wheel_jerk: Likewise, of wheels with a limit of acceleration [rad/s3].
            hold: What the command holds for a time step: the "twist", or the direction of the "displacement".
            p_BoCo_B: The point C (2,) that commands refer to, the centre of a commanded rotation [m]; "port" for an
                input port; by default the reference point of the output.

        Raises:
            KinematicsError: an argument is malformed or does not fit the robot.
        """
        super().__init__()
        kinematics = kinematics_of(robot)
        self.limits: TwistLimits = twist_limits(
            kinematics,
            time_step,
            max_wheel_speed=max_wheel_speed,
            max_wheel_acceleration=max_wheel_acceleration,
            max_wheel_jerk=max_wheel_jerk,
        )
        if hold not in ("twist", "displacement"):
            raise KinematicsError(f"hold = {hold!r}: accepted: 'twist', 'displacement'")
        center = _center(kinematics.p_BoCo_B if p_BoCo_B is None else p_BoCo_B)
        targets = [_moved(kinematics.p_BoCo_B)]
        if hold == "displacement":
            targets = _displacement(self.limits, kinematics.p_BoCo_B, time_step)

        builder = DiagramBuilder()
        command = builder.AddNamedSystem("command", Multiplexer([3, 2]))
        builder.ExportInput(command.get_input_port(0), "v_xyw_B")
        if center is None:
            builder.ExportInput(command.get_input_port(1), "p_BoCo_B")
        else:
            source = builder.AddNamedSystem("center", ConstantVectorSource(center))
            builder.Connect(source.get_output_port(), command.get_input_port(1))
        output = command.get_output_port()
        for index, system in enumerate(targets):
            output = _append(builder, output, f"target_{index}", system)
        output = _append(builder, output, "speed", _speed(self.limits))
        output = _append(builder, output, self._HELD, _held(self.limits, time_step))
        if self.limits.samples > 1:
            output = _mean(builder, output, self._MEAN, self.limits.samples, time_step)
        builder.ExportOutput(output, "v_xyw_B")
        builder.BuildInto(self)

    def set_twist(self, context: Context, v_xyw_B: ArrayLike) -> None:
        """Sets the output (3,) in a context of this system, as if it had been constant for long.

        Raises:
            KinematicsError: v_xyw_B is malformed, or a wheel would turn faster than it may.
        """
        v = finite("v_xyw_B", v_xyw_B)
        if v.shape != (3,):
            raise KinematicsError(f"v_xyw_B has shape {v.shape}: accepted: (3,)")
        speeds = self.limits.wheel_speeds(v)
        for name, speed, largest in zip(self.limits.wheel_names, speeds, self.limits.speeds, strict=True):
            if speed > largest * (1 + 1e-9):
                raise KinematicsError(
                    f"v_xyw_B = {v.tolist()}: {name} would turn at {speed:.4g} rad/s; accepted: {largest:g} at most"
                )
        states = {self._HELD: v}
        if self.limits.samples > 1:
            states |= {f"{self._MEAN}_{axis}": np.full(self.limits.samples - 1, v[axis]) for axis in range(3)}
        for name, state in states.items():
            system = self.GetSubsystemByName(name)
            self.GetMutableSubsystemContext(system, context).SetDiscreteState(state)


def _center(p_BoCo_B: ArrayLike | Literal["port"]) -> Array | None:
    """The point C (2,), None for an input port."""
    if isinstance(p_BoCo_B, str) and p_BoCo_B == "port":
        return None
    center = finite("p_BoCo_B", p_BoCo_B)
    if center.shape != (2,):
        raise KinematicsError(f"p_BoCo_B has shape {center.shape}: accepted: (2,), or 'port'")
    return center


def _append(builder: DiagramBuilder, output: OutputPort, name: str, system: System) -> OutputPort:
    builder.AddNamedSystem(name, system)
    builder.Connect(output, system.get_input_port())
    return system.get_output_port()


def _moved(reference: Array) -> System:
    """From [twist of C; p_BoCo_B] to the twist of the reference point."""
    twist, center = variables("twist", 3), variables("center", 2)
    return symbolic_block(input=[*twist, *center], output=_at(reference, twist, center))


def _displacement(limits: TwistLimits, reference: Array, time_step: float) -> list[System]:
    """From [displacement of C over the time step; p_BoCo_B] to the twist of the reference point, in a chain.

    The load is max_i |A_i v(k)| / speed_i, and 1 at the k looked for. As load / k changes with the turn only, k / load
    comes closer to that in each step. If the load is still above 1, the last step goes below: k / load^2. So the scale
    may be too small, by what is left of the error, but the direction is exact. `_largest` gives squares of loads.
    """
    rate, center, scale = variables("rate", 3), variables("center", 2), Variable("scale")
    turn = np.zeros((1, 2, 3))
    turn[0, 0, 2] = time_step / LARGEST_TURN
    maps = np.concatenate([_finite_maps(limits.maps, limits.speeds), turn])
    straight = _largest(maps, _at(reference, rate, center), 1.0)
    twist = _at(reference, _logarithm(rate, scale, time_step), center)
    better = scale / sqrt(_largest(maps, twist, scale * scale))
    last = scale / _largest(maps, twist, 1.0)
    fixed = [*rate, *center]
    return [
        symbolic_block(input=fixed, output=_expressions([*fixed, 1 / sqrt(straight)])),
        *(
            symbolic_block(input=[*fixed, scale], output=_expressions([*fixed, expression]))
            for expression in [better] * REFINEMENTS + [last]
        ),
        symbolic_block(input=[*fixed, scale], output=twist),
    ]


def _speed(limits: TwistLimits) -> System:
    twist = variables("twist", 3)
    factor = sqrt(_largest(_finite_maps(limits.maps, limits.speeds), twist, 1.0))
    return symbolic_block(input=twist, output=[component / factor for component in twist])


def _held(limits: TwistLimits, time_step: float) -> System:
    """The state w, which approaches the target."""
    held, target = variables("held", 3), variables("target", 3)
    maps = _finite_maps(limits.maps, limits.speed_changes)
    changes = [there - here for here, there in zip(held, target, strict=True)]
    factor = sqrt(_largest(maps, changes, 1.0))
    nearer = [here + change / factor for here, change in zip(held, changes, strict=True)]
    return symbolic_block(
        state=held,
        input=target,
        dynamics=nearer if len(maps) else _expressions(target),
        output=_expressions(held),
        time_period=time_step,
    )


def _mean(builder: DiagramBuilder, output: OutputPort, name: str, samples: int, time_step: float) -> OutputPort:
    """Mean of the last samples, by itself for each component: a running sum would gather rounding errors."""
    size = samples - 1
    split = builder.AddNamedSystem(f"into_{name}", Demultiplexer(3))
    join = builder.AddNamedSystem(name, Multiplexer(3))
    builder.Connect(output, split.get_input_port())
    for axis in range(3):
        system = LinearSystem(
            A=np.eye(size, k=-1),
            B=np.eye(size, 1),
            C=np.full((1, size), 1 / samples),
            D=np.full((1, 1), 1 / samples),
            time_period=time_step,
        )
        builder.Connect(
            _append(builder, split.get_output_port(axis), f"{name}_{axis}", system), join.get_input_port(axis)
        )
    return join.get_output_port()


def _finite_maps(maps: Array, limits: Array) -> Array:
    """Maps (m, 2, 3) over their limits, of those that have one."""
    limited = np.isfinite(limits)
    return maps[limited] / limits[limited, np.newaxis, np.newaxis]


def _largest(maps: Array, twist: Symbols, least: float | Expression) -> Expression:
    """The largest of least and the squares |maps_i twist|^2: squares have derivatives at rest too."""
    squares = []
    for index, rows in enumerate(maps.tolist()):
        x, y = (sum((a * v for a, v in zip(row, twist, strict=True)), Expression(0.0)) for row in rows)
        squares.append((x * x + y * y) * (1 + TIE * (index + 1)))
    return symbolic.max(least, reduce(symbolic.max, squares)) if squares else Expression(0.0) + least


def _at(reference: Array, twist: Symbols, center: Symbols) -> list[Expression]:
    """Twist of the reference point from that of C."""
    vx, vy, wz = _expressions(twist)
    x, y = (at - of for at, of in zip(center, reference.tolist(), strict=True))
    return [vx + wz * y, vy - wz * x, wz]


def _logarithm(rate: Symbols, scale: Variable, time_step: float) -> list[Expression]:
    """Twist that drives scale time_step rate in a time step, in symbols: `odometry.displacement` from the origin."""
    vx, vy, wz = (scale * component for component in rate)
    half = 0.5 * time_step * wz
    # half / tan(half) without a branch: the tiny summand keeps it exact to the last bit, at half = 0 too.
    away = sqrt(half * half + 1e-24)
    along = away * cos(away) / sin(away)
    return [along * vx + half * vy, along * vy - half * vx, wz]


def _expressions(symbols: Symbols) -> list[Expression]:
    return [1.0 * symbol for symbol in symbols]
