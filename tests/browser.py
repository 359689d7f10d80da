"""The system's Chromium, headless: one for all tests, because a process can drive only one."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from patience import PATIENCE

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


MILLISECONDS = 1e3 * PATIENCE


def new_tab(browser: Any, **options: Any) -> Any:
    """Open an empty tab without a network, in a context of its own."""
    context = browser.new_context(offline=True, **options)
    context.set_default_timeout(MILLISECONDS)
    return context.new_page()


def _unavailable(reason: str) -> None:
    if os.environ.get("KNOTWORK_REQUIRE_BROWSER"):
        pytest.fail(f"KNOTWORK_REQUIRE_BROWSER is set, but {reason}")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A browser; without one the test is skipped, or fails where one is required."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _unavailable("the package playwright is not installed")
    program = next((path for name in NAMES if (path := shutil.which(name))), None)
    if program is None:
        _unavailable(f"there is no browser: none of {', '.join(NAMES)} is installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, args=list(ARGUMENTS), timeout=MILLISECONDS
        )
        yield browser
        browser.close()
