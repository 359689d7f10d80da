"""Tables of many rows are cut on the terminal, those that fail last, and whole where asked for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import knotwork as kw
from command_line import Command
from knotwork.kinematics.chain.joint_ranges import AT_LIMIT, all_turns

COUNT = 400


@pytest.fixture
def task(tmp_path: Path) -> Path:
    waypoints = [
        {"name": f"w{i:03d}", "time": i, "joints": {"a": 0.01 * (i % 7)}, "stop": True}
        for i in range(COUNT)
    ]
    path = tmp_path / "long.json"
    path.write_text(json.dumps({"waypoints": waypoints}), encoding="utf-8")
    return path


def rows(text: str) -> list[str]:
    lines = (line.split() for line in text.splitlines())
    return [words[0] for words in lines if words and words[0][1:].isdigit()]


def test_a_long_table_is_cut_and_says_so(task: Path, knotwork: Command, tmp_path: Path) -> None:
    ran = knotwork("plan", task, "--out", tmp_path / "out")
    assert ran.code == 0
    assert rows(ran.out)[:50] == [f"w{i:03d}" for i in range(50)]
    assert f"and {COUNT - 50} more rows; --full shows them" in ran.out
    full = knotwork("plan", task, "--full")
    assert rows(full.out)[:COUNT] == [f"w{i:03d}" for i in range(COUNT)]
    assert "more rows" not in full.out
    assert full.out.splitlines()[-1] == ran.out.splitlines()[-4]  # the verdict
    checked = knotwork("check", tmp_path / "out", "--scenario", task)
    assert rows(checked.out) == rows(ran.out)
    assert len(rows(knotwork("check", tmp_path / "out", "-s", task, "--full").out)) >= COUNT


def test_rows_that_fail_are_shown_first(task: Path, knotwork: Command, tmp_path: Path) -> None:
    made = kw.plan(task)
    made.save(tmp_path / "out")
    data = json.loads(task.read_text())
    data["waypoints"][333]["joints"]["a"] = 0.5
    task.write_text(json.dumps(data))
    ran = knotwork("check", tmp_path / "out", "--scenario", task)
    assert ran.code == 1
    table = rows(ran.out)[:50]
    assert table == [*(f"w{i:03d}" for i in range(49)), "w333"]


def test_only_the_turns_that_fit_are_found_however_they_are_looked_for() -> None:
    """Against all combinations of whole turns, tried one by one."""
    rng = np.random.default_rng(5)
    for name in ("panda", "z1", "ur5", "kinova"):
        arm = kw.load_robot(name)
        lower = np.maximum(arm.lower_position_limit, -9)
        upper = np.minimum(arm.upper_position_limit, 9)
        for scale in (0.9, 1.0, 1.3):
            q = rng.uniform(lower, upper) * scale
            expected = []
            for i in range(arm.dof):
                turning = np.isfinite(arm.upper_position_limit[i]) and arm.joint_units[i] == "rad"
                turns = 2 * np.pi * np.arange(-3, 4) if turning else np.zeros(1)
                low, high = arm.lower_position_limit[i], arm.upper_position_limit[i]
                fits = [x for x in q[i] + turns if low - AT_LIMIT <= x <= high + AT_LIMIT]
                expected.append(len(fits))
            assert len(all_turns(arm, q)) == np.prod(expected)
