"""The system's Chromium, headless: one for all tests, because a process can drive only one."""

from __future__ import annotations

import importlib.util
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
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


@pytest.fixture(scope="session")
def barriers() -> Callable[[Any], list[str]]:
    """What axe-core finds on a tab's page and in its frames, but for minor faults."""
    spec = importlib.util.find_spec("axe_playwright_python")
    if spec is None or spec.origin is None:
        _unavailable("the package axe-playwright-python is not installed")
        raise AssertionError
    axe = (Path(spec.origin).parent / "axe.min.js").read_text(encoding="utf-8")

    def found(tab: Any) -> list[str]:
        violations = []
        for frame in tab.frames:
            frame.evaluate(axe)
            violations += frame.evaluate("axe.run(document, {iframes: false})")["violations"]
        return [
            f"{one['impact']}: {one['id']} at {node['target']}: {node['failureSummary']}"
            for one in violations
            if one["impact"] != "minor"
            for node in one["nodes"][:5]
        ]

    return found
