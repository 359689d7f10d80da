"""Pages of the documentation in a real browser, without a network."""

from __future__ import annotations

from typing import Any

import pytest
from site_build import Site

from browser import new_tab

pytestmark = pytest.mark.exhaustive

DESK, PHONE = (1280, 800), (390, 844)
PAGES = ("index", "getting_started", "method", "scenario", "gallery", "search", "api/planning")

SCROLLS_SIDEWAYS = "document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_pages_fit_and_do_not_complain(site: Site, chromium: Any, width: int, scheme: str) -> None:
    tab = new_tab(chromium, viewport={"width": width, "height": 900}, color_scheme=scheme)
    complaints: list[str] = []
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on("requestfailed", lambda request: complaints.append(request.url))
    for page in site.pages:
        if page.name in ("genindex.html", "py-modindex.html", "search.html"):
            continue
        tab.goto(page.as_uri())
        assert not tab.evaluate(SCROLLS_SIDEWAYS), page
    assert not complaints
    tab.context.close()


LIGHTNESS = """(() => {
    const drawing = document.querySelector(".drawing svg");
    const fills = [drawing.querySelector("path"), drawing].map((one) => getComputedStyle(one).fill);
    return fills.map((fill) => Number(fill.match(/[\\d.]+/)[0]));
})()"""


def test_plots_are_dark_in_the_dark(site: Site, chromium: Any) -> None:
    lightness = {}
    for scheme in ("light", "dark"):
        tab = new_tab(chromium, color_scheme=scheme)
        tab.goto((site.folder / "getting_started.html").as_uri())
        lightness[scheme] = tab.evaluate(LIGHTNESS)
        tab.context.close()
    assert lightness["light"][0] > 200 > 100 > lightness["light"][1]  # paper and letters
    assert lightness["dark"][0] < 60 < 150 < lightness["dark"][1]


def opened(site: Site, chromium: Any, page: str, size: tuple[int, int], **options: Any) -> Any:
    assert site.code == 0, site.output
    width, height = size
    tab = new_tab(chromium, viewport={"width": width, "height": height}, **options)
    tab.goto((site.folder / f"{page}.html").as_uri())
    return tab


@pytest.mark.parametrize(
    ("page", "size", "scheme"),
    [(page, *look) for page in PAGES for look in ((DESK, "light"), (PHONE, "dark"))],
)
def test_nothing_hinders_people(
    site: Site, chromium: Any, barriers: Any, page: str, size: tuple[int, int], scheme: str
) -> None:
    tab = opened(site, chromium, page, size, color_scheme=scheme)
    assert not barriers(tab)
    tab.context.close()


def test_the_first_page_begins_with_installing_and_the_motion(site: Site, chromium: Any) -> None:
    tab = opened(site, chromium, "index", DESK)
    line = tab.locator("article pre").first
    assert "pip install" in line.inner_text()
    assert line.bounding_box()["y"] < 300
    motion = tab.locator("article img").first.bounding_box()
    assert motion["width"] > 500
    assert motion["y"] + 0.9 * motion["height"] < DESK[1]
    tab.context.close()


@pytest.mark.parametrize(
    ("page", "number", "copied"),
    [
        ("index", 0, "python3 -m venv .venv && . .venv/bin/activate && pip install ."),
        ("api/planning", 0, 'lift = [{"joints"'),
    ],
)
def test_button_copies_text(site: Site, chromium: Any, page: str, number: int, copied: str) -> None:
    tab = opened(site, chromium, page, DESK, permissions=["clipboard-read", "clipboard-write"])
    button = tab.locator("button.copy").nth(number)
    button.focus()
    tab.keyboard.press("Enter")
    tab.wait_for_function("document.querySelector('button.copy').textContent === 'copied'")
    text = tab.evaluate("navigator.clipboard.readText()")
    assert text.startswith(copied)
    assert ">>>" not in text
    assert not tab.locator(".output button.copy").count()
    tab.context.close()


@pytest.mark.parametrize("word", ["sweep", "robot"])
def test_search_finds_guides_first(site: Site, chromium: Any, word: str) -> None:
    tab = opened(site, chromium, "search", DESK)
    tab.goto((site.folder / "search.html").as_uri() + f"?q={word}")
    tab.wait_for_selector("#search-results li a[href*='api/']")
    found = [one.get_attribute("href") for one in tab.locator("#search-results li a").all()]
    assert not any("api/" in one or "benchmarks" in one for one in found[:3])
    tab.context.close()
