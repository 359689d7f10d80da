"""Studies: rows and their figures, the folder, going on, and what is read from it again."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any, NoReturn

import pytest
from tasks import LIFT, without_time

import knotwork as kw
from knotwork.verification import CHECKS
from texts import written

VARY = {"waypoints[up].after": "1:3:5", "knots": "paper,balanced"}


@pytest.fixture(scope="module")
def lifted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small study."""
    folder = tmp_path_factory.mktemp("studies") / "lift"
    kw.sweep(LIFT, VARY, out=folder, workers=0)
    return folder


def test_rows_say_what_plans_say(lifted: Path) -> None:
    study = kw.Study.open(lifted)
    assert study["row"] == list(range(10))
    for row in study.rows():
        plan = kw.plan(study.scenario(row["row"]))
        assert plan.scenario.waypoints[1].time == row["waypoints[up].after"]
        assert (row["verdict"] == "passed") == plan.report.ok
        assert row["duration"] == plan.trajectory.duration
        (speed,) = plan.report.select(subject="joint", quantity="velocity")
        assert row["velocity_use"] == speed.utilisation
        assert row["clearance"] is None
        if not plan.report.ok:
            assert row["reason"] == "velocity"
            assert row["message"] == str(plan.report.failures[0])
    assert study.reasons == {"velocity": 2}
    assert study.passed == 8
    assert study.best("velocity_use")["waypoints[up].after"] == 3.0


def test_resuming_plans_only_missing_rows(lifted: Path, tmp_path: Path) -> None:
    """Also a row whose line was cut off by the end of a process."""
    folder = shutil.copytree(lifted, tmp_path / "lift")
    file = folder / "rows.jsonl"
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join([*lines[:4], *lines[7:9], lines[9][:-5]]), encoding="utf-8")
    assert len(kw.Study.open(folder)) == 6
    seen: list[kw.sweeps.SweepProgress] = []

    def progress(at: kw.sweeps.SweepProgress) -> None:
        assert len(kw.Study.open(folder)) == at.done  # nothing is lost if it ends now
        seen.append(at)

    again = kw.sweep(LIFT, VARY, out=folder, workers=0, resume=True, progress=progress)
    assert without_time(again) == without_time(kw.Study.open(lifted))
    assert without_time(kw.Study.open(folder)) == without_time(again)
    assert [at.done for at in seen] == [7, 8, 9, 10]
    assert (seen[-1].before, seen[-1].total, seen[-1].passed) == (6, 10, 8)
    assert set(lines[:4] + lines[7:9]) <= set(file.read_text(encoding="utf-8").splitlines(True))


@pytest.mark.parametrize(
    ("task", "vary", "message"),
    [
        (LIFT, {**VARY, "knots": "paper,optimal"}, "knots[1] differs"),
        ({**LIFT, "rate": 50}, VARY, "scenario.rate differs"),
    ],
)
def test_another_study_is_refused(lifted: Path, task: Any, vary: Any, message: str) -> None:
    with pytest.raises(kw.InputError, match="has another study") as raised:
        kw.sweep(task, vary, out=lifted, workers=0, resume=True)
    assert message in str(raised.value)


def test_a_folder_is_continued_only_on_request(lifted: Path, tmp_path: Path) -> None:
    with pytest.raises(kw.InputError, match="has a study already"):
        kw.sweep(LIFT, VARY, out=lifted, workers=0)
    with pytest.raises(kw.InputError, match=r"is not the folder of a study"):
        kw.Study.open(tmp_path)
    with pytest.raises(kw.InputError, match="resume is given without out"):
        kw.sweep(LIFT, VARY, workers=0, resume=True)


