"""The page in a real browser: it shows the robot, moves it, and when it goes away the robot stops."""

import io
import time
from collections.abc import Callable
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from browser import opened
from rollerbench.simulation.teleop import Teleop

PATIENCE = 60.0
"""Machines may be slow: nothing here is waited for without an end [s]."""

TIMEOUT = 5.0


def until(met: Callable[[], Any]) -> None:
    end = time.monotonic() + PATIENCE
    while not met():
        assert time.monotonic() < end
        time.sleep(0.02)


def colors(png: bytes) -> int:
    pixels = matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]
    return len(np.unique((pixels * 16).astype(int).reshape(-1, 3), axis=0))


def test_a_page_drives_the_robot_and_the_robot_stops_when_it_goes() -> None:
    with Teleop("youbot_base", timeout=TIMEOUT) as teleop, opened(teleop.url, 1200, 800) as watched:
        page, state = watched.page, teleop.state
        page.wait_for_function("document.querySelector('#status').textContent.includes('real time')")
        scene = page.frame_locator("#scene").locator("canvas").first
        scene.wait_for(timeout=1e3 * PATIENCE)
        # The robot, its ghost and the ground, and not one colour.
        until(lambda: colors(page.locator("#scene").screenshot()) > 40)

        # A slider, moved by hand: forward, and not sideways.
        vx = page.locator("#twist input").first
        vx.focus()
        for _ in range(20):
            page.keyboard.press("ArrowRight")
        until(lambda: state()["pose"][0] > 0.1)
        assert abs(state()["pose"][1]) < 0.01
        until(lambda: state()["twist"] == pytest.approx([0.2 * 2 * 1.425, 0.0, 0.0]))
        page.get_by_role("button", name="Stop").click()
        until(lambda: state()["twist"] == [0.0, 0.0, 0.0] and not any(state()["told_twist"]))

        # A key that is held: to the left. The window loses the keyboard: it stops.
        x, y, _ = state()["pose"]
        page.keyboard.down("a")
        until(lambda: state()["pose"][1] > y + 0.1)
        assert abs(state()["pose"][0] - x) < 0.02
        page.keyboard.up("a")
        until(lambda: not any(state()["twist"]))
        page.keyboard.down("q")
        until(lambda: state()["twist"][2] > 0)
        page.evaluate("window.dispatchEvent(new Event('blur'))")
        until(lambda: not any(state()["twist"]))
        page.keyboard.up("q")

        # Space stops also after a click into the scene, and what is still held then does not drive on.
        vx.focus()
        page.keyboard.press("ArrowRight")
        until(lambda: state()["twist"][0] > 0)
        page.locator("#scene").click()
        page.wait_for_timeout(200)
        page.wait_for_function("document.activeElement.id !== 'scene'")
        page.keyboard.press("Space")
        until(lambda: not any(state()["twist"]))
        page.keyboard.down("w")
        until(lambda: state()["twist"][0] > 0)
        page.keyboard.press("Space")
        until(lambda: not any(state()["twist"]))
        page.keyboard.down("w")
        page.wait_for_timeout(300)
        assert not any(state()["twist"])
        page.keyboard.up("w")

        # One wheel alone, which contradicts the others.
        page.get_by_label("front left, speed").focus()
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        until(lambda: state()["wheels"]["front_left"]["told"] == pytest.approx(3.0))
        targets = [wheel["target"] for wheel in state()["wheels"].values()]
        assert targets == pytest.approx([3.0, 0.0, 0.0, 0.0])
        page.get_by_text("The wheels contradict each other: one must slide by 36 mm/s.").wait_for()
        page.keyboard.press("Escape")
        until(lambda: teleop.history[-1].largest_speed == 0.0)

        # It goes away while it drives.
        page.keyboard.down("w")
        until(lambda: state()["told_twist"][0] > 0.1)
        assert watched.errors == []
        assert watched.requests == []
        page.close()
        until(lambda: teleop.history[-1].driver is None)
        until(lambda: teleop.history[-1].largest_speed == 0.0)
        until(lambda: np.abs(state()["measured_twist"]).max() < 1e-3)
        moments = list(teleop.history)
        last = max(index for index, moment in enumerate(moments) if moment.moves)
        # By the server's own clock: what moved the robot last was young enough.
        assert moments[last].age <= TIMEOUT
