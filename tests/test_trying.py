"""What makes a motion pass that fails, found by trying, is said wherever a report is shown."""

from __future__ import annotations

import copy
import itertools
import json
from pathlib import Path
from typing import Any

import pytest
import yaml

import knotwork as kw
from command_line import Command
from drawn import scene
from knotwork.verification import CHECKS

DOWN = [180, 0, 0]
BESIDE_A_POST: dict[str, Any] = {
    "units": {"length": "mm", "angle": "deg"},
    "robot": "ur5",
    "tool": {
        "offset": {"position": [0, 0, 150], "rpy": [0, 0, 0]},
        "shape": [
            {"cylinder": {"radius": 20, "length": 150}, "position": [0, 0, 75]},
            {"box": [200, 40, 40], "position": [120, 0, 100]},
        ],
    },
    "scene": {"objects": {"post": {"box": [60, 60, 600], "position": [650, 0, 300]}}},
    "start": "home",
    "branch": {"shoulder": "left", "elbow": "up"},
    "waypoints": [
        {"name": "here", "after": 3, "pose": {"position": [500, -150, 250], "rpy": DOWN}},
        {"name": "there", "after": 3, "pose": {"position": [500, 150, 250], "rpy": DOWN}},
    ],
}
"""The arm of the tool goes through the post."""
BESIDE_A_POST["waypoints"][0]["stop"] = True


@pytest.fixture
def blocked(tmp_path: Path) -> Path:
    file = tmp_path / "blocked.yaml"
    file.write_text(yaml.safe_dump(BESIDE_A_POST))
    return file


def test_a_turned_tool_is_found_where_it_collides(
    knotwork: Command, blocked: Path, tmp_path: Path
) -> None:
    ran = knotwork("plan", blocked)
    said = " ".join(ran.out.split())
    assert ran.code == 1
    assert "tried: 12 sequences of solutions, all of which collide" in said
    turned = "with the tool turned by 90° about its z axis at 'here' and 'there'"
    assert "tried: it passes with" in said
    assert turned in said
    # what is said is so
    waypoints = [
        {**one, "pose": {**one["pose"], "rpy": [180, 0, -90]}}  # the axis points down
        for one in BESIDE_A_POST["waypoints"]
    ]
    assert kw.plan({**BESIDE_A_POST, "waypoints": waypoints}).report.ok
    # and the same in data, in files and on pages
    ran = knotwork("plan", blocked, "--json", "-o", tmp_path / "out")
    (plan,) = json.loads(ran.out)["plans"]
    found, _ = plan["report"]["tried"]
    assert turned in found
    stored = json.loads((tmp_path / "out" / "report.json").read_text())
    assert found in stored["tried"]
    for command in ("view", "report"):
        knotwork(command, blocked, "-o", tmp_path / f"{command}.html")
        page = (tmp_path / f"{command}.html").read_text()
        assert "turned by 90° about its z axis at" in page
        assert "12 sequences of solutions, all of which collide" in page


def test_no_other_solutions_are_looked_for_than_half_as_many_as_planned(
    knotwork: Command, blocked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Any] = []
    monkeypatch.setitem(CHECKS, "counted", lambda motion, *_: made.append(motion) or ())
    kw.plan(blocked)
    alone = len(made)
    assert alone == 12
    knotwork("plan", blocked)
    assert 0 < len(made) - 2 * alone <= alone // 2


def test_a_part_in_the_grip_is_not_turned(knotwork: Command, blocked: Path) -> None:
    """Turned where it is taken or left, it would lie there otherwise than asked for."""
    task = yaml.safe_load(blocked.read_text())
    part = {"box": [20, 20, 20]}
    for first, last, names in (
        ("here", "there", None),
        ("start", "there", None),
        ("start", "here", "'there'"),
    ):
        task["tool"]["holds"] = {"part": {**part, "from": first, "to": last}}
        blocked.write_text(yaml.safe_dump(task))
        said = " ".join(knotwork("plan", blocked).out.split())
        assert "all of which collide" in said
        assert ("the tool turned" in said) == (names is not None)
        if names is not None:
            assert f"about its z axis at {names}" in said


def test_a_change_is_tried_with_as_many_sequences_as_were_planned(
    knotwork: Command, tmp_path: Path
) -> None:
    """The best one collides here, with every time that is tried."""
    source = kw.load_scenario("ur5_valve").source
    assert source is not None
    task = yaml.safe_load(source.read_text(encoding="utf-8"))
    (quick,) = (one for one in task["waypoints"] if one["name"] == "turn 180")
    quick["after"] = 0.35
    file = tmp_path / "valve.yaml"
    file.write_text(yaml.safe_dump(task))
    ran = knotwork("plan", file)
    assert ran.code == 1
    said = "tried: it passes with `after: 0.7` for 'turn 180' in place of 0.35"
    assert said in " ".join(ran.out.split())
    quick["after"] = 0.7
    assert kw.plan(task).report.ok


