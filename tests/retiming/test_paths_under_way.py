"""Tool paths and events of a motion that is slowed down, stopped or replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.retiming import approximate_by_cubics
from seams import ON, task

GEOMETRY = {"path_deviation", "path_orientation", "path_progress"}


def on_paths(plan: kw.Plan) -> dict[str, set[str]]:
    """Quantities that are judged, by stretch."""
    found: dict[str, set[str]] = {}
    for finding in plan.report.select(group="Tool paths"):
        assert finding.proof == "bounded"
        found.setdefault(finding.name, set()).add(finding.quantity)
    return found


def furthest_from_chords(plan: kw.Plan, start: float, end: float) -> float:
    """Largest distance of the tool from the straight line between its ends [m], by samples."""
    robot = plan.joints.robot
    at = np.array([robot.forward(plan.trajectory(t)).translation for t in np.linspace(start, end)])
    along = (at[-1] - at[0]) / np.linalg.norm(at[-1] - at[0])
    off = at - at[0] - np.outer((at - at[0]) @ along, along)
    return float(np.linalg.norm(off, axis=1).max())


def test_slower_motion_is_checked_on_paths(deburring: kw.Plan) -> None:
    slow = deburring.scaled({0: 0.8, 3: 0.8, 4: 0.4})
    stretches = [finding.name for finding in deburring.report.select(quantity="path_deviation")]
    assert on_paths(slow) == dict.fromkeys(stretches, GEOMETRY)
    assert slow.report.ok
    assert not slow.report.select(quantity="path")
    for one in slow.report.select(quantity="path_deviation"):
        if one.name.startswith("edge"):
            assert furthest_from_chords(slow, *one.interval) < one.value + one.proof_gap + 1e-9
    poses = [finding.name for finding in deburring.report.select(group="Tool at the waypoints")]
    assert [finding.name for finding in slow.report.select(group="Tool at the waypoints")] == poses


def test_stop_on_path_is_checked_until_it_rests(deburring: kw.Plan) -> None:
    ((start, end),) = [
        one.interval for one in deburring.report.select(quantity="path_deviation") if one.interval
    ]
    middle = 0.5 * (start + end)
    stop = deburring.stop(middle)
    assert on_paths(stop) == {f"stop from {middle:g} s to stopped": GEOMETRY}
    (progress,) = stop.report.select(quantity="path_progress")
    assert progress.interval == (0.0, stop.trajectory.end_time)
    aside = deburring.stop(middle, on_path=False)
    assert not on_paths(aside)
    (note,) = aside.report.select(quantity="path")
    assert "leaves the tool paths" in note.message


@pytest.mark.parametrize(
    ("offset", "missed"),
    [
        (1e-7, set[str]()),
        (5e-4, {"path_deviation", "path_progress", "position", "orientation", "linear_velocity"}),
    ],
)
def test_missed_path_fails(
    deburring: kw.Plan, monkeypatch: pytest.MonkeyPatch, offset: float, missed: set[str]
) -> None:
    """The first joint is off by an offset [rad] at all times."""

    def shifted(*args: Any, **through: Any) -> Any:
        motion, gap = approximate_by_cubics(*args, **through)
        c = np.array(motion.c)
        c[-1, :, 0] += offset
        return PiecewisePolynomial(c, motion.x), gap

    monkeypatch.setattr("knotwork.planning.speed_override.approximate_by_cubics", shifted)
    slow = deburring.scaled({0: 1.0, 2.0: 0.3, 4.0: 1.0})
    assert {finding.quantity for finding in slow.report.failures} == missed


def test_paths_with_own_clock_are_reported_as_not_checked() -> None:
    weave = {"shape": "sine", "width": 1, "frequency": 1}
    off = {"name": "off", "along": "line", "speed": 60, "stop": True, "weave": weave}
    off["pose"] = {"position": [450, 50, 60]}
    slow = kw.plan(task(ON | {"stop": True}, off)).scaled({0: 0.5})
    (note,) = slow.report.select(quantity="path")
    assert note.verdict == "warning"
    assert "not checked" in note.message


LIMITS = {"acceleration": 4.0, "jerk": 40.0}


@pytest.fixture(scope="module")
def seam() -> kw.Plan:
    """Gas and arc are on from 2.0 s and 2.3 s to 5.3 s; the arm waits at the start for 0.5 s."""
    inner = [{"gas": "on"}, {"wait": 0.5}, {"arc": "on", "after": 0.3}, {"feed": 3, "after": 0.4}]
    waypoints = [
        {"name": "above", "joints": {"a": 0}},
        {"name": "start", "joints": {"a": 1}, "after": 2, "do": [{"jaw": "close"}, *inner]},
        {"name": "end", "joints": {"a": 3}, "after": 3, "stop": True, "do": {"arc": "off"}},
        {
            "name": "away",
            "joints": {"a": 4},
            "after": 2,
            "do": [{"gas": "off", "before": 1}, {"feed": 0}],
        },
    ]
    outputs = {"arc": 7, "gas": 8}
    return kw.plan({"limits": LIMITS, "outputs": outputs, "waypoints": waypoints})


def test_slower_motion_keeps_segments_and_events(seam: kw.Plan) -> None:
    slow = seam.scaled({0: 0.5})
    assert slow.report.ok
    for one, other in ((seam.segments, slow.segments), (seam.events, slow.events)):
        assert len(one) == len(other) > 0
    for was, now in zip(seam.segments, slow.segments, strict=True):
        assert (now.name, now.kind) == (was.name, was.kind)
        assert (now.start, now.end) == pytest.approx((2 * was.start, 2 * was.end))
    for before, after in zip(seam.events, slow.events, strict=True):
        assert (after.text, after.waypoint, after.output) == (
            before.text,
            before.waypoint,
            before.output,
        )
        assert after.time == pytest.approx(2 * before.time)
    names = [waypoint.name for waypoint in seam.scenario.waypoints]
    assert [waypoint.name for waypoint in slow.scenario.waypoints] == names
    assert any(finding.group == "Waits" for finding in slow.report.findings)


def test_end_on_the_way_has_a_name_of_its_own(seam: kw.Plan) -> None:
    """A waypoint that is passed is called end, like the end of an override of 0."""
    halted = seam.scaled({0: 1, 6: 1, 6.5: 0})
    assert halted.report.ok
    assert [one.name for one in halted.scenario.waypoints][-2:] == ["end", "end 2"]


@pytest.mark.parametrize("on_path", [True, False])
def test_signals_stay_on_after_stop(seam: kw.Plan, on_path: bool, tmp_path: Path) -> None:
    stop = seam.stop(4.0, on_path=on_path)
    assert [(event.text, event.output, event.time) for event in stop.events] == [
        ("gas on", 8, 0),
        ("arc on", 7, 0),
        ("feed 3", None, 0),
    ]
    left = [finding.message for finding in stop.report.findings if finding.verdict == "warning"]
    for name in ("gas", "arc"):
        assert f"{name} on at 0.000 s: the motion ends with it on" in left
    stored = kw.load_trajectory(stop.save(tmp_path)[0])
    assert stored.events == stop.events
    table = stop.trajectory.to_csv()
    assert "arc on" in table
    assert "start to end" in table or not on_path
    # gas is off again on the way, later than the stop
    after = seam.stop(6.2, on_path=on_path)
    assert [event.text for event in after.events] == ["gas on", "feed 3"]


GOAL: dict[str, Any] = {"limits": LIMITS, "waypoints": [{"joints": {"a": 0}, "after": 4}]}


@pytest.mark.parametrize(
    ("task", "outputs"),
    [
        (GOAL, [("gas on", None), ("arc on", None)]),
        ({**GOAL, "outputs": {"torch": 7}}, [("output 8 on", 8), ("torch on", 7)]),
        (
            {
                "limits": LIMITS,
                "outputs": {"torch": 7},
                "waypoints": [
                    {"joints": {"a": 0}, "do": [{"torch": "off", "at": 0}, {"x": 1, "after": 1}]},
                    {"joints": {"a": 1}, "after": 4, "do": {"output": 8, "value": False}},
                ],
            },
            [("output 8 on", 8), ("torch off", 7), ("x 1", None), ("output 8 off", 8)],
        ),
    ],
)
def test_replacing_task_keeps_signals_on(
    seam: kw.Plan, task: dict[str, Any], outputs: list[tuple[str, int | None]]
) -> None:
    new = seam.replan(4.0, task)
    found = [(event.text, event.output) for event in new.events if event.name != "feed"]
    if task is GOAL:
        outputs = [("output 8 on", 8), ("output 7 on", 7)]
    assert found == outputs
    assert any(event.text == "feed 3" and event.time == 0 for event in new.events)
    assert new.report.ok
