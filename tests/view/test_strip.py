"""The strip below a scene: what limits each segment, curves with limits, and broken stretches."""

from __future__ import annotations

from typing import Any

import pytest
from figures import collections, legend_words
from test_limits_shown import deburring

import knotwork as kw
from drawn import scene
from knotwork.view import plot_joints, plot_tool
from plans import planned
from walls import through_wall


def strip(plan: kw.Plan) -> Any:
    return scene(plan.view())["strip"]


def test_a_segment_says_what_its_chosen_time_is_bound_by() -> None:
    plan = planned("ur5_wall")
    said = [one for one in plan.report.findings if one.quantity == "binding_limits"]
    limits = {tuple(one.interval or ()): one.label for one in said}
    for start, end, name, limit in strip(plan)["segments"]:
        if (start, end) in limits:
            assert limit == limits[start, end]
            assert f"bound by {limit}" in " ".join(one.brief for one in said)
        assert name


def test_a_segment_of_given_times_names_the_limit_nearest_to_it() -> None:
    plan = deburring(tool_speed=250.0)
    (speed,) = plan.report.select(quantity="tool_speed")
    assert speed.utilisation is not None
    limits = [one[3] for one in strip(plan)["segments"]]
    assert f"tool speed {100 * speed.utilisation:.0f} %" in limits


def test_a_broken_limit_is_red_as_long_as_it_is_broken() -> None:
    ends = [{"joints": {"shoulder": 0, "elbow": 0.5}}, {"joints": {"shoulder": 1, "elbow": 0.5}}]
    task = {"robot": "planar2", "limits": {"velocity": 0.6}}
    plan = kw.plan({**task, "waypoints": [ends[0], {**ends[1], "after": 2}]})
    (failed,) = plan.report.failures
    spans = strip(plan)["broken"]
    low, high = min(span[0] for span in spans), max(span[1] for span in spans)
    curve = plan.trajectory
    assert failed.name == "shoulder"
    for time in (low + 0.02, high - 0.02):
        assert abs(curve.velocity(time)[0]) > 0.6
    for time in (low - 0.02, high + 0.02):
        assert abs(curve.velocity(time)[0]) < 0.6
    assert high - low > 0.3


def test_a_limited_link_and_what_a_path_leaves_open_are_curves() -> None:
    (elbow,) = strip(deburring(forearm_link=500.0))["curves"]
    assert (elbow["name"], elbow["unit"]) == ("speed of forearm_link", "mm/s")
    assert elbow["limits"] == [pytest.approx(500.0)]
    assert len(elbow["time"]) == len(elbow["value"])
    plan = planned("ur5_dome")
    (used,) = (one for one in plan.report.select(quantity="free") if one.subject == "path")
    (turn,) = strip(plan)["curves"]
    assert turn["name"] == f"turn, {used.name}"
    assert turn["unit"] == "deg"
    span = max(turn["value"]) - min(turn["value"])
    assert span == pytest.approx(plan.scenario.units.shown(used.value or 0.0, "rad")[0], rel=1e-3)


def test_collisions_are_marked_over_all_panels_as_long_as_they_last() -> None:
    plan = through_wall()
    spans = [span for one in plan.report.failures for span in one.spans]
    first, last = min(start for start, _ in spans), max(end for _, end in spans)
    (drawn, *others) = strip(plan)["broken"]
    assert not others
    assert drawn == pytest.approx([first, last], abs=0.01)
    for figure in (plot_joints(plan), plot_tool(plan)):
        assert "collision" in legend_words(figure)
        for axis in figure.axes:
            (mark,) = collections(axis, "contact")
            times = mark.get_x(), mark.get_x() + mark.get_width()
            assert times == pytest.approx((first, last), abs=0.01)
