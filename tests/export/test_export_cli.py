"""`knotwork export` and back with `knotwork check`, from the command line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml

import knotwork as kw
from command_line import Command
from knotwork.files.export import FORMATS
from plans import planned
from shipped import SCENARIO_FILES

ROOT = Path(__file__).parents[2]
BROKEN = ROOT / "tests" / "failing" / "jerk_limit_broken.yaml"
SCENARIO = "paper_case"
TABLES = ([], ["--knots-only"], ["--knots-only", "--accelerations"])


@pytest.fixture
def stored(knotwork: Command, tmp_path: Path) -> Path:
    folder = tmp_path / "planned"
    assert knotwork("plan", SCENARIO, "-o", folder).code == 0
    return folder


@pytest.mark.parametrize("name", ["ros2", "pvt", "csv", "json"])
def test_text_goes_to_standard_output_alone(knotwork: Command, name: str) -> None:
    out = knotwork("export", SCENARIO, "--format", name).done()
    assert out == kw.export.content(kw.plan(SCENARIO).trajectory, name)


@pytest.mark.parametrize("name", ["ros2", "csv", "json", "npz", "mat", "scipy", "pvt"])
def test_a_file_is_written_and_kept(knotwork: Command, tmp_path: Path, name: str) -> None:
    file = tmp_path / "new" / f"motion{FORMATS[name].suffix}"
    ran = knotwork("export", SCENARIO, "-f", name, "-o", file)
    assert (ran.code, ran.err) == (0, "")
    assert f"wrote {file}" in ran.out
    written = file.read_bytes()
    assert written
    file.write_bytes(b"mine")
    err = knotwork("export", SCENARIO, "-f", name, "-o", file).refused()
    assert "exists and is kept" in err
    assert "--force" in err
    assert file.read_bytes() == b"mine"
    assert knotwork("export", SCENARIO, "-f", name, "-o", file, "--force").code == 0
    assert file.read_bytes() == written
    assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize(
    ("scenario", "options"),
    [
        *(("ur5_deburring", ("csv", *extra)) for extra in TABLES),
        ("ur5_deburring", ("json", "--knots-only")),
        ("ur5_deburring", ("pvt", "--degrees")),
        ("ur5_deburring", ("ros2", "--goal")),
        ("ur10_weld", ("ros2",)),
    ],
)
def test_exports_pass_the_check_again(
    knotwork: Command, tmp_path: Path, scenario: str, options: tuple[str, ...]
) -> None:
    file = tmp_path / f"m{FORMATS[options[0]].suffix}"
    assert knotwork("export", scenario, "-f", *options, "-o", file).code == 0
    assert json.loads(knotwork("check", file, "-s", scenario, "--json").done())["ok"]


def test_a_stored_trajectory_is_exported(knotwork: Command, stored: Path) -> None:
    planned = knotwork("export", SCENARIO, "-f", "ros2").out
    for what in (stored, stored / "trajectory.json"):
        assert knotwork("export", what, "-f", "ros2").out == planned
        assert knotwork("export", what, "-f", "ros2", "-s", SCENARIO).out == planned


def test_what_fails_its_check_is_not_exported(knotwork: Command, tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    ran = knotwork("export", BROKEN, "-f", "ros2", "-o", file)
    assert ran.code == 1
    assert "jerk reaches" in ran.err
    assert "--allow-failed" in ran.err
    assert not file.exists()
    assert not knotwork("export", BROKEN, "-f", "ros2").out
    ran = knotwork("export", BROKEN, "-f", "ros2", "-o", file, "--allow-failed")
    assert ran.code == 0
    assert "exported all the same" in ran.err
    assert file.exists()


def test_checks_stored_trajectory_against_scenario(knotwork: Command, tmp_path: Path) -> None:
    knotwork("plan", BROKEN, "-o", tmp_path / "p")
    assert knotwork("export", tmp_path / "p", "-f", "ros2").code == 0
    ran = knotwork("export", tmp_path / "p", "-f", "ros2", "-s", BROKEN)
    assert (ran.code, ran.out) == (1, "")


def test_exports_changed_trajectory_only_with_scenario(knotwork: Command, tmp_path: Path) -> None:
    """Without its events a weld went without an arc, with a note."""
    folder = tmp_path / "weld"
    assert knotwork("plan", "ur10_weld", "-o", folder).code == 0
    file = folder / "trajectory.json"
    data = json.loads(file.read_text())
    del data["events"]
    file.write_text(json.dumps(data))
    err = knotwork("export", folder, "-f", "ros2", "-o", tmp_path / "weld.yaml").refused()
    assert "next to it was written; accepted: the files of one plan, or --scenario in a" in err
    assert not (tmp_path / "weld.yaml").exists()
    assert knotwork("export", folder, "-f", "ros2", "-s", "ur10_weld").code == 1


def test_a_quintic_is_refused_or_fitted(knotwork: Command, tmp_path: Path) -> None:
    line = ["export", SCENARIO, "--planner", "quintic", "--allow-failed", "-f", "pvt"]
    err = knotwork(*line).refused()
    for word in ("degree 5", "--tolerance", "would be off by up to"):
        assert word in err
    ran = knotwork(*line, "--tolerance", "1e-4")
    assert ran.code == 0
    rows = [line for line in ran.out.splitlines() if line[0].isdigit()]
    assert f"{len(rows)} points of position and velocity" in ran.err
    assert "inserted" in ran.err
    assert "C1: the acceleration jumps" in ran.err
    file = tmp_path / "m.csv"
    ran = knotwork(*line, "--tolerance", "1e-4", "-o", file)
    assert f"wrote {file}; {len(rows)} points" in ran.out


@pytest.mark.parametrize(
    "options",
    [
        ("pvt", "quintic"),
        pytest.param(("ros2", "septic"), marks=pytest.mark.exhaustive),
        ("csv", "septic", "--knots-only"),
        pytest.param(("ros2", "septic", "--accelerations"), marks=pytest.mark.exhaustive),
        ("json", "septic", "--knots-only", "--accelerations"),
        pytest.param(("ros2", "quintic", "--accelerations"), marks=pytest.mark.exhaustive),
        ("pvt", "modified-hermite"),
    ],
)
def test_fit_reports_as_check(knotwork: Command, tmp_path: Path, options: tuple[str, ...]) -> None:
    """A fit by cubics loses the continuous acceleration, and no more."""
    name, planner, *extra = options
    file = tmp_path / f"m{FORMATS[name].suffix}"
    line = ["export", "ur5_deburring", "-f", name, "--planner", planner, *extra]
    line += ["--tolerance", "1e-6", "-o", file]
    ran = knotwork(*line)
    assert (ran.code, file.exists()) == (0, True)
    passing = "--accelerations" in extra or planner == "modified-hermite"
    checked = knotwork("check", file, "-s", "ur5_deburring", "--json")
    assert checked.code == (0 if passing else 1)
    failures = json.loads(checked.out)["failures"]
    assert bool(failures) != passing
    for failure in failures:
        assert "acceleration" in failure or "jerk is infinite at the jump" in failure
        assert " ".join(failure.split(": ")[1].split()[:4]) in ran.err
    assert ("fail the check: exported, because a fit by cubics" in ran.err) != passing
    if not passing:
        assert "jump of acceleration" in ran.err


def test_refuses_fit_with_larger_errors(knotwork: Command, tmp_path: Path) -> None:
    """Its acceleration is higher than that of the curve, which is at its limits here."""
    task = yaml.safe_load(SCENARIO_FILES["ur5_deburring"].read_text(encoding="utf-8"))
    curve = planned("ur5_deburring", planner="quintic").trajectory
    reached = curve.extrema("acceleration")
    most = np.maximum(np.abs(reached.minimum), np.abs(reached.maximum))
    tight = dict(zip(curve.joint_names, np.degrees(1.0001 * most).tolist(), strict=True))
    task |= {"planner": "quintic", "limits": {**task.get("limits", {}), "acceleration": tight}}
    task.pop("knots", None)
    scenario, file = tmp_path / "tight.yaml", tmp_path / "m.csv"
    scenario.write_text(yaml.safe_dump(task), encoding="utf-8")
    line = ("export", scenario, "-f", "pvt", "--tolerance", "1e-2", "-o", file)
    ran = knotwork(*line)
    assert (ran.code, file.exists()) == (1, False)
    assert "not exported (--allow-failed exports them)" in ran.err
    assert knotwork(*line, "--allow-failed").code == 0


@pytest.mark.parametrize("name", ["csv", "json", "ros2", "pvt"])
def test_refuses_files_only_to_be_checked(knotwork: Command, tmp_path: Path, name: str) -> None:
    file = tmp_path / f"m{FORMATS[name].suffix}"
    assert knotwork("export", SCENARIO, "-f", name, "-o", file).code == 0
    err = knotwork("export", file, "-f", "ros2").refused()
    assert f"{str(file)!r} has samples or points, which export does not convert" in err
    assert "knotwork check" in err


def test_paths_that_can_not_be_written(knotwork: Command, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    below = (tmp_path / "file" / "m.csv", tmp_path / "file" / "deep" / "m.csv")
    for path in (tmp_path, *below, Path("/dev/null")):
        err = knotwork("export", SCENARIO, "-f", "csv", "-o", path, "--force").refused()
        assert f"can't write to {path}: " in err
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    assert Path("/dev/null").is_char_device()


@pytest.mark.parametrize("command", ["check", "export"])
@pytest.mark.parametrize("suffix", [".json", ".csv", ".yaml"])
def test_pipes_are_no_files(knotwork: Command, tmp_path: Path, command: str, suffix: str) -> None:
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    if command == "check":
        ran = knotwork("check", pipe, "-s", SCENARIO)
    else:
        ran = knotwork("export", pipe, "-f", "ros2")
    assert ran.code == 2
    assert "is not a regular file" in ran.err or (command, suffix) == ("export", ".csv")
