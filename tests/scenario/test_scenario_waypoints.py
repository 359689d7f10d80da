"""Times, stops, joint waypoints and names of scenario files, and what a wrong one may mean."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.errors import InputError, UnknownNameError
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.waypoints import CartesianWaypoint
from shipped import SCENARIO_FILES
from texts import written

POSE = {"position": [0.4, 0, 0.4], "rpy": [0, 0, 0]}
AHEAD = {"position": [0.5, 0, 0.4], "rpy": [0, 0, 0]}


def joints(*waypoints: dict[str, Any], **rest: Any) -> Scenario:
    filled = [{"joints": {"a": i}, **waypoint} for i, waypoint in enumerate(waypoints)]
    return load_scenario({"waypoints": filled, **rest})


# Times


def test_times_are_absolute_or_since_the_waypoint_before() -> None:
    scenario = joints(
        {},
        {"after": 1.5, "stop": True},
        {"time": 4, "stop": True},
        {"after": 0.5, "stop": True},
        {"time": 5},
    )
    np.testing.assert_array_equal(scenario.times, [0, 1.5, 4, 4.5, 5])


def test_start_is_a_waypoint_of_its_own_at_rest_at_time_zero() -> None:
    scenario = load_scenario(
        {"robot": "ur5", "start": "home", "waypoints": [{"pose": POSE, "after": 2}]}
    )
    start, pose = scenario.waypoints
    assert (start.name, start.time) == ("start", 0.0)
    np.testing.assert_array_equal(read_scenario_joints(scenario).targets[0].velocity, 0)
    assert pose.time == 2
    joints_alone = {"start": {"a": 0}, "waypoints": [{"joints": {"a": 1}, "time": 1}]}
    assert len(load_scenario(joints_alone).waypoints) == 2


# Speeds


def test_ends_are_at_rest_by_default() -> None:
    scenario = load_scenario(
        {"robot": "ur5", "waypoints": [{"pose": POSE}, {"pose": AHEAD, "after": 1}]}
    )
    for waypoint in scenario.waypoints:
        np.testing.assert_array_equal([waypoint.linear, waypoint.angular], 0)
    moving = joints({"velocity": {"a": 1}}, {"after": 1})
    assert [target.velocity for target in read_scenario_joints(moving).targets] == [1, 0]


@pytest.mark.parametrize("kind", [{"pose": POSE}, {"joints": "home"}])
def test_stop_is_at_rest(kind: dict[str, Any]) -> None:
    waypoints = [{"pose": AHEAD}, {**kind, "after": 1}, {"pose": AHEAD, "after": 1}]
    waypoints[1]["stop"] = True
    scenario = load_scenario({"robot": "ur5", "waypoints": waypoints})
    waypoint = scenario.waypoints[1]
    if isinstance(waypoint, CartesianWaypoint):
        np.testing.assert_array_equal([waypoint.linear, waypoint.angular], 0)
    else:
        np.testing.assert_array_equal(read_scenario_joints(scenario).targets[1].velocity, 0)


# Joint values


def test_joint_values_are_read_in_the_unit_of_each_joint() -> None:
    scenario = load_scenario(
        {
            "units": {"length": "mm", "angle": "deg"},
            "joint_units": {"slide": "m"},
            "limits": {"velocity": 180, "position": {"slide": [-400, 500]}, "effort": {"slide": 7}},
            "planner_options": {
                "accelerations": [{"turn": 1, "slide": 1}, {"turn": 2, "slide": 2}]
            },
            "waypoints": [
                {"joints": {"turn": 90, "slide": 250}, "velocity": {"slide": 10}},
                {"joints": {"slide": 0, "turn": 0}, "after": 1},
            ],
        }
    )
    joints = read_scenario_joints(scenario)
    assert joints.joint_names == ("turn", "slide")
    first, last = joints.targets
    np.testing.assert_allclose(first.position, [np.pi / 2, 0.25])
    np.testing.assert_allclose(first.velocity, [0, 0.01])
    np.testing.assert_array_equal([last.position, last.velocity], np.zeros((2, 2)))
    np.testing.assert_allclose(joints.limits.lower, [-np.inf, -0.4])
    np.testing.assert_allclose(joints.limits.upper, [np.inf, 0.5])
    np.testing.assert_allclose(joints.limits["velocity"], [np.pi, 0.18])
    np.testing.assert_allclose(joints.limits["effort"], [np.inf, 7])
    np.testing.assert_allclose(joints.accelerations, [[np.pi / 180, 1e-3], [2 * np.pi / 180, 2e-3]])


def test_a_configuration_is_named_and_copied() -> None:
    task: dict[str, Any] = {"robot": "ur5", "waypoints": [{"pose": POSE, "time": 1}]}
    joints = read_scenario_joints(load_scenario({**task, "start": "home", "near": "home"}))
    start, pose = joints.targets
    assert pose is None
    for q in (start.position, joints.near):
        np.testing.assert_array_equal(q, joints.robot.configurations["home"])
        assert q is not joints.robot.configurations["home"]


# Everything else


WAYPOINTS = "waypoints: [{joints: {a: 0}}, {joints: {a: 1}, after: 1}]\n"


def test_default_name_is_that_of_file(tmp_path: Path) -> None:
    path = written(tmp_path / "weld seam.yml", WAYPOINTS)
    scenario = load_scenario(path)
    assert scenario.name == "weld seam"
    assert scenario.source == path
    assert scenario.waypoints[1].where == f"{path}: line 1: waypoints[1]"


def test_a_robot_may_be_described_in_place_and_keeps_its_lines(tmp_path: Path) -> None:
    robot = "robot:\n  urdf: arm.urdf\n  tool_fram: tip\n"
    path = written(tmp_path / "task.yaml", robot + WAYPOINTS)
    with pytest.raises(InputError, match=re.escape(f"{path}: line 3: robot.tool_fram: unknown")):
        read_scenario_joints(load_scenario(path))


# Finding files


def test_shipped_files_are_found_by_name_and_others_by_path(tmp_path: Path) -> None:
    assert load_scenario("paper_case").source == SCENARIO_FILES["paper_case"]
    path = written(tmp_path / "paper_case.yaml", WAYPOINTS)
    assert load_scenario(str(path)).source == path
    for name in ("paper_cse", "Paper_Case"):
        with pytest.raises(UnknownNameError, match="did you mean 'paper_case'") as caught:
            load_scenario(name)
        assert caught.value.available == tuple(SCENARIO_FILES)
    with pytest.raises(InputError, match=r"no file nowhere/x\.yaml.*paper_case"):
        load_scenario("nowhere/x.yaml")
    with pytest.raises(InputError, match="is a folder"):
        load_scenario(tmp_path)
    for name in ("", ".", "..", "paper_case\n", "x" * 5000, "a\0b"):
        with pytest.raises(InputError):
            load_scenario(name)
    for path_text in ("a/\0.yaml", "~nobody-of-this-name/x.yaml", f"{'x' * 5000}.yaml"):
        with pytest.raises(InputError, match="there is no file"):
            load_scenario(path_text)


def pose(roll: float, x: float = 0.45) -> dict[str, Any]:
    where = {"position": [x, 0.1, 0.3], "rpy": [roll, 0, 0]}
    return {"after": 3, "pose": where, "stop": True}


def task(unit: str, *waypoints: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "robot": "ur5",
        "units": {"angle": unit},
        "waypoints": list(waypoints),
        "start": "home",
        **more,
    }


def test_what_is_no_scenario_is_refused() -> None:
    with pytest.raises(InputError, match="scenario is 5; accepted: a shipped name"):
        kw.plan(5)  # type: ignore[arg-type]


def test_a_file_without_a_start_says_that_the_way_to_its_first_waypoint_is_not_planned() -> None:
    assert not kw.plan(task("rad", pose(3.14))).report.select(quantity="no_start")
    data = task("rad", {**pose(3.14), "name": "first"}, pose(3.14, 0.5))
    del data["start"], data["waypoints"][0]["after"]
    report = kw.plan(data).report
    (finding,) = report.select(quantity="no_start")
    assert "\n  Not planned " in str(report)
    assert " the approach to 'first': the task gives no start\n" in str(report)
    assert finding.verdict == "information"
    assert "the approach to 'first' is neither planned nor checked" in str(finding)
    at_home = task("rad", {"joints": "home"}, pose(3.14))
    del at_home["start"]
    assert not kw.plan(at_home).report.select(quantity="no_start")
