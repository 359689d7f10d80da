"""What the report, pictures, the scene and progress say of ways."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figures import data, label, lines, notes

import knotwork as kw
from drawn import scene
from knotwork.planning.timing import Progress
from knotwork.verification import Finding
from knotwork.view import plot_tool
from plans import planned
from walls import past


def once(*others: Any, tries: int = 1) -> dict[str, Any]:
    """The task past the wall, with few tries."""
    given = past(None, *others)
    given["waypoints"][1]["way"] = {"clear": True, "tries": tries}
    return given


@cache
def made() -> kw.Plan:
    return kw.plan(once())


def nearest(plan: kw.Plan) -> Finding:
    """The pair that comes nearest to something that stands there."""
    around = [one for one in plan.report.select(quantity="clearance") if one.involves_scene]
    return min(around, key=lambda one: one.value or 0.0)


def test_the_report_says_of_a_way_how_near_it_leads_past_what() -> None:
    (found,) = made().report.select(quantity="way")
    assert found.verdict == "information"
    assert found.message.startswith("here to there: clear motion found in ")
    assert nearest(made()).name in found.message
    assert found.value == pytest.approx(nearest(made()).value, abs=1e-3)
    assert found.interval == pytest.approx((0.0, made().trajectory.duration))
    assert "here to there: minimum clearance" in " ".join(str(made().report).split())


def test_the_strip_shows_the_clearance_that_the_check_finds() -> None:
    shown = scene(made().view())["strip"]["clearance"]
    assert len(shown["time"]) <= 200
    assert shown["margin"] == 0.005
    least = int(np.argmin(shown["distance"]))
    assert shown["distance"][least] == pytest.approx(nearest(made()).value, abs=1e-3)
    assert shown["distance"][least] <= (nearest(made()).value or 0.0) + 1e-6
    assert shown["names"][shown["pair"][least]] == nearest(made()).name


def test_the_plot_of_the_tool_has_a_row_of_clearance_with_the_margin_as_limit() -> None:
    figure = plot_tool(made())
    axis = figure.axes[-1]
    assert label(axis) == "clearance [mm]"
    _, value = data(lines(axis, "curve")[0])
    assert value.min() == pytest.approx(1e3 * (nearest(made()).value or 0.0), abs=1)
    (limit,) = (set(data(one)[1]) for one in lines(axis, "limit"))
    assert limit == {5.0}
    assert "limit 5 mm" in notes(figure)[-1]


def test_the_scene_has_the_way_and_says_so_in_the_legend(tmp_path: Path) -> None:
    for plan in (made(), kw.plan(made().freeze(tmp_path / "frozen.yaml"))):
        page = plan.view()
        assert [one["name"] for one in scene(page)["things"]].count("way") == 1
        assert "▪▪▪ way" in page.html
    other = planned("ur5_deburring").view()
    assert "way" not in [one["name"] for one in scene(other)["things"]]
    assert "▪▪▪ way" not in other.html


def test_progress_says_what_exists_already_and_what_is_tried() -> None:
    told: list[Progress] = []
    plan = kw.plan(once(tries=2), progress=told.append)
    assert told[0].trying == "way 1 of 2"
    assert told[0].duration is None
    exists = [one.duration for one in told if one.duration is not None]
    assert exists == sorted(exists, reverse=True)
    assert exists[-1] == pytest.approx(plan.trajectory.duration)
