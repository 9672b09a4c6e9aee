"""Shows a simulation in Meshcat while it runs: paced to real time, with buttons to pause, step and start again."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatVisualizer
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from rollerbench.description.inertia import GRAVITY
from rollerbench.kinematics.profile import reference_poses
from rollerbench.simulation.leg_station import LegStation
from rollerbench.simulation.pace import Pace
from rollerbench.simulation.scenario import Scenario
from rollerbench.simulation.station import Station
from rollerbench.simulation.watch import CHUNK
from rollerbench.visualization import marks
from rollerbench.visualization.live_marks import ForceArrows, SupportPolygon
from rollerbench.visualization.live_scene import LiveScene
from rollerbench.visualization.scenes import View

Array = NDArray[np.float64]

FRAME = 1 / 30
"""Time between two pictures, and what the button Step simulates [s]."""

POLL = 0.02
"""Time between two looks at the buttons of a simulation that waits [s]."""

PAUSE, STEP, RESET, SPEED = "Pause / Resume", "Step", "Reset", "Speed"
BUTTONS = {PAUSE: "Space", STEP: "Period", RESET: "KeyR"}
CAMERAS: dict[str, View] = {view.capitalize(): view for view in get_args(View)}
"""Buttons, in the order of the keys 1, 2, 3."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Live:
    """Paces a run to real time and lets its page control it (`rollerbench.run(..., meshcat=..., live=Live())`).

    Under Open Controls the page has the buttons Pause / Resume (space), Step (full stop), Reset (R), Iso, Top and
    Follow (1, 2, 3), and the slider Speed (- and =), which starts at the scenario's simulator.target_realtime_rate if
    it has one, else at 1. None of them changes what is simulated: the recording is bitwise that of a run that nobody
    watched. The real-time factor in its summary is the simulation's own, without the waiting.

    Attributes:
        patience: How long the robot waits at the start for a page to connect [s].
        stay: Asked at the end, again and again: while it says True, the page can start the run again.
        clock: Tells the time [s].
        sleep: Waits for a time [s].
    """

    patience: float = 0.0
    stay: Callable[[], bool] = lambda: False
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


class Controls:
    """Buttons and slider in the panel of a Meshcat page."""

    def __init__(self, meshcat: Meshcat, speed: float) -> None:
        """Adds them; the slider starts at a speed [-]."""
        self._meshcat = meshcat
        self.remove()
        for name, key in BUTTONS.items():
            meshcat.AddButton(name, key)
        meshcat.AddSlider(SPEED, 0.1, 4.0, 0.1, speed, "Minus", "Equal")
        for number, name in enumerate(CAMERAS, 1):
            meshcat.AddButton(name, f"Digit{number}")
        self._seen = dict.fromkeys((*BUTTONS, *CAMERAS), 0)

    @property
    def speed(self) -> float:
        """The chosen speed [-]."""
        return float(self._meshcat.GetSliderValue(SPEED))

    def clicked(self) -> set[str]:
        """Buttons that were clicked since this was last asked."""
        counts = {name: self._meshcat.GetButtonClicks(name) for name in self._seen}
        new = {name for name, count in counts.items() if count > self._seen[name]}
        self._seen = counts
        return new

    def remove(self) -> None:
        """Takes them away; another run may add its own."""
        for name in (*BUTTONS, *CAMERAS):
            if name in self._meshcat.GetButtonNames():
                self._meshcat.DeleteButton(name)
        if SPEED in self._meshcat.GetSliderNames():
            self._meshcat.DeleteSlider(SPEED)


