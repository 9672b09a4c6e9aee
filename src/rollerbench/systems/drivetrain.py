"""Imperfect gears, play and encoders between commands, wheels and measurements, as a Drake System."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake import symbolic
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import Multiplexer

from rollerbench.errors import KinematicsError
from rollerbench.kinematics.drivetrain import WheelDrive
from rollerbench.kinematics.given import positive_time
from rollerbench.systems.symbolic_block import symbolic_block, variables


class Drivetrain(Diagram):
    """What stands between the commanded wheel speeds, the wheels' servos, and the measured wheel speeds.

    Once a time step dt, with the command u, the play b, the motor's lead g over its shaft in [-b/2, b/2], and the
    shaft's angle s from that of the wheel, Theta(s) (`WheelDrive.wheel_angle`):

        g_next = clip(g + u dt, -b/2, b/2)                      the shaft stands while its motor crosses the play
        servo = (Theta(s + u dt - (g_next - g)) - Theta(s)) / dt
        motor = s + g                                           where the motor is, seen at the wheel
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
            drives: Drivetrains of the n wheels, at least one.
            time_step: Period of the updates: the plant's [s].
        """
        super().__init__()
        positive_time("time_step", time_step)
        if not drives:
            raise KinematicsError("drives is empty: accepted: one for each driven wheel, at least one")
        n = len(drives)
        builder = DiagramBuilder()
        play = builder.AddNamedSystem("play", _play(drives, time_step))
        shaft = builder.AddNamedSystem("shaft", _shaft(drives))
        gear = builder.AddNamedSystem("gear", _gear(drives, time_step))
        encoder = builder.AddNamedSystem("encoder", _encoder(drives, time_step))
        into_gear = builder.AddNamedSystem("into_gear", Multiplexer([n, n, n]))
        into_encoder = builder.AddNamedSystem("into_encoder", Multiplexer([n, n]))
        command = builder.ExportInput(play.get_input_port(), "wheel_speed_command")
        builder.ExportInput(shaft.get_input_port(), "wheel_angles")
        builder.ConnectInput(command, into_gear.get_input_port(2))
        for inputs, system in ((into_gear, gear), (into_encoder, encoder)):
            builder.Connect(shaft.get_output_port(), inputs.get_input_port(0))
            builder.Connect(play.get_output_port(), inputs.get_input_port(1))
            builder.Connect(inputs.get_output_port(), system.get_input_port())
        builder.ExportOutput(gear.get_output_port(), "servo_wheel_speeds")
        builder.ExportOutput(encoder.get_output_port(), "measured_wheel_speeds")
        builder.BuildInto(self)


def _play(drives: Sequence[WheelDrive], time_step: float) -> System:
    """From the commands to the leads g."""
    leads, commands = (variables(name, len(drives)) for name in ("lead", "command"))
    crossings = [_crossing(*each, time_step) for each in zip(drives, leads, commands, strict=True)]
    return symbolic_block(
        state=leads,
        input=commands,
        dynamics=[lead + crossing for lead, crossing in zip(leads, crossings, strict=True)],
        output=[Expression(lead) for lead in leads],
        time_period=time_step,
    )


def _shaft(drives: Sequence[WheelDrive]) -> System:
    """From the wheels' angles to the shafts'."""
    angles = variables("angle", len(drives))
    return symbolic_block(
        input=angles, output=[_shaft_angle(drive, angle) for drive, angle in zip(drives, angles, strict=True)]
    )


def _gear(drives: Sequence[WheelDrive], time_step: float) -> System:
    """From [shaft angles; leads; commands] to the speeds of the servos."""
    shafts, leads, commands = (variables(name, len(drives)) for name in ("shaft", "lead", "command"))
    speeds = []
    for drive, shaft, lead, command in zip(drives, shafts, leads, commands, strict=True):
        turn = time_step * command - _crossing(drive, lead, command, time_step)
        wave = _cosine(drive, shaft + turn) - _cosine(drive, shaft)
        speeds.append(((1 + drive.constant) * turn - drive.amplitude / drive.cycles * wave) / time_step)
    return symbolic_block(input=[*shafts, *leads, *commands], output=speeds)


def _encoder(drives: Sequence[WheelDrive], time_step: float) -> System:
    """From [shaft angles; leads] to the measured speeds; its state is where the motors were."""
    before, shafts, leads = (variables(name, len(drives)) for name in ("before", "shaft", "lead"))
    dynamics, output = [], []
    for drive, last, shaft, lead in zip(drives, before, shafts, leads, strict=True):
        now = shaft + lead
        dynamics.append(now)
        output.append((_counted(drive, now) - _counted(drive, last)) / time_step)
    return symbolic_block(
        state=before, input=[*shafts, *leads], dynamics=dynamics, output=output, time_period=time_step
    )


def _crossing(drive: WheelDrive, lead: Variable, command: Variable, time_step: float) -> Expression:
    """g_next - g [rad]."""
    half = 0.5 * drive.backlash
    return symbolic.max(symbolic.min(lead + time_step * command, half), -half) - lead


def _shaft_angle(drive: WheelDrive, wheel_angle: Variable) -> Expression:
    """Inverse of `WheelDrive.wheel_angle` in symbols, by its fixed point; |amplitude| < 1 + constant contracts."""
    shaft = Expression(wheel_angle) / (1 + drive.constant)
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
