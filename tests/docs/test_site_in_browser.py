"""Pages of the documentation in a real browser, without a network."""

from __future__ import annotations

from typing import Any

import pytest
from site_build import Site

from browser import new_tab

pytestmark = pytest.mark.exhaustive

SCROLLS_SIDEWAYS = "document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"
SIZES = """
[...document.querySelectorAll('math')].map(m => m.getBoundingClientRect())
                                      .map(r => [r.width, r.height])
"""


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (390, "dark")])
def test_pages_fit_and_do_not_complain(
    whole_site: Site, chromium: Any, width: int, scheme: str
) -> None:
    tab = new_tab(chromium, viewport={"width": width, "height": 900}, color_scheme=scheme)
    complaints: list[str] = []
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on("requestfailed", lambda request: complaints.append(request.url))
    for page in whole_site.pages:
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


def test_equations_are_drawn(whole_site: Site, chromium: Any) -> None:
    tab = new_tab(chromium, viewport={"width": 1280, "height": 900})
    tab.goto((whole_site.folder / "method.html").as_uri())
    sizes = tab.evaluate(SIZES)
    assert len(sizes) > 30
    assert all(width > 4 and height > 4 for width, height in sizes)
    # a fraction is laid out, not written in a row
    height = tab.evaluate("document.querySelector('#equation-eq-31 math').clientHeight")
    line = tab.evaluate("document.querySelector('#equation-eq-30 math').clientHeight")
    assert height > 1.3 * line
    tab.context.close()


def test_plots_are_dark_in_the_dark(whole_site: Site, chromium: Any) -> None:
    lightness = {}
    for scheme in ("light", "dark"):
        tab = new_tab(chromium, color_scheme=scheme)
        tab.goto((whole_site.folder / "getting_started.html").as_uri())
        lightness[scheme] = tab.evaluate(LIGHTNESS)
        tab.context.close()
    assert lightness["light"][0] > 200 > 100 > lightness["light"][1]  # paper and letters
    assert lightness["dark"][0] < 60 < 150 < lightness["dark"][1]
