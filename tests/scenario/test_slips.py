"""What a wrong name or place may mean, and what is not planned."""

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


@pytest.mark.parametrize(
    ("change", "meant"),
    [
        ({"robot": "UR5"}, "'ur5'"),
        ({"frame": "TABLE", "frames": {"Table": {"position": [0, 0, 0]}}}, "'Table'"),
        ({"PLANNER": "cubic"}, "'planner'"),
    ],
)
def test_names_are_compared_without_their_case(change: dict[str, Any], meant: str) -> None:
    with pytest.raises(kw.InputError, match=f"did you mean {meant}"):
        kw.plan({**task("rad", pose(3.14)), **change})


def test_a_scenario_is_found_without_its_case() -> None:
    with pytest.raises(kw.InputError, match="did you mean 'ur5_deburring'"):
        kw.load_scenario("UR5_Deburring")


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
