"""What a robot's legs are about to do, for one moment; and what the plan is made from."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rollerbench.description import Posture
from rollerbench.kinematics.gaits.changes import Change
from rollerbench.kinematics.gaits.gait import Gait, Schedule, gait_of
from rollerbench.kinematics.gaits.smooth import Follower
from rollerbench.kinematics.gaits.wheeling import Wheeling
from rollerbench.kinematics.legs.group import Hold

Array = NDArray[np.float64]

Activity = Literal["walk", "drive", "change", "halt"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LegMode:
    """How a robot on legs follows its commands.

    Attributes:
        posture: Name of the posture.
        motion: "walk", or "drive" on the feet's wheels.
        gait: Name of the gait (`GAITS`), or a Gait of one's own.
        change: How it gets to another posture: "stepping", or "rolling" with all wheels on the ground.
    """

    posture: str
    motion: Literal["walk", "drive"] = "walk"
    gait: str | Gait = "tripod"
    change: Literal["stepping", "rolling"] = "stepping"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegCommand:
    """What a robot on legs is asked to do.

    Attributes:
        v_xyw_B: Body twist (3,) [m/s, m/s, rad/s].
        offset: Pose (6,) of the body from where its posture has it: x, y, z [m], roll, pitch, yaw [rad].
        mode: How.
        correction: Twist (3,) that brings the robot back to its reference while it moves [m/s, m/s, rad/s].
        level: Height [m], roll and pitch [rad] (3,) by which the legs shall overdo the pose, for what they give way.
    """

    v_xyw_B: Array
    offset: Array
    mode: LegMode
    correction: Array = field(default_factory=lambda: np.zeros(3))
    level: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegFeedback:
    """What a plan learns from those who follow it.

    Attributes:
        q: Joint angles (k, n) that the legs are at [rad].
        q_rate: Joint speeds (k, n) at which they got there [rad/s].
        roll_P: Displacements (k, 3) by which feet on the ground rolled sideways, as their legs leaned, since the last
            plan, in P [m].
        loads: Measured loads (k,) of the feet [N]; None where nobody measures, and the ground is taken to be level.
        fault: What went wrong, in words; the robot then halts.
        held: Whether the legs could not follow the plan, and stayed where they were.
    """

    q: Array
    q_rate: Array
    roll_P: Array
    loads: Array | None = None
    fault: str = ""
    held: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LegPlan:
    """Where body and feet shall be at a moment. Frame P is the plan's own world.

    Attributes:
        time: The moment [s].
        q_xyt: Planar pose (3,) of B in P, without the offset [m, m, rad].
        reference: The pose (3,) that the accepted twist alone leads to [m, m, rad].
        twist: Body twist (3,) [m/s, m/s, rad/s], and its rate.
        offset: Offset (6,) of the body (see `LegCommand`), and its rate.
        level: What the pose overdoes (3,) (see `LegCommand`).
        height: Height of Bo over the ground, without the offset [m].
        ground: Mean height (1,) of the ground under the feet [m], and its rate.
        feet_P: Lowest points (k, 3) of the feet's wheels [m].
        swing: Progress (k,) of legs in the air, from 0 to 1; -1 on the ground.
        lifted_P: Where legs in the air left the ground (k, 3) [m].
        load: Shares (k,) of its load that a foot bears, from 0 in the air to 1.
        phase: Where in its period the gait is, from 0 to 1.
        schedule: The gait.
        posture: The posture that it stands in, or leaves.
        hold: What settles the joints that the feet leave free.
        activity: What the robot does.
        request: The twist (3,) that was last asked for, and ...
        accepted: ... the one (3,) within the legs' reach that was made of it.
        posed: The offset (6,) that was last asked for, and ...
        offset_share: ... the share of it that is within the legs' reach.
        before: The plan before this one.
        change: The change of posture that is under way.
        wheeling: What driving on wheels remembers.
        status: What the robot could not do, in words; empty if nothing.
    """

    time: float
    q_xyt: Array
    reference: Array
    twist: Follower
    offset: Follower
    level: Array
    height: float
    ground: Follower
    feet_P: Array
    swing: Array
    lifted_P: Array
    load: Array
    phase: float
    schedule: Schedule
    posture: Posture
    hold: Hold
    activity: Activity = "walk"
    request: Array
    accepted: Array
    posed: Array
    offset_share: float = 1.0
    before: "LegPlan | None" = None
    change: Change | None = None
    wheeling: Wheeling | None = None
    status: str = ""

    def __deepcopy__(self, memo: dict[int, Any]) -> "LegPlan":
        """Itself: a value that nobody changes need not be copied, which takes simulators longer than planning."""
        return self

    @property
    def at_rest(self) -> bool:
        """Whether the body does not move and all feet are on the ground."""
        still = not (self.twist.value.any() or self.twist.rate.any())
        return bool(still and (self.swing < 0).all())

    @property
    def X_PB(self) -> Array:
        """Pose (4, 4) of the body in P."""
        x, y, z, roll, pitch, yaw = self._pose(self.q_xyt, self.level)
        pose = np.eye(4)
        pose[:3, :3] = rotation(roll, pitch, yaw)
        pose[:3, 3] = x, y, z
        return pose

    @property
    def desired(self) -> Array:
        """Where the body shall be (6,): x, y, z [m], roll, pitch, yaw [rad], on its reference."""
        return np.array(self._pose(self.reference, np.zeros(3)))

    def _pose(self, q_xyt: Array, level: Array) -> tuple[float, float, float, float, float, float]:
        # Plain numbers: numpy's functions take ten times as long on single ones.
        (x, y, yaw), (dx, dy, dz, roll, pitch, turn) = q_xyt.tolist(), self.offset.value.tolist()
        cos, sin = math.cos(yaw), math.sin(yaw)
        up, more_roll, more_pitch = level.tolist()
        height = self.height + float(self.ground.value[0]) + dz + up
        return (
            x + cos * dx - sin * dy,
            y + sin * dx + cos * dy,
            height,
            roll + more_roll,
            pitch + more_pitch,
            yaw + turn,
        )


def mode_gait(mode: LegMode) -> Gait:
    """The gait of a mode.

    Raises:
        KinematicsError: there is none of this name.
    """
    return gait_of(mode.gait) if isinstance(mode.gait, str) else mode.gait


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Rotation (3, 3) by yaw about z after pitch about y after roll about x [rad]."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
