"""Stored trajectories: the same motion for SciPy and for us; files are whole or not there."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from command_line import Command, python
from knotwork import Plan
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files import storage
from plans import assert_same_bits
from sweeps import examples
from texts import written

FORMAT = "knotwork." + "trajectory"  # of files, which packages do not rename
FILES = ["report.json", "samples.csv", "trajectory.json"]


@pytest.fixture(scope="module")
def stored(deburring: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stored")
    written = deburring.save(folder)
    assert sorted(path.name for path in written) == FILES
    assert sorted(path.name for path in folder.iterdir()) == FILES
    return folder


def read(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "trajectory.json").read_text(encoding="utf-8"))


def edited(folder: Path, tmp_path: Path, change: dict[str, Any]) -> Path:
    return written(tmp_path / "edited.json", {**read(folder), **change})


# What is in the files


def test_reading_gives_back_every_bit(deburring: Plan, stored: Path) -> None:
    for place in (stored, stored / "trajectory.json"):
        again = kw.load_trajectory(place)
        assert_same_bits(again, deburring.trajectory)
        assert kw.check(again, deburring.scenario).to_dict() == deburring.report.to_dict()


@examples()
@given(st.data())
def test_any_trajectory_comes_back_through_text(data: st.DataObject) -> None:
    numbers = st.floats(-1e150, 1e150, allow_subnormal=True)
    degree, pieces, joints = (data.draw(st.integers(low, 4)) for low in (0, 1, 1))
    size = (degree + 1) * pieces * joints
    values = data.draw(st.lists(numbers, min_size=size, max_size=size))
    steps = data.draw(st.lists(st.floats(1e-3, 10), min_size=pieces, max_size=pieces))
    start = data.draw(st.floats(-10, 10))
    breaks = np.cumsum([start, *steps])
    c = np.reshape(values, (degree + 1, pieces, joints))
    if degree == 3:
        c = c / 1e30  # knots are written for cubics, and must be finite
    names = [data.draw(st.text(min_size=1, max_size=5)) + str(i) for i in range(joints)]
    names = [name.encode("utf-8", "replace").decode() for name in names]
    units = ["rad", "m", "rad", "m"][:joints]
    before = JointTrajectory(
        tuple(names), PiecewisePolynomial(c, breaks), joint_units=units, origin="a [ 1,  2] b"
    )
    text = storage.json_text(storage.trajectory_to_dict(before))
    after = storage.trajectory_from_dict(json.loads(text))
    assert after.polynomial.c.tobytes() == np.ascontiguousarray(c).tobytes()
    assert after.breaks.tobytes() == breaks.tobytes()
    assert (after.joint_names, after.joint_units) == (before.joint_names, before.joint_units)
    assert after.origin == before.origin


def test_the_report_in_the_file_is_the_report(deburring: Plan, stored: Path) -> None:
    data = json.loads((stored / "report.json").read_text(encoding="utf-8"))
    assert set(data.pop("files")) == {"samples.csv", "trajectory.json"}
    assert data.pop("scenario_file") == "ur5_deburring"
    assert data == deburring.report_to_dict()
    assert data["ok"] is True
    solutions = data.pop("solutions")
    assert data == deburring.report.to_dict()
    assert [c["waypoint"] for c in solutions["choices"]] == [
        choice.waypoint for choice in deburring.solution.choices
    ]


# Writing


def test_files_are_replaced_and_others_left_alone(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "mine.txt").write_text("mine")
    storage.write_files(tmp_path, {"a.txt": "new\n", "b.txt": "ü\n"})
    assert (tmp_path / "a.txt").read_text() == "new\n"
    assert (tmp_path / "b.txt").read_bytes() == "ü\n".encode()
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 3


def test_a_file_in_the_place_of_the_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here first")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="give a folder"):
            storage.write_files(folder, {"a": "x"})
    assert (tmp_path / "file").read_text() == "here first"


def test_text_that_no_file_can_hold_is_an_error_that_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="can't write"):
        storage.write_files(tmp_path, {"a": "fine", "b": "\ud800"})
    with pytest.raises(InputError, match="can't write"):
        storage.write_files(tmp_path / "a\0b", {"a": "fine"})
    assert not list(tmp_path.iterdir())


# Files edited by hand


@pytest.mark.parametrize("index", [(3, 5, 1), (0, 0, 3), (2, 9, 5)])
def test_an_edited_coefficient_fails_the_check(
    index: tuple[int, int, int], stored: Path, tmp_path: Path, knotwork: Command
) -> None:
    data = read(stored)
    power, piece, joint = index
    data["coefficients"][power][piece][joint] += 1e-3
    path = edited(stored, tmp_path, {"coefficients": data["coefficients"]})
    ran = knotwork("check", path, "--scenario", "ur5_deburring", "--json")
    report = json.loads(ran.failed())
    assert report["ok"] is False
    joint_name = data["joint_names"][joint]
    assert any(joint_name in failure and "jump" in failure for failure in report["failures"])


@pytest.mark.parametrize("name", ["time", "position", "velocity", "acceleration"])
def test_edited_knots_fail(name: str, stored: Path, tmp_path: Path, knotwork: Command) -> None:
    knots = read(stored)["knots"]
    if name == "time":
        knots[name][4] += 1e-4
        at = "knots.time[4]"
    else:
        knots[name][4][2] += 1e-4
        at = f"knots.{name}[4][2]"
    path = edited(stored, tmp_path, {"knots": knots})
    ran = knotwork("check", path, "--scenario", "ur5_deburring", "--json")
    (failure,) = json.loads(ran.failed())["failures"]
    assert failure.startswith(at)


def test_the_knots_may_be_left_out(stored: Path, tmp_path: Path, knotwork: Command) -> None:
    path = edited(stored, tmp_path, {"knots": None})
    assert knotwork("check", path, "--scenario", "ur5_deburring").code == 0


def without(key: str, data: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in data.items() if name != key}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: without("coefficients", d), "coefficients: is missing"),
        (lambda d: {**d, "format": "other"}, "format"),
        (lambda d: {**d, "version": 2}, "version"),
        (lambda d: {**d, "breaks": d["breaks"][::-1]}, "breaks[1]"),
        (lambda d: {**d, "breaks": ["0", *d["breaks"][1:]]}, "breaks[0]: '0': must be a number"),
        (lambda d: {**d, "coefficients": [[[1, 2], [1]]]}, "rows of different lengths"),
        (lambda d: {**d, "coeficients": []}, "did you mean 'coefficients'?"),
        (lambda d: {**d, "joint_names": [d["joint_names"][0]] * 6}, "joint_names"),
        (lambda d: {**d, "units": {"joints": ["rad"]}}, "units.joints: has 1 entries"),
        (lambda d: {**d, "units": {"joints": ["deg"] * 6}}, "units.joints[0]"),
        (lambda d: {**d, "waypoint_times": [0, 999]}, "waypoint_times"),
        (lambda d: {**d, "knots": {**d["knots"], "time": [0]}}, "knots.time: has shape (1,)"),
        (lambda d: {**d, "knots": {**d["knots"], "position": [[1], []]}}, "knots.position"),
        (lambda d: [d], "a mapping"),
    ],
)
def test_a_malformed_file_names_file_and_field(
    change: Any, says: str, stored: Path, tmp_path: Path, knotwork: Command
) -> None:
    path = written(tmp_path / "edited.json", change(read(stored)))
    err = knotwork("check", path, "--scenario", "ur5_deburring").refused()
    assert str(path) in err
    assert says in err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f'{{"format": "{FORMAT}",\n "breaks": [0, 1,]}}', "line 2: is not valid JSON"),
        ("", "not valid JSON"),
        ('{"breaks": [NaN]}', "breaks[0]: nan: must be a finite number"),
        ('{"breaks": [' + "9" * 5000 + "]}", "digits"),
        ("[" * 100_000, "nested"),
        ('{"version": 1, "version": 1}', "version is given twice"),
    ],
)
def test_locates_errors_of_json(text: str, says: str, tmp_path: Path, knotwork: Command) -> None:
    path = written(tmp_path / "broken.json", text)
    err = knotwork("check", path, "--scenario", "ur5_deburring").refused()
    assert "broken.json" in err
    assert says in err
    assert len(err) < 5000


NAMES = ("a", "b", "c")
# Ends the process at its n-th step that changes a folder, as a power cut or Ctrl-C would.
CUT = """
import os, signal, sys
from knotwork.files import storage
steps = int(sys.argv[3])
def counted(function):
    def step(*arguments, **options):
        global steps
        steps -= 1
        if steps == 0 and sys.argv[4] == "interrupt":
            raise KeyboardInterrupt
        if steps == 0 and sys.argv[4] == "full":
            raise OSError(28, "No space left on device")
        if steps == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return function(*arguments, **options)
    return step
