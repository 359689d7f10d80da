"""Tool paths of a motion that runs at another speed or is stopped: their geometry is checked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.retiming import approximate_by_cubics
from plans import arm, planned

GEOMETRY = {"path_deviation", "path_orientation", "path_progress"}


def on_paths(plan: kw.Plan) -> dict[str, set[str]]:
    """Quantities that are judged, by stretch."""
    found: dict[str, set[str]] = {}
    for one in plan.report.select(group="Tool paths"):
        assert one.proof == "bounded"
        found.setdefault(one.name, set()).add(one.quantity)
    return found


def furthest_from_chords(plan: kw.Plan, start: float, end: float) -> float:
    """Largest distance of the tool from the straight line between its ends [m], by samples."""
    robot = arm(plan)
    at = np.array([robot.forward(plan.trajectory(t)).translation for t in np.linspace(start, end)])
    along = (at[-1] - at[0]) / np.linalg.norm(at[-1] - at[0])
    off = at - at[0] - np.outer((at - at[0]) @ along, along)
    return float(np.linalg.norm(off, axis=1).max())


def test_slower_motion_is_checked_on_paths(deburring: kw.Plan) -> None:
    slow = deburring.scaled({0: 0.8, 3: 0.8, 4: 0.4})
    stretches = [one.name for one in deburring.report.select(quantity="path_deviation")]
    assert on_paths(slow) == dict.fromkeys(stretches, GEOMETRY)
    assert slow.report.ok
    assert not slow.report.select(quantity="path")
    for one in slow.report.select(quantity="path_deviation"):
        assert one.interval is not None
        assert one.value is not None
        if one.name.startswith("edge"):
            assert furthest_from_chords(slow, *one.interval) < one.value + one.excess + 1e-9
    poses = [one.name for one in deburring.report.select(group="Tool at the waypoints")]
    assert [one.name for one in slow.report.select(group="Tool at the waypoints")] == poses


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
        (
            5e-4,
            {"path_deviation", "path_progress", "position", "orientation", "linear_velocity"},
        ),
    ],
)
def test_missed_path_fails(
    deburring: kw.Plan, monkeypatch: pytest.MonkeyPatch, offset: float, missed: set[str]
) -> None:
    """The first joint is off by an offset [rad] at all times."""

    def shifted(*args: Any) -> Any:
        motion, gap = approximate_by_cubics(*args)
        c = np.array(motion.c)
        c[-1, :, 0] += offset
        return PiecewisePolynomial(c, motion.x), gap

    monkeypatch.setattr("knotwork.planning.speed_override.approximate_by_cubics", shifted)
    slow = deburring.scaled({0: 1.0, 2.0: 0.3, 4.0: 1.0})
    assert {one.quantity for one in slow.report.failures} == missed


def test_paths_with_own_clock_are_reported_as_not_checked() -> None:
    slow = planned("ur10_weave").scaled({0: 0.5})
    (note,) = slow.report.select(quantity="path")
    assert note.verdict == "warning"
    assert "not checked" in note.message
