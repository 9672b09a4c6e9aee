"""A robot on wheels that a hand drives."""

from typing import Any

import numpy as np
from pydrake.geometry import Meshcat

from rollerbench.kinematics.odometry import rotate
from rollerbench.simulation.drake_engine import start_at_rest
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.station import Station
from rollerbench.simulation.teleop.desk import Message
from rollerbench.simulation.teleop.driver import Array, Told, WheelDriver, Wish
from rollerbench.simulation.teleop.session import PERIOD, Session, plain, pose_error
from rollerbench.simulation.watch import fault

STEERING = 180.0
"""How far steered wheels can be asked to turn from heading_deg [deg]."""


class WheelSession(Session):
    """A simulated robot on wheels.

    Attributes:
        driver: What turns wishes into what the wheels are told.
        told: What they are told in the present period.
    """

    def __init__(self, scenario: Scenario, meshcat: Meshcat | None = None) -> None:
        """Builds the station; a meshcat shows it.

        Raises:
            SimulationError: the robot cannot stand.
            DescriptionError: Drake refuses a setting.
            KinematicsError: the wheels do not determine how the robot moves.
        """
        self.driver = WheelDriver(scenario.motion.kinematics, PERIOD)
        self.told: Told = self.driver.start()
        self._steers = bool(self.driver.kinematics.robot.steered_wheels)
        super().__init__(scenario, Station(scenario, command="wheels", meshcat=meshcat, visuals=meshcat is not None))
        self._rest_W = self.pose_W

    @property
    def ghost_W(self) -> Array:
        """Pose (4, 4) of the body as the equations alone predict it, as high as at the start."""
        pose = self._rest_W.copy()
        x, y, yaw = self.told.ghost
        turn = np.eye(3)
        turn[:2, :2] = rotate(yaw, np.eye(2)).T
        pose[:3, :3] = turn @ pose[:3, :3]
        pose[:2, 3] = x, y
        return pose

    @property
    def largest_speed(self) -> float:
        """Largest size of what is told to a wheel [rad/s]."""
        return float(np.abs(self.told.wheel_speeds).max())

    def hello(self) -> dict[str, Any]:
        """What a page must know to show its controls."""
        ranges, robot = self.driver.ranges, self.robot
        return {
            "axes": [{"name": a.name, "largest": a.largest, "reason": a.reason} for a in ranges.axes],
            "wheels": [
                {"name": wheel.name, "largest": float(largest)}
                for wheel, largest in zip(robot.driven_wheels, ranges.wheel_speeds, strict=True)
            ],
            "steered": [wheel.name for wheel in robot.steered_wheels],
            "passive": [wheel.name for wheel in robot.wheels if not wheel.driven],
        }

    def state(self, message: Message | None) -> dict[str, Any]:
        """What a page shows, under a command."""
        wish = self._wish(message)
        preview = self.driver.preview(self.told, wish)
        pose, slip = self._eval("pose"), dict(zip(self.robot.wheel_names, plain(self._eval("slip")), strict=True))
        measured = plain(self._eval("wheel_speeds"))
        state = {
            "mode": wish.mode,
            "twist": plain(preview.v_xyw_B),
            "told_twist": plain(self.told.v_xyw_B),
            "measured_twist": plain(self._eval("twist")),
            "pose": plain(pose),
            "ghost": plain(self.told.ghost),
            "error": pose_error(pose, self.told.ghost),
            "contradiction": preview.contradiction,
            "notes": list(preview.notes),
            "wheels": {
                wheel.name: {"target": target, "told": told, "measured": speed}
                for wheel, target, told, speed in zip(
                    self.robot.driven_wheels,
                    plain(preview.wheel_speeds),
                    plain(self.told.wheel_speeds),
                    measured,
                    strict=True,
                )
            },
            "slip": slip,
            "steering": {},
        }
        if self._steers:
            names = [wheel.name for wheel in self.robot.steered_wheels]
            angles = (preview.steering_angles, self.told.steering_angles, self._eval("steering_state")[: len(names)])
            state["steering"] = {
                name: dict(zip(("target", "told", "measured"), plain(np.array(values)), strict=True))
                for name, *values in zip(names, *angles, strict=True)
            }
        return state

    def _place(self) -> None:
        self._set_inputs()
        start_at_rest(self._simulator, self._station, self.scenario)

    def _forget(self) -> None:
        self.told = self.driver.start()
        self._set_inputs()

    def _command(self, message: Message | None) -> None:
        self.told = self.driver.step(self.told, self._wish(message))
        self._set_inputs()

    def _set_inputs(self) -> None:
        told = self.told
        self._station.GetInputPort("wheel_command").FixValue(self._context, told.wheel_speeds)
        if self._steers:
            steering = np.concatenate([told.steering_angles, told.steering_rates])
            self._station.GetInputPort("steering_command").FixValue(self._context, steering)

    def _look(self) -> str | None:
        return fault(self._station.parts.model, self._plant_context)

    def _wish(self, message: Message | None) -> Wish:
        """What a command asks for, no further than the sliders go."""
        if message is None:
            return self.driver.rest(self.told)
        robot, told, ranges = self.robot, self.told, self.driver.ranges
        steered = zip(robot.steered_wheels, told.steering_angles, strict=True)
        angles = [
            np.radians(np.clip(message.steering[wheel.name], -STEERING, STEERING))
            if wheel.name in message.steering
            else angle
            for wheel, angle in steered
        ]
        most, fastest = np.array([axis.largest for axis in ranges.axes]), ranges.wheel_speeds
        speeds = [message.wheels.get(wheel.name, 0.0) for wheel in robot.driven_wheels]
        return Wish(
            mode=message.mode,
            v_xyw_B=np.clip(message.twist, -most, most),
            wheel_speeds=np.clip(speeds, -fastest, fastest),
            steering_angles=np.array(angles, dtype=np.float64),
        )
