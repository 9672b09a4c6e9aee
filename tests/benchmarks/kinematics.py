"""Twists per second through the kinematics, batched, beside WPILib's in a loop."""

import importlib.util
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

import rollerbench as rb

from .motions import robot_with_rollers
from .rounds import Spread, timed_rounds

BATCHES = (1, 10, 100, 1_000, 10_000, 100_000, 1_000_000)
LOOPS = 2_000
"""Calls of WPILib in one measurement."""

BUDGET = 0.03
"""Time of one measurement, at least one call [s]."""


def measure(batches: Sequence[int], rounds: int, progress: Callable[[str], None]) -> list[dict[str, Any]]:
    """Twists per second of each function at each batch size; four wheel speeds belong to each twist."""
    kinematics = rb.WheelKinematics(robot_with_rollers())
    rng = np.random.default_rng(0)
    works: dict[str, Callable[[], float]] = {}
    heads: dict[str, dict[str, Any]] = {}

    def add(name: str, batch: int, call: Callable[[], object], twists: int) -> None:
        key = f"{name}, batch {batch}"
        works[key], heads[key] = _rate_of(call, twists), {"function": name, "batch": batch}

    for batch in batches:
        twists = rng.uniform(-1, 1, (batch, 3))
        speeds, poses = kinematics.inverse(twists), rng.uniform(-1, 1, (batch, 3))
        add("inverse", batch, lambda v=twists: kinematics.inverse(v), batch)
        add("forward", batch, lambda q=speeds: kinematics.forward(q), batch)
        add("odometry.integrate", batch, lambda q=poses, v=twists: rb.odometry.integrate(q, v, 0.01), batch)
    if importlib.util.find_spec("wpimath") is not None:
        for name, call in _wpilib(kinematics.robot, rng):
            add(name, 1, call, LOOPS)
    rates = timed_rounds(works, rounds, progress)
    rows = []
    for key, head in heads.items():
        spread = Spread.of(rates[key])
        rows.append({**head, "twists_per_second": spread.median, "low": spread.low, "high": spread.high})
        rows[-1]["wheel_speeds_per_second"] = 4 * spread.median
    return rows


def _rate_of(call: Callable[[], object], twists: int) -> Callable[[], float]:
    def rate() -> float:
        call()
        count, started = 0, time.perf_counter()
        while (elapsed := time.perf_counter() - started) < BUDGET or not count:
            call()
            count += 1
        return twists * count / elapsed if elapsed else 0.0

    return rate


def _wpilib(robot: rb.Robot, rng: np.random.Generator) -> Iterable[tuple[str, Callable[[], object]]]:
    """WPILib's functions, objects made before, called in a loop from Python as its users do."""
    from wpimath.geometry import Pose2d, Translation2d, Twist2d
    from wpimath.kinematics import ChassisSpeeds, MecanumDriveKinematics

    wpilib = MecanumDriveKinematics(*(Translation2d(*wheel.p_BoHo_B[:2]) for wheel in robot.wheels))
    speeds = [ChassisSpeeds(*row) for row in rng.uniform(-1, 1, (LOOPS, 3))]
    wheels = [wpilib.toWheelSpeeds(each) for each in speeds]
    twists = [Twist2d(*row) for row in rng.uniform(-0.01, 0.01, (LOOPS, 3))]
    pose = Pose2d()

    def loop(function: Callable[[Any], object], values: Sequence[Any]) -> Callable[[], object]:
        def call() -> None:
            for value in values:
                function(value)

        return call

    yield "WPILib toWheelSpeeds", loop(wpilib.toWheelSpeeds, speeds)
    yield "WPILib toChassisSpeeds", loop(wpilib.toChassisSpeeds, wheels)
    yield "WPILib Pose2d.exp", loop(pose.exp, twists)
