"""Waits in frames that move: the tool stays where it is in the frame, by plain Pinocchio."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from moving.test_moving_things import DOWN, belt, in_tray, refused

WAIT = 0.5


def waiting(**more: Any) -> dict[str, Any]:
    """The tool goes down to a place on the belt, waits there, and goes up again."""
    low, high = ({"position": [0.05, 0, z], **DOWN} for z in (0.05, 0.15))
    task = belt(
        waypoints=[
            {"pose": high, "after": 2, "stop": True},
            {"along": "line", "pose": low, "speed": 0.1, "wait": WAIT, "name": "low"},
            {"along": "line", "pose": high, "speed": 0.1, "stop": True},
            {"joints": "home", "after": 3},
        ]
    )
    return {**task, **more}


def span(plan: kw.Plan) -> tuple[float, float]:
    by_name = {one.name: one for one in plan.segments}
    wait = by_name["wait at low"]
    assert wait.kind == "wait"
    assert wait.end - wait.start == pytest.approx(WAIT)
    return wait.start, wait.end


@pytest.mark.parametrize("free", [None, {"turn": "z"}])
def test_tool_keeps_pose_on_belt_during_wait(free: Any) -> None:
    plan = kw.plan(waiting(tool={"free": free} if free else None))
    assert plan.report.ok, plan.report
    low, high = span(plan)
    for t in np.linspace(low, high, 40).tolist():
        pose, moving = in_tray(plan, t)
        assert pose.translation == pytest.approx([0.05, 0, 0.05], abs=1e-4)
        assert moving == pytest.approx(np.zeros(3), abs=5e-4)
        assert np.abs(pose.rotation[:, 2] + [0, 0, 1]).max() < 1e-3
    rows = [one for one in plan.report.findings if one.interval == (low, high)]
    assert {"path_deviation", "path_orientation"} <= {one.quantity for one in rows}
    assert {one.proof for one in rows if one.quantity == "path_deviation"} == {"bounded"}


@pytest.mark.parametrize("creeps", [0.0003, 0.003])
def test_check_fails_tool_creeping_on_belt(creeps: float) -> None:
    """It is judged by its distance from the place, not by how slow it is."""
    task = waiting()
    creeping = waiting()
    last = creeping["waypoints"][1]
    del last["wait"]
    last["stop"] = True
    aside = {"position": [0.05 + creeps, 0, 0.05], **DOWN}
    more = {"along": "line", "pose": aside, "after": WAIT, "stop": True}
    creeping["waypoints"].insert(2, more)
    plan = kw.plan(creeping)
    failed = kw.check(plan.trajectory, kw.load_scenario(task)).failures
    low, high = span(kw.plan(task))
    assert "path_deviation" in {one.quantity for one in failed if one.interval == (low, high)}


def test_refuses_invalid_waits_on_belt(tmp_path: Path) -> None:
    task = waiting()
    task["waypoints"][1] = {
        "pose": {"position": [0, 0, 0.1], **DOWN},
        "after": 1,
        "wait": WAIT,
        "free": {"position": {"x": [-0.1, 0.1]}},
    }
    del task["waypoints"][2]
    assert "waypoints[1].free: leaves the position open where the tool moves" in refused(task)
    rows = [(0, 0.0), (3.2, 0.1), (9, 0.3)]
    (tmp_path / "y.csv").write_text("\n".join(["time,y", *(f"{t},{y}" for t, y in rows)]))
    task = waiting()
    task["frames"]["belt"]["moves"] = {"file": str(tmp_path / "y.csv")}
    assert "at 3.2 s the speed of frame 'belt' jumps" in refused(task)
