"""A bounded turn is one continuous angle: whole turns count, along all that is joined."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import knotwork as kw
from plans import arm
from seams import task
from sweeps import mostly_exhaustive

TURN = {"turn": "z"}
HALF = {"turn": [-180, 180]}


def rim(
    axis: int = 1, parts: int = 1, *, at_ends: Any = (), yaw: float = 0.0, free: Any = TURN
) -> dict[str, Any]:
    """A round of a rim, in parts: a tool that does not turn turns once against its path."""
    arc = {"arc": {"centre": [600, 0, 200], "normal": [0, 0, axis]}}
    ends = [axis * 2 * np.pi * (k + 1) / parts - np.pi / 2 for k in range(parts)]
    down = {"rpy": [180, 0, yaw]}
    given = task(
        {"after": 3, "pose": {"position": [600, -200, 200], **down}, "stop": True},
        *(
            {
                "along": arc,
                "orientation": "tangent",
                "speed": 80,
                **dict(at_ends),
                "pose": {"position": [600 + 200 * np.cos(a), 200 * np.sin(a), 200]},
            }
            for a in ends
        ),
        robot="ur10",
        tool={"offset": {"position": [0, 0, 120]}},
    )
    for k, waypoint in enumerate(given["waypoints"]):
        waypoint |= {"name": "abcde"[k], "free": free if k else "none"}
    return given


def judged(motion: kw.JointTrajectory, task: dict[str, Any], free: Any) -> kw.verification.Report:
    for waypoint in task["waypoints"]:
        waypoint["free"] = free
    return kw.check(motion, kw.load_scenario(task))


def turns(plan: kw.Plan) -> np.ndarray:
    """Of the tool's x axis against the direction about the rim's centre [rad], whole turns too."""
    robot = arm(plan)
    first, last = plan.scenario.paths[0].motion, plan.scenario.paths[-1].motion
    poses = [
        robot.forward(q)
        for q in plan.trajectory.position(np.linspace(first.start_time, last.end_time, 2000))
    ]
    x = np.unwrap([np.arctan2(*pose.rotation[1::-1, 0]) for pose in poses])
    place = [pose.translation - [0.6, 0.0, 0.2] for pose in poses]
    about = np.unwrap([np.arctan2(y, x) for x, y, _ in place])
    return np.asarray((x - x[0]) - (about - about[0]))


@pytest.mark.parametrize(
    ("axis", "parts", "at_ends"),
    [
        pytest.param(1, 1, {}, marks=pytest.mark.exhaustive),
        (-1, 2, {}),
        pytest.param(1, 2, {"stop": True}, marks=pytest.mark.exhaustive),
    ],
)
def test_whole_turn_exceeds_half_turn_range(axis: int, parts: int, at_ends: dict[str, Any]) -> None:
    plan = kw.plan(rim(axis, parts, at_ends=at_ends))
    assert plan.report.ok
    wound = np.abs(turns(plan)).max()
    assert wound > np.radians(350)
    report = judged(plan.trajectory, rim(axis, parts, at_ends=at_ends), HALF)
    worst = max(report.select(quantity="path_turn"), key=lambda one: one.value or 0.0)
    assert {one.quantity for one in report.failures} == {"path_turn"}
    assert worst.value == pytest.approx(wound - np.pi, abs=1e-3)


RANGES = [(1, 361, -1), (1, 350, 10), (2, 361, -1)]


@pytest.mark.parametrize(("rounds", "most", "off"), mostly_exhaustive(RANGES, *RANGES[1:]))
def test_range_of_several_turns_is_bounded(rounds: int, most: float, off: float) -> None:
    """Two rounds fit into one turn each way, begun at its end."""
    task = rim(-1)
    task["waypoints"][1]["along"]["arc"]["turns"] = rounds - 1
    plan = kw.plan(task)
    assert np.degrees(np.abs(turns(plan)).max()) == pytest.approx(360 * rounds, abs=2)
    report = judged(plan.trajectory, task, {"turn": [-most, most]})
    (row,) = report.select(quantity="path_turn")
    assert report.ok == (off < 0)
    assert np.degrees(row.value or 0.0) == pytest.approx(off, abs=1)


@pytest.mark.parametrize(
    "free", [pytest.param(HALF, marks=pytest.mark.exhaustive), {"turn": [-400, 300]}]
)
def test_plans_turn_within_range(free: Any) -> None:
    assert kw.plan(rim(free=free)).report.ok


@pytest.mark.parametrize("axis", [1, -1])
def test_turn_may_wind_across_whole_range(axis: int) -> None:
    plan = kw.plan(rim(axis))
    report = judged(plan.trajectory, rim(axis, yaw=180), HALF)
    assert report.ok, report.failures
    (used,) = report.select(group="Freedom")
    ends = [float(word) for word in used.message.split("turn ")[1].split(" of ")[0].split(" to ")]
    assert np.abs(np.abs(ends) - 180).max() < 5


@pytest.mark.parametrize(
    ("at_ends", "more"),
    [({"stop": True}, {}), ({"wait": 0.5}, {}), ({"stop": True}, {"tilt": 5})],
)
def test_turn_does_not_wrap_between_joined_paths(
    at_ends: dict[str, Any], more: dict[str, Any]
) -> None:
    """Half a turn each, both within the range if the second began anew at its other end."""
    plan = kw.plan(rim(parts=2, at_ends=at_ends))
    first, last = (one.motion for one in plan.scenario.paths)
    part = (first.end_time - first.start_time) / (last.end_time - first.start_time)
    found = turns(plan)
    halfway = float(np.interp(part, np.linspace(0, 1, len(found)), found))
    task = rim(parts=2, at_ends=at_ends, yaw=180 + float(np.degrees(halfway)))
    for waypoint, free in zip(task["waypoints"], (HALF, HALF, HALF | more), strict=True):
        waypoint["free"] = free
    report = kw.check(plan.trajectory, kw.load_scenario(task))
    first_half, second_half = report.select(quantity="path_turn")
    assert first_half.ok
    assert first_half.value == pytest.approx(0.0, abs=1e-3)
    assert second_half.value == pytest.approx(halfway - found[-1], abs=2e-3)
