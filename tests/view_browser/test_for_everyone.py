"""Pages by keyboard, by a screen reader, on a small screen, without motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from serving import NEXT_FRAME, READY

from knotwork.view import report_page
from knotwork.view.page import Page
from plans import planned

DESK, UPRIGHT, ACROSS, SMALL = (1280, 800), (390, 844), (844, 390), (480, 320)

MANY_FAILURES = ("ur5_deburring", "parabolic-blend")
"""A scenario and a planner that breaks limits, along a tool path."""

PAGES: dict[str, Callable[[], Page]] = {
    "scene": cache(lambda: planned(*MANY_FAILURES).view()),
    "report": cache(lambda: report_page(planned(*MANY_FAILURES))),
}


def opened(tabs: Any, folder: Path, name: str, size: tuple[int, int], **options: Any) -> Any:
    """The page in a new tab of that size."""
    page = PAGES[name]().save(folder / f"{name}.html").as_uri() + "#paused"
    tab = tabs.open(page, "html", size=size, **options)
    (tab.frames[1] if name == "report" else tab).wait_for_selector(READY, state="attached")
    return tab


@pytest.mark.parametrize(
    ("name", "size", "scheme"),
    [
        ("scene", DESK, "dark"),
        ("scene", UPRIGHT, "light"),
        pytest.param("scene", ACROSS, "light", marks=pytest.mark.exhaustive),
        pytest.param("report", UPRIGHT, "dark", marks=pytest.mark.exhaustive),
        pytest.param("report", DESK, "light", marks=pytest.mark.exhaustive),
    ],
)
def test_nothing_hinders_people(
    name: str, size: tuple[int, int], scheme: str, tabs: Any, tmp_path: Path, barriers: Any
) -> None:
    tab = opened(tabs, tmp_path, name, size, color_scheme=scheme)
    assert tab.locator(".verdict").first.inner_text() == "FAILED"
    assert not barriers(tab)
    if name == "scene":
        panels_cover_none(tab, size)
    elif size == UPRIGHT:
        plots_are_moved(tab)


@pytest.mark.exhaustive
def test_keys_turn_the_view(tabs: Any, tmp_path: Path) -> None:
    tab = opened(tabs, tmp_path, "scene", SMALL)
    target = "viewer.controls.target.toArray()"
    offset = f"viewer.camera.position.toArray().map((one, i) => one - {target}[i])"

    def pressed(key: str) -> tuple[float, float, float]:
        """Distance, turn about the vertical axis and height [deg] that a key leads to."""
        tab.keyboard.press(key)
        tab.evaluate(NEXT_FRAME)
        x, y, z = tab.evaluate(offset)
        far = np.hypot(np.hypot(x, z), y)
        return far, np.degrees(np.arctan2(x, z)), np.degrees(np.arcsin(y / far))

    first, aimed = pressed("Home"), tab.evaluate(target)
    assert pressed("Shift+ArrowRight") == pytest.approx(np.add(first, (0, -10, 0)))
    assert pressed("Shift+ArrowLeft") == pytest.approx(first)
    assert pressed("Shift+ArrowUp") == pytest.approx(np.add(first, (0, 0, -10)))
    assert pressed("Shift+ArrowDown") == pytest.approx(first)
    assert pressed("+") == pytest.approx(np.divide(first, (1.2, 1, 1)))
    assert pressed("-") == pytest.approx(first)
    for _ in range(10):
        *_, height = pressed("Shift+ArrowDown")
    assert 80 < height < 90  # never over the top
    assert tab.evaluate(target) == pytest.approx(aimed)
    assert tab.evaluate("knotwork.time()") == 0
    pressed("a")
    assert pressed("Home") == pytest.approx(first, rel=0.05)


@pytest.mark.exhaustive
def test_nothing_moves_by_itself_for_those_who_ask_for_that(tabs: Any, tmp_path: Path) -> None:
    page = PAGES["scene"]().save(tmp_path / "scene.html").as_uri()
    for wish in ("no-preference", "reduce"):
        tab = tabs.open(page, reduced_motion=wish)
        assert tab.get_attribute("#play", "aria-label") == ("pause" if wish != "reduce" else "play")
        tab.click("#play")
        tab.evaluate(NEXT_FRAME)
        assert tab.get_attribute("#play", "aria-label") == ("play" if wish != "reduce" else "pause")


def panels_cover_none(tab: Any, size: tuple[int, int]) -> None:
    """No panel covers another one."""
    tab.evaluate(NEXT_FRAME)
    boxes = {
        one.get_attribute("id"): one.bounding_box() for one in tab.locator(".keep-clear").all()
    }
    assert boxes.keys() >= {"head", "legend", "bar", "shown", "joints"}
    seen = [
        (one["x"], one["y"], one["x"] + one["width"], one["y"] + one["height"])
        for one in boxes.values()
    ]
    for i, (left, top, right, bottom) in enumerate(seen):
        assert left >= 0
        assert top >= 0
        assert right <= size[0]
        assert bottom <= size[1]
        for x0, y0, x1, y1 in seen[:i]:
            assert x1 <= left or right <= x0 or y1 <= top or bottom <= y0, boxes
    open_first = size == DESK
    assert tab.locator("#legend .scale").first.is_visible() == open_first
    tab.click("#legend summary")
    assert tab.locator("#legend .scale").first.is_visible() != open_first


def plots_are_moved(tab: Any) -> None:
    """On a phone, by hand and keys; on a wide screen they need not be."""
    plot = tab.locator("#plots figure").first
    sign = "one => getComputedStyle(one.querySelector('h2'), '::after').content"
    assert "↔" in plot.evaluate(sign)
    plot.focus()
    tab.keyboard.press("ArrowRight")
    tab.wait_for_function("document.activeElement.scrollLeft > 10")
    tab.set_viewport_size({"width": 1280, "height": 800})
    tab.evaluate(NEXT_FRAME)
    assert plot.get_attribute("tabindex") is None
    assert "↔" not in plot.evaluate(sign)
