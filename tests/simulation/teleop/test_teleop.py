"""The server, through its WebSocket: driving, silence, goodbye, strangers; wheels and legs."""

import asyncio
import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

import rollerbench as rb
from rollerbench.cli import main
from rollerbench.simulation.teleop import Teleop
from rollerbench.simulation.teleop.desk import Message
from rollerbench.simulation.teleop.leg_session import LegSession
from rollerbench.simulation.teleop.server import FILES
from rollerbench.simulation.teleop.session import teleop_scenario
from rollerbench.simulation.teleop.wheel_session import WheelSession

PATIENCE = 60.0
"""Machines may be slow: nothing here is waited for without an end [s]."""


def socket_of(teleop: Teleop) -> str:
    return teleop.url.replace("http", "ws") + "socket"


@asynccontextmanager
async def connected(teleop: Teleop) -> AsyncIterator[WebSocketClientConnection]:
    """A connection that is closed, and has heard so, at the end."""
    channel = await websocket_connect(socket_of(teleop))
    yield channel
    channel.close()
    while channel.close_code is None and await channel.read_message() is not None:
        pass


async def until(met: Callable[[], Any], channel: WebSocketClientConnection | None = None, **command: Any) -> None:
    """Waits for something, as a page that sends a command all the while."""
    end = time.monotonic() + PATIENCE
    while not met():
        assert time.monotonic() < end
        if channel is not None:
            await channel.write_message(json.dumps(command))
        await asyncio.sleep(0.05)


def obeys_the_timeout(teleop: Teleop, timeout: float) -> bool:
    """Whether nothing moved by a command that was too old, by the server's own clock."""
    return all(not moment.moves for moment in list(teleop.history) if moment.age > timeout)


def test_silence_and_goodbye_stop_the_robot() -> None:
    with Teleop("kiwi", timeout=0.3) as teleop:

        async def drive() -> None:
            async with connected(teleop) as channel:
                hello = json.loads(await channel.read_message())
                assert hello["kind"] == "hello"
                assert [wheel["name"] for wheel in hello["wheels"]] == ["front", "rear_left", "rear_right"]
                ahead = {"touch": 1, "twist": [0.3, 0.0, 0.0]}
                await until(lambda: teleop.state().get("pose", [0])[0] > 0.05, channel, **ahead)
                assert abs(teleop.state()["pose"][1]) < 0.01
                # Silence, the connection open.
                await until(lambda: teleop.state()["late"])
                await until(lambda: teleop.history[-1].largest_speed == 0.0)
                assert teleop.state()["driver"] is None
                # It goes on by itself, and its user does something before it was told: nothing moves.
                stopped = teleop.state()["time"]
                await until(lambda: teleop.state()["time"] > stopped + 0.4, channel, **ahead)
                await until(lambda: teleop.state()["time"] > stopped + 0.8, channel, **{**ahead, "touch": 2})
                assert teleop.history[-1].largest_speed == 0.0
                # Its user does something anew, and single wheels.
                ahead |= {"touch": 3, "lapses": 1}
                await until(lambda: teleop.history[-1].largest_speed > 1.0, channel, **ahead)
                wheel = {"touch": 4, "lapses": 1, "mode": "wheels", "wheels": {"front": 5.0}}
                await until(lambda: teleop.state()["wheels"]["front"]["told"] == 5.0, channel, **wheel)
                told = [wheel["told"] for wheel in teleop.state()["wheels"].values()]
                assert told == pytest.approx([5.0, 0.0, 0.0])
                # Goodbye.
                channel.close()
                await until(lambda: teleop.history[-1].driver is None)
                await until(lambda: teleop.history[-1].largest_speed == 0.0)

        asyncio.run(drive())
        assert any(moment.moves for moment in teleop.history)
        assert any(moment.age > 0.3 for moment in teleop.history)
        assert obeys_the_timeout(teleop, 0.3)


def test_reset_brings_the_robot_back_also_after_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[str] = []
    monkeypatch.setattr("rollerbench.simulation.teleop.wheel_session.fault", lambda *_: found[0] if found else None)
    with Teleop("youbot_base") as teleop:

        async def drive() -> None:
            async with connected(teleop) as channel:
                pair = {"touch": 1, "mode": "wheels", "wheels": dict.fromkeys(("front_left", "rear_left"), 30.0)}
                await until(lambda: teleop.state().get("time", 0.0) > 0.5, channel, **pair)
                assert teleop.state()["pose"][2] < -0.1
                found.append("the robot tipped over")
                await until(lambda: teleop.state()["fault"], channel, **pair)
                stopped = teleop.state()["time"]
                assert teleop.state()["fault"] == f"at t = {stopped:.2f} s the robot tipped over"
                found.clear()
                await channel.write_message(json.dumps({"touch": 2, "action": "reset"}))
                await until(lambda: not teleop.state()["fault"])
                state = teleop.state()
                assert state["time"] < stopped
                assert state["pose"] == pytest.approx([0, 0, 0], abs=1e-3)
                assert state["ghost"] == [0, 0, 0]
                await until(lambda: teleop.state()["time"] > state["time"])

        asyncio.run(drive())


