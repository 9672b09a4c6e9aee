"""A robot in simulation, period by period: what sessions on wheels and on legs share."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from rollerbench.description import Robot, load_robot
from rollerbench.errors import DescriptionError, RollerbenchError
from rollerbench.kinematics import WheelKinematics
from rollerbench.plant import follow_rollers
from rollerbench.simulation.advance import configure
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.scenario import Scenario, load_scenario
from rollerbench.simulation.station import Station
from rollerbench.simulation.teleop.desk import Message
from rollerbench.simulation.teleop.driver import WheelDriver
from rollerbench.simulation.teleop.ranges import plant_step

Array = NDArray[np.float64]

PERIOD = 0.02
"""Period of control [s]."""

LEG_STEP = 0.004
"""Step of the plant of robots on legs [s]."""


def teleop_scenario(
    robot: Robot | str | Path | Mapping[str, Any], overrides: Mapping[str, Any] | Sequence[str] = ()
) -> Scenario:
    """What is simulated while a robot is driven by hand.

    Args:
        robot: The robot.
        overrides: Fields of the scenario to set, as of `load_scenario`.

    Raises:
        ResourceError, DescriptionError: there is no such robot, or it or a field is not valid.
        KinematicsError: the robot's wheels do not determine how it moves.
    """
    loaded = load_robot(robot)
    command: dict[str, Any]
    if loaded.legs:
        step, command = LEG_STEP, {"type": "gait", "pieces": [{"duration": 1.0}]}
    elif loaded.driven_wheels:
        driver = WheelDriver(WheelKinematics(loaded), PERIOD)
        step, command = plant_step(driver.kinematics, driver.ranges), {"type": "twist", "v_xyw_B": [0.0, 0.0, 0.0]}
    else:
        raise DescriptionError(f"{loaded.name}: no wheel is driven; accepted: a robot with driven: true somewhere")
    scenario = load_scenario(
        {
            "name": "teleop",
            "robot": loaded,
            "duration": 1.0,
            "command": command,
            "plant": {"time_step": step},
            "recording": {"html": False},
        },
        overrides=overrides,
    )
    if scenario.engine != "drake":
        raise DescriptionError(f"engine = {scenario.engine}: robots are driven by hand in Drake; accepted: drake")
    return scenario


class Session(ABC):
    """A simulated robot that a hand drives.

    Attributes:
        robot: The robot.
        scenario: What is simulated.
        fault: Why the simulation stopped, in words; empty while it goes on.
    """

    def __init__(self, scenario: Scenario, station: Station | LegStation) -> None:
        """Starts the robot at the origin.

        Raises:
            SimulationError: the robot cannot stand.
            DescriptionError: Drake refuses a setting.
        """
        self.robot, self.scenario, self.fault = scenario.robot, scenario, ""
        self._station = station
        self._simulator = Simulator(station)
        if isinstance(station, Station):
            follow_rollers(self._simulator)
        configure(self._simulator, scenario)
        self._context: Context = self._simulator.get_mutable_context()
        model = station.parts.model
        self._plant_context = model.plant.GetMyMutableContextFromRoot(self._context)
        self._place()
        self._start = self._context.Clone()
        self._periods = 0

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._periods * PERIOD

    @property
    def pose_W(self) -> Array:
        """Pose (4, 4) of the simulated robot's body."""
        model = self._station.parts.model
        return np.array(model.plant.EvalBodyPoseInWorld(self._plant_context, model.body).GetAsMatrix4())

    def advance(self, message: Message | None) -> None:
        """Simulates a period of control under a command; None for none: the robot comes to rest."""
        if self.fault:
            return
        try:
            self._command(message)
            self._simulator.AdvanceTo((self._periods + 1) * PERIOD)
            what = self._look()
        except RollerbenchError as error:
            what = str(error)
        except (RuntimeError, SystemExit) as error:
            what = f"Drake stopped: {error}"
        self._periods += 1
        self.fault = f"at t = {self.time:.2f} s {what}" if what else ""

    def restart(self) -> None:
        """Brings the robot back to where it started."""
        self._context.SetTimeStateAndParametersFrom(self._start)
        self._periods, self.fault = 0, ""
        self._forget()
        self._simulator.Initialize()

    def _eval(self, port: str) -> Array:
        return np.array(self._station.GetOutputPort(port).Eval(self._context))

    @property
    @abstractmethod
    def ghost_W(self) -> Array:
        """Pose (4, 4) of the body as the equations alone predict it."""

    @property
    @abstractmethod
    def largest_speed(self) -> float:
        """Largest size of what was told to a wheel [rad/s], or on legs of the accepted twist [m/s, rad/s]."""

    @abstractmethod
    def hello(self) -> dict[str, Any]:
        """What a page must know to show its controls."""

    @abstractmethod
    def state(self, message: Message | None) -> dict[str, Any]:
        """What a page shows, under a command."""

    @abstractmethod
    def _place(self) -> None:
        """Puts the robot where it starts."""

    @abstractmethod
    def _forget(self) -> None:
        """Starts again with what is not in the context."""

    @abstractmethod
    def _command(self, message: Message | None) -> None:
        """Sets the inputs for the next period."""

    @abstractmethod
    def _look(self) -> str | None:
        """What is wrong with the robot, in words, or None."""


def plain(values: Array) -> list[float]:
    """Numbers for JSON; those that are not finite become 0."""
    return [float(value) for value in np.nan_to_num(np.asarray(values), posinf=0.0, neginf=0.0)]


def pose_error(simulated: Array, predicted: Array) -> list[float]:
    """Distance [m] and turn in [-pi, pi] [rad] from a predicted to a simulated pose (3,)."""
    turn = (simulated[2] - predicted[2] + np.pi) % (2 * np.pi) - np.pi
    return plain(np.array([np.hypot(*(simulated - predicted)[:2]), turn]))
