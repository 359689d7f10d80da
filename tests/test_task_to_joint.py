"""Solutions chosen over the whole sequence: turns, branches, speeds, and paths with self-motion."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from judged import judged
from knotwork.errors import BranchError
from knotwork.planning.task_to_joint import TaskSolution, solve_task
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from plans import pose_of
from sweeps import mostly_exhaustive

UR5 = kw.load_robot("ur5")
HOME = UR5.configuration("home")


def joints(q: Any) -> dict[str, float]:
    return dict(zip(UR5.joint_names, map(float, q), strict=True))


def solved(task: dict) -> TaskSolution:
    scenario = kw.load_scenario(task)
    return solve_task(scenario, read_scenario_joints(scenario))


def needed_speed(task: dict) -> str:
    """The message of the joint speed that is needed."""
    (finding,) = kw.plan(task).report.select(quantity="joint_velocity_needed")
    return finding.message


def stops(poses: list[dict], seconds: float = 2.0) -> list[dict]:
    return [{"pose": pose, "after": seconds, "stop": True} for pose in poses]


def test_reports_changed_branch() -> None:
    low = {"position": {"wrist_3_joint": [-3.2, 3.2]}}
    start, end = HOME.copy(), HOME.copy()
    start[5], end[5] = 3.0, -2.5
    task = {
        "robot": "ur5",
        "limits": low,
        "start": joints(start),
        "waypoints": stops([pose_of(UR5, end)], 2.8),
    }
    (fixed,) = solved({**task, "branch": "fixed"}).choices
    (kept,) = solved({**task, "branch": "keep"}).choices
    assert fixed.branch == kept.branch
    hurried = {**task, "waypoints": stops([pose_of(UR5, end)], 1.7)}
    (kept,) = solved({**hurried, "branch": "keep"}).choices
    assert kept.branch != fixed.branch
    failed = solved({**hurried, "branch": "fixed"})
    assert failed.choices[0].branch == fixed.branch
    assert failed.infeasibilities


@pytest.mark.parametrize(
    "word", [{"elbow": "down"}, {"wrist": "no flip"}, {"shoulder": "right", "elbow": "up"}]
)
def test_takes_requested_branch(word: dict[str, str]) -> None:
    q = [HOME + 0.1, HOME + 0.2]
    chosen = solved(
        {"robot": "ur5", "branch": word, "waypoints": stops([pose_of(UR5, x) for x in q])}
    )
    for choice in chosen.choices:
        for joint, value in word.items():
            assert (value if joint == "wrist" else f"{joint} {value}") in choice.branch.split(", ")
        assert choice.branches == 8


def test_refuses_missing_branch() -> None:
    narrow = {"position": {"elbow_joint": [0.1, 3.0]}}
    q = HOME + 0.1
    task = {
        "robot": "ur5",
        "limits": narrow,
        "waypoints": stops([pose_of(UR5, q), pose_of(UR5, q + 0.1)]),
    }
    reached = {choice.branch for choice in solved(task).choices}
    up = next(iter(reached)).split(", ")[:2]
    other = {"shoulder": up[0].split()[1], "elbow": "down" if "up" in up[1] else "up"}
    with pytest.raises(BranchError, match="is reached in: ") as caught:
        solved({**task, "branch": other})
    assert caught.value.branches


def test_branch_fixed_or_kept_at_speed() -> None:
    first = np.array([0.4, -1.2, 1.1, -0.8, 0.3, 0.3])
    mirrored = next(
        b.q
        for b in kw.solve_pose_ik_all(UR5, UR5.forward(first))
        if np.sign(b.q[4]) != np.sign(first[4])
    )
    poses = stops([pose_of(UR5, first)], 3.0)
    task = {
        "robot": "ur5",
        "start": joints(first),
        "waypoints": [*poses, {"joints": joints(mirrored), "after": 3}],
    }
    assert solved(task).choices
    assert solved({**task, "branch": "keep"}).choices[0].branch == solved(task).choices[0].branch
    with pytest.raises(BranchError, match="the branch of the waypoints before it"):
        solved({**task, "branch": "fixed"})


def test_reports_unavoidable_joint_speed() -> None:
    far = HOME + np.array([2.0, 0, 0, 0, 0, 0])
    task = {"robot": "ur5", "start": "home", "waypoints": stops([pose_of(UR5, far)], 0.5)}
    (one,) = solved(task).infeasibilities
    text = needed_speed(task)
    assert (one.name, one.interval, one.unit, one.limit) == ("start", (0.0, 0.5), "rad/s", 3.15)
    assert one.value == pytest.approx(4.0)
    assert "from 'start' to waypoint 1 shoulder_pan_joint needs 4 rad/s" in text
    assert float(re.findall(r"at least ([\d.]+) s", text)[0]) == pytest.approx(2.0 / 3.15, rel=1e-3)
    assert not kw.plan(task).report.ok


def test_reports_feasible_tool_speed() -> None:
    q = HOME + 0.1
    task = {
        "robot": "ur5",
        "start": "home",
        "waypoints": [
            {"pose": pose_of(UR5, q), "after": 3.0, "velocity": {"linear": [5.0, 0, 0]}},
            {"joints": "home", "after": 3.0},
        ],
    }
    found = solved(task)
    (one,) = found.infeasibilities
    text = needed_speed(task)
    assert (one.name, one.interval, one.time) == ("waypoint 1", None, 3.0)
    assert text.startswith("at waypoint 1 ")
    plan = kw.plan(task)
    assert set(plan.solution.infeasibilities) <= set(plan.report.failures)
    failures = plan.report_to_dict()["failures"]
    assert any("waypoint 1" in line and "of that velocity" in line for line in failures)
    speeds = np.abs(found.waypoints.velocity[1])
    worst = int(np.argmax(speeds / UR5.limits.velocity))
    assert f"{UR5.joint_names[worst]} needs" in text
    assert one.value == speeds[worst]
    part = float(re.findall(r"([\d.]+) of that velocity is feasible", text)[0])
    assert part == pytest.approx(one.limit / one.value, rel=1e-2)
    slower = {"linear": [5.0 * 0.999 * part, 0, 0]}
    task["waypoints"][0]["velocity"] = slower
    assert not solved(task).infeasibilities


def test_keeps_branch_while_tool_moves() -> None:
    """The wrist could flip during the turn at less travel; it does so before, where it may."""
    q = np.array([0.1, -1.6, 1.8, -1.8, -1.6, 1.0])
    pose = UR5.forward(q)
    axis = pose.rotation[:, 2]
    turned = [q + np.array([0, 0, 0, 0, 0, angle]) for angle in (0.0, 1.0, 2.0, 3.0, 4.0)]
    waypoints = stops([pose_of(UR5, turned[0])], 3.0)
    spin = {"angular": axis.tolist()}
    waypoints += [{"pose": pose_of(UR5, x), "after": 1.0, "velocity": spin} for x in turned[1:-1]]
    waypoints += stops([pose_of(UR5, turned[-1])], 2.0)
    task = {
        "robot": "ur5",
        "start": joints(q),
        "limits": {"position": {"wrist_3_joint": [-3.5, 3.5]}},
        "branch": {"shoulder": "left", "elbow": "up"},
        "waypoints": waypoints,
    }
    branches = [choice.branch for choice in solved(task).choices]
    assert len(set(branches)) == 1
    assert "no flip" in branches[0]
    assert UR5.forward(q).isApprox(pose)


ROOT = Path(__file__).parents[1]
NAMES = ("panda__1cube", "panda__2cubes", "fetch_arm__s")


@pytest.fixture
def problems(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("path_problems")


@pytest.mark.parametrize("name", mostly_exhaustive(NAMES, "panda__2cubes"))
def test_a_path_for_redundant_arms_is_planned_and_proved(name: str, problems: Any) -> None:
    task = problems.problem(name)
    plan = kw.plan(task)
    assert plan.report.ok
    found = {one.quantity: one for one in plan.report.findings if one.group == "Tool paths"}
    assert found["path_deviation"].limit == 1e-4
    assert found["path_orientation"].limit == np.radians(0.1)
    assert all(one.proof == "bounded" for one in found.values())
    assert not judged(plan, task)


def test_guides_keep_joint_limits(problems: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    name, ladders = "knotwork.robot.kinematics.following.ladder.Ladder.find_guided_starts", []
    monkeypatch.setattr(name, lambda ladder, count: ladders.append(ladder) or iter(()))
    with pytest.raises(kw.InputError):
        kw.plan(problems.problem("panda__2cubes"))
    q, robot = np.vstack([rung.q for rung in ladders[0].rungs[1:]]), ladders[0].robot
    assert ((robot.limits.lower <= q) & (q <= robot.limits.upper)).all()
