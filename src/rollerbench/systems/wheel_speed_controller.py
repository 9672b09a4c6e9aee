"""A motor controller as a Drake System: torques from the errors of wheel speeds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydrake import symbolic
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import Multiplexer

from rollerbench.description import Robot, load_robot
from rollerbench.description.mass import axle_inertia
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.given import positive_time
from rollerbench.systems.symbolic_block import symbolic_block

LAG = 0.02
"""Time constant of the default gains [s], on robots whose wheels are not too light for it."""

INTEGRAL_TIME = 4.0
"""Integral time of the default gains, over their time constant [-]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PidGains:
    """Gains of a wheel's speed controller.

    Attributes:
        kp: Torque over the speed error [N m s/rad].
        ki: Torque over the integral of the speed error [N m/rad].
        kd: Torque over the rate of the speed [N m s2/rad].
    """

    kp: float
    ki: float
    kd: float = 0.0


def wheel_speed_gains(robot: Robot, time_step: float) -> list[PidGains]:
    """Gains (n_driven) that suit a robot and a sampling time.

    With the share J = m R^2 / n + J_w of the robot's inertia at a driven wheel, kp = J / tau makes up a speed error in
    the time tau, and ki = kp / (4 tau). tau is as long as it takes that a wheel which slips, and so has only its own
    inertia J_w, stays stable: kp time_step <= J_w.

    Args:
        robot: The robot.
        time_step: Period of the controller's updates [s].
    """
    gains = []
    for wheel in robot.driven_wheels:
        own = axle_inertia(wheel)
        share = robot.mass * wheel.radius**2 / len(robot.driven_wheels) + own
        tau = max(LAG, share * time_step / own)
        gains.append(PidGains(kp=share / tau, ki=share / (INTEGRAL_TIME * tau**2)))
    return gains


class WheelSpeedController(Diagram):
    """PID control of wheel speeds by explicit torques, with the motors' limits and anti-windup.

    Once a time step dt, with the speed error e = command - speed, and the speed one step before:

        wanted = kp e + i - kd (speed - speed before) / dt
        torque = clip(wanted, -max_effort, max_effort)
        i_next = i + dt ki e + min(1, dt ki / kp) (torque - wanted)

    so the integral i [N m] does not grow against a limit (back-calculation with the tracking time kp / ki, dt at least)
    and damping the rate of the speed, not that of the error, gives no kick at a step of the command.

    Input ports:
        wheel_speed_command (n_driven): in the order of robot.yaml [rad/s].
        wheel_speeds (n_driven): measured [rad/s].
    Output ports:
        wheel_efforts (n_driven): torques at the wheels [N m].

    Source: Astrom and Haegglund (2006), Advanced PID control, sections 3.4 and 3.5.
    """

    def __init__(
        self,
        robot: Robot | str | Path | Mapping[str, Any],
        time_step: float,
        gains: Sequence[PidGains] | None = None,
    ) -> None:
        """Builds the diagram.

        Args:
            robot: Robot, name of a shipped one, or path to a robot.yaml.
            time_step: Period of the updates: the plant's [s].
            gains: Gains (n_driven); by default those of `wheel_speed_gains`.

        Raises:
            KinematicsError: time_step is not positive, a gain is negative or not finite, ki comes without kp, or their
                number is not that of the driven wheels.
        """
        super().__init__()
        positive_time("time_step", time_step)
        robot = load_robot(robot)
        wheels = robot.driven_wheels
        gains = wheel_speed_gains(robot, time_step) if gains is None else list(gains)
        if not wheels or len(gains) != len(wheels):
            raise KinematicsError(f"gains: {len(gains)} for {len(wheels)} driven wheels; accepted: one for each")
        for wheel, gain in zip(wheels, gains, strict=True):
            values = (gain.kp, gain.ki, gain.kd)
            if not all(math.isfinite(value) and value >= 0 for value in values) or (gain.ki and not gain.kp):
                raise KinematicsError(f"gains of {wheel.name}: {gain}: accepted: 0 or more, and ki only with kp")
        limits = [wheel.max_effort for wheel in wheels]
        builder = DiagramBuilder()
        both = builder.AddNamedSystem("inputs", Multiplexer([len(wheels), len(wheels)]))
        pid = builder.AddNamedSystem("pid", _pid(gains, limits, time_step))
        builder.Connect(both.get_output_port(), pid.get_input_port())
        builder.ExportInput(both.get_input_port(0), "wheel_speed_command")
        builder.ExportInput(both.get_input_port(1), "wheel_speeds")
        builder.ExportOutput(pid.get_output_port(), "wheel_efforts")
        builder.BuildInto(self)


def _pid(gains: Sequence[PidGains], limits: Sequence[float | None], time_step: float) -> System:
    """From [commands; speeds] to torques; its state is [integrals; speeds before]."""
    n = len(gains)
    commands, speeds, integrals, before = (
        [Variable(f"{name}_{index}") for index in range(n)] for name in ("command", "speed", "integral", "before")
    )
    torques, steps = [], []
    for gain, limit, command, speed, integral, last in zip(
        gains, limits, commands, speeds, integrals, before, strict=True
    ):
        error = command - speed
        wanted = gain.kp * error + integral - gain.kd * (speed - last) / time_step
        torque = wanted if limit is None else symbolic.max(symbolic.min(wanted, limit), -limit)
        torques.append(torque)
        back = min(1.0, time_step * gain.ki / gain.kp) if gain.kp else 0.0
        steps.append(integral + time_step * gain.ki * error + back * (torque - wanted))
    return symbolic_block(
        state=[*integrals, *before],
        input=[*commands, *speeds],
        dynamics=[*steps, *(Expression(speed) for speed in speeds)],
        output=torques,
        time_period=time_step,
    )