def test_rows_of_another_study_are_not_taken_over(lifted: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(lifted, tmp_path / "lift")
    described = folder / "study.json"
    text = described.read_text(encoding="utf-8")
    described.unlink()
    with pytest.raises(kw.InputError, match=r"has rows of a study but no study\.json"):
        kw.sweep(LIFT, {"rate": [50]}, out=folder, workers=0)
    older = {**json.loads(text), "knotwork": "0.0.1"}
    described.write_text(json.dumps(older), encoding="utf-8")
    with pytest.raises(kw.InputError, match=r"begun by version 0\.0\.1 of knotwork, and this is"):
        kw.sweep(LIFT, VARY, out=folder, workers=0, resume=True)


@pytest.mark.parametrize("changed", ["lift.urdf", "other.urdf", "block.stl"])
def test_a_study_stands_on_all_files_that_are_named(changed: str, tmp_path: Path) -> None:
    """The robot's file names a URDF, which names a mesh; and so may a value that is varied."""
    link = (
        '<link name="{}"><visual><geometry><mesh filename="block.stl"/></geometry></visual></link>'
    )
    joint = (
        '<joint name="lift" type="prismatic"><parent link="base"/><child link="plate"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="2" velocity="2" effort="9"/></joint>'
    )
    urdf = f'<robot name="lift">{link.format("base")}{link.format("plate")}{joint}</robot>'
    for name in ("lift", "other"):
        (tmp_path / f"{name}.urdf").write_text(urdf, encoding="utf-8")
        robot = f"urdf: {name}.urdf\ntool_frame: plate\n"
        (tmp_path / f"{name}.yaml").write_text(robot, encoding="utf-8")
    (tmp_path / "block.stl").write_bytes(b"a")
    task = written(tmp_path / "task.yaml", json.dumps({**LIFT, "robot": "./lift.yaml"}))
    vary = {"robot": "./lift.yaml,./other.yaml"}
    kw.sweep(task, vary, out=tmp_path / "study", workers=0)
    assert len(kw.sweep(task, vary, out=tmp_path / "study", workers=0, resume=True)) == 2
    with (tmp_path / changed).open("a", encoding="utf-8") as file:
        file.write(" ")
    with pytest.raises(kw.InputError, match=f"another study: files.*{changed}"):
        kw.sweep(task, vary, out=tmp_path / "study", workers=0, resume=True)


@pytest.mark.parametrize("wrong", ['{"row": 99}', "[]", '{"row": 1'])
def test_damaged_rows_are_named(wrong: str, lifted: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(lifted, tmp_path / "lift")
    file = folder / "rows.jsonl"
    first, _, *others = file.read_text(encoding="utf-8").splitlines()
    file.write_text("\n".join([first, wrong, *others, ""]), encoding="utf-8")
    with pytest.raises(kw.InputError, match=r"rows\.jsonl: line 2 can't be read"):
        kw.Study.open(folder)


def test_it_stops_when_enough_rows_pass() -> None:
    study = kw.sweep(LIFT, VARY, workers=0, stop_after=3)
    assert 3 <= study.passed < 8
    assert len(study) < 10


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"workers": -1}, "workers is -1; it must be at least 0"),
        ({"workers": 1.5}, "workers is 1.5; it must be a whole number"),
        ({"workers": 1, "scheduler": "tcp://x:1"}, "both given"),
        ({"stop_after": 0}, "stop_after is 0"),
        ({"time_limit": -1}, "time_limit is -1"),
        ({"together": "no"}, "together is 'no'"),
        ({"resume": "no"}, "resume is 'no'"),
        ({"seed": "x"}, "seed is 'x'; it must be a whole number"),
    ],
)
def test_options_that_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(kw.InputError, match=message):
        kw.sweep(LIFT, VARY, **options)


def test_a_frozen_row_has_the_chosen_times_as_a_frozen_plan_has(tmp_path: Path) -> None:
    file = written(
        tmp_path / "swing.yaml",
        "times: fastest\nlimits: {velocity: 1.2, acceleration: 4, jerk: 40} # a comment\n"
        "waypoints:\n- joints: {a: 0}\n- joints: {a: 1}\n  velocity: free\n- joints: {a: 2}\n",
    )
    vary = {"limits.velocity": [1, 1.1], "waypoints[1].velocity": ["free", {"a": 0}]}
    study = kw.sweep(file, vary, workers=0)
    for row in range(4):
        frozen = study.freeze(row, tmp_path / "best.yaml")
        text = frozen.read_text(encoding="utf-8")
        assert "fastest" not in text
        assert "# a comment" in text
        plan = kw.plan(study.scenario(row))
        assert kw.load_scenario(frozen).unknowns is None
        again = kw.plan(frozen).trajectory
        assert again.duration == plan.trajectory.duration == study["duration"][row]
        plan.freeze(tmp_path / "same.yaml")
        assert kw.plan(tmp_path / "same.yaml").trajectory.duration == again.duration
    with pytest.raises(kw.InputError, match=r"the study has no row 4; accepted: 0 to 3"):
        study.freeze(4, tmp_path / "best.yaml")
    file.write_text("# the study has its own copy", encoding="utf-8")
    assert kw.plan(study.freeze(3, tmp_path / "best.yaml")).trajectory.duration == again.duration


