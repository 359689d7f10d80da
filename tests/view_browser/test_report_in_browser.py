"""The report's page in a real browser: on a screen, on a phone and on paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import knotwork as kw
from knotwork.view.report_page import report_page


def test_the_report_reads_on_screen_phone_and_paper(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan("planar2_closed_form")
    path = report_page(plan).save(tmp_path / "report.html")
    tab.goto(path.as_uri())
    inside = tab.frame_locator("iframe").locator("html[data-ready=true]")
    inside.wait_for(state="attached", timeout=60_000)
    assert tab.inner_text(".verdict") == "passed"
    rows = tab.locator("#requirements tbody tr")
    assert rows.count() == len(plan.report.requirements)
    assert "three four" in tab.inner_text("#requirements")
    assert tab.locator("#plots img").count() == 2
    assert tab.evaluate("[...document.images].every((i) => !i.src || i.naturalWidth > 300)")
    assert "Planar two-link arm through points" in tab.inner_text("#appendix pre")
    tab.set_viewport_size({"width": 390, "height": 800})
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    # what matters lies on the screen, not beside it
    for selector in ("td[data-label=error]", "td[data-label=margin]", "tr td:last-child"):
        for section in ("#requirements", "#limits"):
            for box in tab.locator(f"{section} {selector}").all()[:6]:
                place = box.bounding_box()
                assert place is None or place["x"] + place["width"] <= 390
    tab.wait_for_function("document.getElementById('still').src.startsWith('data:image/png')")
    tab.emulate_media(media="print")
    assert tab.locator("#still").is_visible()
    assert not tab.locator("iframe").is_visible()


def test_without_a_robot_the_report_says_so(tab: Any, tmp_path: Path) -> None:
    plan = kw.plan("paper_case")
    tab.goto(report_page(plan).save(tmp_path / "report.html").as_uri())
    assert "no arm to show" in tab.inner_text("#view")
    assert tab.locator("iframe").count() == 0
    assert tab.locator("#plots img").count() == 1
