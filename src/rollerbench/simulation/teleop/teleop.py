"""Drives a simulated robot by hand, from a page in a browser."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rollerbench.description import Robot
from rollerbench.errors import RollerbenchError
from rollerbench.simulation.pace import Pace
from rollerbench.simulation.teleop.desk import Desk, Order
from rollerbench.simulation.teleop.leg_session import LegSession
from rollerbench.simulation.teleop.server import Server
from rollerbench.simulation.teleop.session import PERIOD, Session, teleop_scenario
from rollerbench.simulation.teleop.wheel_session import WheelSession
from rollerbench.visualization.live_scene import LiveScene
from rollerbench.visualization.surroundings import local_meshcat

FRAME_TIME, STATE_TIME = 1 / 30, 1 / 15
"""Times between two pictures, and between two states that pages are told [s]."""

LARGEST_PORT = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """One period of control, as it was.

    Attributes:
        wall_time: When it began, on the clock `time.monotonic` [s].
        age: How old the last command was then [s].
        driver: Number of the page that drove, or None.
        moves: Whether any motion was asked for: never when the command is older than the timeout.
        largest_speed: Largest size of what was told to a wheel [rad/s]; on legs of the accepted twist [m/s, rad/s].
    """

    wall_time: float
    age: float
    driver: int | None
    moves: bool
    largest_speed: float


class Teleop:
    """A robot in simulation, and a page to drive it by hand: `run` here, or a `with` block while which it runs.

    The port of its scene, which is Drake's Meshcat, stays open until the process ends.

    Attributes:
        url: The page's address, once it runs.
        history: The last moments.
    """

    url: str

    def __init__(
        self,
        robot: Robot | str | Path | Mapping[str, Any],
        *,
        overrides: Mapping[str, Any] | Sequence[str] = (),
        host: str = "localhost",
        port: int = 0,
        timeout: float = 0.5,
    ) -> None:
        """Prepares the simulation.

        Args:
            robot: Robot, name of a shipped one, path to a robot.yaml, or its content.
            overrides: Fields of the scenario: {"ground.friction": 0.2} or ["ground.friction=0.2"].
            host: Where to serve the page and its scene; "0.0.0.0" for every address of this machine.
            port: The page's port, 0 for any that is free.
            timeout: Wall time without a word from the page after which the robot stops [s].

        Raises:
            RollerbenchError: an argument is not valid.
        """
        number = isinstance(timeout, int | float) and not isinstance(timeout, bool)
        if not (number and math.isfinite(timeout) and timeout > 0):
            raise RollerbenchError(f"--timeout {timeout}: accepted: a positive number of seconds")
        if type(port) is not int or not 0 <= port <= LARGEST_PORT:
            raise RollerbenchError(f"--port {port}: accepted: 0 (any that is free) to {LARGEST_PORT}")
        self._scenario = teleop_scenario(robot, overrides)
        self._host, self._port, self._timeout = host, port, timeout
        self._stop, self._ready = threading.Event(), threading.Event()
        self._state: dict[str, Any] = {}
        self._error: BaseException | None = None
        self._thread: threading.Thread | None = None
        self.history: deque[Moment] = deque(maxlen=3000)

    def __enter__(self) -> Self:
        """Runs in a thread until the block ends; returns once the page is served."""
        self._stop.clear()
        self._ready.clear()
        self._error = None
        self._thread = threading.Thread(target=self._run_quietly, name="teleop", daemon=True)
        self._thread.start()
        self._ready.wait()
        if self._error is not None:
            self._thread.join()
            raise self._error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stops."""
        self.stop()
        if self._thread is not None:
            self._thread.join()
        if self._error is not None and error is None:
            raise self._error

    def stop(self) -> None:
        """Lets `run` come to its end."""
        self._stop.set()

    def state(self) -> dict[str, Any]:
        """What pages were told last."""
        return self._state

    def run(self, ready: Callable[[str], None] = lambda url: None) -> None:
        """Simulates in real time until `stop`, in this thread.

        Args:
            ready: Called with the page's address when it is served.

        Raises:
            RollerbenchError: the port cannot be had, or Drake refuses a setting.
            SimulationError: the robot cannot stand.
        """
        desk = Desk(self._timeout)
        server = Server(desk, self._host, self._port)
        try:
            # Meshcat wants to be spoken to from the thread that made it.
            meshcat = local_meshcat(self._host)
            legs = bool(self._scenario.robot.legs)
            session: Session = (LegSession if legs else WheelSession)(self._scenario, meshcat)
            scene = LiveScene(meshcat, session.robot, camera="follow")
            server.start(
                {
                    "robot": session.robot.name,
                    "summary": session.robot.summary,
                    "meshcat_port": meshcat.port(),
                    "timeout": self._timeout,
                    **session.hello(),
                }
            )
            self.url = server.url
            ready(server.url)
            self._ready.set()
            self._loop(session, scene, desk, server)
        finally:
            server.stop()

    def _run_quietly(self) -> None:
        """Runs; what goes wrong is told to who waits."""
        try:
            self.run()
        except BaseException as error:
            self._error = error
        finally:
            self._ready.set()

    def _loop(self, session: Session, scene: LiveScene, desk: Desk, server: Server) -> None:
        pace, frame, told = _Pace(), 0.0, 0.0
        while not self._stop.is_set():
            now = time.monotonic()
            order = desk.order(now)
            for action in order.actions:
                if action == "reset":
                    session.restart()
                    scene.restart()
                else:
                    scene.camera(action)
            session.advance(order.message)
            self._remember(session, order, now)
            if now - frame >= FRAME_TIME:
                scene.show(session.pose_W, session.ghost_W)
                frame = now
            if now - told >= STATE_TIME:
                self._tell(session, order, pace.factor, server)
                told = now
            pace.wait(self._stop)

    def _remember(self, session: Session, order: Order, now: float) -> None:
        moves = order.message is not None and order.message.moves
        self.history.append(
            Moment(wall_time=now, age=order.age, driver=order.driver, moves=moves, largest_speed=session.largest_speed)
        )

    def _tell(self, session: Session, order: Order, factor: float, server: Server) -> None:
        self._state = {
            "kind": "state",
            "time": session.time,
            "factor": factor,
            "fault": session.fault,
            "driver": order.driver,
            "late": order.late,
            "lapses": order.lapses,
            **session.state(None if session.fault else order.message),
        }
        server.broadcast(self._state)


class _Pace:
    """Keeps the simulation from running ahead of the clock.

    Attributes:
        factor: Simulated time over wall time of the last second or so.
    """

    def __init__(self) -> None:
        self.factor = 1.0
        self._pace, self._since, self._periods = Pace(time.monotonic), time.monotonic(), 0

    def wait(self, stop: threading.Event) -> None:
        """Waits until the next period is due; time that was lost is made up for only in part."""
        self._pace.add(PERIOD, 1.0)
        self._periods += 1
        passed = time.monotonic() - self._since
        if passed >= 1.0:
            self.factor = self._periods * PERIOD / passed
            self._since, self._periods = time.monotonic(), 0
        if self._pace.ahead() > 0:
            stop.wait(self._pace.ahead())
