"""However long a task is, the terminal tells it in few lines, and in whole where asked for."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import knotwork as kw
from command_line import Command

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


def test_a_long_report_is_told_in_few_lines_and_whole_where_asked_for(
    task: Path, knotwork: Command, tmp_path: Path
) -> None:
    ran = knotwork("plan", task, "--out", tmp_path / "out")
    assert ran.code == 0
    assert len(ran.out.splitlines()) <= 12
    full = knotwork("plan", task, "--full")
    assert rows(full.out)[:COUNT] == [f"w{i:03d}" for i in range(COUNT)]
    assert ran.out.splitlines()[0].startswith(full.out.splitlines()[-1])  # the verdict
    checked = knotwork("check", tmp_path / "out", "--scenario", task)
    assert checked.out.splitlines()[0] == ran.out.splitlines()[0]
    assert len(rows(knotwork("check", tmp_path / "out", "-s", task, "--full").out)) >= COUNT


def test_the_worst_of_many_failures_is_told(task: Path, knotwork: Command, tmp_path: Path) -> None:
    made = kw.plan(task)
    made.save(tmp_path / "out")
    data = json.loads(task.read_text())
    for i, asked in ((331, 0.4), (333, 0.5), (335, 0.3)):
        data["waypoints"][i]["joints"]["a"] = asked
    task.write_text(json.dumps(data))
    ran = knotwork("check", tmp_path / "out", "--scenario", task)
    assert ran.code == 1
    told = " ".join(ran.out.split())
    assert "FAIL waypoint 'w333' at 333 s: joint position is off by" in told
    assert "(and 2 more like it)" in told
    # on a page each is a line of its own, which goes there, the worst first
    page = tmp_path / "page.html"
    assert knotwork("report", tmp_path / "out", "--scenario", task, "--html", page).code == 1
    listed = page.read_text().partition('<h2 id="fails">')[2].partition("</header>")[0]
    assert "more like it" not in listed
    assert re.findall(r'data-at="([\d.]+)"[^>]*>waypoint &#39;(w\d+)', listed) == [
        ("333.0", "w333"),
        ("331.0", "w331"),
        ("335.0", "w335"),
    ]
