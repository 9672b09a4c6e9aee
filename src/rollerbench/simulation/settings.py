"""The settings of a scenario, section by section: controller, plant, ground, simulator, recording."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, ConfigDict, Field, ValidationInfo, model_validator

from rollerbench.description.part import Flag, NonNegative, Number, Part, Positive
from rollerbench.kinematics.tracking import DEFAULT_GAINS, TrackingGains
from rollerbench.sdf.servo import DRIVE_TIME_CONSTANT
from rollerbench.sdf.window import DEFAULT_SIZE


class PidSettings(Part):
    """Gains of the wheels' speed controllers (`rollerbench.systems.WheelSpeedController`), the same for all wheels.

    Attributes:
        kp: Torque over the speed error [N m s/rad].
        ki: Torque over the integral of the speed error [N m/rad].
        kd: Torque over the rate of the speed [N m s2/rad].
    """

    kp: Positive
    ki: NonNegative = 0.0
    kd: NonNegative = 0.0


class WheelControl(Part):
    """What every controller of wheels has: how motors follow their speeds, and which equations it believes.

    Attributes:
        servo: What makes the wheels follow: "implicit", the plant's own stiff servo, or "pid", explicit torques.
        pid: Gains, where servo is "pid"; by default such that follow from the robot (`wheel_speed_gains`).
        servo_time_constant: Time in which the wheel servos make up a speed difference of the whole robot [s].
        rollers: "textbook", or "finite" for equations that count the rollers of Mecanum wheels (`WheelKinematics`).
    """

    servo: Literal["implicit", "pid"] = "implicit"
    pid: PidSettings | None = None
    servo_time_constant: Positive = DRIVE_TIME_CONSTANT
    rollers: Literal["textbook", "finite"] = "textbook"


class OpenLoop(WheelControl):
    """Wheel speeds from the command by inverse kinematics, without feedback of the pose."""

    type: Literal["open_loop"] = "open_loop"


LARGEST_GAIN = 0.5
"""Largest share of an error that feedback may take away in the time by which it is late; loops swing from 1.2 on."""


class PoseTracking(WheelControl):
    """Feedback that brings the robot back to the pose where its command has it (`rollerbench.systems.PoseTracker`).

    Attributes:
        feedback: Where the pose comes from: "pose", from a perfect measurement; "odometry", from the wheels alone.
        position: Rate at which errors of position decay [1/s].
        heading: Rate at which errors of heading decay [1/s].
        lateral: Inverse of the distance on which a robot with fixed tyres comes back to its path [1/m].
        period: Period of control [s], a multiple of the plant's step.
        max_wheel_acceleration: Limit of the driven wheels' accelerations [rad/s2]; None for no limit.
        max_wheel_jerk: Limit of their jerks [rad/s3]; None for no limit.
    """

    type: Literal["pose_tracking"] = "pose_tracking"
    feedback: Literal["pose", "odometry"] = "pose"
    position: NonNegative = DEFAULT_GAINS.position
    heading: NonNegative = DEFAULT_GAINS.heading
    lateral: NonNegative = DEFAULT_GAINS.lateral
    period: Annotated[Positive, Field(ge=1e-4, le=0.1)] = 0.01
    max_wheel_acceleration: Positive | None = None
    max_wheel_jerk: Positive | None = None

    @model_validator(mode="after")
    def _is_stable(self) -> Self:
        for name in ("position", "heading"):
            gain, most = getattr(self, name), LARGEST_GAIN / self.period
            if gain > most:
                raise ValueError(f"{name} = {gain:g}: accepted: up to {most:g}, {LARGEST_GAIN:g} / period")
        return self

    @property
    def gains(self) -> TrackingGains:
        """Gains of the tracking law."""
        return TrackingGains(position=self.position, heading=self.heading, lateral=self.lateral)


class LegControl(Part):
    """Joint torques of legs from a plan of their feet (`rollerbench.systems.GaitPlanner`).

    Attributes:
        closed_loop: Whether stance odometry brings the body back to its reference.
        period: Period of control [s], a multiple of the plant's step.
    """

    type: Literal["legs"] = "legs"
    closed_loop: Flag = False
    period: Annotated[Positive, Field(ge=1e-4, le=0.1)] = 0.02


Controller = OpenLoop | PoseTracking | LegControl


def with_type(value: Any, info: ValidationInfo) -> Any:
    """A controller that leaves out its type: the one that has most of its fields.

    If two have as many it is open_loop, or else the one for the robot, which is validated before.
    """
    if not isinstance(value, Mapping) or "type" in value:
        return value
    kinds: dict[str, type[Part]] = {"open_loop": OpenLoop, "pose_tracking": PoseTracking, "legs": LegControl}
    robot = info.data.get("robot")
    if robot is not None and robot.legs:
        kinds = {"open_loop": OpenLoop, "legs": LegControl, "pose_tracking": PoseTracking}
    return {"type": max(kinds, key=lambda kind: len(value.keys() & kinds[kind].model_fields.keys())), **value}


UNFIT = {
    "sap": "lets wheels creep over the ground by percents of the path",
    "tamsi": "ignores the wheels' servos, and is gone from newer Drake",
}
"""Drake's other contact approximations, and why they are refused."""


