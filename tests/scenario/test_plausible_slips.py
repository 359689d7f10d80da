"""What was plausibly not meant as a file says it, and what a wrong name or place may mean."""

from __future__ import annotations

from typing import Any

import pytest

import knotwork as kw

ARM = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
HOME = {"start": "home"}


def pose(roll: float, x: float = 0.45) -> dict[str, Any]:
    where = {"position": [x, 0.1, 0.3], "rpy": [roll, 0, 0]}
    return {"after": 3, "pose": where, "stop": True}


def joints(*values: float) -> dict[str, Any]:
    names = (f"{name}_joint" for name in ARM)
    return {"after": 9, "joints": dict(zip(names, values, strict=True))}


def task(unit: str, *waypoints: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"robot": "ur5", "units": {"angle": unit}, "waypoints": list(waypoints), **HOME, **more}


def warned(data: dict[str, Any]) -> list[str]:
    report = kw.plan(data).report
    return [one.message for one in report.warnings if one.quantity == "angle_unit"]


@pytest.mark.parametrize(
    ("waypoint", "largest"),
    [
        (pose(3.14159), r"pose.rpy[0] is 3.14159 degrees, the largest angle of a pose"),
        (pose(-1.57), r"pose.rpy[0] is -1.57 degrees, the largest angle of a pose"),
    ],
)
def test_warns_of_radians_in_file_in_degrees(waypoint: Any, largest: str) -> None:
    (said,) = warned(task("deg", waypoint))
    assert f"waypoints[0].{largest} of the file; if they" in said
    assert "give `units: {angle: rad}`" in said
    assert not warned(task("rad", waypoint))


def test_warns_of_joints_in_radians_with_poses_in_degrees() -> None:
    inner = {**joints(0.31, -1.57, 1.93, -0.7, 1.1, 0), "stop": True}
    (said,) = warned(task("deg", inner, pose(180)))
    assert "elbow_joint is 1.93 degrees" in said


@pytest.mark.parametrize(
    "waypoints",
    [
        (pose(180), pose(175, 0.5)),
        (pose(3.14), pose(-90)),  # one of them is no angle in radians
        (joints(0, -90, 90, 1.57, 2, 1),),
        (joints(0.5, -1, 1.5, -2.5, 5, 0),),
        (joints(0.21, -0.33, 0.72, 0.4, 0.1, 0.2),),
        (pose(2.5),),
        (pose(0),),
    ],
)
def test_accepts_plausible_degrees(waypoints: Any) -> None:
    assert not warned(task("deg", *waypoints))


def test_warns_of_pose_in_degrees() -> None:
    (said,) = warned(task("rad", pose(180)))
    assert "pose.rpy[0] is 180 rad, more than a whole turn" in said


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"limits": {"velocity": 180}}, "limits.velocity is 180 rad/s"),
        ({"limits": {"velocity": {"elbow_joint": 90}}}, "limits.velocity.elbow_joint is 90 rad/s"),
    ],
)
def test_warns_of_limits_in_degrees(change: dict[str, Any], where: str) -> None:
    (said,) = warned(task("rad", pose(3.14), **change))
    assert f"{where}, more than two turns a second; if it is in degrees, give" in said
    assert not warned(task("deg", pose(180), **change))


def test_warns_of_waypoint_rates_in_degrees() -> None:
    turning = {**pose(3.14), "velocity": {"angular": [0, 0, 30]}}
    del turning["stop"]
    (said,) = warned(task("rad", turning, pose(3.14, 0.5)))
    assert "waypoints[0].velocity.angular[2] is 30 rad/s" in said
    ends = [{"joints": {"a": 0, "b": 0}}, {"after": 9, "joints": {"a": 1, "b": 1}}]
    passing = {"after": 9, "joints": {"a": 0.5, "b": 0.5}, "velocity": {"a": 45, "b": 45}}
    data = {"waypoints": [ends[0], passing, ends[1]], "joint_units": {"a": "m"}}
    (said,) = warned(data)
    assert "waypoints[1].velocity.b is 45 rad/s" in said


@pytest.mark.parametrize("limits", [{"velocity": 12}, {"velocity": {"a": 180}}])
def test_accepts_plausible_rates(limits: dict[str, Any]) -> None:
    points = [{"joints": {"a": 0, "b": 0}}, {"after": 9, "joints": {"a": 1, "b": 1}}]
    assert not warned({"joint_units": {"a": "m"}, "limits": limits, "waypoints": points})


@pytest.mark.parametrize(
    ("change", "meant"),
    [
        ({"robot": "UR5"}, "'ur5'"),
        ({"start": "HOME"}, "'home'"),
        ({"frame": "TABLE", "frames": {"Table": {"position": [0, 0, 0]}}}, "'Table'"),
        ({"limits": {"velocity": {"ELBOW_joint": 1}}}, "'elbow_joint'"),
        ({"collisions": {"ignore": [["FOREARM_link", "tool0"]]}}, "'forearm_link'"),
        ({"PLANNER": "cubic"}, "'planner'"),
    ],
)
def test_names_are_compared_without_their_case(change: dict[str, Any], meant: str) -> None:
    with pytest.raises(kw.InputError, match=f"did you mean {meant}"):
        kw.plan({**task("rad", pose(3.14)), **change})


def test_a_scenario_is_found_without_its_case() -> None:
    with pytest.raises(kw.InputError, match="did you mean 'ur5_deburring'"):
        kw.load_scenario("UR5_Deburring")


def test_the_mass_of_what_is_held_is_said_to_be_the_tools() -> None:
    where = r"tool\.holds\.mass: 2: must be a mapping \(mass is a key of tool\)"
    with pytest.raises(kw.InputError, match=where):
        kw.plan(task("rad", pose(3.14), tool={"holds": {"mass": 2}}))


def test_a_key_of_the_file_in_a_waypoint_is_said_to_be_the_files() -> None:
    with pytest.raises(kw.InputError, match=r"robot: unknown key \(robot is a key of the file"):
        kw.plan(task("rad", {**pose(3.14), "robot": "ur5"}))


def test_a_file_without_a_start_says_that_the_way_to_its_first_waypoint_is_not_planned() -> None:
    first = {**pose(3.14), "name": "first"}
    first.pop("after")
    data = task("rad", first, pose(3.14, 0.5))
    assert not kw.plan(task("rad", pose(3.14))).report.select(quantity="no_start")
    del data["start"]
    report = kw.plan(data).report
    (said,) = report.select(quantity="no_start")
    assert "\n  Not planned " in str(report)
    assert " the approach to 'first': the file has no start\n" in str(report)
    assert said.verdict == "information"
    assert "the approach to 'first' is neither planned nor checked" in str(said)
    home = kw.load_robot("ur5").configurations["home"]
    begin = joints(*home.tolist())
    begin.pop("after")
    at_home = task("rad", begin, pose(3.14))
    del at_home["start"]
    assert not kw.plan(at_home).report.select(quantity="no_start")
