"""The command line: what it prints where, what it writes, and its exit codes."""

from __future__ import annotations

import json
import os
import re
import shlex
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import knotwork as kw
from command_line import Command, python, shell, without_progress
from plans import planned
from shipped import SCENARIO_FILES
from sweeps import mostly_exhaustive

ROOT = Path(__file__).parents[1]
BROKEN = ROOT / "tests" / "failing" / "jerk_limit_broken.yaml"
WRONG = ROOT / "tests" / "failing" / "unknown_key.yaml"


# plan


@pytest.mark.parametrize(
    "name",
    mostly_exhaustive(
        SCENARIO_FILES, "paper_case", "ur5_deburring", "panda_pick_place", "ur10_weld"
    ),
)
def test_a_plan_is_reported_in_few_lines_of_80_characters(name: str, knotwork: Command) -> None:
    first, *others = knotwork("plan", name).done().splitlines()
    assert re.fullmatch(rf"PASSED {name}: (\d+) of \1 requirements met; [\d.]+ s", first)
    assert 2 <= len(others) <= 17  # with the command and a prompt, all on a screen of 24 lines
    assert max(map(len, [first, *others])) <= 80
    shown = "plot" if name.startswith("paper_case") else "view"  # without a robot
    assert others[-1].startswith(f"next: knotwork {shown} {name} | report ")


def test_failures_are_second_and_name_a_remedy(knotwork: Command) -> None:
    file = ROOT / "tests" / "failing" / "velocity_limit_broken.yaml"
    lines = knotwork("plan", file).failed().splitlines()
    assert lines[0].startswith("FAILED velocity_limit_broken: 56 of 57 requirements met, 1 failed")
    text = " ".join(line.strip() for line in lines[1:5])
    assert text.startswith("FAIL joint 'shoulder_pan_joint': velocity reaches 5.23599 rad/s")
    assert "limit 3.15 rad/s (166 %)" in text
    assert (
        "the excess is largest between waypoint 1 and waypoint 2; 1.67 times the duration" in text
    )
    assert max(map(len, lines)) <= 80
    (plan,) = json.loads(knotwork("plan", file, "--json").out)["plans"]
    (failure,) = plan["report"]["failures"]
    assert failure.endswith("1.67 times the duration keeps this limit")


SWING = "waypoints: [{joints: {a: 0}}, {joints: {a: 1}, after: 2}]\n"