def _no_creep(value: Any) -> Any:
    if isinstance(value, str) and value in UNFIT:
        raise ValueError(f"it {UNFIT[value]}; accepted: lagged, similar, or fast (SAP with nearly rigid contacts)")
    return value


class PlantSettings(Part):
    """How Drake simulates. Any further field of Drake's MultibodyPlantConfig is passed on.

    Attributes:
        roller_model: "full": every roller is a body; "windowed": those near the ground are.
        roller_window: How many rollers of a wheel are simulated, if windowed; bumps may need more than that.
        time_step: Step of the discrete plant [s].
        contact_approximation: Drake's discrete contact approximation, "lagged" or "similar"; or "fast", its SAP with
            nearly rigid contacts, which is for wheels that roll: where they slide for long, they bounce.
    """

    model_config = ConfigDict(extra="allow")

    roller_model: Literal["windowed", "full"] = "windowed"
    roller_window: Annotated[int, Field(strict=True, ge=2)] = DEFAULT_SIZE
    time_step: Annotated[Positive, Field(ge=1e-5, le=0.1)] = 0.005
    contact_approximation: Annotated[Literal["lagged", "similar", "fast"], BeforeValidator(_no_creep)] = "lagged"


class GroundStep(Part):
    """A step across the robot's way, for robots on legs.

    Attributes:
        start: Where it begins along x [m].
        end: Where it ends along x [m].
        height: Height [m].
    """

    start: Number
    end: Number
    height: Positive

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.end <= self.start:
            raise ValueError(f"end = {self.end:g}: accepted: more than start = {self.start:g}")
        return self


class Ground(Part):
    """What the robot stands on.

    Attributes:
        friction: Coefficient of friction; with a wheel's it combines to 2ab/(a+b).
        slope_deg: Inclination; the world's x axis points uphill.
        roll_resistance: Rolling resistance over load, of wheels and of rollers along the ground. It falls off near
            rest, so it slows a robot on a slope but does not hold it.
        steps: Steps of which a robot on legs knows nothing; it feels them with its feet.
    """

    friction: Positive = 0.8
    slope_deg: Annotated[Number, Field(gt=-90, lt=90)] = 0.0
    roll_resistance: Annotated[Number, Field(ge=0, lt=1)] = 0.0
    steps: tuple[GroundStep, ...] = ()

    @property
    def up_W(self) -> NDArray[np.float64]:
        """Unit vector (3,) against gravity in W, whose z axis is the ground's normal."""
        slope = math.radians(self.slope_deg)
        return np.array([math.sin(slope), 0.0, math.cos(slope)])


class SimulatorSettings(Part):
    """Any field of Drake's SimulatorConfig."""

    model_config = ConfigDict(extra="allow")


class RecordingSettings(Part):
    """What a run leaves behind.

    Attributes:
        html: Whether to write the self-contained Meshcat page recording.html.
        frames_per_second: Frames of that page, and of a video [1/s].
        camera: Where it looks from: "iso", at the whole path from aside; "top", from above; "follow", at the robot.
        forces: Whether to record the forces of the ground on the wheels, and to show them.
        slip: Whether to show where wheels slid.
        preview: Whether to draw a picture of the end as preview.png, where there is a page or a video.
        video: Whether to write a video, as recording.mp4 (with the extra `video`) or recording.gif; None for none.
        diagram: Whether to draw the simulated diagram as diagram.svg.
    """

    html: Flag = True
    frames_per_second: Annotated[Positive, Field(le=200)] = 30.0
    camera: Literal["iso", "top", "follow"] = "iso"
    forces: Flag = False
    slip: Flag = False
    preview: Flag = True
    video: Literal["mp4", "gif"] | None = None
    diagram: Flag = False
