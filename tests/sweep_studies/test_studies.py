"""Studies: rows and their figures, the folder, going on, and what is read from it again."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from tasks import LIFT

import knotwork as kw
from knotwork.documents import Document, edited
from knotwork.scenario import scenario_of
from knotwork.sweeps import work
from knotwork.sweeps.bench import Bench, Block
from knotwork.sweeps.outcome import outcome_of
from knotwork.sweeps.placing import Placing, poses_of
from knotwork.sweeps.spec import StudySpec, scenario_document
from knotwork.sweeps.variations import make_axes

VARY = {"waypoints[up].after": "1:3:5", "knots": "paper,balanced"}


@pytest.fixture(scope="module")
def lifted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small study."""
    folder = tmp_path_factory.mktemp("studies") / "lift"
    kw.sweep(LIFT, VARY, out=folder, workers=0, chunk=4)
    return folder


def without_time(study: kw.Study) -> list[dict[str, Any]]:
    return [{k: v for k, v in row.items() if k != "plan_time"} for row in study.rows()]


def test_rows_say_what_plans_say(lifted: Path) -> None:
    study = kw.Study.open(lifted)
    assert study["row"] == list(range(10))
    for row in study.rows():
        made = kw.plan(study.scenario(row["row"]))
        assert made.scenario.waypoints[1].time == row["waypoints[up].after"]
        assert (row["verdict"] == "passed") == made.report.ok
        assert row["duration"] == made.trajectory.duration
        (speed,) = made.report.select(subject="joint", quantity="velocity")
        assert row["velocity_use"] == speed.use
        assert row["clearance"] is None
        if not made.report.ok:
            assert row["reason"] == "velocity"
            assert row["message"] == str(made.report.failures[0])
    assert study.reasons == {"velocity": 2}
    assert study.passed == 8
    assert study.best("velocity_use")["waypoints[up].after"] == 3.0


def test_a_study_in_memory_has_the_same_rows(lifted: Path) -> None:
    study = kw.sweep(LIFT, VARY, workers=0, chunk=3)
    assert without_time(study) == without_time(kw.Study.open(lifted))


def test_going_on_does_only_what_is_missing(lifted: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(lifted, tmp_path / "lift")
    files = sorted(folder.rglob("*.parquet"))
    assert [file.name for file in files] == [f"{i:07d}.parquet" for i in range(3)]
    before = {file: file.stat().st_mtime_ns for file in files}
    files[1].unlink()
    assert len(kw.Study.open(folder)) == 6
    seen: list[kw.SweepProgress] = []
    again = kw.sweep(LIFT, VARY, out=folder, workers=0, resume=True, progress=seen.append)
    assert without_time(again) == without_time(kw.Study.open(lifted))
    assert [(at.before, at.done, at.total, at.passed) for at in seen] == [(6, 10, 10, 8)]
    assert {file for file in files if file.stat().st_mtime_ns != before[file]} == {files[1]}


@pytest.mark.parametrize(
    ("task", "vary", "said"),
    [
        (LIFT, {**VARY, "knots": "paper,optimal"}, "knots[1] is 'balanced' there and 'optimal'"),
        ({**LIFT, "rate": 50}, VARY, "it has no scenario.rate"),
    ],
)
def test_another_study_is_refused(lifted: Path, task: Any, vary: Any, said: str) -> None:
    with pytest.raises(kw.InputError, match="holds another study") as raised:
        kw.sweep(task, vary, out=lifted, workers=0, resume=True)
    assert said in str(raised.value)


def test_a_folder_is_not_gone_on_with_unasked(lifted: Path, tmp_path: Path) -> None:
    with pytest.raises(kw.InputError, match="holds a study already"):
        kw.sweep(LIFT, VARY, out=lifted, workers=0)
    with pytest.raises(kw.InputError, match=r"is not the folder of a study"):
        kw.Study.open(tmp_path)
    with pytest.raises(kw.InputError, match="resume is given without out"):
        kw.sweep(LIFT, VARY, workers=0, resume=True)


def test_damaged_folders_are_named(lifted: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(lifted, tmp_path / "lift")
    chunk = sorted(folder.rglob("*.parquet"))[1]
    chunk.write_bytes(chunk.read_bytes()[:-40])
    with pytest.raises(kw.InputError, match=f"{chunk.name}: can't be read"):
        kw.Study.open(folder).rows().__next__()
    table = parquet.read_table(chunk.with_stem("0000000"), partitioning=None)
    for other, said in ((table.drop(["verdict"]), "columns"), (table.take([0] * 99), "rows")):
        parquet.write_table(other, chunk)
        with pytest.raises(kw.InputError, match=f"it has (other|more) {said} than the study"):
            kw.Study.open(folder).rows().__next__()
    data = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    for wrong, said in (
        ({**data, "study": {**data["study"], "version": 9}}, "has version 9, and 1 is accepted"),
        ({**data, "chunk": None}, "can't be understood"),
        ({**data, "chunk": 0}, r"can't be understood \(ValueError: its chunks have 0 rows"),
        ([], "is not the description of a study"),
    ):
        (folder / "study.json").write_text(json.dumps(wrong), encoding="utf-8")
        with pytest.raises(kw.InputError, match=said):
            kw.Study.open(folder)


@pytest.mark.parametrize("size", [60_000, 200_000])
def test_texts_that_fill_memory_are_refused(
    size: int, lifted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A text of a chunk's file stands there once, however many rows have it, and compressed."""
    folder = shutil.copytree(lifted, tmp_path / "lift")
    chunk = min(folder.rglob("*.parquet"))
    table = parquet.read_table(chunk, partitioning=None)
    place = table.schema.get_field_index("message")
    parquet.write_table(table.set_column(place, "message", [["x" * size] * 4]), chunk)
    assert len(kw.Study.open(folder)["message"][3]) == size
    assert chunk.stat().st_size < 30_000
    monkeypatch.setattr("knotwork.sweeps.study.MOST_BYTES", 100_000)
    with pytest.raises(kw.InputError, match=r"0000000\.parquet: .* more than 2000000000 bytes"):
        kw.Study.open(folder).rows().__next__()


def test_it_stops_when_enough_rows_pass() -> None:
    study = kw.sweep(LIFT, VARY, workers=0, chunk=2, stop_after=3)
    assert 3 <= study.passed < 8
    assert len(study) < 10


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"workers": -1}, "workers is -1; it must be at least 0"),
        ({"workers": 1.5}, "workers is 1.5; it must be a whole number"),
        ({"workers": 1, "scheduler": "tcp://x:1"}, "both given"),
        ({"chunk": 0}, "chunk is 0"),
        ({"stop_after": 0}, "stop_after is 0"),
        ({"time_limit": -1}, "time_limit is -1"),
    ],
)
def test_options_that_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(kw.InputError, match=said):
        kw.sweep(LIFT, VARY, **options)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(kw.InputError, match=r"'distributed'.*knotwork\[sweep\]"):
        kw.sweep(LIFT, VARY, workers=2)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(kw.InputError, match=r"'pyarrow'.*knotwork\[sweep\]"):
        kw.sweep(LIFT, VARY, workers=0)


