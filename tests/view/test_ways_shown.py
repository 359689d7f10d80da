"""What a report proposes where a motion collides, and what pictures and pages show of ways."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figures import data, label, lines, notes

import knotwork as kw
from command_line import Command
from drawn import scene
from knotwork.planning.timing import Progress
from knotwork.verification import Finding
from knotwork.view import plot_tool
from plans import passing_plan, planned
from walls import DOWN, WALL, at, past

ONE = "way: clear at 'there' may avoid the collision (not attempted)"


def across(*others: dict[str, Any], **more: Any) -> dict[str, Any]:
    """The tool goes through the wall, to 'there' and wherever else."""
    waypoints = [at("here", -250), at("there", 250, after=3), *others]
    return past(waypoints=waypoints, scene={"objects": WALL}, **more)


def tried(given: dict[str, Any], **options: Any) -> list[str]:
    report = kw.plan(given, **options).report
    assert not report.ok
    return [str(one) for one in report.tried]


def test_proposes_clear_motion_for_collision() -> None:
    given = across()
    (line,) = tried(given)
    assert line.startswith(ONE)
    given["waypoints"][1] |= {"way": "clear"}
    given["waypoints"][1].pop("after", None)
    assert kw.plan(given).report.ok


def fastest(*others: dict[str, Any], **more: Any) -> dict[str, Any]:
    given = across(*others, times="fastest", **more)
    for waypoint in given["waypoints"]:
        waypoint.pop("after", None)
    return given


def test_takes_clear_motion_if_fastest_collides(tmp_path: Path) -> None:
    plan = passing_plan(fastest(at("back", -250)))
    (line,) = (str(one) for one in plan.report.findings if one.quantity == "sequences_tried")
    assert "the fastest motion collides, so way: clear was taken at 'there' and 'back'" in line
    frozen = passing_plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert frozen.trajectory.duration == plan.trajectory.duration


@pytest.mark.exhaustive
def test_reports_missing_clear_motion() -> None:
    given = fastest()
    given["scene"]["objects"] = {
        "right": {"box": [2000, 30, 3000], "position": [1100, 0, 1000]},
        "left": {"box": [2000, 30, 3000], "position": [-1100, 0, 1000]},
    }
    (line,) = tried(given)
    assert "way: clear finds no motion either: " in line
    assert "one may exist all the same" in line
    assert "not attempted" not in line


@pytest.mark.exhaustive
def test_proposes_all_motions_in_one_line() -> None:
    (line,) = tried(across(at("back", -250, after=3), at("still", -250, after=1)))
    assert "way: clear at 'there' and 'back' may avoid the collisions (not attempted)" in line


def test_proposes_nothing_if_waypoint_collides() -> None:
    given = across()
    given["scene"]["objects"]["wall"]["box"][1] = 500
    assert not any("way: clear" in line for line in tried(given))


def test_proposes_nothing_before_colliding_waypoint() -> None:
    """The motion to 'over' could find its way, but one with it leads on into a post."""
    given = across()
    pose = {"position": [450, 100, 300], "rpy": DOWN}
    given["waypoints"].insert(1, {"name": "over", "pose": pose, "velocity": "free", "after": 2})
    assert any("way: clear" in line for line in tried(given))
    given["scene"]["objects"]["post"] = {"box": [60, 60, 60], "position": [450, 250, 100]}
    assert not any("way: clear" in line for line in tried(given))


def test_check_proposes_nothing(tmp_path: Path, knotwork: Command) -> None:
    """A motion from elsewhere does not come from the scenario that would have the way."""
    file = tmp_path / "across.yaml"
    kw.Task(**across()).save(file)
    planned = knotwork("plan", file, "--out", tmp_path / "out").failed()
    assert ONE in " ".join(planned.split())
    checked = knotwork("check", tmp_path / "out", "--scenario", file).failed()
    assert "way: clear" not in checked


def once(*others: Any, tries: int = 1) -> dict[str, Any]:
    """The task past the wall, with few tries."""
    given = past(None, *others)
    given["waypoints"][1]["way"] = {"clear": True, "tries": tries}
    return given


@cache
def past_block() -> kw.Plan:
    return kw.plan(once())


def nearest(plan: kw.Plan) -> Finding:
    """The pair that comes nearest to something that stands there."""
    around = [one for one in plan.report.select(quantity="clearance") if one.involves_scene]
    return min(around, key=lambda one: one.value or 0.0)


def test_the_report_names_the_nearest_body_of_a_way() -> None:
    (finding,) = past_block().report.select(quantity="way")
    assert finding.verdict == "information"
    assert finding.message.startswith("here to there: clear motion, found in ")
    assert nearest(past_block()).name in finding.message
    assert finding.value == pytest.approx(nearest(past_block()).value, abs=1e-3)
    assert finding.interval == pytest.approx((0.0, past_block().trajectory.duration))
    assert "here to there: minimum clearance" in " ".join(str(past_block().report).split())


def test_the_strip_shows_the_clearance_that_the_check_finds() -> None:
    shown = scene(past_block().view())["strip"]["clearance"]
    assert len(shown["time"]) <= 200
    assert shown["margin"] == 0.005
    least = int(np.argmin(shown["distance"]))
    assert shown["distance"][least] == pytest.approx(nearest(past_block()).value, abs=1e-3)
    assert shown["distance"][least] <= (nearest(past_block()).value or 0.0) + 1e-6
    assert shown["names"][shown["pair"][least]] == nearest(past_block()).name


def test_the_plot_of_the_tool_has_a_row_of_clearance_with_the_margin_as_limit() -> None:
    figure = plot_tool(past_block())
    axis = figure.axes[-1]
    assert label(axis) == "clearance [mm]"
    _, value = data(lines(axis, "curve")[0])
    assert value.min() == pytest.approx(1e3 * (nearest(past_block()).value or 0.0), abs=1)
    (limit,) = (set(data(one)[1]) for one in lines(axis, "limit"))
    assert limit == {5.0}
    assert "limit 5 mm" in notes(figure)[-1]


def test_the_scene_has_the_way_and_says_so_in_the_legend(tmp_path: Path) -> None:
    for plan in (past_block(), kw.plan(past_block().freeze(tmp_path / "frozen.yaml"))):
        page = plan.view()
        assert [one["name"] for one in scene(page)["meshes"]].count("way") == 1
        assert "▪▪▪ way" in page.html
    other = planned("ur5_deburring").view()
    assert "way" not in [one["name"] for one in scene(other)["meshes"]]
    assert "▪▪▪ way" not in other.html


@pytest.mark.exhaustive
def test_progress_names_the_duration_found_and_the_attempt() -> None:
    steps: list[Progress] = []
    plan = kw.plan(once(tries=2), progress=steps.append)
    assert steps[0].trying == "way 1 of 2"
    assert steps[0].duration is None
    exists = [one.duration for one in steps if one.duration is not None]
    assert exists == sorted(exists, reverse=True)
    assert exists[-1] == pytest.approx(plan.trajectory.duration)
