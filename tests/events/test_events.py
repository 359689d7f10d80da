"""What is switched on the way: at which moments, what is refused, and what is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from welding import do, weld

import drawn as page
import knotwork as kw
from knotwork.errors import DocumentError
from knotwork.view import plot_joints, plot_tool


@pytest.fixture(scope="module")
def plan() -> kw.Plan:
    return kw.plan(
        weld(
            approach=do({"gripper": "close", "before": 0.5}),
            seam={
                **do(
                    {"gas": "on"},
                    {"wait": 0.3},
                    {"arc": "on"},
                    {"wait": 0.2},
                    {"feed": 2.5, "at": 15},
                ),
                "stop": None,
            },
            end=do({"arc": "off", "at": -120}, {"feed": 0}, {"gas": False, "after": 0.25}),
        )
    )


def test_moments(plan: kw.Plan) -> None:
    at = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    begin, end = at["seam, after the wait"], at["end"]
    found = [(event.name, event.value, event.output, event.waypoint) for event in plan.events]
    assert found == [
        ("gripper", "close", None, "approach"),
        ("gas", True, None, "seam"),
        ("arc", True, 3, "seam"),
        ("feed", 2.5, None, "seam"),
        ("arc", False, 3, "end"),
        ("feed", 0, None, "end"),
        ("gas", False, None, "end"),
    ]
    times = [event.time for event in plan.events]
    assert begin == at["seam"] + 0.5
    assert times[:3] == [at["approach"] - 0.5, at["seam"], at["seam"] + 0.3]
    assert times[5:] == [end, end + 0.25]
    motion, robot = plan.trajectory, plan.joints.robot

    def speed(t: float) -> float:
        _, jacobian = robot.forward_and_jacobian(motion.position(t))
        return float(np.linalg.norm((jacobian @ motion.velocity(t))[:3]))

    def covered(start: float, stop: float) -> float:
        breaks = [t for t in motion.breaks if start < t < stop]
        return float(quad(speed, start, stop, points=breaks, limit=200)[0])

    # 15 mm by the integral of the tool's speed, found without the path
    reached = brentq(lambda t: covered(begin, t) - 0.015, begin + 0.1, begin + 1.0)
    assert times[3] == pytest.approx(reached, abs=2e-5)
    assert covered(times[4], end) == pytest.approx(0.12, abs=2e-5)  # over the rounded corner


def test_segments(plan: kw.Plan) -> None:
    assert [(segment.name, segment.kind) for segment in plan.segments] == [
        ("start to approach", "free motion"),
        ("approach to seam", "free motion"),
        ("wait at seam", "wait"),
        ("seam to corner", "tool path"),
        ("corner to end", "tool path"),
        ("end to retract", "free motion"),
    ]
    ends = [plan.segments[0].start, *(segment.end for segment in plan.segments)]
    assert ends == [waypoint.time for waypoint in plan.scenario.waypoints]


def test_on_twice_and_moments_that_coincide_are_fine() -> None:
    scenario = kw.load_scenario(weld(seam=do({"a": "on"}, {"b": "on"}), end=do({"a": "on"})))
    assert [event.event.text for event in scenario.events] == ["a on", "b on", "a on"]


def test_free_times_are_chosen_first_and_freezing_keeps_events(tmp_path: Any) -> None:
    task = {
        "limits": {"acceleration": 4, "jerk": 40},
        "times": "fastest",
        "waypoints": [
            {"joints": {"a": 0}},
            {"joints": {"a": 1}, "stop": True, "do": [{"wait": 0.5}, {"x": "on", "before": 0.2}]},
            {"joints": {"a": 0}, "do": {"x": "off"}},
        ],
    }
    plan = kw.plan(task)
    assert kw.load_scenario(task).events == ()
    on, off = plan.events
    assert on.time == plan.scenario.waypoints[1].time - 0.2
    assert off.time == plan.trajectory.end_time
    frozen = kw.plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert frozen.events == plan.events
    assert frozen.segments == plan.segments
    stored = kw.load_trajectory(plan.save(tmp_path)[0])
    assert (stored.events, stored.segments) == (plan.events, plan.segments)
    assert kw.Task(**task).to_dict() == task


def test_repeated_waypoints_repeat_their_events() -> None:
    turn = [
        {"name": "open", "joints": {"a": 1}, "after": 1, "stop": True, "do": {"jaw": "open"}},
        {"name": "close", "joints": {"a": 0}, "after": 1, **do({"jaw": "close"}, {"wait": 0.5})},
    ]
    places = [{"position": [0, 0, 0]}] * 2
    task = {"start": {"a": 0}, "waypoints": [{"over": places, "repeat": turn}]}
    found = [(event.event.waypoint, event.event.time) for event in kw.load_scenario(task).events]
    assert found == [("open 1", 1), ("close 1", 2), ("open 2", 3.5), ("close 2", 4.5)]
    turn[1]["do"][0]["before"] = 1.5
    with pytest.raises(DocumentError, match=r"repeat\[1\]\.do\[0\]: jaw close \(close 1\) comes"):
        kw.load_scenario(task)


def warned(plan: kw.Plan) -> list[str]:
    return [finding.message for finding in plan.report.findings if finding.group == "Warnings"]


def test_what_stays_on_and_what_is_on_already_is_warned_of() -> None:
    def joints(*actions: dict[str, Any]) -> kw.Plan:
        ends = [{"joints": {"a": 0}, **do(*actions)}, {"joints": {"a": 1}, "after": 2}]
        return kw.plan({"outputs": {"arc": 1}, "waypoints": ends})

    assert warned(joints({"arc": "on"}, {"arc": "off", "after": 1}, {"jaw": "close"})) == []
    assert warned(joints({"arc": "on"}, {"feed": 2})) == [
        "arc on at 0.000 s: the motion ends with it on"
    ]
    twice = joints(
        {"arc": "on"}, {"output": 1, "value": True, "after": 1}, {"arc": "off", "after": 2}
    )
    assert warned(twice) == ["arc on at 1.000 s: it has had this value since 0.000 s"]


def test_an_output_has_one_name() -> None:
    with pytest.raises(DocumentError, match=r"outputs: 'gas' and 'arc' are both output 1; give"):
        kw.load_scenario(weld() | {"outputs": {"gas": 1, "arc": 1}})


@pytest.fixture(scope="module")
def welding_plan() -> kw.Plan:
    return kw.plan(
        weld(seam=do({"arc": "on", "at": 20}, {"wait": 0.2}, {"b": "x"}) | {"stop": None})
    )


def test_the_strip_has_them(welding_plan: kw.Plan) -> None:
    strip = page.scene(welding_plan.view())["strip"]
    assert strip["events"] == [[event.time, event.text] for event in welding_plan.events]
    assert [one[:3] for one in strip["segments"]] == [
        [segment.start, segment.end, segment.name] for segment in welding_plan.segments
    ]


def test_plots_mark_them_on_their_upper_edge(welding_plan: kw.Plan) -> None:
    times = [event.time for event in welding_plan.events]
    for figure in (plot_joints(welding_plan), plot_tool(welding_plan)):
        drawn = {str(line.get_gid()).split(":")[0]: line for line in figure.axes[0].lines}
        named = figure.legends[-1].get_title().get_text()
        assert named == "events: " + ", ".join(
            dict.fromkeys(event.text for event in welding_plan.events)
        )
        assert drawn["event"].get_xdata().tolist() == times
        for kind in ("tool path", "wait"):
            spans = [(one.start, one.end) for one in welding_plan.segments if one.kind == kind]
            found = np.reshape(drawn[kind].get_xdata(), (-1, 3))[:, :2]
            assert found.tolist() == [list(span) for span in spans]
        assert "way" not in drawn
