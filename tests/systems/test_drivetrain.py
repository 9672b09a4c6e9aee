"""The Drivetrain alone, against the same equations in numpy."""

import math
from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import rollerbench as rb
from rollerbench.kinematics.drivetrain import WheelDrive
from rollerbench.systems import Drivetrain

DT = 0.01
DRIVES = [
    WheelDrive(constant=0.02, amplitude=0.1, cycles=3, phase=0.4, backlash=0.05, counts=500),
    WheelDrive(amplitude=-0.2, cycles=0.5),
    WheelDrive(backlash=0.02),
    WheelDrive(counts=64),
]


def _simulated(drives: list[WheelDrive], inputs: dict[str, Any]) -> tuple[Any, Any]:
    """Outputs (steps, n) for inputs (steps, n), held over each step."""
    builder = DiagramBuilder()
    system = builder.AddNamedSystem("drivetrain", Drivetrain(drives, DT))
    for name, values in inputs.items():
        # Held from half a step before: the steps lie in the middle, on no break.
        breaks = DT * (np.arange(len(values) + 1) - 0.5)
        held = PiecewisePolynomial.ZeroOrderHold(breaks, np.vstack([values, values[-1:]]).T)
        source = builder.AddSystem(TrajectorySource(held))
        builder.Connect(source.get_output_port(), system.GetInputPort(name))
    ports = [system.GetOutputPort(name) for name in ("servo_wheel_speeds", "measured_wheel_speeds")]
    logs = [LogVectorOutput(port, builder, publish_period=DT) for port in ports]
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(DT * (len(values) - 1))
    servo, measured = (log.FindLog(simulator.get_context()).data().T for log in logs)
    return servo, measured


def test_the_system_is_its_equations() -> None:
    random = np.random.default_rng(1)
    command = random.uniform(-8, 8, (400, len(DRIVES)))
    # The shafts are anywhere, not where they were commanded: the wheel angles are those that belong to them.
    shafts = random.uniform(-8, 8, (400, len(DRIVES)))
    angles = np.column_stack([drive.wheel_angle(s) for drive, s in zip(DRIVES, shafts.T, strict=True)])
    servo, measured = _simulated(DRIVES, {"wheel_speed_command": command, "wheel_angles": angles})
    for column, drive in enumerate(DRIVES):
        lead, before = 0.0, 0.0
        for step, (u, shaft) in enumerate(zip(command[:, column], shafts[:, column], strict=True)):
            moved = np.clip(lead + u * DT, -drive.backlash / 2, drive.backlash / 2)
            turned = shaft + u * DT - (moved - lead)
            expected = (drive.wheel_angle(turned) - drive.wheel_angle(shaft)) / DT
            assert servo[step, column] == pytest.approx(expected, abs=1e-10)
            motor = shaft + lead
            seen = (motor, before)
            if drive.counts is not None:
                count = 2 * math.pi / drive.counts
                seen = tuple(count * math.floor(angle / count + 0.5) for angle in seen)
            assert measured[step, column] == pytest.approx((seen[0] - seen[1]) / DT, abs=1e-9)
            lead, before = moved, motor


def test_a_perfect_drivetrain_changes_nothing() -> None:
    command, angles = np.random.default_rng(2).uniform(-8, 8, (2, 50, 2))
    servo, measured = _simulated([WheelDrive()] * 2, {"wheel_speed_command": command, "wheel_angles": angles})
    assert servo == pytest.approx(command, abs=1e-12)
    assert measured == pytest.approx(np.diff(angles, axis=0, prepend=0.0) / DT, abs=1e-12)


def test_the_wheel_turns_at_one_plus_the_gear_error() -> None:
    """The derivative of the wheel's angle over the shaft's, by central differences (1e-8 of h^2)."""
    drive, shaft, h = DRIVES[0], np.linspace(-4, 4, 101), 1e-4
    slope = (drive.wheel_angle(shaft + h) - drive.wheel_angle(shaft - h)) / (2 * h)
    eps = drive.constant + drive.amplitude * np.sin(drive.cycles * shaft + drive.phase)
    assert slope == pytest.approx(1 + eps, abs=1e-8)
    assert float(drive.wheel_angle(0.0)) == 0.0


def test_measurements_need_no_command() -> None:
    """A controller may compute the command from the measured speeds: that is no algebraic loop."""
    system = Drivetrain(DRIVES, DT)
    command = int(system.GetInputPort("wheel_speed_command").get_index())
    servo, measured = (
        int(system.GetOutputPort(name).get_index()) for name in ("servo_wheel_speeds", "measured_wheel_speeds")
    )
    assert system.HasDirectFeedthrough(command, servo)
    assert not system.HasDirectFeedthrough(command, measured)


def test_impossible_drivetrains_are_refused() -> None:
    with pytest.raises(rb.KinematicsError, match="time_step = 0"):
        Drivetrain(DRIVES, 0)
    with pytest.raises(rb.KinematicsError, match="drives is empty"):
        Drivetrain([], DT)
    for bad in ({"amplitude": 1.2}, {"constant": -1.0}, {"counts": 0}, {"cycles": 0.0}, {"backlash": -0.1}):
        with pytest.raises(rb.KinematicsError, match=f"{next(iter(bad))} = .*accepted"):
            WheelDrive(**bad)
