"""The report in a browser, on a screen, a phone and paper; tool paths in it and in scenes."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from drawn import scene, thing, vertices
from knotwork.view import report_page
from knotwork.view.page import Page
from plans import planned
from seams import ON, task
from sweeps import mostly_exhaustive
from walls import through_wall


@cache
def planar_report(planner: str = "quintic:estimated") -> Page:
    return report_page(planned("planar2_closed_form", planner=planner))


@pytest.mark.exhaustive
def test_the_report_reads_on_screen_phone_and_paper(tabs: Any, tmp_path: Path) -> None:
    plan = planned("planar2_closed_form", planner="parabolic-blend")
    path = planar_report("parabolic-blend").save(tmp_path / "report.html")
    tab = tabs.open(path.as_uri(), "html.has-still", size=(1000, 700))
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


@pytest.mark.parametrize(
    "planner", mostly_exhaustive(["quintic", "quintic:estimated"], "quintic:estimated")
)
def test_each_value_beside_the_scene_is_of_a_drawn_curve(planner: str) -> None:
    text = planar_report(planner).html
    shown = set(re.findall(r'data-curve="([^"]+)"', text))
    assert shown == set(re.findall(r'data-part="(curve:[^"]+)"', text))
    assert "<span>tool speed <b" in text


def test_without_javascript_the_report_says_so(tabs: Any, tmp_path: Path) -> None:
    path = planar_report().save(tmp_path / "report.html")
    tab = tabs.new(java_script_enabled=False)
    tab.goto(path.as_uri())
    assert "switched off" in tab.inner_text("#view")
    assert not tab.locator("iframe").is_visible()
    assert not tab.locator("#still").is_visible()
    assert all(picture.is_visible() for picture in tab.locator("#plots svg").all())


def test_view_stays_beside_plots_with_one_cursor(tabs: Any, tmp_path: Path) -> None:
    plan = through_wall()
    page = report_page(plan).save(tmp_path / "hit.html")
    tab = tabs.open(page.as_uri(), "html.has-still", size=(1440, 900))
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


SEAM = task(
    ON,
    {"name": "turn", "along": "line", "speed": 60, "pose": {"position": [450, 50, 60]}},
    {
        "name": "off",
        "along": {"arc": {"centre": [480, 50, 60], "normal": [0, 0, -1]}},
        "speed": 40,
        "stop": True,
        "pose": {"position": [510, 50, 60]},
    },
)


@cache
def planned_corner(planner: str | None) -> kw.Plan:
    return kw.plan(SEAM, planner=planner)


@cache
def drawn(planner: str | None) -> Any:
    return scene(planned_corner(planner).view())


def off_seam(points: Any) -> Any:
    """Distance from the line and the half circle [m], in the axes of the URDF's root."""
    robot = planned_corner(None).joints.robot
    base = robot.base_placement.inverse()
    x, y, z = (points @ base.rotation.T + base.translation).T
    line = np.linalg.norm([x - 0.45, y - np.clip(y, -0.1, 0.05), z - 0.06], axis=0)
    arc = np.hypot(np.hypot(x - 0.48, y - 0.05) - 0.03, z - 0.06)
    end = np.linalg.norm([x - 0.51, y - 0.05, z - 0.06], axis=0)
    return np.minimum(line, np.where(y < 0.05, end, arc))


@pytest.mark.parametrize("planner", [None, "bspline"])
def test_the_required_path_is_a_thin_dashed_line(planner: str | None) -> None:
    data = drawn(planner)
    points = vertices(thing(data, "given path"))
    thick = 0.0045 * data["size"]
    assert off_seam(points).max() == pytest.approx(thick, rel=0.02)
    assert off_seam(points).min() > 0.9 * thick
    corners = np.array([[0.45, -0.1], [0.45, 0.05], [0.48, 0.08], [0.51, 0.05]])
    for corner in corners:  # from its start to its end
        robot = planned_corner(None).joints.robot
        at = robot.base_placement.act(np.array([*corner, 0.06]))
        assert np.linalg.norm(points - at, axis=1).min() < 0.03 * data["size"]


def test_a_deviation_is_no_limit_of_a_joint() -> None:
    data = drawn("bspline")
    assert {one["name"] for one in data["meshes"] if one["hidden"]} == {
        "knots",
        "collision shapes",
    }
    assert not data["legend"]["exceeded"]
    assert data["legend"]["path"]
    (failed,) = planned_corner("bspline").report.select(
        name="on to turn", quantity="path_deviation"
    )
    assert failed.fact in [one["fact"] for one in data["failures"]]
    wanted = f"on to turn path deviation {1e3 * failed.value:.4g} of 0.1 mm at {failed.time:.3f} s"
    assert any(label["text"] == wanted for label in data["labels"])
    assert any(one["line"].startswith(wanted) for one in data["failures"])  # the same words


def test_only_waypoints_of_the_scenario_have_labels() -> None:
    data, plan = drawn(None), planned_corner(None)
    names = [one["text"] for one in data["labels"] if one["kind"] == "waypoint"]
    assert names == ["start", "on", "turn", "off"]
    assert len(plan.joint_waypoints.time) > 4
