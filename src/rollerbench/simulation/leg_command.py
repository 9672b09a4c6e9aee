"""What a robot on legs can be asked to do: the gait command of a scenario."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from rollerbench.description import Robot
from rollerbench.description.part import Name, Number, Part, Positive, Vector3
from rollerbench.description.problems import Problem
from rollerbench.errors import KinematicsError
from rollerbench.kinematics.gaits import GAITS, Gait, LegCommand, LegMode, LegPlanner

GaitName = Literal["tripod", "ripple", "amble", "wave"]


class BodyOffset(Part):
    """Pose of the body from where its posture has it.

    Attributes:
        x: Forward [m].
        y: To the left [m].
        z: Up [m].
        roll_deg: About x.
        pitch_deg: About y.
        yaw_deg: About z.
    """

    x: Number = 0.0
    y: Number = 0.0
    z: Number = 0.0
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0
    yaw_deg: Number = 0.0


class GaitPiece(Part):
    """What a robot on legs does for a while.

    Attributes:
        duration: How long [s]. Coming to rest from the last piece, and a change of posture, take part of it.
        v_xyw_B: Twist [vx, vy, wz] [m/s, m/s, rad/s].
        posture: Name of the posture; that of the piece before if left out.
        motion: "walk", or "drive" on the feet's wheels.
        gait: tripod, ripple, amble or wave.
        change: How it gets to another posture: "stepping", or "rolling" with all wheels on the ground.
        body: Pose of the body from where the posture has it.
    """

    duration: Positive
    v_xyw_B: Vector3 = (0.0, 0.0, 0.0)
    posture: Name | None = None
    motion: Literal["walk", "drive"] = "walk"
    gait: GaitName = "tripod"
    change: Literal["stepping", "rolling"] = "stepping"
    body: BodyOffset = BodyOffset()


class GaitCommand(Part):
    """Pieces of walking, driving and standing, one after the other; after the last one the robot stands.

    Attributes:
        pieces: The pieces.
        period: Time of a step of all legs [s].
        lift: Height by which feet are lifted [m].
    """

    type: Literal["gait"] = "gait"
    pieces: Annotated[tuple[GaitPiece, ...], Field(min_length=1)]
    period: Annotated[Positive, Field(ge=0.1, le=20)] = 1.0
    lift: Annotated[Positive, Field(le=1)] = 0.05

    def problems(self, robot: Robot, duration: float, time_step: float) -> Iterator[Problem]:
        """Robots without legs, postures that the robot has not, wheels without motors, and too long pieces."""
        if not robot.legs:
            message = f"{robot.name} has no legs; accepted: twist, wheel_speeds, wheel_efforts, waypoints, path"
            yield Problem(("command", "type"), message, self.type)
            return
        total = sum(piece.duration for piece in self.pieces)
        if total > duration * (1 + 1e-9):
            message = f"the pieces last {total:g} s; accepted: at most the scenario's duration, {duration:g} s"
            yield Problem(("command", "pieces"), message)
        planner = LegPlanner(robot)
        for index, mode in enumerate(self.modes(robot)):
            try:
                planner.require(mode)
            except KinematicsError as error:
                yield Problem(("command", "pieces", index), str(error))

    def modes(self, robot: Robot) -> list[LegMode]:
        """How each piece is followed."""
        posture, modes = robot.standing[0].name, []
        for piece in self.pieces:
            posture = piece.posture or posture
            data = GAITS[piece.gait]
            gait = Gait(
                name=data.name, duty=data.duty, lag=data.lag, offset=data.offset, period=self.period, lift=self.lift
            )
            modes.append(LegMode(posture=posture, motion=piece.motion, gait=gait, change=piece.change))
        return modes

    def course(self, robot: Robot) -> list[tuple[float, LegCommand]]:
        """Each piece's end [s] and command, and at last standing still without end."""
        course, end = [], 0.0
        modes = self.modes(robot)
        for piece, mode in zip(self.pieces, modes, strict=True):
            end += piece.duration
            body = piece.body
            angles = (math.radians(angle) for angle in (body.roll_deg, body.pitch_deg, body.yaw_deg))
            offset = np.array([body.x, body.y, body.z, *angles])
            course.append((end, LegCommand(v_xyw_B=np.array(piece.v_xyw_B), offset=offset, mode=mode)))
        last = course[-1][1]
        course.append((math.inf, LegCommand(v_xyw_B=np.zeros(3), offset=last.offset, mode=last.mode)))
        return course


def piece_at(course: list[tuple[float, LegCommand]], time: float) -> int:
    """Index of the piece of a course at a time [s]."""
    return next(index for index, (end, _) in enumerate(course) if time < end - 1e-9)


def command_at(course: list[tuple[float, LegCommand]], time: float) -> LegCommand:
    """The command of a course at a time [s]."""
    return course[piece_at(course, time)][1]
