"""A page on a port of this machine."""

import asyncio
import errno
import re
import socket
from collections.abc import Callable

from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler

from rollerbench.errors import ResourceError

EVERYWHERE = ("", "*", "0.0.0.0", "::")
"""Hosts that mean every address of this machine."""


def names(host: str) -> str:
    """Pattern of the names under which a server at a host answers.

    A foreign page that had its own name lead here gets nothing. Only a server for everyone, whose names it cannot know,
    answers to all.
    """
    return ".*" if host in EVERYWHERE else rf"^(localhost|127\.0\.0\.1|\[::1\]|\[?{re.escape(host)}\]?)$"


def listen(host: str, port: int) -> tuple[list[socket.socket], str]:
    """Opens a port; returns its sockets and the address of a page there.

    Args:
        host: Name or address to listen at, or one of `EVERYWHERE`.
        port: Port, 0 for any that is free.

    Raises:
        ResourceError: the port cannot be had.
    """
    try:
        sockets = _listening(None if host in EVERYWHERE else host, port)
    except (OSError, OverflowError, UnicodeError) as error:
        raise ResourceError(
            f"--host {host} --port {port}: {error}; accepted: a host of this machine, and a port that is free (0: any)"
        ) from error
    name = "localhost" if host in EVERYWHERE else f"[{host}]" if ":" in host else host
    return sockets, f"http://{name}:{sockets[0].getsockname()[1]}/"


def _listening(host: str | None, port: int) -> list[socket.socket]:
    """Sockets at all addresses of a host, at one port."""
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    sockets: list[socket.socket] = []
    for family, address in dict.fromkeys((family, str(address[0])) for family, *_, address in found):
        at = sockets[0].getsockname()[1] if sockets else port
        try:
            sockets.append(socket.create_server((address, at), family=family))
        except OSError as error:
            # Where the machine has no IPv6, its name may still have such an address.
            if sockets and error.errno in (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT):
                continue
            for each in sockets:
                each.close()
            raise
        sockets[-1].setblocking(False)
    return sockets


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
        application = Application()
        application.add_handlers(names(host), [("/", _Page, {"page": page})])
        HTTPServer(application).add_sockets(sockets)
        if ready is not None:
            ready(address)
        await asyncio.Event().wait()

    sockets, address = listen(host, port)
    try:
        asyncio.run(serve())
    finally:
        for each in sockets:
            each.close()
