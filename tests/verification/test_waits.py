"""Where a task has the arm wait, it stands still: planned so, and checked over all time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.verification import Finding
from sweeps import mostly_exhaustive

POSE = {"position": [450, 0, 300], "rpy": [180, 0, 0]}


def task(*waypoints: dict[str, Any], robot: str = "ur5", back: float = 2) -> dict[str, Any]:
    home = {"name": "home", "joints": "home"}
    last = {"name": "back", "joints": "home", "after": back}
    units = {"length": "mm", "angle": "deg"}
    return {"robot": robot, "units": units, "waypoints": [home, *waypoints, last]}


def standing(plan: kw.Plan) -> tuple[Finding, ...]:
    return plan.report.select(quantity="movement")


@pytest.mark.parametrize(
    ("robot", "turning"),
    mostly_exhaustive(
        [("ur5", None), ("panda", None), ("xarm7", None), ("ur5", "tangent"), ("xarm7", "tangent")],
        *[("panda", None), ("ur5", "tangent")],
    ),
)
def test_full_circle_between_waits_is_not_a_wait(robot: str, turning: str | None) -> None:
    begin = {"name": "begin", "pose": POSE, "after": 2, "wait": 0.4}
    circle = {
        "name": "end",
        "pose": POSE,
        "along": {"arc": {"centre": [450, 30, 300], "normal": [0, 0, 1]}},
        "speed": 30,
        "wait": 0.3,
    }
    if turning:
        circle["orientation"] = turning
        circle["pose"] = {"position": POSE["position"]}
    plan = kw.plan(task(begin, circle, robot=robot, back=8))
    start, end = standing(plan)
    assert (start.name, end.name) == ("begin", "end")
    for found, wait in ((start, 0.4), (end, 0.3)):
        assert np.ptp(found.interval) == pytest.approx(wait)
        assert found.value == 0.0
        q = plan.trajectory.position(np.linspace(*found.interval, 1001))
        assert np.ptp(q, axis=0).max() == 0.0
    assert all(found.ok for found in plan.report.findings if found.subject in ("path", "waypoint"))


@pytest.mark.parametrize("planner", ["modified-hermite", "quintic", "3-5-3", "bspline"])
def test_reports_largest_movement_in_wait(planner: str) -> None:
    there = {"name": "there", "pose": POSE, "after": 2, "wait": 0.3}
    plan = kw.plan(task(there), planner=planner)
    (found,) = standing(plan)
    q = plan.trajectory.position(np.linspace(2.0, 2.3, 20001))
    moved = np.abs(q - q[0]).max()
    assert found.value == pytest.approx(moved, rel=1e-6, abs=1e-15)
    assert found.ok == (moved <= 1e-6)
    assert found.ok == (planner in ("modified-hermite", "quintic"))


def test_names_joint_with_largest_error() -> None:
    there = {"name": "there", "joints": {"a": 1, "b": 1}, "after": 1, "wait": 1}
    ends = [{"joints": {"a": 0, "b": 0}}, there, {"joints": {"a": 0, "b": 0}, "after": 1}]
    scenario = kw.load_scenario({"waypoints": ends})
    moved = {**there, "joints": {"a": 1.1, "b": 1.3}}
    motion = kw.plan({"waypoints": [ends[0], moved, ends[2]]}).trajectory
    (finding, _) = kw.check(motion, scenario).select(quantity="joint_position", verdict="failed")
    assert finding.value == pytest.approx(0.3)
