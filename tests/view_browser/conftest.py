"""Tabs without a network; a page is opened once, looked at often."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from serving import READY

from browser import new_tab
from knotwork.view.page import Page

SCENES = 2
"""That stay open for the next tests: each page draws on and on, at rest, too."""

# As it was when it was opened: shown what is shown at first, at the start, from the first camera.
AFRESH = """() => {
  for (const box of document.querySelectorAll("#switches input"))
    if (box.checked !== box.defaultChecked) box.click();
  viewer.set_property(["Knotwork", "arm"], "visible", true);
  document.getElementById("rate").value = "1";
  document.getElementById("rate").dispatchEvent(new Event("change"));
  knotwork.loop(false);
  knotwork.seek(0);
  knotwork.look("whole arm");
}"""


class Tabs:
    """Tabs without a network, in which no page may complain in any way."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser
        self.complaints: list[str] = []
        self.opened: dict[str, Any] = {}
        """Pages that stay open, the one that was shown last at the end."""
        self.others: list[Any] = []

    def new(self, **options: Any) -> Any:
        """Open an empty tab, which is closed with the test."""
        size = {"width": 640, "height": 400}
        page = new_tab(self.browser, viewport=size, **options)
        complaints = self.complaints
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "console",
            lambda message: complaints.append(message.text) if message.type == "error" else None,
        )
        page.on("requestfailed", lambda request: complaints.append(request.url[:200]))
        self.others.append(page)
        return page

    def open(
        self,
        address: str,
        ready: str = READY,
        *,
        size: tuple[int, int] = (640, 400),
        online: bool = False,
        **options: Any,
    ) -> Any:
        """Open an address in a new tab, and wait for what a selector names."""
        tab = self.new(**options)
        tab.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
        tab.context.set_offline(not online)
        tab.goto(address)
        tab.wait_for_selector(ready, state="attached")
        return tab

    def close(self, *, all_pages: bool = False) -> None:
        """Close what does not stay open, or all."""
        kept = [] if all_pages else list(self.opened.values())
        for page in [*self.others, *self.opened.values()]:
            if page not in kept:
                page.context.close()
        self.others.clear()

    def scene(self, name: str, build: Callable[[], Page], folder: Path) -> Any:
        """Show a scene from disk; it looks as at first each time."""
        page = self.opened.pop(name, None)
        if page is None:
            page = self.open(build().save(folder / f"{name}.html").as_uri() + "#paused")
        self.opened[name] = page
        for other in [*self.opened][:-SCENES]:
            self.opened.pop(other).context.close()
        page.set_viewport_size({"width": 640, "height": 400})
        page.evaluate(AFRESH)
        return page


@pytest.fixture(scope="module")
def all_tabs(chromium: Any) -> Iterator[Tabs]:
    """All tabs of a module."""
    tabs = Tabs(chromium)
    yield tabs
    tabs.close(all_pages=True)


@pytest.fixture
def tabs(all_tabs: Tabs) -> Iterator[Tabs]:
    """Tabs to open pages in; the test fails if one of them complains."""
    yield all_tabs
    all_tabs.close()
    complaints = all_tabs.complaints[:]
    all_tabs.complaints.clear()
    assert not complaints
