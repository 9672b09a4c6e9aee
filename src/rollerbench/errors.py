"""Exceptions of rollerbench: one root, few leaves.

Every message says where the fault lies (file, field), what was found and what is accepted.
"""

from typing import Any


class RollerbenchError(Exception):
    """Root of all errors that rollerbench raises on purpose."""


class ResourceError(RollerbenchError):
    """A robot, scenario or file that was asked for does not exist or cannot be read."""


class DescriptionError(RollerbenchError):
    """A robot.yaml or scenario.yaml that cannot be accepted."""


class KinematicsError(RollerbenchError):
    """A kinematic question that has no answer for this robot."""


class InfeasibleTwist(KinematicsError):
    """A body twist that would make a tyre skid sideways.

    Attributes:
        wheel_names: The tyres that would skid.
        skid_speeds: Their sideways speeds [m/s], positive to the left of the wheel.
    """

    def __init__(self, message: str, wheel_names: tuple[str, ...], skid_speeds: tuple[float, ...]) -> None:
        super().__init__(message)
        self.wheel_names = wheel_names
        self.skid_speeds = skid_speeds


class UnreachableTarget(KinematicsError):
    """A position to which a leg cannot bring its foot.

    Attributes:
        index: Index of the target, () of a single one.
        distance: How far it is from the points in reach [m]; 0 if only limits of joints keep the foot from it.
        limit_excess: How far joints would have to turn beyond their limits [rad]; 0 if it is out of reach anyway.
    """

    def __init__(self, message: str, index: tuple[int, ...], distance: float, limit_excess: float) -> None:
        super().__init__(message)
        self.index = index
        self.distance = distance
        self.limit_excess = limit_excess


class SimulationError(RollerbenchError):
    """A simulation that could not go on.

    Attributes:
        result: What was computed until then (a RunResult); None if nothing was.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message)
        self.result = result


class RollerbenchWarning(UserWarning):
    """Something that may make a result worse than its user expects."""