def test_next_command_shows_judged_motion(run: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    Path("a task.yaml").write_text(SWING)
    given = "'a task.yaml' --planner quintic --budget 10s"
    ran = run("plan", *shlex.split(given), "-o", "made")
    # there is no arm to view
    assert ran.out.splitlines()[-1] == (
        f"next: knotwork plot {given} | report {given} --html FILE | --full"
    )
    ran = run("check", "./made", "-s", "a task.yaml")
    assert ran.out.splitlines()[-1].startswith("next: knotwork plot ./made -s 'a task.yaml' | rep")


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_the_same_motion_in_so_much_more_time_keeps_the_limit(quantity: str) -> None:
    def task(factor: float, limit: float = 1e6) -> dict[str, Any]:
        rows = [(0.0, 0.0), (1.0, 1.0), (1.2, 0.0)]
        return {
            "limits": {quantity: limit},
            "waypoints": [
                {"joints": {"a": q}, "velocity": {"a": v / factor}, "time": i * factor}
                for i, (q, v) in enumerate(rows)
            ],
        }

    limit = 0.8 * kw.plan(task(1.0)).trajectory.extrema(quantity).peak[0]
    (failure,) = kw.plan(task(1.0, limit)).report.failures
    factor = float(re.match(r"([\d.]+) times the duration keeps", failure.remedy)[1])  # type: ignore[index]
    assert not kw.plan(task(0.98 * factor, limit)).report.ok
    assert kw.plan(task(factor, limit)).report.ok


def test_values_are_in_the_units_of_the_scenario() -> None:
    def text(units: dict[str, str], scale: float) -> str:
        task = {
            "units": units,
            "limits": {"velocity": 0.5 * scale, "acceleration": 40 * scale},
            "waypoints": [{"joints": {"a": 0}}, {"joints": {"a": scale}, "after": 2.5}],
        }
        return str(kw.plan(task).report)

    assert "velocity 0.6 rad/s" not in text({}, 1.0)
    assert "reaches 0.6 rad/s at 1.25 s, limit 0.5 rad/s (120 %)" in " ".join(text({}, 1.0).split())
    degrees = " ".join(text({"angle": "deg"}, 180 / np.pi).split())
    assert "reaches 34.3775 deg/s at 1.25 s, limit 28.6479 deg/s (120 %)" in degrees


def test_plan_prints_all_as_tables_and_a_verdict(knotwork: Command) -> None:
    ran = knotwork("plan", "ur5_deburring", "--full")
    assert ran.code == 0
    assert not ran.err
    lines = ran.out.splitlines()
    assert lines[0].startswith("ur5_deburring")
    assert re.fullmatch(r"PASSED ur5_deburring: (\d+) of \1 requirements met", lines[-1])
    words = ("edge start to edge end", "path deviation", "elbow_joint", "none", "off by")
    for word in (*words, "acceleration jump"):
        assert word in ran.out
    assert max(map(len, lines)) <= 80
    assert "\x1b" not in ran.out
    assert "e+" not in ran.out


def test_plan_writes_three_files_and_says_where(knotwork: Command, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    out = knotwork("plan", "paper_case", "--out", folder, "--rate", "50").done()
    names = {"trajectory.json", "samples.csv", "report.json"}
    assert {path.name for path in folder.iterdir()} == names
    for name in names:
        assert f"wrote {folder / name}" in out
    assert len((folder / "samples.csv").read_text().splitlines()) == 1 + 25 * 50 + 1


def test_json_is_alone_on_standard_output(knotwork: Command, tmp_path: Path) -> None:
    ran = knotwork("plan", "ur5_deburring", "--json", "--out", tmp_path)
    assert ran.code == 0
    assert not ran.err
    data = json.loads(ran.out)
    assert data["ok"] is True
    (plan,) = data["plans"]
    assert plan["scenario"] == "ur5_deburring"
    report = json.loads((tmp_path / "report.json").read_text())
    assert set(report.pop("files")) == {"samples.csv", "trajectory.json"}
    assert report.pop("scenario_file") == "ur5_deburring"
    assert plan["report"] == report
    assert plan["trajectory"] == json.loads((tmp_path / "trajectory.json").read_text())
    assert sorted(plan["files"]) == sorted(str(path) for path in tmp_path.iterdir())


def test_json_of_several_says_what_became_of_each(knotwork: Command) -> None:
    ran = knotwork("plan", "paper_case", BROKEN, WRONG, "nowhere", "--json")
    assert ran.code == 2
    data = json.loads(ran.out)
    assert data["ok"] is False
    assert [plan["ok"] for plan in data["plans"]] == [True, False, False, False]
    assert data["plans"][2]["error"]["type"] == "DocumentError"
    assert "did you mean 'velocity'" in data["plans"][2]["error"]["message"]
    assert data["plans"][3]["error"]["type"] == "UnknownNameError"


# check


def test_check_prints_the_verdict_again(knotwork: Command, tmp_path: Path) -> None:
    planned("paper_case").save(tmp_path)
    out = knotwork("check", tmp_path, "-s", "paper_case").done()
    assert out.splitlines()[0].startswith("PASSED paper_case")
    ran = knotwork("check", tmp_path / "trajectory.json", "-s", "paper_case", "--json")
    report = json.loads((tmp_path / "report.json").read_text())
    del report["files"], report["scenario_file"]
    assert json.loads(ran.out) == report


# robots, scenarios, schema


def test_robots_lists_all_and_shows_one(knotwork: Command) -> None:
    out = knotwork("robots").done()
    for name in kw.robot_names():
        assert name in out
    out = knotwork("robots", "ur5").done()
    for word in ("shoulder_pan_joint", "tool0", "home", "base_link", "180.5", "2292", "-90"):
        assert word in out
    data = json.loads(knotwork("robots", "ur5", "--json").out)
    assert data["limits"]["velocity_limit"]["elbow_joint"] == pytest.approx(3.15)
    assert data["limits"]["jerk_limit"]["elbow_joint"] == 2000.0
    assert list(data["joints"]) == list(kw.load_robot("ur5").joint_names)
    listing = json.loads(knotwork("robots", "--json").out)
    assert [robot["name"] for robot in listing] == kw.robot_names()
    urdf = ROOT / "tests/failing/arms/two_joints.urdf"
    assert "slide" in knotwork("robots", urdf).done()


def test_scenarios_lists_all(knotwork: Command) -> None:
    out = knotwork("scenarios").done()
    for name in SCENARIO_FILES:
        assert name in out
    assert "paper_case  no robot, 4 waypoints, 25 s\n" in out
    assert "paper_case_fastest  no robot, 4 waypoints, times to be chosen\n" in out
    rows = {row["name"]: row for row in json.loads(knotwork("scenarios", "--json").out)}
    assert rows["paper_case"]["duration"] == 25.0
    assert rows["paper_case_fastest"]["duration"] is None


@pytest.fixture(scope="module")
def validator() -> Any:
    ran = python("-m", "knotwork", "schema")
    assert ran.returncode == 0
    schema = json.loads(ran.stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", SCENARIO_FILES)
def test_the_schema_accepts_the_shipped_scenarios(name: str, validator: Any) -> None:
    task = kw.load_scenario(name).task.to_dict()
    errors = [error.message for error in validator.iter_errors(task)]
    assert errors == []


@pytest.mark.parametrize(
    "change",
    [
        {"waypoints": []},
        {"rat": 3},
        {"rate": "fast"},
        {"units": {"length": "cm"}},
        {"waypoints": [{"joints": {"a": 1}, "tme": 0}]},
        {"knots": "even"},
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(change: dict[str, Any], validator: Any) -> None:
    task = {"waypoints": [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 1}]}
    assert validator.is_valid(task)
    assert not validator.is_valid({**task, **change})


# Help and usage


def test_version(knotwork: Command) -> None:
    for option in ("--version", "-V"):
        ran = knotwork(option)
        assert (ran.code, ran.out.strip()) == (0, f"knotwork {kw.__version__}")


# In processes of their own


def test_it_works_from_any_folder_and_with_any_output_encoding(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C", "COLUMNS": "40"}
    command = ("-m", "knotwork", "plan", "ur5_deburring", "--out", "out")
    ran = python(*command, cwd=tmp_path, env=environment)
    assert ran.returncode == 0, ran.stderr
    assert "PASSED" in ran.stdout
    assert not without_progress(ran.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_reader_that_stops_reading_is_no_error(tmp_path: Path) -> None:
    ran = shell("plan ur5_deburring | head -1", tmp_path)
    assert ran.stdout.startswith("PASSED ur5_deburring")
    assert not without_progress(ran.stderr)
