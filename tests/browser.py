"""A real, headless browser that has no network, for tests of pages."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Page, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
ARGUMENTS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking")


@dataclass
class Watched:
    """A page, and what it did that a self-contained page must not do."""

    page: Page
    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


@contextmanager
def opened(file: Path, width: int = 800, height: int = 600) -> Iterator[Watched]:
    """Opens a file offline; skips the test where there is no browser, unless REQUIRE_BROWSER is set."""
    executable = next(filter(None, map(shutil.which, NAMES)), None)
    if executable is None:
        assert not os.environ.get("REQUIRE_BROWSER"), f"no browser found: install one of {', '.join(NAMES)}"
        pytest.skip("no Chromium or Chrome on PATH")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=list(ARGUMENTS), chromium_sandbox=False)
        context = browser.new_context(offline=True, viewport={"width": width, "height": height})
        watched = Watched(context.new_page())
        own = file.resolve().as_uri()
        local = ("data:", "blob:")
        watched.page.on(
            "request",
            lambda request: None if request.url.startswith((own, *local)) else watched.requests.append(request.url),
        )
        watched.page.on(
            "console",
            lambda message: watched.errors.append(message.text) if message.type == "error" else None,
        )
        watched.page.on("pageerror", lambda error: watched.errors.append(str(error)))
        watched.page.goto(own, wait_until="load")
        yield watched
        browser.close()
