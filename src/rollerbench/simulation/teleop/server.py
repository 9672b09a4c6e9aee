"""The page's server: a few files, and one WebSocket."""

import asyncio
import itertools
import json
import threading
import time
from collections.abc import Iterator
from importlib.resources import files
from typing import Any

from pydantic import ValidationError
from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from rollerbench.simulation.teleop.desk import Desk, Message
from rollerbench.visualization.serve import listen, names

FILES = {
    "": ("page.html", "text/html"),
    "page.js": ("page.js", "text/javascript"),
    "input.js": ("input.js", "text/javascript"),
    "view.js": ("view.js", "text/javascript"),
    "page.css": ("page.css", "text/css"),
}
"""Files of the page by address, and their types."""

PING_INTERVAL = 10.0
"""Time between two looks at whether a page is still there [s]."""

UNSUPPORTED = 1003
"""WebSocket's code for data that cannot be accepted."""


class Server:
    """Serves the page in a thread of its own.

    Attributes:
        url: The page's address.
    """

    def __init__(self, desk: Desk, host: str, port: int) -> None:
        """Opens the port; `start` serves.

        Args:
            desk: Where commands go.
            host: Name or address to listen at.
            port: Port, 0 for any that is free.

        Raises:
            ResourceError: the port cannot be had.
        """
        self.desk = desk
        self.hello: dict[str, Any] = {}
        self.clients: dict[int, Channel] = {}
        self.numbers: Iterator[int] = itertools.count(1)
        self._sockets, self.url = listen(host, port)
        self._names = names(host)
        self._loop = asyncio.new_event_loop()
        self._stopping = asyncio.Event()
        self._thread = threading.Thread(target=self._serve, name="teleop server", daemon=True)

    def start(self, hello: dict[str, Any]) -> None:
        """Begins to serve; pages are told this first."""
        self.hello = hello
        self._thread.start()

    def stop(self) -> None:
        """Closes all connections, and the port."""
        if not self._thread.is_alive():
            for each in self._sockets:
                each.close()
            self._loop.close()
            return
        self._loop.call_soon_threadsafe(self._stopping.set)
        self._thread.join()

    def broadcast(self, state: dict[str, Any]) -> None:
        """Sends a state to all pages; to be called from any thread."""
        text = json.dumps(state, allow_nan=False)
        self._loop.call_soon_threadsafe(self._send, text)

    def _send(self, text: str) -> None:
        for client in list(self.clients.values()):
            client.send(text)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._main())
        finally:
            self._loop.close()

    async def _main(self) -> None:
        application = Application(websocket_ping_interval=PING_INTERVAL)
        application.add_handlers(
            self._names,
            [(r"/socket", Channel, {"server": self}), (r"/([a-z.]*)", Page)],
        )
        http = HTTPServer(application)
        http.add_sockets(self._sockets)
        await self._stopping.wait()
        http.stop()
        for client in list(self.clients.values()):
            client.close(1001, "the simulation ended")
        await http.close_all_connections()


class Page(RequestHandler):
    """The page and its parts."""

    def get(self, name: str) -> None:
        """Answers with a file."""
        if name not in FILES:
            self.send_error(404)
            return
        file, kind = FILES[name]
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.write((files(__package__) / "page" / file).read_bytes())

    def data_received(self, chunk: bytes) -> None:
        """Nobody sends."""


class Channel(WebSocketHandler):
    """The connection of a page. Tornado refuses those of pages of another origin."""

    def initialize(self, server: Server) -> None:
        """Takes what the application passes on."""
        self._server, self._number = server, next(server.numbers)
        self._sent: asyncio.Future[None] | None = None

    def open(self, *_: str, **__: str) -> None:
        """Greets the page."""
        self.set_nodelay(True)
        self._server.clients[self._number] = self
        self.send(json.dumps({**self._server.hello, "kind": "hello", "you": self._number}, allow_nan=False))

    def on_message(self, message: str | bytes) -> None:
        """Takes a command; closes the connection to a page that does not speak our language."""
        try:
            command = Message.model_validate_json(message)
        except ValidationError as error:
            self.close(UNSUPPORTED, f"{error.errors()[0]['msg']}"[:120])
            return
        self._server.desk.receive(self._number, command, time.monotonic())

    def on_close(self) -> None:
        """The page went away."""
        self._server.clients.pop(self._number, None)
        self._server.desk.leave(self._number)

    def send(self, text: str) -> None:
        """Sends a text, unless nobody is there any more, or the one before is still on its way."""
        if self._sent is not None and not self._sent.done():
            return
        try:
            self._sent = asyncio.ensure_future(self.write_message(text))
        except WebSocketClosedError:
            return
        # A page that goes away meanwhile is no error; looking at it keeps asyncio from reporting one.
        self._sent.add_done_callback(lambda future: future.cancelled() or future.exception())

    def data_received(self, chunk: bytes) -> None:
        """Tornado reads the socket by itself."""
