"""Frames that move are met, waited in, and left with parts; by plain Pinocchio."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from moving.moving_truth import down
from moving.test_moving_things import belt, in_tray, refused
from plans import passing_plan
from sweeps import mostly_exhaustive

HIGH, LOW = (down(0, 0, z) for z in (0.15, 0.05))
NAMES = ("over", "low", "up")


def picking(first: dict[str, Any], **more: Any) -> dict[str, Any]:
    """To a place over the belt, down, a wait, up, and home."""
    return belt(
        **{
            "near": "home",
            "waypoints": [
                {"name": "over", "pose": HIGH, "stop": True, **first},
                {"name": "low", "along": "line", "pose": LOW, "speed": 0.1, "wait": 0.3},
                {"name": "up", "along": "line", "pose": HIGH, "speed": 0.1, "stop": True},
                {"joints": "home", "after": "fastest"},
            ],
            **more,
        }
    )


@cache
def met() -> kw.Plan:
    """The plan of meeting the belt as soon as can be."""
    return kw.plan(picking({"after": "fastest"}))


def check_places(plan: kw.Plan) -> dict[str, float]:
    """The tool is at rest in the tray at the waypoints' poses and times; gives these."""
    assert plan.report.ok, plan.report
    at = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    for name, pose in zip(NAMES, (HIGH, LOW, HIGH), strict=True):
        found, moving = in_tray(plan, at[name])
        assert found.translation == pytest.approx(pose["position"], abs=2e-6)
        assert moving == pytest.approx(np.zeros(3), abs=1e-4)
    return at


@pytest.mark.parametrize("along", mostly_exhaustive([-0.2, 0.3], 0.3))
def test_meets_belt_at_minimum_time(along: float) -> None:
    task = picking({"after": "fastest"})
    task["frames"]["belt"]["moves"] = {"linear": [0, along, 0]}
    task["frames"]["belt"]["position"] = [0.4, -0.5 if along > 0 else 0.2, 0.1]
    plan = passing_plan(task)
    (over,) = (waypoint.time for waypoint in plan.scenario.waypoints if waypoint.name == "over")
    assert f"'over' met at {over:.6g} s" in str(plan.report.select(quantity="duration")[0])
    task["waypoints"][0]["after"] = 0.97 * over
    try:
        sooner = kw.plan({**task, "knots": "optimal"}).report.ok
    except kw.errors.InputError:
        sooner = False
    assert not sooner


def test_meets_places_on_turning_belt() -> None:
    at = check_places(met())
    assert at["low"] - at["over"] < 2.0


def test_a_time_at_a_belt_is_chosen_though_all_later_ones_are_given() -> None:
    task = picking({"after": "fastest"})
    task["waypoints"][-1]["after"] = 3.0
    (duration,) = kw.plan(task).report.select(quantity="duration")
    assert "times chosen" in duration.fact
    assert "'over' met at" in duration.fact


def test_keeps_given_time_after_chosen_ones() -> None:
    """The arm does something as fast as it can, and is over the part when that comes by."""
    task = picking({"time": 3.0})
    aside = down(0.4, 0.2, 0.3)
    task["waypoints"].insert(
        0, {"name": "aside", "frame": "base", "pose": aside, "after": "fastest", "stop": True}
    )
    at = check_places(kw.plan(task))
    assert at["over"] == 3.0
    assert at["aside"] < 1.5
    task["waypoints"][1]["time"] = 0.5
    message = refused(task)
    assert "waypoints[1].time: 'over' is reached at" in message
    soonest = float(message.split("reached at ")[1].split(" s")[0])
    task["waypoints"][1]["time"] = 1.1 * soonest
    assert check_places(kw.plan(task))["over"] == 1.1 * soonest


@pytest.mark.exhaustive
def test_meets_belt_after_path_with_chosen_speed() -> None:
    """With the frames at the time of a nominal speed, the belt would be out of reach."""
    task = picking({"after": "fastest"})
    task["frames"]["belt"] |= {"moves": {"linear": [0, 0.2, 0]}, "position": [0.4, -0.7, 0.1]}
    bead = {"name": "bead", "along": "line", "speed": "fastest", "stop": True}
    task["waypoints"][:0] = [
        {"frame": "base", "pose": down(0.45, -0.2, 0.3), "after": "fastest", "stop": True},
        {"frame": "base", "pose": down(0.45, 0.2, 0.3), **bead},
    ]
    passing_plan(task)


def test_keeps_given_time_after_chosen_ones_in_fixed_frames() -> None:
    one, other = (down(0.4, y, 0.3) for y in (-0.2, 0.2))
    task = {
        "robot": "ur5",
        "start": "home",
        "waypoints": [
            {"pose": one, "after": "fastest", "stop": True},
            {"pose": other, "time": 4, "stop": True},
            {"joints": "home", "after": "fastest"},
        ],
    }
    plan = passing_plan(task)
    assert plan.scenario.times[2] == 4.0


@pytest.mark.parametrize("later", [False, True], ids=["last", "before a wait and a free time"])
def test_long_motion_after_short_one_does_not_swing(later: bool) -> None:
    """The short one ends with its largest acceleration, from which the arm does not swing on."""
    ends = [([0.5, 0.0, 0.2], 3.0), ([0.5, 0.0, 0.3], "fastest")]
    stops = [{"after": after, "pose": down(*place), "stop": True} for place, after in ends]
    stops.append({"time": 9, "pose": down(0.4, 0.2, 0.3), "stop": True})
    if later:
        stops[-1]["wait"] = 1
        stops.append({"joints": "home", "after": "fastest"})
    plan = passing_plan({"robot": "ur5", "start": "home", "waypoints": stops})
    start, end = plan.joint_waypoints.time[2:4]
    assert end == 9.0
    moved = np.ptp(plan.trajectory.position(np.linspace(start, end, 500)), axis=0)
    direct = np.abs(np.diff(plan.joint_waypoints.position[2:4], axis=0)[0])
    assert (moved < direct + 0.3).all()


