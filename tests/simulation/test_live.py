"""Live runs: what is paced, paused, slowed down and repeated is recorded as if nobody had watched."""

import io
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import matplotlib.image
import numpy as np
import pytest
import umsgpack
from pydrake.geometry import Meshcat

import rollerbench as rb
from browser import opened
from rollerbench.errors import ResourceError, SimulationError
from rollerbench.recording import Recording
from rollerbench.simulation.live import FRAME
from rollerbench.simulation.pace import LATEST, Pace
from rollerbench.simulation.watch import CHUNK
from rollerbench.visualization.live_scene import LiveScene
from rollerbench.visualization.surroundings import local_meshcat

QUICK = {"duration": 0.4, "command.ramp": 0.1, "recording.html": False}


@dataclass
class Clock:
    """A clock that only sleep moves on, and the times that a run had reached whenever it slept."""

    now: float = 0.0
    slept: list[float] = field(default_factory=list)
    on_sleep: Callable[["Clock"], None] = lambda clock: None

    def __call__(self) -> float:
        return self.now

    def sleep(self, duration: float) -> None:
        assert duration >= 0.0
        self.now += max(duration, 1e-6)
        self.slept.append(duration)
        self.on_sleep(self)


def click(meshcat: Meshcat, button: str) -> None:
    meshcat._InjectWebsocketMessage(message=umsgpack.packb({"type": "button", "name": button}))


def slide(meshcat: Meshcat, value: float) -> None:
    meshcat._InjectWebsocketMessage(message=umsgpack.packb({"type": "slider", "name": "Speed", "value": value}))


def assert_same(one: Recording, other: Recording) -> None:
    assert one.columns.keys() == other.columns.keys()
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, other.columns[name], err_msg=name)


@pytest.fixture(scope="module")
def meshcat() -> Meshcat:
    return local_meshcat(port=0)


@pytest.fixture(scope="module")
def scenario() -> rb.Scenario:
    return rb.load_scenario("youbot_plus_y", overrides={**QUICK, "recording.forces": True})


@pytest.fixture(scope="module")
def unseen(scenario: rb.Scenario) -> rb.RunResult:
    return rb.run(scenario, save=False)


def live_run(scenario: rb.Scenario, meshcat: Meshcat, clock: Clock, **options: object) -> rb.RunResult:
    stay = options.pop("stay", lambda: False)
    live = rb.Live(clock=clock, sleep=clock.sleep, stay=stay)  # type: ignore[arg-type]
    return rb.run(scenario, save=False, meshcat=meshcat, live=live, **options)  # type: ignore[arg-type]


def test_pace_waits_for_the_clock_and_forgives_what_is_too_late() -> None:
    clock = Clock()
    pace = Pace(clock)
    pace.add(0.3, speed=0.5)
    assert pace.ahead() == pytest.approx(0.6)
    clock.now = 10.0
    pace.add(0.02, speed=1.0)
    assert pace.ahead() == pytest.approx(-LATEST)
    pace.add(0.15, speed=1.0)
    assert pace.ahead() == pytest.approx(0.15 - LATEST)


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_a_live_run_takes_its_time_and_records_what_an_unseen_one_does(
    speed: float, scenario: rb.Scenario, unseen: rb.RunResult, meshcat: Meshcat
) -> None:
    """The clock stands still while Drake works: waiting makes up the duration over the speed but for the last piece."""
    clock = Clock()
    timed = rb.load_scenario(scenario, overrides={"simulator.target_realtime_rate": speed})
    result = live_run(timed, meshcat, clock)
    assert 0.0 <= 0.4 / speed - clock.now <= min(CHUNK, speed * FRAME) / speed + 1e-6
    assert_same(result.recording, unseen.recording)
    assert not {"Reset", "Speed"} & {*meshcat.GetButtonNames(), *meshcat.GetSliderNames()}


def test_a_meshcat_alone_shows_the_run_unpaced(scenario: rb.Scenario, unseen: rb.RunResult, meshcat: Meshcat) -> None:
    result = rb.run(scenario, save=False, meshcat=meshcat)
    assert_same(result.recording, unseen.recording)
    for path in ("/ghost/body", "/trails/simulated/0", "/trails/reference/0", "/forces/front_left_0/arrow"):
        assert meshcat.HasPath(path)
    assert meshcat.GetButtonNames() == []
    LiveScene(meshcat, rb.load_robot("kiwi"))
    for path in ("/trails/simulated/0", "/forces", "/ghost/front_left"):
        assert not meshcat.HasPath(path)


def test_pictures_between_the_steps_do_not_change_how_rollers_are_followed(meshcat: Meshcat) -> None:
    scenario = rb.load_scenario(
        {
            "name": "watched",
            "robot": "kiwi",
            "duration": 1.5,
            "command": {"type": "twist", "v_xyw_B": [0.3, 0.0, 0.5], "ramp": 0.3},
            "plant": {"time_step": 0.005},
            "recording": {"html": False, "frames_per_second": 30},
        }
    )
    unseen = rb.run(scenario, save=False)
    assert_same(rb.run(scenario, save=False, meshcat=meshcat).recording, unseen.recording)


