"""A robot on legs that a hand drives."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import Value
from pydrake.geometry import Meshcat

from rollerbench.kinematics.gaits import GAITS, LegMode, LegPlan
from rollerbench.kinematics.gaits.plan import rotation
from rollerbench.simulation.leg_engine import fall
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.teleop.desk import Message
from rollerbench.simulation.teleop.ranges import leg_axes
from rollerbench.simulation.teleop.session import Session, plain, pose_error

Array = NDArray[np.float64]

BODY = ("height", "roll", "pitch")

BODY_ANGLE = 8.0
"""How far the body can be asked to roll and pitch [deg]."""

BODY_SHARE = 0.25
"""How far it can be asked to rise and sink, over its height in the first posture [-]."""


class LegSession(Session):
    """A simulated robot on legs."""

    def __init__(self, scenario: Scenario, meshcat: Meshcat | None = None) -> None:
        """Builds the station; a meshcat shows it.

        Raises:
            DescriptionError: Drake refuses a setting.
        """
        posture = scenario.robot.standing[0].name
        self._axes = leg_axes(scenario.robot)
        self._body = (-1e3 * BODY_SHARE * scenario.robot.ground_height, BODY_ANGLE, BODY_ANGLE)
        self._last = self._first = Message(touch=0, posture=posture)
        super().__init__(
            scenario, LegStation(scenario, command="external", meshcat=meshcat, visuals=meshcat is not None)
        )

    @property
    def ghost_W(self) -> Array:
        """Pose (4, 4) of the body as it is planned."""
        x, y, z, roll, pitch, yaw = self._eval("desired")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation(roll, pitch, yaw), (x, y, z)
        return pose

    @property
    def largest_speed(self) -> float:
        """Largest component of the accepted twist [m/s, rad/s]."""
        return float(np.abs(self._eval("reference_twist")).max())

    def hello(self) -> dict[str, Any]:
        """What a page must know to show its controls."""
        return {
            "axes": [{"name": a.name, "largest": a.largest, "reason": a.reason} for a in self._axes],
            "legs": [leg.name for leg in self.robot.legs],
            "postures": [posture.name for posture in self.robot.standing],
            "gaits": list(GAITS),
            "drives": all(leg.wheel.driven for leg in self.robot.legs),
            "body": [{"name": n, "largest": most} for n, most in zip(BODY, self._body, strict=True)],
        }

    def state(self, message: Message | None) -> dict[str, Any]:
        """What a page shows, under a command."""
        plan: LegPlan = self._station.GetOutputPort("plan").Eval(self._context)
        pose, desired = self._eval("pose"), self._eval("desired")[[0, 1, 5]]
        feet = zip(self.robot.legs, self._eval("normal_forces"), self._eval("slip"), self._eval("stance"), strict=True)
        last = self._last
        return {
            "mode": "twist",
            "twist": list(self._used(message).twist),
            "told_twist": plain(self._eval("reference_twist")),
            "measured_twist": plain(self._eval("twist")),
            "pose": plain(pose),
            "ghost": plain(desired),
            "error": pose_error(pose, desired),
            "notes": [plan.status] if plan.status else [],
            "activity": plan.activity,
            "stands_in": plan.posture.name,
            "asked": {"posture": last.posture, "motion": last.motion, "gait": last.gait, "change": last.change},
            "body": list(last.body),
            "feet": {
                leg.name: {
                    "load": float(np.nan_to_num(load)),
                    "slip": float(np.nan_to_num(slip)),
                    "stands": bool(stands),
                }
                for leg, load, slip, stands in feet
            },
        }

    def _place(self) -> None:
        self._command(None)
        self._simulator.Initialize()

    def _forget(self) -> None:
        self._last = self._first
        self._command(None)

    def _command(self, message: Message | None) -> None:
        """Sets the inputs; without a command the twist is zero, and the rest as it was."""
        self._last = last = self._used(message)
        assert last.posture is not None
        mode = LegMode(posture=last.posture, motion=last.motion, gait=last.gait, change=last.change)
        height, roll, pitch = last.body
        offset = [0.0, 0.0, 1e-3 * height, math.radians(roll), math.radians(pitch), 0.0]
        station = self._station
        station.GetInputPort("twist_command").FixValue(self._context, np.array(last.twist))
        station.GetInputPort("body_offset").FixValue(self._context, np.array(offset))
        station.GetInputPort("mode").FixValue(self._context, Value(mode))

    def _used(self, message: Message | None) -> Message:
        """A command as it is used: no further than the sliders go, and with names that the robot knows."""
        if message is None:
            return self._last.model_copy(update={"twist": (0.0, 0.0, 0.0)})
        most = np.array([axis.largest for axis in self._axes])
        names = [posture.name for posture in self.robot.standing]
        return message.model_copy(
            update={
                "twist": tuple(np.clip(message.twist, -most, most).tolist()),
                "body": tuple(np.clip(message.body, -np.array(self._body), self._body).tolist()),
                "posture": message.posture if message.posture in names else names[0],
                "gait": message.gait if message.gait in GAITS else next(iter(GAITS)),
            }
        )

    def _look(self) -> str | None:
        height = float(self._eval("desired")[2])
        return fall(self._station.parts.model, self._plant_context, height)