def swings(by_after: bool, after: float, velocities: tuple[float, float], limit: float) -> Any:
    """A joint that goes on slowly beside a short move."""
    at = {"a": 0.0, "b": 1.0, "c": 1.2, "d": 2.5}
    rows: list[dict[str, Any]] = [{"name": one, "joints": {"a": at[one]}} for one in at]
    for row, velocity in zip(rows[1:], velocities, strict=False):
        row["velocity"] = {"a": velocity}
    durations = (2, after, 2)
    times = itertools.accumulate(durations)
    for row, duration, end in zip(rows[1:], durations, times, strict=True):
        row |= {"after": duration} if by_after else {"time": end}
    return {"limits": {"velocity": limit}, "waypoints": rows}


def test_a_short_move_gets_more_time_until_it_passes(knotwork: Command, tmp_path: Path) -> None:
    """Twice the time does not do, four times as much does."""
    file = tmp_path / "swings.yaml"
    file.write_text(yaml.safe_dump(swings(True, 0.1, (0.3, 1.0), 2.0)))
    said = " ".join(knotwork("plan", file).out.split())
    assert "tried: it passes with `after: 0.4` for 'c' in place of 0.1" in said


MOVE: dict[str, Any] = {
    "units": {"angle": "deg"},
    "limits": {"velocity": 90, "acceleration": 400},
    "waypoints": [
        {"name": "a", "time": 0, "joints": {"j": 0}, "stop": True},
        {"name": "b", "time": 1, "joints": {"j": 100}, "stop": True},
        {"name": "c", "time": 3, "joints": {"j": 20}, "stop": True},
    ],
}
"""The first move is too fast."""


def test_more_time_is_found_for_a_move_that_is_too_fast(knotwork: Command, tmp_path: Path) -> None:
    file = tmp_path / "move.yaml"
    for key, said in (
        ("time", "`time: 1.9` for 'b' in place of 1, and later times moved with it"),
        ("after", "`after: 1.9` for 'b' in place of 1"),
    ):
        task = copy.deepcopy(MOVE)
        if key == "after":
            del task["waypoints"][1]["time"], task["waypoints"][2]["time"]
            task["waypoints"][1]["after"], task["waypoints"][2]["after"] = 1, 2
        file.write_text(yaml.safe_dump(task))
        told = " ".join(knotwork("plan", file).out.split())
        assert f"tried: it passes with {said}" in told
        nameless = copy.deepcopy(task)
        for one in nameless["waypoints"]:
            del one["name"]
        file.write_text(yaml.safe_dump(nameless))
        other = " ".join(knotwork("plan", file).out.split())
        assert f"tried: it passes with {said.replace('b', 'waypoint 2')}" in other
        # what is tried says more than that the whole motion may be slower
        assert "the same motion in" not in told
        # and it is so
        task["waypoints"][1][key] = 1.9
        if key == "time":
            task["waypoints"][2]["time"] = 3.9
        assert kw.plan(task).report.ok


def test_a_page_that_follows_its_files_does_not_wait_for_it(
    knotwork: Command, blocked: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes: list[Any] = []
    monkeypatch.setattr(
        "knotwork.cli.watching.follow",
        lambda server, files, made: scenes.append(made()[0]),
    )
    assert knotwork("view", blocked, "--watch", "--no-open").code == 0
    (said,) = scenes[0]["tried"]
    assert "12 sequences of solutions" in said


def test_nothing_is_tried_where_all_is_met() -> None:
    report = kw.plan("ur5_valve").report
    assert report.select(quantity="sequences_tried")
    assert report.to_dict()["tried"] == []
    assert "tried" not in str(report)


def test_a_label_and_the_text_say_a_collision_alike() -> None:
    plan = kw.plan(BESIDE_A_POST)
    labels = [one["text"] for one in scene(plan.view())["labels"] if one["kind"] == "miss"]
    for found, label in zip(plan.report.failures, labels, strict=True):
        assert " deep in post" in label
        assert str(found).startswith(label.partition(" at ")[0])


def test_a_label_names_no_tolerance_for_rounding() -> None:
    plan = kw.plan("ur5_deburring", planner="cubic")
    labels = [one["text"] for one in scene(plan.view())["labels"] if one["kind"] == "miss"]
    jumps = [label for label in labels if "acceleration jump" in label]
    assert jumps
    assert not any("limit" in label for label in jumps)