def test_pause_step_and_speed(scenario: rb.Scenario, unseen: rb.RunResult, meshcat: Meshcat) -> None:
    reached, paused = [0.0], []

    def on_sleep(clock: Clock) -> None:
        sleeps = len(clock.slept)
        if sleeps == 2:
            click(meshcat, "Pause / Resume")
        elif 3 <= sleeps < 50:
            paused.append(reached[-1])
        elif sleeps == 50:
            click(meshcat, "Step")
        elif sleeps == 60:
            paused.append(reached[-1])
            slide(meshcat, 0.1)
            click(meshcat, "Pause / Resume")
            clock.now = 100.0

    clock = Clock(on_sleep=on_sleep)
    result = live_run(scenario, meshcat, clock, progress=reached.append)
    held = paused[0]
    assert 0.0 < held < 0.2
    assert set(paused[:-1]) == {held}
    assert 0.0 < paused[-1] - held <= FRAME
    # The rest takes ten times as long, but for the last piece and what is left of the present frame.
    assert clock.now - 100.0 == pytest.approx(10 * (0.4 - paused[-1]), abs=0.25)
    assert_same(result.recording, unseen.recording)


@pytest.mark.parametrize("at_the_end", [False, True])
def test_a_run_that_was_reset_ends_as_one_that_was_not(
    at_the_end: bool, scenario: rb.Scenario, unseen: rb.RunResult, meshcat: Meshcat
) -> None:
    reached, asked = [0.0], []

    def progress(now: float) -> None:
        if not at_the_end and now > 0.2 and max(reached) <= 0.2:
            click(meshcat, "Reset")
        reached.append(now)

    def stay() -> bool:
        asked.append(reached[-1])
        if at_the_end and len(asked) == 3:
            click(meshcat, "Reset")
        return at_the_end and len(asked) < 6

    result = live_run(scenario, meshcat, Clock(), progress=progress, stay=stay)
    assert np.count_nonzero(np.diff(reached) < 0) == 1
    assert_same(result.recording, unseen.recording)


@pytest.mark.parametrize("errors", [{}, {"errors.lost_legs": {"front_left": 0.1}}])
def test_legs_start_again_too(errors: dict[str, object], meshcat: Meshcat) -> None:
    scenario = rb.load_scenario(
        "hexapod_stand", overrides={"recording.html": False, "recording.forces": True, **errors}
    )
    clicked: list[float] = []

    def progress(now: float) -> None:
        if now > 0.2 and not clicked:
            clicked.append(now)
            click(meshcat, "Reset")

    def outcome(run: Callable[[], rb.RunResult]) -> tuple[Recording, str | None]:
        try:
            return run().recording, None
        except SimulationError as error:
            return error.result.recording, str(error)

    unseen, failure = outcome(lambda: rb.run(scenario, save=False))
    shown, same = outcome(lambda: live_run(scenario, meshcat, Clock(), progress=progress))
    assert clicked
    assert_same(shown, unseen)
    assert (failure is None) == (same is None)
    assert meshcat.HasPath("/support/polygon")


def test_ctrl_c_while_paused_keeps_what_there_is(scenario: rb.Scenario, meshcat: Meshcat) -> None:
    def on_sleep(clock: Clock) -> None:
        if len(clock.slept) == 5:
            click(meshcat, "Pause / Resume")
        if len(clock.slept) == 30:
            raise KeyboardInterrupt

    with pytest.raises(SimulationError, match=r"interrupted at t = 0\.") as caught:
        live_run(scenario, meshcat, Clock(on_sleep=on_sleep))
    assert 0 < caught.value.result.recording.time[-1] < 0.4


def test_a_port_in_use_and_a_live_run_without_a_page_are_refused(scenario: rb.Scenario, meshcat: Meshcat) -> None:
    with pytest.raises(ResourceError, match=f"cannot listen at localhost, port {meshcat.port()}"):
        local_meshcat(port=meshcat.port())
    with pytest.raises(ResourceError, match="port = 80: accepted: 0 for any"):
        local_meshcat(port=80)
    with pytest.raises(SimulationError, match="live: accepted: together with a meshcat"):
        rb.run(scenario, save=False, live=rb.Live())


def test_the_page_pauses_the_run_and_shows_the_ghost_apart_from_the_robot() -> None:
    """A motor that turns less than it is told leads the cart away from its ghost: their colours are apart."""
    scenario = rb.load_scenario(
        "cart_straight",
        overrides={
            "duration": 7.0,
            "errors.gear_error": {"left": {"constant": -0.3}},
            "recording.html": False,
            "recording.camera": "follow",
        },
    )
    times, address, over = [0.0], [], threading.Event()

    def simulate() -> None:
        meshcat = local_meshcat(port=0)  # It answers only to the thread that made it.
        address.append(meshcat.web_url())
        live = rb.Live(patience=60.0, stay=lambda: not over.is_set())
        rb.run(scenario, save=False, meshcat=meshcat, live=live, progress=times.append)

    worker = threading.Thread(target=simulate)
    worker.start()
    try:
        while not address and worker.is_alive():
            over.wait(0.01)
        with opened(address[0]) as watched:
            page = watched.page
            page.get_by_text("Open Controls").click()
            while times[-1] < 0.3 * scenario.duration and worker.is_alive():
                page.wait_for_timeout(50)
            page.get_by_text("Pause / Resume", exact=True).click()
            page.wait_for_timeout(300)
            held = times[-1]
            page.wait_for_timeout(500)
            assert times[-1] == held < scenario.duration
            red, green, blue = np.moveaxis(_pixels(page.screenshot()), -1, 0)
            page.keyboard.press("Space")
            page.wait_for_timeout(300)
            assert watched.requests == []
            assert watched.errors == []
    finally:
        over.set()
        worker.join()
    assert times[-1] == pytest.approx(scenario.duration)
    orange = (red > 0.6) & (blue < 0.25) & (green < 0.6)
    azure = (blue > 0.5) & (red < 0.45)
    assert orange.mean() > 5e-4
    assert azure.mean() > 5e-4
    middles = [np.argwhere(each).mean(axis=0) for each in (orange, azure)]
    assert np.linalg.norm(middles[0] - middles[1]) > 20


def _pixels(png: bytes) -> np.ndarray:
    return matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]
