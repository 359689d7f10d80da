"""The use of limits in pictures, pages and the strip is that of the verdict."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import yaml
from figures import collections, data, legend_words, lines, notes

import knotwork as kw
from drawn import numbers, scene, thing, vertices
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.verification import Topic
from knotwork.view import plot_joints, plot_tool
from plans import planned
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive
from walls import through_wall

GROUPS = ("Joint limits", "Tool and links", "Singularity")
WITH_ARM = [name for name in SCENARIO_FILES if not name.startswith("paper_case")]


@cache
def deburring(**limits: Any) -> kw.Plan:
    task = yaml.safe_load(SCENARIO_FILES["ur5_deburring"].read_text(encoding="utf-8"))
    frames = [{"frame": name, "speed": limits.pop(name)} for name in (*limits,) if "link" in name]
    given = task["limits"] | limits | ({"frame_speed": frames} if frames else {})
    return kw.plan({**task, "limits": given})


def peak(quantity: str) -> float:
    """The greatest value of a quantity of the tool, or of the forearm [mm]."""
    plan = deburring(tool_acceleration=1e4, forearm_link=1e4)
    (finding,) = plan.report.select(quantity=quantity)
    return 1e3 * finding.value


def most_used(plan: kw.Plan) -> Any:
    """The finding on a limit that uses most of it."""
    limits = [one for one in plan.report.findings if one.group in GROUPS and one.limit is not None]
    return max(limits, key=lambda one: one.utilisation or 0.0)


def shown(plan: kw.Plan) -> Any:
    return numbers(scene(plan.view())["strip"]["use"], "<f4", 1)[:, 0]


@pytest.mark.parametrize(
    "name", mostly_exhaustive(WITH_ARM, "ur5_deburring", "planar2_closed_form")
)
def test_the_most_that_the_strip_shows_is_the_most_in_the_verdict(name: str) -> None:
    plan = kw.plan(name)
    assert shown(plan).max() == pytest.approx(most_used(plan).utilisation, rel=1e-6)


def test_effort_with_unknown_load_is_shown_at_its_time_only() -> None:
    plan = deburring()
    topic = Topic("Joint limits", "joint", plan.joints.joint_names[1])
    effort = topic.at_most("effort", "effort", 5.0, 10.0, "N m", time=0.3)
    joints = replace(plan.joints, loaded_robots=None)
    use = shown(replace(plan, joints=joints, report=replace(plan.report, findings=(effort,))))
    assert use[use > 0.0].tolist() == [0.5]


def test_limits_far_exceeded_are_shown() -> None:
    plan = deburring(tool_speed=1e-99)
    assert shown(plan).max() > 1e6


BROKEN = [
    ("tool_speed", "tool_speed", "tool speed", "mm/s"),
    ("tool_acceleration", "tool_acceleration", "tool acceleration", "mm/s²"),
    ("forearm_link", "frame_speed", "speed of forearm_link", "mm/s"),
]


@pytest.mark.parametrize(("key", "quantity", "title", "unit"), mostly_exhaustive(BROKEN, BROKEN[2]))
def test_a_broken_limit_is_shown_everywhere(key: str, quantity: str, title: str, unit: str) -> None:
    """At 392 % of a limit of tool or link, while every joint keeps its own."""
    plan = deburring(**{key: peak(quantity) / 3.92})
    worst = most_used(plan)
    assert (worst.quantity, plan.report.failures) == (quantity, (worst,))
    assert worst.utilisation == pytest.approx(3.92, rel=1e-3)
    assert "(392 %)" in worst.message

    use = shown(plan)
    assert use.max() == pytest.approx(worst.utilisation, rel=1e-6)
    time = np.linspace(plan.trajectory.start_time, plan.trajectory.end_time, len(use))
    assert time[use.argmax()] == pytest.approx(worst.time, abs=0.6 * time[1])

    page, robot = scene(plan.view()), plan.joints.robot
    assert page["legend"]["exceeded"]
    red = vertices(thing(page, "limits exceeded"))
    places = [(robot.base_placement * robot.forward(q)).translation for q in plan.trajectory(time)]
    near = np.linalg.norm(np.array(places)[:, None] - red, axis=2).min(axis=1) < 0.01 * page["size"]
    assert near[use > 1].all()
    assert (use > 1).sum() > 5  # as long as it is broken

    figure = plot_tool(plan)
    named = {" ".join(one.get_ylabel().split()): one for one in figure.axes}
    axis = named[f"{title} [{unit}]"]
    (limit,) = lines(axis, "limit")
    drawn = data(limit)[1]
    assert drawn[~np.isnan(drawn)] == pytest.approx(1e3 * worst.limit)
    assert not np.isnan(drawn).all()
    (curve,) = lines(axis, "curve")
    most = np.nanmax(data(curve)[1]) / 1e3  # the value is the worst sample, the gap what is left
    assert worst.value * (1 - 1e-6) <= most <= worst.value + worst.proof_gap + 1e-9
    assert len(lines(axis, "exceeded")) == 1
    note = axis.get_title(loc="right")
    assert note.startswith(f"{1e3 * worst.value:.3g} {unit} at ")


@pytest.mark.parametrize("share", mostly_exhaustive([0.9, 1.5], 1.5))
def test_a_limit_from_below_is_shown_too(share: float) -> None:
    """The smallest singular value, kept and broken."""
    (least,) = planned("ur5_deburring").report.select(quantity="smallest_singular_value")
    plan = deburring(singular_value=share * least.value)
    assert shown(plan).max() == pytest.approx(most_used(plan).utilisation, rel=1e-6)
    figure = plot_tool(plan)
    row = figure.axes[-1]
    assert row.get_ylabel().replace("\n", " ") == "smallest singular value"
    assert np.nanmin(data(lines(row, "curve")[0])[1]) == pytest.approx(least.value, rel=1e-3)
    assert bool(lines(row, "exceeded")) == (share > 1)
    assert f"limit {share * least.value:.3g}" in notes(figure)[-1]
    assert plan.report.ok == (share < 1)


def test_a_jump_is_no_kept_limit() -> None:
    """The tool's acceleration is infinite there, though it is within its limit at all samples."""
    ends = [{"joints": {"shoulder": 0, "elbow": 0.5}}, {"joints": {"shoulder": 0.5, "elbow": 0.5}}]
    task = {"robot": "planar2", "limits": {"tool_acceleration": 50}, "waypoints": ends}
    plan = kw.plan({**task, "waypoints": [ends[0], {**ends[1], "after": 2}]})
    corners = [[[0.1, 0.0], [0.4, 0.0]], [[0.0, 0.5], [0.1, 0.5]]]  # linear, (2, pieces, joints)
    curve = PiecewisePolynomial(np.array(corners), np.array([0.0, 1.0, 2.0]))
    motion = replace(plan.trajectory, polynomial=curve)
    report = kw.check(motion, plan.scenario)
    (finding,) = report.select(quantity="tool_acceleration")
    assert finding.value == np.inf
    broken = replace(plan, trajectory=motion, report=report)
    assert shown(broken).max() == np.inf
    assert "infinite at the jump at 1 s, limit 50 m/s²" in notes(plot_tool(broken))


