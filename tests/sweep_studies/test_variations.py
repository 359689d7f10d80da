"""What a sweep varies and how often, and what its command prints and refuses."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tasks import LIFT

import knotwork as kw
from cases import cases
from command_line import Command
from texts import written

REFUSED = cases(__file__)


def rows_of(vary: dict[str, Any], document: Any = None, **options: Any) -> list[tuple[Any, ...]]:
    spec = kw.sweep(document or LIFT, vary, workers=0, **options).spec
    return [spec.values(i) for i in range(len(spec))]


def test_ranges_have_both_ends() -> None:
    lift = "waypoints[up].joints.lift"
    assert rows_of({lift: "-200:200:41"}) == [(float(x),) for x in range(-200, 201, 10)]
    assert rows_of({lift: "1e-3:1e-3:1"}) == [(1e-3,)]


def test_lists_hold_what_a_file_may() -> None:
    given = {"knots": "paper, {balanced: 0.2}, null", "rate": np.array([100, 200])}
    rows = rows_of(given)
    assert [row[0] for row in rows[::2]] == ["paper", {"balanced": 0.2}, None]
    assert [row[1] for row in rows[:2]] == [100, 200]


def test_the_last_value_varies_fastest() -> None:
    rows = rows_of({"knots": ["paper", "balanced"], "rate": [1, 2, 3]})
    assert rows[:4] == [("paper", 1), ("paper", 2), ("paper", 3), ("balanced", 1)]
    assert rows_of({"knots": ["paper", "balanced"], "rate": [1, 2]}, together=True) == [
        ("paper", 1),
        ("balanced", 2),
    ]


def test_random_samples_are_drawn_together_and_again_the_same() -> None:
    vary = {"rate": "uniform(10, 20)", "waypoints[up].after": "uniform(1, 2)", "knots": ["paper"]}
    rows = rows_of(vary, samples=50, seed=3)
    assert len(rows) == 50
    assert rows == rows_of(vary, samples=50, seed=3)
    assert rows != rows_of(vary, samples=50, seed=4)
    # the paths are in the order of the axes: what is random comes last
    rate, after = np.array([row[1:] for row in rows], float).T
    assert 10 <= rate.min() < 12 < 18 < rate.max() <= 20
    assert 1 <= after.min() < 1.2 < 1.8 < after.max() <= 2
    assert abs(np.corrcoef(rate, after)[0, 1]) < 0.5
    assert rows[0][1] == 17.063633032120116  # on any machine


def test_rows_of_a_file_go_together(tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    file.write_text("knots,waypoints[1].after\npaper,1\nbalanced,2.5\n", encoding="utf-8-sig")
    assert rows_of({"rate": [100, 200]}, rows=file) == [
        ("paper", 1, 100),
        ("paper", 1, 200),
        ("balanced", 2.5, 100),
        ("balanced", 2.5, 200),
    ]


@pytest.mark.parametrize(("vary", "options", "message"), REFUSED["vary"])
def test_what_is_refused(vary: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(kw.InputError, match=message):
        rows_of(vary, **options)


@pytest.mark.parametrize(("text", "message"), REFUSED["files"])
def test_files_of_rows_that_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = written(tmp_path / "rows.csv", text)
    with pytest.raises(kw.InputError) as raised:
        kw.sweep(LIFT, rows=file, workers=0)
    assert str(file) in str(raised.value)
    assert message in str(raised.value)


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
    return written(tmp_path / "lift.yaml", TASK)


def test_a_study_is_made_shown_drawn_and_frozen(knotwork: Command, task: Path) -> None:
    after = ("--vary", "waypoints[up].after=1:2:5")
    out = knotwork("sweep", task, *after, "--workers", 0, "--out", "study").done()
    assert "lift: 5 rows, 4 pass" in out
    assert "velocity" in out
    assert "best duration: 1.25 s in row 1, waypoints[up].after = 1.25" in out
    again = knotwork("sweep", task, *after, "--workers", 0, "--out", "study", "--resume")
    assert again.out == out
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
    command = ("sweep", task, "--vary", "waypoints[up].after=0.5,1", "--workers", 0)
    assert "0 pass" in knotwork(*command, "--stop-after", 1).failed()
    ran = knotwork(*command, "--freeze", "best.yaml")
    assert ran.code == 2
    assert "no row passes" in ran.err
    assert not Path("best.yaml").exists()


def test_a_folder_of_a_study_is_not_planned(knotwork: Command, task: Path) -> None:
    knotwork("sweep", task, "--vary", "rate=100", "--workers", 0, "--out", "study")
    for option in ("--vary rate=1", "--workers 0", "--scheduler tcp://nowhere:1", "--zip"):
        err = knotwork("sweep", "study", *option.split()).refused()
        name = option.partition(" ")[0]
        assert f"not planned again: give its scenario, or leave out {name}" in err


def test_progress_shows_rate_remaining_time_and_passes(
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