def test_the_best_row_is_frozen_with_its_comments(tmp_path: Path) -> None:
    file = tmp_path / "lift.yaml"
    file.write_text(
        "name: lift # a comment\nlimits: {velocity: 1.2}\nwaypoints:\n"
        "  - joints: {lift: 0}\n  - joints: {lift: 1}\n    after: 1\n",
        encoding="utf-8",
    )
    study = kw.sweep(file, {"waypoints[1].after": [1, 1.5, 2]}, workers=0)
    frozen = study.freeze(study.best("duration")["row"], tmp_path / "best.yaml")
    assert "# a comment" in frozen.read_text(encoding="utf-8")
    assert kw.plan(frozen).trajectory.duration == 1.5
    file.write_text(file.read_text(encoding="utf-8").replace("1.2", "0.1"), encoding="utf-8")
    assert kw.plan(study.freeze(1, frozen)).report.ok
    with pytest.raises(kw.InputError, match=r"there is no row 3; accepted: 0 to 2"):
        study.freeze(3, frozen)


def test_out_of_reach_is_found_without_planning(monkeypatch: pytest.MonkeyPatch) -> None:
    from knotwork.sweeps import outcome

    vary = {"frames.block.position[0]": [450, 1500, 2500]}
    planned: list[float] = []
    real = outcome.plan

    def counted(scenario: Any) -> Any:
        planned.append(scenario.frames["block"].translation[0])
        return real(scenario)

    monkeypatch.setattr(outcome, "plan", counted)
    study = kw.sweep("ur5_deburring", vary, workers=0)
    assert planned == [0.45]
    assert study["reason"] == ["", "out of reach", "out of reach"]
    assert study["clearance"][0] > 0.01
    assert study["path_deviation"][0] < 5e-5
    assert study["clearance"][1:] == [None, None]


PLACES = tuple(("frames", "block", key, i) for key in ("position", "rpy") for i in range(3))
"""Six numbers that place the block of ur5_deburring."""


def random_places(count: int) -> Block:
    """Rows that place the block anywhere around the robot."""
    most = [800, 800, 300, 30, 30, 180]
    values = np.random.default_rng(5).uniform(-1, 1, (count, 6)) * most
    document = scenario_document("ur5_deburring")
    return Block(document, PLACES, {i: tuple(row) for i, row in enumerate(values.tolist())})


