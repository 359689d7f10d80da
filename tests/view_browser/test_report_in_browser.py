"""The report's page in a real browser: on a screen, on a phone and on paper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from knotwork.view import report_page
from plans import planned
from walls import through_wall


@pytest.mark.exhaustive
def test_the_report_reads_on_screen_phone_and_paper(tabs: Any, tmp_path: Path) -> None:
    plan = planned("planar2_closed_form", planner="parabolic-blend")
    path = report_page(plan).save(tmp_path / "report.html")
    tab = tabs.new()
    tab.set_viewport_size({"width": 1000, "height": 700})
    tab.goto(path.as_uri())
    tab.wait_for_selector("html.has-still", state="attached")
    assert tab.inner_text(".verdict") == "FAILED"
    for group in ("Tool at the waypoints", "Joints at the waypoints"):
        rows = tab.locator(f"[data-group='{group}'] tbody tr")
        assert rows.count() == len(plan.report.select(group=group)) > 0
    assert "three four" in tab.text_content("[data-group='Tool at the waypoints']")
    assert tab.locator("#plots svg").count() == 2
    assert tab.evaluate("[...document.images].every((i) => !i.src || i.naturalWidth > 300)")
    assert "Planar two-link arm through points" in tab.inner_text("#appendix pre")

    tab.emulate_media(media="print")
    assert tab.locator("#still").is_visible()
    assert not tab.locator("iframe").is_visible()
    # before there is a still picture the scene itself is printed
    tab.evaluate("document.documentElement.classList.remove('has-still')")
    assert tab.locator("iframe").is_visible()
    tab.emulate_media(media="screen")

    tab.set_viewport_size({"width": 390, "height": 800})
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    # what matters lies on the screen, not beside it
    for selector in ("td[data-label=value]", "td[data-label=margin]", "tr td:last-child"):
        for box in tab.locator(f".findings {selector}").all()[:40]:
            place = box.bounding_box()
            assert place is None or place["x"] + place["width"] <= 390


def test_without_javascript_the_report_says_so(tabs: Any, tmp_path: Path) -> None:
    path = report_page(planned("planar2_closed_form")).save(tmp_path / "report.html")
    tab = tabs.new(java_script_enabled=False)
    tab.goto(path.as_uri())
    assert "switched off" in tab.inner_text("#view")
    assert not tab.locator("iframe").is_visible()
    assert not tab.locator("#still").is_visible()
    assert all(picture.is_visible() for picture in tab.locator("#plots svg").all())


def test_the_view_stays_beside_plots_with_one_cursor_values_and_a_window_of_time(
    tabs: Any, tmp_path: Path
) -> None:
    plan = through_wall()
    tab = tabs.new()
    tab.set_viewport_size({"width": 1440, "height": 900})
    tab.goto(report_page(plan).save(tmp_path / "hit.html").as_uri())
    tab.wait_for_selector("html.has-still", state="attached")
    for link in tab.locator("nav a").all():
        assert tab.locator(link.get_attribute("href") or "").count() == 1
    panels = tab.locator(".cursor").count()
    assert tab.locator("[data-part=contact]").count() == panels

    plot = tab.locator("#plot-2 .plot")
    plot.evaluate("one => one.scrollIntoView({block: 'end'})")
    tab.mouse.move(5, 5)
    scene = tab.locator("iframe").bounding_box()
    assert scene["y"] >= 0
    assert scene["y"] + scene["height"] <= 900
    box = plot.bounding_box()
    inside = box["x"] + 0.4 * box["width"], box["y"] + 0.2 * box["height"]
    tab.mouse.move(*inside)
    assert tab.locator(".cursor.hover:visible").count() == panels

    def shown() -> float:
        return float(tab.inner_text("#now").split()[0])

    time = shown()
    assert 0.2 < time < 1.8
    view = tab.frames[1]
    in_view = "share => Math.abs(knotwork.time() - share) < 0.02"
    view.wait_for_function(in_view, arg=time)  # the 3D view is of the time under the pointer
    tab.mouse.move(5, 5)
    view.wait_for_function(in_view, arg=0)
    assert shown() == 0.0
    tab.mouse.move(*inside)
    for i, joint in enumerate(plan.trajectory.joint_names):
        row = tab.locator("#values tbody tr").filter(has_text=joint)
        found = [
            float(text.replace("−", "-")) for text in row.locator(".value").all_inner_texts()[:2]
        ]
        motion = plan.trajectory
        expected = [motion.position(time)[i], motion.velocity(time)[i]]
        assert found == pytest.approx(np.degrees(expected), abs=0.2)
    tab.mouse.click(*inside)
    tab.mouse.move(5, 5)
    assert tab.locator("#whole").is_disabled()
    tab.click("#closer")
    assert tab.locator("#whole").is_enabled()
    assert shown() == pytest.approx(time, abs=0.01)  # that of a frame
    tab.mouse.move(*inside)
    assert shown() == pytest.approx(time, abs=0.02)  # what the window is about stays in place
    tab.mouse.move(inside[0] + 0.1 * box["width"], inside[1])
    near = shown() - time
    tab.mouse.dblclick(inside[0] + 0.1 * box["width"], inside[1])
    assert tab.locator("#whole").is_disabled()
    tab.mouse.move(*inside)
    tab.mouse.move(inside[0] + 0.1 * box["width"], inside[1])
    assert shown() - time == pytest.approx(2 * near, abs=0.02)