def test_strangers_and_babblers_are_turned_away() -> None:
    with Teleop("kiwi") as teleop:
        for name, (_, kind) in FILES.items():
            with urllib.request.urlopen(teleop.url + name) as answer:
                assert answer.headers["Content-Type"].startswith(kind)
        for request in (
            urllib.request.Request(teleop.url, headers={"Host": "stranger.example"}),
            urllib.request.Request(teleop.url + "server.py"),
        ):
            with pytest.raises(urllib.error.HTTPError, match="404") as refused:
                urllib.request.urlopen(request)
            refused.value.close()

        async def strangers() -> None:
            foreign = HTTPRequest(socket_of(teleop), headers={"Origin": "http://stranger.example"})
            with pytest.raises(HTTPClientError, match="403"):
                await websocket_connect(foreign)
            async with connected(teleop) as channel:
                await channel.write_message('{"touch": 1, "twist": [Infinity, 0, 0]}')
                while await channel.read_message() is not None:
                    pass
                assert channel.close_code == 1003

        asyncio.run(strangers())
        assert not any(moment.moves for moment in teleop.history)


def test_a_hexapod_walks_and_changes_its_posture() -> None:
    with Teleop("wheel_leg_hexapod") as teleop:

        async def drive() -> None:
            async with connected(teleop) as channel:
                hello = json.loads(await channel.read_message())
                assert hello["postures"] == ["insect", "mammal"]
                walk = {"touch": 1, "twist": [0.2, 0.0, 0.0], "posture": "insect", "gait": "tripod"}
                await until(lambda: teleop.state().get("pose", [0])[0] > 0.06, channel, **walk)
                state = teleop.state()
                assert state["activity"] == "walk"
                assert abs(state["pose"][1]) < 0.01
                assert state["error"][0] < 0.01
                await until(
                    lambda: not all(foot["stands"] for foot in teleop.state()["feet"].values()), channel, **walk
                )
                change = {**walk, "touch": 2, "twist": [0, 0, 0], "posture": "mammal"}
                await until(lambda: teleop.state()["activity"] == "change", channel, **change)
                assert teleop.state()["asked"]["posture"] == "mammal"

        asyncio.run(drive())


@pytest.mark.parametrize(
    ("robot", "command"),
    [
        ("youbot_base", {}),
        ("youbot_base", {"mode": "wheels", "wheels": {"front_left": 1e308}}),
        ("wheel_leg_hexapod", {"body": (1e308, -1e308, 1e308), "posture": "none", "gait": "none"}),
    ],
)
def test_no_command_is_too_large(robot: str, command: dict[str, Any]) -> None:
    scenario = teleop_scenario(robot)
    session = (LegSession if scenario.robot.legs else WheelSession)(scenario)
    message = Message(touch=1, twist=(1e308, 1e308, 1e308), **command)
    session.advance(message)
    assert session.fault == ""
    largest = [axis["largest"] for axis in session.hello()["axes"]]
    assert (np.abs(session.state(message)["twist"]) <= np.multiply(largest, 10)).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no_such_robot"], "no_such_robot"),
        (["kiwi", "--timeout", "0"], "--timeout 0.0: accepted: a positive number"),
        (["kiwi", "--timeout", "nan"], "--timeout nan"),
        (["kiwi", "--port", "70000"], "--port 70000"),
        (["kiwi", "--host", "no.such.host.invalid"], "no.such.host.invalid"),
        (["kiwi", "--set", "ground.friction=-1"], "ground.friction"),
        (["kiwi", "--set", "nonsense"], "KEY=VALUE"),
    ],
)
def test_bad_input_is_one_message(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["rollerbench", "teleop", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    shown = capsys.readouterr().err
    assert end.value.code == 2
    assert message in shown
    assert len(shown.strip().splitlines()) == 1


def test_a_port_in_use_is_refused() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(rb.RollerbenchError, match=f"--port {port}.*accepted: .* a port that is free"):
            Teleop("kiwi", port=port).run()


def test_the_command_serves_until_it_is_interrupted() -> None:
    # Where tests run in the background, interrupts are ignored, and so would they be here.
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    code += "from rollerbench.cli import main; main()"
    arguments = [sys.executable, "-c", code, "teleop", "kiwi", "--no-open"]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        line = process.stderr.readline()
        url = line.split()[2]
        with urllib.request.urlopen(url) as answer:
            assert b"rollerbench teleop" in answer.read()
        process.send_signal(signal.SIGINT)
        try:
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
        assert process.stderr.read() == ""
