"""What makes a motion pass that fails, found by trying, is said wherever a report is shown."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

import knotwork as kw
from command_line import Command
from drawn import scene

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


def test_a_turned_tool_or_another_branch_is_found_where_it_collides(
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
    free = {key: value for key, value in BESIDE_A_POST.items() if key != "branch"}
    assert kw.plan(free).report.ok
    waypoints = [
        {**one, "pose": {**one["pose"], "rpy": [180, 0, -90]}}  # the axis points down
        for one in BESIDE_A_POST["waypoints"]
    ]
    assert kw.plan({**BESIDE_A_POST, "waypoints": waypoints}).report.ok
    # and the same in data, in files and on pages
    ran = knotwork("plan", blocked, "--json", "-o", tmp_path / "out")
    (plan,) = json.loads(ran.out)["plans"]
    _, found = plan["report"]["tried"]
    assert turned in found
    stored = json.loads((tmp_path / "out" / "report.json").read_text())
    assert found in stored["tried"]
    for command in ("view", "report"):
        knotwork(command, blocked, "-o", tmp_path / f"{command}.html")
        page = (tmp_path / f"{command}.html").read_text()
        assert "turned by 90° about its z axis at" in page
        assert "12 sequences of solutions, all of which collide" in page


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
