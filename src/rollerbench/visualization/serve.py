"""A page on a port of this machine."""

import asyncio
import socket
from collections.abc import Callable

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler

from rollerbench.errors import ResourceError

EVERYWHERE = ("", "*", "0.0.0.0", "::")
"""Hosts that mean every address of this machine."""


def listen(host: str, port: int) -> tuple[list[socket.socket], str]:
    """Opens a port; returns its sockets and the address of a page there.

    Args:
        host: Name or address to listen at, or one of `EVERYWHERE`.
        port: Port, 0 for any that is free.

    Raises:
        ResourceError: the port cannot be had.
    """
    try:
        sockets = bind_sockets(port, None if host in EVERYWHERE else host)
    except (OSError, OverflowError) as error:
        raise ResourceError(
            f"--host {host} --port {port}: {error}; accepted: an address of this machine, and a free port (0 for any)"
        ) from error
    name = "localhost" if host in EVERYWHERE else f"[{host}]" if ":" in host else host
    return sockets, f"http://{name}:{sockets[0].getsockname()[1]}/"


class _Page(RequestHandler):
    def initialize(self, page: str) -> None:
        self._page = page

    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.write(self._page)


def serve_page(
    page: str, *, host: str = "localhost", port: int = 0, ready: Callable[[str], None] | None = None
) -> None:
    """Serves a page until it is interrupted.

    Args:
        page: HTML text.
        host: Address to listen on; by default only this machine can reach it.
        port: Port; 0 for a free one.
        ready: Called with the page's address.

    Raises:
        ResourceError: the port cannot be had.
        KeyboardInterrupt: Ctrl-C, the way to end it.
    """

    async def serve() -> None:
        HTTPServer(Application([("/", _Page, {"page": page})])).add_sockets(sockets)
        if ready is not None:
            ready(address)
        await asyncio.Event().wait()

    sockets, address = listen(host, port)
    asyncio.run(serve())