def test_moved_frames_move_the_poses_that_reading_gives() -> None:
    block = random_places(5)
    placing = Placing(block.document)
    for row in block.values:
        read = poses_of(scenario_of(edited(block.document, block.edits(row))))
        moved = placing.poses(block.edits(row))
        assert moved is not None
        assert [name for name, _ in moved] == [name for name, _ in read]
        for (_, one), (_, other) in zip(moved, read, strict=True):
            assert np.abs(one.homogeneous - other.homogeneous).max() < 1e-12


@pytest.mark.parametrize(
    ("edits", "changes"),
    [
        ({("rate",): 100}, {}),  # not a frame
        ({("frames", "block", "rpy", 2): "much"}, {}),
        ({("frames", "block", "in"): "nowhere"}, {}),
        ({("frames", "block", "position", 0): 1e9}, {}),
        # one waypoint stays where it is
        ({("frames", "block", "position", 0): 400}, {("waypoints", 0, "frame"): "base"}),
    ],
)
def test_rows_that_have_to_be_read(edits: dict[Any, Any], changes: dict[Any, Any]) -> None:
    document = edited(scenario_document("ur5_deburring"), changes)
    assert Placing(document).poses(edits) is None


@pytest.mark.parametrize("count", [12, pytest.param(120, marks=pytest.mark.exhaustive)])
def test_what_the_test_of_poses_refuses_planning_refuses_for_the_same_reason(count: int) -> None:
    block = random_places(count)
    known = Bench().begin(block, True)
    assert 0.2 * count < len(known) < 0.9 * count
    for row in list(known) if count > 12 else list(known)[:3]:
        alone = outcome_of(scenario_of(edited(block.document, block.edits(row))))
        assert (alone.verdict, alone.reason) == (known[row].verdict, known[row].reason)


def test_rows_that_are_wrong_and_out_of_reach_are_wrong() -> None:
    block = random_places(8)
    locations = (*PLACES, ("planner",))
    values = {row: (*given, "nonsense") for row, given in block.values.items()}
    assert Bench().begin(Block(block.document, locations, values), True) == {}
    wrong = edited(block.document, {("planner",): "nonsense"})
    assert Bench().begin(Block(wrong, PLACES, block.values), True) == {}


@pytest.mark.exhaustive
def test_an_arm_without_a_closed_form_is_searched_for() -> None:
    vary = {"frames.bench.position[0]": "0.3:0.9:7", "frames.bench.rpy[2]": "0:4.5:4"}
    spec = StudySpec(scenario_document("panda_pick_place"), make_axes(vary), 60.0)
    block = Block(spec.document, spec.locations, {i: spec.values(i) for i in range(len(spec))})
    known = Bench().begin(block, True)
    assert 4 < len(known) < 28
    for row in known:
        alone = outcome_of(scenario_of(spec.document_of(row)))
        assert (alone.verdict, alone.reason) == (known[row].verdict, known[row].reason)


class Unpickled:
    """A value that does something in the process that it is sent to."""

    def __init__(self, action: Any, *arguments: Any) -> None:
        self.action, self.arguments = action, arguments

    def __reduce__(self) -> Any:
        return self.action, self.arguments


@pytest.mark.exhaustive
def test_rows_that_hang_or_crash_say_so_and_the_others_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(work, "BLOCK_LIMIT", 0.5)
    values = {
        0: (1.5,),
        1: (Unpickled(os.abort),),
        2: (Unpickled(time.sleep, 60),),
        3: (2.5,),
        4: (Unpickled(os._exit, 7),),
    }
    block = Block(Document(LIFT), (("waypoints", 1, "after"),), values)
    worker = work.ChildWorker()
    chunk = work.Chunk(0, 0, 5, (block,), (), 0.5)
    found = {row: done for row, _, done in work.outcomes(chunk, worker)}
    worker.close()
    verdicts = [done.verdict for done in found.values()]
    assert verdicts == ["passed", "crashed", "time limit", "passed", "crashed"]
    assert "SIGABRT" in found[1].message
    assert found[2].message == "took longer than 0.5 s"
    assert "code 7" in found[4].message


def test_faults_in_planning_are_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(scenario: Any) -> Any:
        raise ZeroDivisionError("no")

    monkeypatch.setattr("knotwork.sweeps.outcome.plan", broken)
    study = kw.sweep(LIFT, {"rate": [100]}, workers=0)
    (row,) = study.rows()
    assert row["verdict"] == "crashed"
    assert row["message"] == "internal error: ZeroDivisionError: no"


def test_plans_of_many() -> None:
    tasks = [LIFT, {**LIFT, "waypoints": []}, {**LIFT, "limits": {}}]
    first, wrong, last = kw.plan_many(tasks, workers=1)
    assert isinstance(first, kw.Plan)
    assert isinstance(last, kw.Plan)
    assert isinstance(wrong, kw.InputError)
    assert not first.report.ok
    assert last.report.ok
    assert first.report.findings == kw.plan(LIFT).report.findings
    with pytest.raises(kw.InputError, match="workers is 0"):
        kw.plan_many(tasks, workers=0)
