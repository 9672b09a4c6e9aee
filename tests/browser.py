"""A real, headless browser that has no network, or only that of this machine, for tests of pages."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Page, Request, WebSocket, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
ARGUMENTS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking")
LOCAL = ("http://localhost:", "ws://localhost:")


@dataclass
class Watched:
    """A page, and what it did that a self-contained page must not do."""

    page: Page
    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


@contextmanager
def opened(address: Path | str, width: int = 800, height: int = 600) -> Iterator[Watched]:
    """Opens a file offline, or a page that this machine serves; requests elsewhere are told.

    Skips the test where there is no browser, unless REQUIRE_BROWSER is set; where it is "no", always.
    """
    required = os.environ.get("REQUIRE_BROWSER")
    if required == "no":
        pytest.skip("REQUIRE_BROWSER=no")
    executable = next(filter(None, map(shutil.which, NAMES)), None)
    if executable is None:
        assert not required, f"no browser found: install one of {', '.join(NAMES)}"
        pytest.skip("no Chromium or Chrome on PATH")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(ARGUMENTS), chromium_sandbox=False)
        context = browser.new_context(offline=isinstance(address, Path), viewport={"width": width, "height": height})
        watched = Watched(context.new_page())
        own = address.resolve().as_uri() if isinstance(address, Path) else address
        local = (own,) if isinstance(address, Path) else LOCAL

        def note(asked: Request | WebSocket) -> None:
            if not asked.url.startswith(("data:", "blob:", *local)):
                watched.requests.append(asked.url)

        watched.page.on("request", note)
        watched.page.on("websocket", note)
        watched.page.on(
            "console",
            lambda message: watched.errors.append(message.text) if message.type == "error" else None,
        )
        watched.page.on("pageerror", lambda error: watched.errors.append(str(error)))
        watched.page.goto(own, wait_until="load")
        yield watched
        browser.close()
