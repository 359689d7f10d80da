"""Boxes from a conveyor to a pallet, in one file: the shipped scenario, and a part of it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork.errors import FollowingError
from shipped import SCENARIO_FILES
from urscript_controller import Controller

FILE = SCENARIO_FILES["ur10_palletise_24"]


def of_boxes(folder: Path, counts: str) -> Path:
    """The scenario with so many boxes along x, y and z."""
    text = FILE.read_text(encoding="utf-8")
    path = folder / "pallet.yaml"
    path.write_text(text.replace("counts: [4, 3, 2]", f"counts: {counts}"), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("counts", "boxes"),
    [("[1, 1, 2]", 2), pytest.param("[4, 3, 2]", 24, marks=pytest.mark.exhaustive)],
)
def test_pallet_has_short_file_report_and_program(
    counts: str, boxes: int, tmp_path: Path, knotwork: Command
) -> None:
    assert len(FILE.read_text(encoding="utf-8").splitlines()) <= 45
    path = of_boxes(tmp_path, counts)
    planned = knotwork("plan", path, "-o", tmp_path / "out")
    assert planned.code == 0, planned.out
    assert len(planned.out.splitlines()) <= 22
    assert f"{boxes} turns" in planned.out
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["ok"]
    exported = knotwork(
        "export", tmp_path / "out" / "trajectory.json", "--format", "urscript", "-o",
        tmp_path / "motion.script",
    )  # fmt: skip
    assert exported.code == 0, exported.err
    program = (tmp_path / "motion.script").read_text()
    first = re.search(r"global kw_q = \[(.*)\]", program)
    assert first is not None
    controller = Controller(np.array(first[1].split(","), dtype=float), 125.0)
    controller.run(program)
    assert [one[3] for one in controller.switched] == [True, False] * boxes
    assert [mass for _, mass, _ in controller.payloads] == [1.5, *[7.5, 1.5] * boxes]


def test_released_boxes_are_obstacles(tmp_path: Path) -> None:
    """With rows that are too near to one another the second box would touch the first."""
    path = of_boxes(tmp_path, "[1, 2]")
    text = path.read_text()
    path.write_text(text.replace("[210, -170, 126]", "[210, -170]"))
    assert kw.plan(path).report.ok
    path.write_text(text.replace("[210, -170, 126]", "[210, -163]"))
    with pytest.raises(FollowingError, match=r"repeat\[4\].*box 2 comes too near to box 1"):
        kw.plan(path)
