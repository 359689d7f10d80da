"""Every shipped scenario, planned by name and by path, and what its description promises."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from judged import judged_folder
from knotwork.errors import UnknownNameError
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.verification.finding import Group
from knotwork.waypoints import CartesianWaypoint, JointWaypoints
from plans import planned
from shipped import LONG
from sweeps import mostly_exhaustive

ROOT = Path(__file__).parents[1]
PATHS = sorted((ROOT / "scenarios").glob("*.yaml"))
SLOW = LONG | {"panda_bookshelf", "panda_three_parts", "ur10_weave", "ur5_dome"}
SLOW |= {"ur5_machine_door", "ur5_two_arms", "ur5_wall"}
QUICK = [path for path in PATHS if path.stem not in SLOW]

WARNINGS = {
    "ur5_turntable_rim": [
        "efforts are not checked: the frame of the poses is on table, which moves"
    ],
}
"""Of scenarios that are warned of, on purpose."""


def test_the_folder_holds_the_scenarios_that_are_shipped() -> None:
    with pytest.raises(UnknownNameError) as unknown:
        kw.load_scenario("none")
    assert unknown.value.available == tuple(path.stem for path in PATHS)
    assert len(PATHS) == 26
    robots = {str(kw.load_scenario(path).task.robot) for path in PATHS}
    assert {"ur5", "panda", "kinova", "ur10", "xarm7", "planar2", "None"} <= robots


@pytest.mark.parametrize("path", mostly_exhaustive(PATHS, *QUICK), ids=lambda path: path.stem)
def test_scenario_passes_the_judge_and_reports_its_branches(
    path: Path, knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No acceleration is a spike, though in the fastest ones it changes sign in milliseconds."""
    monkeypatch.setenv("COLUMNS", "300")  # so that no cell of a table is wrapped
    ran = knotwork("plan", path.stem, "--full", "--out", tmp_path)
    assert (ran.code, ran.err) == (0, "")
    assert f"PASSED {path.stem}" in ran.out
    saved = json.loads((tmp_path / "report.json").read_text())
    assert saved["ok"]
    assert not [one for one in saved["findings"] if one["quantity"].endswith("_spike")]
    assert {one["group"] for one in saved["findings"]} <= set(vars(Group).values())
    assert judged_folder(tmp_path, path) == []
    assert [one.partition(" for ")[0] for one in saved["warnings"]] == WARNINGS.get(path.stem, [])
    # where times are free, the numbers in their place say what the motion has to do when
    numbers = tmp_path / "scenario.yaml"
    free = kw.load_scenario(path).unknowns is not None
    assert numbers.exists() == free == ("chosen_times" in saved)
    chosen = saved.get("chosen_times", {"lower_bound": 0.0, "duration": 0.0, "binding": ["none"]})
    assert chosen["lower_bound"] <= chosen["duration"]
    assert chosen["binding"]
    assert knotwork("check", tmp_path, "--scenario", numbers if free else path.stem).code == 0

    posed = [w.name for w in kw.load_scenario(path).waypoints if isinstance(w, CartesianWaypoint)]
    assert ("Solutions chosen" in ran.out) == ("solutions" in saved) == bool(posed)
    solutions = saved.get("solutions", {"choices": []})
    assert [choice["waypoint"] for choice in solutions["choices"]] == posed
    for choice in solutions["choices"]:
        assert choice["branch"] in " ".join(ran.out.split())
        assert choice["solutions"] >= choice["branches"] >= 1


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_it_is_described_and_its_waypoints_are_named(path: Path) -> None:
    scenario = kw.load_scenario(path)
    assert scenario.name == path.stem
    assert len(scenario.task.description.split()) >= 4
    assert not any(waypoint.name.startswith("waypoint ") for waypoint in scenario.waypoints)
    assert path.read_text().startswith("#")


def nearest_by_nearest(scenario: Scenario) -> JointWaypoints:
    """Joint waypoints as one takes them without looking ahead: each nearest the one before."""
    joints = read_scenario_joints(scenario)
    q, positions, velocities = joints.robot.configurations["home"], [], []
    for waypoint, state in zip(scenario.waypoints, joints.targets, strict=True):
        if state is not None:
            q, v = state.position, state.velocity
        else:
            q = kw.solve_pose_ik(joints.robot, waypoint.pose, q).q
            v = kw.solve_velocity_ik(joints.robot, q, waypoint.twist)
        positions.append(q)
        velocities.append(v)
    return JointWaypoints(
        joints.joint_names, scenario.times, np.array(positions), np.array(velocities)
    )


@pytest.mark.parametrize("name", ["ur5_valve", "ur3_lid"])
def test_taking_the_nearest_solution_each_time_fails_where_the_plan_passes(name: str) -> None:
    scenario = kw.load_scenario(name)
    waypoints = nearest_by_nearest(scenario)
    options = kw.interpolation.PlannerOptions(end_acceleration="zero")
    trajectory = kw.interpolation.get_planner(scenario.planner)(waypoints, options)
    report = kw.check(trajectory, scenario)
    broken = {finding.name for finding in report.failures if finding.quantity == "velocity"}
    assert len(broken) >= 3
    assert all(finding.ok for finding in report.select(subject="waypoint"))
    plan = planned(name)
    assert plan.report.ok
    assert not plan.solution.infeasibilities
    # The poses are the same, and so are the branches all the way: the arm does not change over.
    assert len({choice.branch for choice in plan.solution.choices}) == 1
