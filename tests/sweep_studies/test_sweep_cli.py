"""`knotwork sweep`: what it prints, its exit codes, and what it refuses."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from command_line import Command

TASK = """
name: lift # kept
limits: {velocity: 1.2}
waypoints:
  - {name: down, joints: {lift: 0}}
  - {name: up, joints: {lift: 1}, after: 1}
"""


@pytest.fixture
def task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A task in an empty folder."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "lift.yaml"
    file.write_text(TASK, encoding="utf-8")
    return file


def test_a_study_is_made_shown_drawn_and_frozen(knotwork: Command, task: Path) -> None:
    after = ("--vary", "waypoints[up].after=1:2:5")
    made = knotwork("sweep", task, *after, "--workers", 0, "--out", "study")
    assert made.code == 0, made.err
    assert "lift: 5 rows, 4 pass" in made.out
    assert "velocity" in made.out
    assert "best duration: 1.25 s in row 1, waypoints[up].after = 1.25" in made.out
    again = knotwork("sweep", task, *after, "--workers", 0, "--out", "study", "--resume")
    assert again.out == made.out
    shown = knotwork("sweep", "study", "--best", "velocity_use", "--freeze", "best.yaml")
    assert shown.code == 0, shown.err
    assert "in row 4, waypoints[up].after = 2" in shown.out
    assert "# kept" in Path("best.yaml").read_text(encoding="utf-8")
    assert kw.plan("best.yaml").trajectory.duration == 2.0
    data = json.loads(knotwork("sweep", "study", "--json").out)
    assert (data["rows"], data["finished"], data["passed"]) == (5, 5, 4)
    assert data["reasons"] == {"velocity": 1}
    assert data["best"]["row"]["waypoints[up].after"] == 1.25


def test_none_passes(knotwork: Command, task: Path) -> None:
    ran = knotwork("sweep", task, "--vary", "waypoints[up].after=0.5,1", "--workers", 0)
    assert ran.code == 1
    assert "0 pass" in ran.out
    frozen = ("--freeze", "best.yaml")
    ran = knotwork("sweep", task, "--vary", "waypoints[up].after=0.5,1", "--workers", 0, *frozen)
    assert ran.code == 2
    assert "no row passes" in ran.err
    assert not Path("best.yaml").exists()


def test_a_folder_of_a_study_is_not_planned(knotwork: Command, task: Path) -> None:
    knotwork("sweep", task, "--vary", "rate=100", "--workers", 0, "--out", "study")
    ran = knotwork("sweep", "study", "--vary", "rate=1")
    assert ran.code == 2
    assert "--vary: study is the folder of a study, which is not planned again" in ran.err
    for option in (
        ["--workers", "0"],
        ["--scheduler", "tcp://nowhere:1"],
        ["--zip"],
        ["--seed", "0"],
    ):
        ran = knotwork("sweep", "study", *option)
        assert (ran.code, ran.out) == (2, "")
        assert f"{option[0]}: study is the folder of a study" in ran.err


def test_progress_has_rate_time_left_and_how_many_pass(
    knotwork: Command, task: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a terminal, of a sweep that is as far as we say."""
    at = kw.sweeps.SweepProgress(done=2500, total=10_000, passed=500, before=500, seconds=100.0)

    def far(
        _: object, vary: Any, *, progress: Callable[[kw.sweeps.SweepProgress], None], **__: Any
    ) -> Any:
        progress(at)
        return sweep(task, vary, workers=0)

    sweep = kw.sweep
    monkeypatch.setattr("knotwork.planning.sweeps.sweep", far)
    monkeypatch.setattr("knotwork.cli.progress_display.SHOWN_AFTER", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("TERM", "xterm")
    ran = knotwork("sweep", task, "--vary", "rate=100")
    assert "2500 of 10000 rows, 20 a second, 0:06:15 left, 500 pass (20 %)" in ran.err
    assert "━" in ran.err


def test_logs_progress(knotwork: Command, task: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("knotwork.cli.progress_display.SWEEP_INTERVAL", 0.005)
    ran = knotwork("sweep", task, "--vary", "waypoints[up].after=2:3:9", "--workers", 0)
    done = [line.partition(" of 9 rows, ")[0] for line in ran.err.splitlines()]
    assert set(done) <= {"planning", *map(str, range(10))}
    assert len(set(done)) > 1
