"""Drake Systems of rollerbench: thin shells over kinematics, with named ports."""

from rollerbench.kinematics.tracking import TrackingGains
from rollerbench.systems.contacts import RollResistance, SlipMonitor
from rollerbench.systems.drivetrain import Drivetrain
from rollerbench.systems.kinematic_base import KinematicBase
from rollerbench.systems.kinematics import ForwardKinematics, InverseKinematics, Odometry, PlanarState
from rollerbench.systems.leg_servo import LegServo, damp_joints, unlimited
from rollerbench.systems.legs import GaitPlanner, LegInverseKinematics, LegTracker
from rollerbench.systems.pose_estimator import PoseEstimator
from rollerbench.systems.pose_sensors import GyroSensor, PoseFixSensor
from rollerbench.systems.pose_tracker import PoseTracker, ReferenceSource
from rollerbench.systems.stance import BodyPoseController, LegWatch, StanceOdometry
from rollerbench.systems.steering import SteeredOdometry, SteeringKinematics
from rollerbench.systems.twist_limiter import TwistLimiter
from rollerbench.systems.wheel_speed_controller import PidGains, WheelSpeedController, wheel_speed_gains

__all__ = [
    "BodyPoseController",
    "Drivetrain",
    "ForwardKinematics",
    "GaitPlanner",
    "GyroSensor",
    "InverseKinematics",
    "KinematicBase",
    "LegInverseKinematics",
    "LegServo",
    "LegTracker",
    "LegWatch",
    "Odometry",
    "PidGains",
    "PlanarState",
    "PoseEstimator",
    "PoseFixSensor",
    "PoseTracker",
    "ReferenceSource",
    "RollResistance",
    "SlipMonitor",
    "StanceOdometry",
    "SteeredOdometry",
    "SteeringKinematics",
    "TrackingGains",
    "TwistLimiter",
    "WheelSpeedController",
    "damp_joints",
    "unlimited",
    "wheel_speed_gains",
]