def test_rows_without_motion_are_wrong_or_out_of_reach(tmp_path: Path) -> None:
    file = written(
        tmp_path / "rows.csv",
        "frames.block.position[0],frames.block.rpy[2],frames.block.in,planner\n"
        "450,0,base,modified-hermite\n"
        "2500,0,base,nonsense\n"
        "450,much,base,cubic\n"
        "450,0,nowhere,cubic\n"
        "2500,0,base,cubic\n",
    )
    study = kw.sweep("ur5_deburring", rows=file, workers=0)
    assert study["reason"] == ["", *["wrong input"] * 3, "out of reach"]
    assert "the pose is out of reach" in study["message"][4]
    assert study["clearance"][0] > 0.01
    assert study["path_deviation"][0] < 5e-5
    assert study["clearance"][1:] == [None] * 4


FAULTY = """
import ctypes, os, pathlib
from knotwork.verification import CHECKS

def faulty(motion, scenario, joints):
    seconds, ended = motion.trajectory.duration, pathlib.Path(__file__).with_name("ended")
    if seconds == 1.25 and not ended.exists(): ended.touch(); os._exit(9)
    if seconds == 1.5: os.abort()
    if seconds == 2.0: ctypes.PyDLL(None).sleep(10_000)  # no other thread of Python runs meanwhile
    return ()

CHECKS["faulty"] = faulty
"""


@pytest.mark.exhaustive
def test_rows_hang_or_crash_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a check in the processes that plan; a row that crashes once is planned again."""
    (tmp_path / "sitecustomize.py").write_text(FAULTY, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(tmp_path), *sys.path[1:])))
    vary = {"waypoints[up].after": [1.25, 1.5, 2, 2.5]}
    study = kw.sweep(LIFT, vary, workers=1, time_limit=20)
    assert study["verdict"] == ["passed", "crashed", "time limit", "passed"]
    assert study["message"][1:3] == ["its process ended with SIGABRT(-6)", "took longer than 20 s"]
    assert (tmp_path / "ended").exists()
    (crashed,) = kw.plan_many([study.scenario(1)], workers=1)
    assert isinstance(crashed, kw.errors.PlanningCrashError)
    assert crashed.exit_code == "SIGABRT(-6)"


def test_faults_in_planning_are_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> NoReturn:
        raise ZeroDivisionError("no")

    monkeypatch.setitem(CHECKS, "broken", broken)
    (row,) = kw.sweep(LIFT, {"rate": [100]}, workers=0).rows()
    assert row["verdict"] == "crashed"
    assert row["message"] == "internal error: ZeroDivisionError: no"
    for planned in (
        lambda: kw.sweep(LIFT, {"rate": [100]}, workers=1),
        lambda: kw.plan_many([LIFT], workers=1),
    ):
        with pytest.raises(kw.InputError, match=r"do not have your own checks \(broken\)"):
            planned()


def test_plans_of_many() -> None:
    tasks = [LIFT, {**LIFT, "waypoints": []}, {**LIFT, "limits": {}}]
    first, wrong, last = kw.plan_many(tasks, workers=1)
    assert isinstance(wrong, kw.InputError)
    assert last.report.ok
    assert first.report.findings == kw.plan(LIFT).report.findings
    (slow,) = kw.plan_many([LIFT], workers=1, time_limit=1e-9)
    assert isinstance(slow, kw.errors.PlanningTimeoutError)
    assert slow.time_limit == 1e-9
    with pytest.raises(kw.InputError, match="workers is 0"):
        kw.plan_many(tasks, workers=0)
    with pytest.raises(kw.InputError, match=r"scenarios\[1\] is 5; accepted: a name"):
        kw.plan_many([LIFT, 5], workers=1)  # type: ignore[list-item]
    for single in ("ur5_deburring", Path("task.yaml"), LIFT, kw.load_scenario(LIFT), 5):
        with pytest.raises(kw.InputError, match=r"scenarios is .*; accepted: a list of"):
            kw.plan_many(single, workers=1)  # type: ignore[arg-type]
