"""What several parts' tests share."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

CHROMIUM = Path("/usr/bin/chromium")
#: How a request ends that was under way as its page was left.
ABORTED = "net::ERR_ABORTED"
ARGUMENTS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Headless Chromium; in CI its absence fails the test."""
    if not CHROMIUM.exists():
        missing = f"{CHROMIUM} is not installed"
        pytest.fail(missing) if os.environ.get("CI") else pytest.skip(missing)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        running = driver.chromium.launch(executable_path=str(CHROMIUM), args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def visitor(browser: Browser) -> Iterator[Callable[..., Page]]:
    """`visitor(folder, **settings)` is an empty page of the browser, for the files of a folder.

    In the end no page must have complained on its console, or asked for anything outside of its folder.
    """
    complaints: list[str] = []
    contexts: list[BrowserContext] = []

    def visit(folder: Path, **settings: Any) -> Page:
        contexts.append(browser.new_context(**settings))
        page = contexts[-1].new_page()
        home = folder.as_uri()
        page.on("console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("requestfailed", lambda request: None if request.failure == ABORTED else complaints.append(f"failed: {request.url}"))
        page.on("request", lambda request: None if request.url.startswith((home, "data:", "about:")) else complaints.append(request.url))
        return page

    yield visit
    for context in contexts:
        context.close()
    assert complaints == []
