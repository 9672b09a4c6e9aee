"""Imperfect gears, play and encoders between commands, wheels and measurements, as a Drake System."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake import symbolic
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import Multiplexer, SymbolicVectorSystem

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.drivetrain import WheelDrive


class Drivetrain(Diagram):
    """What stands between the commanded wheel speeds, the wheels' servos, and the measured wheel speeds.

    Once a time step dt, with the command u, the play b, the motor's lead g over its shaft in [-b/2, b/2], the shaft's
    angle s, and the wheel's angle Theta(s) (`WheelDrive.wheel_angle`):

        g_next = clip(g + u dt, -b/2, b/2)            the shaft stands while its motor crosses the play
        s_next = s + u dt - (g_next - g)
        servo = (Theta(s_next) - Theta(s)) / dt
        motor = inverse of Theta(wheel's angle) + g   where the motor is, seen at the wheel
        measured = (motor - motor before) / dt, each rounded to whole counts if there is an encoder

    Input ports:
        wheel_speed_command (n): commanded wheel speeds [rad/s].
        wheel_angles (n): true angles of the wheels from the start [rad].
    Output ports:
        servo_wheel_speeds (n): speeds at which the servos are to turn the wheels [rad/s].
        measured_wheel_speeds (n): what the encoders on the motors measure [rad/s]; without direct feedthrough from
            wheel_speed_command.
    """

    def __init__(self, drives: Sequence[WheelDrive], time_step: float) -> None:
        """Builds the diagram.

        Args:
            drives: Drivetrains of the n wheels.
            time_step: Period of the updates: the plant's [s].
        """
        super().__init__()
        if not (math.isfinite(time_step) and time_step > 0):
            raise KinematicsError(f"time_step = {time_step}: accepted: a positive number of seconds")
        n = len(drives)
        builder = DiagramBuilder()
        play = builder.AddNamedSystem("play", _play(drives, time_step))
        gear = builder.AddNamedSystem("gear", _gear(drives, time_step))
        encoder = builder.AddNamedSystem("encoder", _encoder(drives, time_step))
        ports = []
        for name, system in (("wheel_speed_command", gear), ("wheel_angles", encoder)):
            inputs = builder.AddNamedSystem(f"into_{system.get_name()}", Multiplexer([n, 2 * n]))
            builder.Connect(play.get_output_port(), inputs.get_input_port(1))
            builder.Connect(inputs.get_output_port(), system.get_input_port())
            ports.append(builder.ExportInput(inputs.get_input_port(0), name))
        builder.ConnectInput(ports[0], play.get_input_port())
        builder.ExportOutput(gear.get_output_port(), "servo_wheel_speeds")
        builder.ExportOutput(encoder.get_output_port(), "measured_wheel_speeds")
        builder.BuildInto(self)


def _play(drives: Sequence[WheelDrive], time_step: float) -> SymbolicVectorSystem:
    """From the commands to [leads g; shaft angles s]."""
    leads, shafts, commands = (_variables(name, len(drives)) for name in ("lead", "shaft", "command"))
    crossings = [_crossing(*each, time_step) for each in zip(drives, leads, commands, strict=True)]
    turns = [time_step * command - crossing for command, crossing in zip(commands, crossings, strict=True)]
    return SymbolicVectorSystem(
        state=[*leads, *shafts],
        input=commands,
        dynamics=[now + step for now, step in zip([*leads, *shafts], [*crossings, *turns], strict=True)],
        output=[Expression(variable) for variable in (*leads, *shafts)],
        time_period=time_step,
    )


def _gear(drives: Sequence[WheelDrive], time_step: float) -> SymbolicVectorSystem:
    """From [commands; leads; shaft angles] to the speeds of the servos."""
    commands, leads, shafts = (_variables(name, len(drives)) for name in ("command", "lead", "shaft"))
    speeds = []
    for drive, command, lead, shaft in zip(drives, commands, leads, shafts, strict=True):
        turn = time_step * command - _crossing(drive, lead, command, time_step)
        wave = _cosine(drive, shaft + turn) - _cosine(drive, shaft)
        speeds.append(((1 + drive.constant) * turn - drive.amplitude / drive.cycles * wave) / time_step)
    return SymbolicVectorSystem(input=[*commands, *leads, *shafts], output=speeds)


def _encoder(drives: Sequence[WheelDrive], time_step: float) -> SymbolicVectorSystem:
    """From [wheel angles; leads; shaft angles] to the measured speeds; its state is where the motors were."""
    before, angles, leads, shafts = (_variables(name, len(drives)) for name in ("before", "angle", "lead", "shaft"))
    dynamics, output = [], []
    for drive, last, angle, lead in zip(drives, before, angles, leads, strict=True):
        now = _shaft_angle(drive, angle) + lead
        dynamics.append(now)
        output.append((_counted(drive, now) - _counted(drive, last)) / time_step)
    inputs = [*angles, *leads, *shafts]
    return SymbolicVectorSystem(state=before, input=inputs, dynamics=dynamics, output=output, time_period=time_step)


def _crossing(drive: WheelDrive, lead: Variable, command: Variable, time_step: float) -> Expression:
    """g_next - g [rad]."""
    half = 0.5 * drive.backlash
    return symbolic.max(symbolic.min(lead + time_step * command, half), -half) - lead


def _shaft_angle(drive: WheelDrive, wheel_angle: Variable) -> Expression:
    """Inverse of `WheelDrive.wheel_angle` in symbols, by its fixed point; |amplitude| < 1 + constant contracts."""
    shaft = wheel_angle / (1 + drive.constant)
    for _ in range(drive.iterations):
        wave = drive.amplitude / drive.cycles * (_cosine(drive, shaft) - math.cos(drive.phase))
        shaft = (wheel_angle + wave) / (1 + drive.constant)
    return shaft


def _cosine(drive: WheelDrive, shaft: Expression) -> Expression:
    return symbolic.cos(drive.cycles * shaft + drive.phase)


def _counted(drive: WheelDrive, angle: Variable | Expression) -> Variable | Expression:
    """The angle in whole counts; the encoder starts in the middle of one."""
    if drive.counts is None:
        return angle
    count = 2 * np.pi / drive.counts
    return count * symbolic.floor(angle / count + 0.5)


def _variables(name: str, count: int) -> list[Variable]:
    return [Variable(f"{name}_{index}") for index in range(count)]
