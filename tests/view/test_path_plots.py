"""Pictures of a motion along a tool path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from figures import collections, data, label, lines, notes, outside, overlaps, waypoint_names

import knotwork as kw
from knotwork import Plan
from knotwork.view import plot_joints, plot_tool
from seams import ON, task

DOWN = {"rpy": [180, 0, 0]}
SEAM = task(
    ON,
    {
        "name": "corner",
        "along": "line",
        "speed": 60,
        "blend": 10,
        "pose": {"position": [450, 50, 60]},
    },
    {"name": "turn", "along": "line", "speed": 60, "pose": {"position": [530, 50, 60]}},
    {
        "name": "off",
        "along": {"arc": {"through": [560, 80, 60]}},
        "speed": 40,
        "pose": {"position": [530, 110, 60]},
    },
    {"name": "up", "after": 2, "stop": True, "pose": {"position": [450, 50, 200], **DOWN}},
)
NAMES = ["start", "on", "corner", "turn", "off", "up"]


@pytest.fixture(scope="module")
def seam() -> Plan:
    return kw.plan(SEAM)


@pytest.fixture(scope="module")
def loose() -> Plan:
    return kw.plan(SEAM, planner="bspline")


def panel(figure: Any, title: str) -> Any:
    (axis, *_) = (one for one in figure.axes if label(one).startswith(title))
    return axis


def test_deviation_is_that_of_the_check_and_lies_below_its_tolerance(seam: Plan) -> None:
    figure = plot_tool(seam, degrees=True)
    for title, quantity, factor in (
        ("off tool path", "path_deviation", 1e3),
        ("turned off path", "path_orientation", np.degrees(1.0)),
        ("speed error", "path_speed", 100 / 0.06),
    ):
        axis = panel(figure, title)
        time, value = data(lines(axis, "curve")[0])
        found = seam.report.select(quantity=quantity)
        assert len(found) == 3
        for one in found[:2]:  # both at 60 mm/s
            start, end = one.interval
            shown = np.abs(value[(time >= start) & (time <= end)])
            most = factor * (one.value + one.excess)
            assert np.nanmax(shown) <= most * (1 + 1e-6) + 1e-9
            assert np.nanmax(shown) == pytest.approx(factor * one.value, rel=0.05, abs=1e-6)
        level = data(lines(axis, "tolerance")[-1])
        limit = 1.0 if quantity == "path_speed" else factor * found[0].limit
        assert np.nanmax(level[1]) == pytest.approx(limit)
        assert np.nanmin(level[0]) == pytest.approx(seam.scenario.waypoints[1].time)
        assert np.nanmax(level[0]) == pytest.approx(seam.scenario.waypoints[4].time)
        assert not lines(axis, "beyond")


def test_what_is_beyond_a_tolerance_stands_out_and_is_said(seam: Plan, loose: Plan) -> None:
    figure = plot_tool([seam, loose])
    axis = panel(figure, "off tool path")
    (beyond,) = lines(axis, "beyond")
    assert "bspline" in str(beyond.get_gid())
    drawn = data(beyond)[1]
    assert np.nanmin(drawn) > 0.1
    worst = max(one.value for one in loose.report.select(quantity="path_deviation"))
    assert np.nanmax(drawn) == pytest.approx(1e3 * worst, rel=0.02)
    assert any(
        note.startswith("bspline: ") and "tolerance 0.1 mm" in note for note in notes(figure)
    )


def test_the_speed_asked_for_is_a_band(seam: Plan) -> None:
    bands = collections(panel(plot_tool(seam), "tool speed"), "band")
    heights = [one.get_paths()[0].get_extents().extents for one in bands]
    assert [tuple(np.round(box[[1, 3]], 9)) for box in heights] == [
        (59.4, 60.6),
        (59.4, 60.6),
        (39.6, 40.4),
    ]


@pytest.mark.parametrize("draw", [plot_tool, plot_joints])
def test_only_waypoints_of_the_scenario_are_named_and_nothing_overlaps(
    seam: Plan, draw: Any
) -> None:
    figure = draw(seam)
    assert [text.get_text() for text in waypoint_names(figure.axes[0])] == NAMES
    assert len(seam.joint_waypoints.time) > len(NAMES)
    assert not overlaps(figure)
    assert not outside(figure)
