"""Waypoints that are repeated over places, against the same task written out, and palletising."""

from __future__ import annotations

import json
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork.errors import DocumentError, FollowingError
from shipped import SCENARIO_FILES
from sweeps import first_of
from texts import written
from urscript_controller import Controller

DOWN = [np.pi, 0, 0]
BOX = {"from": "pick", "to": "put", "appears": "pick", "box": [0.2, 0.1, 0.1], "mass": 2.0}
PITCHES = [0.22, -0.15, 0.11]


def turn(frame: str, number: str = "") -> list[dict[str, Any]]:
    """The waypoints of a turn."""
    return [
        {"name": f"pick{number}", "frame": "belt", "pose": at(0.05), "after": 3, "wait": 0.2},
        {"frame": frame, "pose": at(0.2), "after": 3, "stop": True},
        {"name": f"put{number}", "frame": frame, "pose": at(0.05), "after": 3, "wait": 0.2},
    ]


def at(z: float) -> dict[str, Any]:
    return {"position": [0, 0, z], "rpy": DOWN}


def palletising(over: Any = "pallet", **more: Any) -> dict[str, Any]:
    """Boxes from a belt to a pallet."""
    return {
        "robot": "ur10",
        "tool": {"frame": "tool0", "offset": {"position": [0, 0, 0.1]}},
        "frames": {
            "belt": {"position": [0.6, -0.4, 0.1]},
            "pallet": {
                "position": [0.3, 0.7, 0],
                "grid": {"counts": [2, 1, 2], "pitches": PITCHES},
            },
        },
        "scene": {
            "objects": {
                "floor": {
                    "half_space": {"normal": [0, 0, 1]},
                    "position": [0, 0, -1],
                    "allow": ["box"],
                }
            }
        },
        "collisions": {"ignore": [["box", "wrist_3_link"]]},
        "waypoints": [
            {"name": "home", "frame": "belt", "pose": at(0.3)},
            {"over": over, "holds": {"box": BOX | {"allow": ["box"]}}, "repeat": turn("place")},
            {"name": "end", "frame": "belt", "pose": at(0.3), "after": 3},
        ],
    } | more


def written_out() -> dict[str, Any]:
    """The same, every turn by hand."""
    task = palletising()
    task["tool"]["holds"] = {}
    names = [f"box {k + 1}" for k in range(4)]
    steps = [(x, 0, z) for z, x in product(range(2), range(2))]
    waypoints = []
    for k, step in enumerate(steps, start=1):
        place = {"in": "pallet", "position": [n * d for n, d in zip(step, PITCHES, strict=True)]}
        task["frames"][f"spot {k}"] = place
        waypoints += turn(f"spot {k}", f" {k}")
        ends = {key: f"{BOX[key]} {k}" for key in ("from", "to", "appears")}
        others = [name for name in names if name != f"box {k}"]
        task["tool"]["holds"][f"box {k}"] = BOX | ends | {"allow": others}
    task["scene"]["objects"]["floor"]["allow"] = names
    task["collisions"]["ignore"] = [[name, "wrist_3_link"] for name in names]
    task["waypoints"][1:2] = waypoints
    return task


def coefficients(plan: kw.Plan) -> np.ndarray[Any, Any]:
    return plan.trajectory.polynomial.c


def test_repeat_equals_written_out_turns(tmp_path: Path) -> None:
    plan = kw.plan(palletising())
    assert plan.report.ok, plan.report
    names = [waypoint.name for waypoint in plan.scenario.waypoints]
    assert names[1:5] == ["pick 1", "pick 1, after the wait", "waypoint 3", "put 1"]
    assert names[-2:] == ["put 4, after the wait", "end"]
    task = kw.Task(**palletising())
    saved = task.save(tmp_path / "task.yaml")
    for same in (written_out(), task, saved):
        assert np.array_equal(coefficients(kw.plan(same)), coefficients(plan)), same
    plain = kw.load_scenario(saved).task
    assert plain.collisions.ignore == tuple((f"box {k}", "wrist_3_link") for k in range(1, 5))
    assert plain.scene.objects["floor"].allow == ("box 1", "box 2", "box 3", "box 4")