for name in ("mkdir", "replace", "link", "fsync"):
    setattr(os, name, counted(getattr(os, name)))
storage.write_files(sys.argv[1], {name: sys.argv[2] for name in "abc"})
sys.exit(steps <= 0)  # a step that may fail has failed
"""


@pytest.mark.parametrize("how", ["kill", "interrupt", "full"])
def test_a_writer_ended_at_any_step_leaves_whole_files(how: str, tmp_path: Path) -> None:
    """And after an interrupt from the keyboard, or on a full disk, nothing else."""
    seen = set()
    for steps in range(1, 100):
        folder = tmp_path / str(steps)
        storage.write_files(folder, dict.fromkeys(NAMES, "old"))
        ran = python("-c", CUT, folder, "new", steps, how)
        found = {(folder / name).read_text() for name in NAMES}
        assert found <= {"old", "new"}
        if how != "kill":
            assert not [path.name for path in folder.iterdir() if path.name.startswith(".")]
        seen |= found
        if ran.returncode == 0:
            break
    else:
        pytest.fail("it never came to its end")
    assert seen == {"old", "new"}
    assert steps > 6


def test_report_names_its_files(paper_case: Plan, tmp_path: Path, knotwork: Command) -> None:
    paper_case.save(tmp_path)
    stated = json.loads((tmp_path / "report.json").read_text())["files"]
    for name in ("trajectory.json", "samples.csv"):
        digest = hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
        assert stated[name] == f"sha256:{digest}"
    for source in (tmp_path, tmp_path / "trajectory.json", tmp_path / "samples.csv"):
        assert "note" not in knotwork("check", source, "--scenario", "paper_case").err
    for name in ("trajectory.json", "samples.csv"):
        with (tmp_path / name).open("a") as file:
            file.write("\n")
        ran = knotwork("check", tmp_path / name, "--scenario", "paper_case")
        assert "was changed after report.json next to it was written" in ran.err
    assert "was changed after" in knotwork("plot", tmp_path, "-o", tmp_path / "a.png").refused()
    storage.load_trajectory(tmp_path)
    assert "was changed after" in str(storage.changed_since_report(tmp_path))
    (tmp_path / "report.json").unlink()
    assert storage.changed_since_report(tmp_path) is None