def test_frozen_task_gives_same_motion() -> None:
    plan = met()
    again = passing_plan(plan.scenario.task)
    times = np.linspace(0.0, plan.trajectory.end_time, 50)
    assert again.trajectory.position(times) == pytest.approx(plan.trajectory.position(times))


def test_refuses_infeasible_meetings() -> None:
    task = picking({"after": "fastest"})
    task["frames"]["belt"]["position"] = [0.4, -3.0, 0.1]
    message = refused(task)
    assert "out of reach" in message
    assert (
        "after: {fastest: true, at_least: seconds} delays the arrival until they are in reach"
        in message
    )
    task["frames"]["belt"]["moves"] = {"linear": [0, 0.2, 0]}
    task["waypoints"][0]["after"] = {"fastest": True, "at_least": 13.0}
    plan = passing_plan(task)
    assert plan.scenario.waypoints[1].time == pytest.approx(13.0, abs=1e-9)
    assert "duration: is given, and the time in moving frame 'tray' is chosen" in refused(
        {**picking({"after": "fastest"}), "duration": 9.0}
    )


WAIT = 0.5


def waiting(**more: Any) -> dict[str, Any]:
    """The tool goes down to a place on the belt, waits there, and goes up again."""
    low, high = (down(0.05, 0, z) for z in (0.05, 0.15))
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
    by_name = {segment.name: segment for segment in plan.segments}
    wait = by_name["wait at low"]
    assert wait.kind == "wait"
    assert wait.end - wait.start == pytest.approx(WAIT)
    return wait.start, wait.end


@pytest.mark.parametrize("free", [None, {"turn": "z"}])
def test_tool_keeps_pose_on_belt_during_wait(free: Any) -> None:
    plan = passing_plan(waiting(tool={"free": free} if free else None))
    low, high = span(plan)
    for t in np.linspace(low, high, 40).tolist():
        pose, moving = in_tray(plan, t)
        assert pose.translation == pytest.approx([0.05, 0, 0.05], abs=1e-4)
        assert moving == pytest.approx(np.zeros(3), abs=5e-4)
        assert np.abs(pose.rotation[:, 2] + [0, 0, 1]).max() < 1e-3
    rows = [finding for finding in plan.report.findings if finding.interval == (low, high)]
    assert {"path_deviation", "path_orientation"} <= {row.quantity for row in rows}
    assert {row.proof for row in rows if row.quantity == "path_deviation"} == {"bounded"}


@pytest.mark.parametrize("creeps", [0.0003, 0.003])
def test_check_fails_tool_creeping_on_belt(creeps: float) -> None:
    """It is judged by its distance from the place, not by how slow it is."""
    task, creeping = waiting(), waiting()
    last = creeping["waypoints"][1]
    del last["wait"]
    last["stop"] = True
    aside = down(0.05 + creeps, 0, 0.05)
    creeping["waypoints"].insert(2, {"along": "line", "pose": aside, "after": WAIT, "stop": True})
    plan = kw.plan(creeping)
    failed = kw.check(plan.trajectory, kw.load_scenario(task)).failures
    low, high = span(kw.plan(task))
    assert "path_deviation" in {one.quantity for one in failed if one.interval == (low, high)}


@pytest.mark.parametrize("after", [[], [{"joints": "home", "after": "fastest"}]])
def test_belt_is_met_a_given_time_after_a_path_with_a_free_speed(
    after: list[dict[str, Any]], tmp_path: Path
) -> None:
    start, end = ({"pose": down(0.4, y, 0.5), "frame": "base"} for y in (0.1, -0.1))
    waypoints = [
        {"name": "in", "after": 2, **start},
        {"name": "out", "along": "line", "speed": "fastest", "stop": True, **end},
        {"name": "over", "pose": HIGH, "after": 3, "stop": True},
        *after,
    ]
    plan = passing_plan(belt(waypoints=waypoints))
    times = {waypoint.name: waypoint.time for waypoint in plan.scenario.waypoints}
    assert times["over"] - times["out"] == pytest.approx(3)
    again = kw.plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert again.trajectory.duration == pytest.approx(plan.trajectory.duration)


def test_speed_along_path_after_wait_on_belt_names_acceleration_of_task() -> None:
    """The wait is a path in the frame of the belt, without an acceleration of its own."""
    on, off = ({"pose": down(0.4, y, 0.4), "stop": True, "frame": "base"} for y in (-0.2, -0.1))
    waypoints = [
        {"pose": HIGH, "time": 3, "wait": 0.3},
        {"name": "on", "after": 3, **on},
        {"name": "off", "along": "line", "speed": "fastest", **off},
    ]
    options: dict[str, Any] = {"path": {"acceleration": 0.3}, "limits": {"acceleration": 20.0}}
    plan = kw.plan(belt(near="home", waypoints=waypoints, **options))
    (finding,) = plan.report.select(quantity="active_limits")
    assert str(finding) == "on to off: its speed is limited by path.acceleration, 0.3 m/s²"