def test_a_frozen_repeat_gives_the_same_motion(tmp_path: Path) -> None:
    file = kw.Task.load(palletising(["belt"])).save(tmp_path / "task.yaml")
    text = (
        file.read_text()
        .replace("after: 3.0", "after: fastest")
        .replace("stop: true", "velocity: free")
        .replace("appears: pick\n", "\n")
    )
    file.write_text(f"# one turn\n{text}")
    plan = kw.plan(file, budget=20)
    frozen = plan.freeze(tmp_path / "frozen.yaml")
    assert frozen.read_text().startswith("# one turn")
    assert np.array_equal(coefficients(kw.plan(frozen)), coefficients(plan))


def test_places_are_frames_positions_or_a_file(tmp_path: Path) -> None:
    spots = [[0.3, 0.7, 0.0], [0.52, 0.7, 0.0]]
    (tmp_path / "spots.csv").write_text("x,y,z\n0.3,0.7,0\n0.52,0.7,0\n")
    (tmp_path / "turned.csv").write_text("x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n0.22,0,0,0,0,0,1\n")
    frames = {name: {"position": spot} for name, spot in zip(("a", "b"), spots, strict=True)}
    base = palletising()["frames"]
    found = [
        kw.load_scenario(palletising(over, frames=base | more))
        for over, more in (
            (["a", "b"], frames),
            ([{"position": spots[0]}, "b"], frames),
            (
                [{"position": [0, 0, 0], "in": "pallet"}, {"position": [0.22, 0, 0], "in": "a"}],
                frames,
            ),
            ({"file": str(tmp_path / "spots.csv")}, {}),
            ({"file": str(tmp_path / "turned.csv"), "in": "pallet"}, {}),
        )
    ]
    for scenario in found:
        poses = [one.pose for one in scenario.waypoints if one.name in ("put 1", "put 2")]
        for pose, spot in zip(poses, spots, strict=True):
            np.testing.assert_allclose(pose.translation, np.add(spot, [0, 0, 0.05]), atol=1e-12)


def test_error_has_line_of_block(tmp_path: Path) -> None:
    file = kw.Task.load(palletising()).save(tmp_path / "task.yaml")
    lines = file.read_text().splitlines()
    line = next(i for i, text in enumerate(lines, start=1) if "from: pick" in text)
    file.write_text(file.read_text().replace("from: pick", "from: pack"))
    with pytest.raises(DocumentError) as caught:
        kw.plan(file)
    assert f"line {line}: waypoints[1].holds.box.from: unknown waypoint 'pack'" in str(caught.value)


FILE = SCENARIO_FILES["ur10_palletise_24"]


def of_boxes(folder: Path, counts: str) -> Path:
    """The scenario with so many boxes along x, y and z."""
    text = FILE.read_text(encoding="utf-8")
    return written(folder / "pallet.yaml", text.replace("counts: [4, 3, 2]", f"counts: {counts}"))


@pytest.mark.parametrize(("counts", "boxes"), first_of(("[1, 1, 2]", 2), ("[4, 3, 2]", 24)))
def test_pallet_needs_few_lines(counts: str, boxes: int, tmp_path: Path, knotwork: Command) -> None:
    assert len(FILE.read_text(encoding="utf-8").splitlines()) <= 45
    path = of_boxes(tmp_path, counts)
    planned = knotwork("plan", path, "-o", tmp_path / "out").done()
    assert len(planned.splitlines()) <= 22
    assert f"{boxes} repetitions" in planned
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["ok"]
    script = tmp_path / "motion.script"
    stored = tmp_path / "out" / "trajectory.json"
    knotwork("export", stored, "--format", "urscript", "-o", script).done()
    program = script.read_text()
    first = re.search(r"global kw_q = \[(.*)\]", program)
    controller = Controller(np.array(first[1].split(","), dtype=float), 125.0)
    controller.run(program)
    assert [one[3] for one in controller.switched] == [True, False] * boxes
    assert [mass for _, mass, _ in controller.payloads] == [1.5, *[7.5, 1.5] * boxes]


@pytest.mark.exhaustive
def test_released_boxes_are_obstacles(tmp_path: Path) -> None:
    """With rows that are too near to one another the second box would touch the first."""
    path = of_boxes(tmp_path, "[1, 2]")
    text = path.read_text()
    path.write_text(text.replace("[210, -170, 126]", "[210, -170]"))
    assert kw.plan(path).report.ok
    path.write_text(text.replace("[210, -170, 126]", "[210, -163]"))
    with pytest.raises(FollowingError, match=r"repeat\[4\].*box 2 is too near to box 1"):
        kw.plan(path)
