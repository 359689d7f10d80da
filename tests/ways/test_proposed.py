"""What a report proposes where a motion collides that could find its own way."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from command_line import Command
from walls import DOWN, WALL, at, past

ONE = "way: clear at 'there' may avoid the collision (not attempted)"


def across(*others: dict[str, Any], **more: Any) -> dict[str, Any]:
    """The tool goes through the wall, to 'there' and wherever else."""
    waypoints = [at("here", -250), at("there", 250, after=3), *others]
    return past(waypoints=waypoints, scene={"objects": WALL}, **more)


def told(given: dict[str, Any], **options: Any) -> list[str]:
    report = kw.plan(given, **options).report
    assert not report.ok
    return [str(one) for one in report.tried]


def test_proposes_clear_motion_for_collision() -> None:
    given = across()
    (line,) = told(given)
    assert line.startswith(ONE)
    given["waypoints"][1] |= {"way": "clear"}
    given["waypoints"][1].pop("after", None)
    assert kw.plan(given).report.ok


def fastest(*others: dict[str, Any], **more: Any) -> dict[str, Any]:
    given = across(*others, times="fastest", **more)
    for waypoint in given["waypoints"]:
        waypoint.pop("after", None)
    return given


def test_takes_clear_motion_if_fastest_collides(tmp_path: Path) -> None:
    plan = kw.plan(fastest(at("back", -250)))
    assert plan.report.ok
    (line,) = (str(one) for one in plan.report.findings if one.quantity == "sequences_tried")
    assert "the fastest motion collides, so way: clear was taken at 'there' and 'back'" in line
    frozen = kw.plan(plan.freeze(tmp_path / "frozen.yaml"))
    assert frozen.report.ok
    assert frozen.trajectory.duration == plan.trajectory.duration


@pytest.mark.exhaustive
def test_reports_missing_clear_motion() -> None:
    given = fastest()
    given["scene"]["objects"] = {
        "right": {"box": [2000, 30, 3000], "position": [1100, 0, 1000]},
        "left": {"box": [2000, 30, 3000], "position": [-1100, 0, 1000]},
    }
    (line,) = told(given)
    assert "way: clear finds no motion either: " in line
    assert "one may exist all the same" in line
    assert "not attempted" not in line


def test_proposes_all_motions_in_one_line() -> None:
    (line,) = told(across(at("back", -250, after=3), at("still", -250, after=1)))
    assert "way: clear at 'there' and 'back' may avoid the collisions (not attempted)" in line


def test_proposes_nothing_if_waypoint_collides() -> None:
    given = across()
    given["scene"]["objects"]["wall"]["box"][1] = 500
    assert not any("way: clear" in line for line in told(given))


def test_proposes_nothing_before_colliding_waypoint() -> None:
    """The motion to 'over' could find its way, but one with it leads on into a post."""
    given = across()
    pose = {"position": [450, 100, 300], "rpy": DOWN}
    given["waypoints"].insert(1, {"name": "over", "pose": pose, "velocity": "free", "after": 2})
    assert any("way: clear" in line for line in told(given))
    given["scene"]["objects"]["post"] = {"box": [60, 60, 60], "position": [450, 250, 100]}
    assert not any("way: clear" in line for line in told(given))


def test_check_proposes_nothing(tmp_path: Path, knotwork: Command) -> None:
    """A motion from elsewhere does not come from the scenario that would have the way."""
    file = tmp_path / "across.yaml"
    kw.Task(**across()).save(file)
    planned = knotwork("plan", file, "--out", tmp_path / "out")
    assert planned.code == 1
    assert ONE in " ".join(planned.out.split())
    checked = knotwork("check", tmp_path / "out", "--scenario", file)
    assert checked.code == 1
    assert "way: clear" not in checked.out