class LiveShow:
    """Shows a station that is being simulated, between the pieces in which its simulator advances."""

    def __init__(
        self,
        meshcat: Meshcat,
        simulator: Simulator,
        scenario: Scenario,
        *,
        restart: Callable[[], None],
        live: Live | None = None,
    ) -> None:
        """Dresses the scene of a station's simulator, which is initialized.

        Args:
            meshcat: Where the station shows its robot.
            simulator: The simulator of a `Station` or `LegStation`.
            scenario: What it simulates.
            restart: Brings the simulation back to its start.
            live: How to pace it; without, it runs as fast as it can, and the page has no buttons.
        """
        station = simulator.get_system()
        assert isinstance(station, Station | LegStation)
        self._meshcat, self._station, self._restart, self._live = meshcat, station, restart, live
        self._context, self._time_step = simulator.get_context(), scenario.plant.time_step
        self._visualizer = next(each for each in station.GetSystems() if isinstance(each, MeshcatVisualizer))
        self._reference, path = _reference(station, scenario)
        settings = scenario.recording
        self._scene = LiveScene(meshcat, scenario.robot, camera=settings.camera, reference_q_xyt=path)
        self._arrows = ForceArrows(meshcat, scenario.robot) if settings.forces else None
        self._support = SupportPolygon(meshcat, scenario.robot) if scenario.robot.legs else None
        self._controls: Controls | None = None
        self._paused, self._shown = False, 0.0
        self._draw()
        if live is not None:
            self._controls = Controls(meshcat, simulator.get_target_realtime_rate() or 1.0)
            simulator.set_target_realtime_rate(0.0)
            self._pace = Pace(live.clock)

    def begin(self) -> None:
        """Waits for somebody to look, if it is live, and not for long."""
        if self._live is not None:
            patience = self._live.clock() + self._live.patience
            while not self._meshcat.GetNumActiveConnections() and self._live.clock() < patience:
                self._live.sleep(POLL)
            self._pace.restart()

    def piece(self) -> int:
        """Steps of the plant to simulate until the next picture; slow motion has as many pictures as real time."""
        span = FRAME
        if self._controls is not None and not self._paused:
            span = min(CHUNK, self._controls.speed * FRAME)
        return max(1, math.floor(span / self._time_step + 1e-6))

    def frame(self, *, over: bool) -> bool:
        """Shows the present, and waits until it is time to go on.

        Args:
            over: Whether the run is over.

        Returns:
            Whether to go on from the start, to which the simulation has been brought back.
        """
        self._draw()
        if self._controls is None or self._live is None:
            return False
        now = self._context.get_time()
        self._pace.add(now - self._shown, self._controls.speed)
        self._shown = now
        try:
            return self._wait(self._controls, self._live, over=over)
        except KeyboardInterrupt:
            if over:
                return False
            raise

    def close(self) -> None:
        """Takes the buttons away."""
        if self._controls is not None:
            self._controls.remove()

    def _wait(self, controls: Controls, live: Live, *, over: bool) -> bool:
        while True:
            clicked = controls.clicked()
            for name in clicked & CAMERAS.keys():
                self._scene.camera(CAMERAS[name])
                self._draw()
            if PAUSE in clicked:
                self._paused = not self._paused
            if RESET in clicked:
                self._go_back()
                return True
            if over:
                if not live.stay():
                    return False
            elif STEP in clicked:
                self._paused = True
                return False
            elif not self._paused and self._pace.ahead() <= 0:
                return False
            if over or self._paused:
                self._pace.restart()
                live.sleep(POLL)
            else:
                live.sleep(min(POLL, max(0.0, self._pace.ahead())))

    def _go_back(self) -> None:
        self._restart()
        self._scene.restart()
        self._shown = self._context.get_time()
        self._draw()
        self._pace.restart()

    def _draw(self) -> None:
        self._visualizer.ForcedPublish(self._visualizer.GetMyContextFromRoot(self._context))
        model = self._station.parts.model
        X_WB = model.plant.EvalBodyPoseInWorld(model.plant.GetMyContextFromRoot(self._context), model.body)
        self._scene.show(X_WB.GetAsMatrix4(), self._reference(self._context))
        if self._arrows is not None:
            places, forces, slips = map(self._output, ("contact_points", "contact_forces", "slip"))
            self._arrows.show(places.reshape(-1, 3), forces.reshape(-1, 3), slips)
        if self._support is not None:
            stands = self._output("normal_forces") > marks.BEARS * model.robot.mass * GRAVITY
            self._support.show(_soles(self._station, self._context)[stands])

    def _output(self, name: str) -> Array:
        return np.asarray(self._station.GetOutputPort(name).Eval(self._context))


def _soles(station: Station | LegStation, context: Context) -> Array:
    """Lowest points (n_legs, 3) of the feet [m]."""
    model = station.parts.model
    own = model.plant.GetMyContextFromRoot(context)
    centers = [model.plant.EvalBodyPoseInWorld(own, model.foot_body(leg)).translation() for leg in model.robot.legs]
    return np.array(centers) - [[0.0, 0.0, leg.wheel.radius] for leg in model.robot.legs]


def _reference(station: Station | LegStation, scenario: Scenario) -> tuple[Callable[[Context], Array], Array]:
    """Where the equations have the body (4, 4) at a context's time, and the path (n, 3) that it will take."""
    if isinstance(station, LegStation):
        desired = station.GetOutputPort("desired")
        return lambda context: _pose(desired.Eval(context)), scenario.rehearsal.reference
    step, height = scenario.plant.time_step, -scenario.robot.ground_height
    last = round(scenario.duration / step) + 1
    times = np.linspace(0.0, last * step, last + 1)
    path = reference_poses(scenario.motion.twist, times)

    def pose(context: Context) -> Array:
        x, y, yaw = path[round(context.get_time() / step)]
        return _pose(np.array([x, y, height, 0.0, 0.0, yaw]))

    return pose, path


def _pose(position_rpy: Array) -> Array:
    return RigidTransform(RollPitchYaw(position_rpy[3:]), position_rpy[:3]).GetAsMatrix4()