def strip(plan: kw.Plan) -> Any:
    return scene(plan.view())["strip"]


def test_a_segment_says_what_its_chosen_time_is_bound_by() -> None:
    plan = planned("panda_pick_place_fastest")
    findings = [finding for finding in plan.report.findings if finding.quantity == "active_limits"]
    limits = {tuple(finding.interval or ()): finding.short_fact for finding in findings}
    for start, end, name, limit in strip(plan)["segments"]:
        if (start, end) in limits:
            assert limit == limits[start, end]
            assert f"limited by {limit}" in " ".join(finding.highlight for finding in findings)
        assert name


def test_a_segment_of_given_times_names_the_limit_nearest_to_it() -> None:
    plan = deburring(tool_speed=250.0)
    (speed,) = plan.report.select(quantity="tool_speed")
    limits = [one[3] for one in strip(plan)["segments"]]
    assert f"tool speed {100 * speed.utilisation:.0f} %" in limits


def test_a_broken_limit_is_red_as_long_as_it_is_broken() -> None:
    ends = [{"joints": {"shoulder": 0, "elbow": 0.5}}, {"joints": {"shoulder": 1, "elbow": 0.5}}]
    task = {"robot": "planar2", "limits": {"velocity": 0.6}}
    plan = kw.plan({**task, "waypoints": [ends[0], {**ends[1], "after": 2}]})
    (failed,) = plan.report.failures
    spans = strip(plan)["exceeded"]
    low, high = min(span[0] for span in spans), max(span[1] for span in spans)
    curve = plan.trajectory
    assert failed.name == "shoulder"
    assert (abs(curve.velocity([low + 0.02, high - 0.02])[:, 0]) > 0.6).all()
    assert (abs(curve.velocity([low - 0.02, high + 0.02])[:, 0]) < 0.6).all()
    assert high - low > 0.3


def test_a_limited_link_is_a_curve() -> None:
    (elbow,) = strip(deburring(forearm_link=500.0))["curves"]
    assert (elbow["name"], elbow["unit"]) == ("speed of forearm_link", "mm/s")
    assert elbow["limits"] == [pytest.approx(500.0)]
    assert len(elbow["time"]) == len(elbow["value"])


@pytest.mark.exhaustive
def test_what_a_path_leaves_open_is_a_curve() -> None:
    plan = planned("ur5_dome")
    (used,) = (one for one in plan.report.select(quantity="free_range") if one.subject == "path")
    (turn,) = strip(plan)["curves"]
    assert turn["name"] == f"turn, {used.name}"
    assert turn["unit"] == "deg"
    span = max(turn["value"]) - min(turn["value"])
    assert span == pytest.approx(plan.scenario.units.shown(used.value or 0.0, "rad")[0], rel=1e-3)


def test_collisions_are_marked_over_all_panels_as_long_as_they_last() -> None:
    plan = through_wall()
    spans = [span for finding in plan.report.failures for span in finding.intervals]
    first, last = min(start for start, _ in spans), max(end for _, end in spans)
    (drawn, *others) = strip(plan)["exceeded"]
    assert not others
    assert drawn == pytest.approx([first, last], abs=0.01)
    for figure in (plot_joints(plan), plot_tool(plan)):
        assert "collision" in legend_words(figure)
        for axis in figure.axes:
            (mark,) = collections(axis, "contact")
            times = mark.get_x(), mark.get_x() + mark.get_width()
            assert times == pytest.approx((first, last), abs=0.01)
