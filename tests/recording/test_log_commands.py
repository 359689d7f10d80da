"""`knotwork check`, `plot`, `view` and `report` with the log of a robot."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from robot_logs import record, write

from command_line import Command
from knotwork import Plan


@pytest.fixture
def log(tmp_path: Path, deburring: Plan) -> Path:
    return write(tmp_path / "log.csv", record(deburring.trajectory, rate=100.0, noise=1e-4))


@pytest.fixture
def result(tmp_path: Path, deburring: Plan) -> Path:
    deburring.save(tmp_path / "result")
    return tmp_path / "result"


def test_checks_log_against_planned_clock(knotwork: Command, log: Path) -> None:
    out = knotwork("check", log, "--log", "--scenario", "ur5_deburring").done()
    assert "PASSED ur5_deburring" in out
    words = " ".join(out.split())
    assert re.search(
        r"\w+_joint up to [\d.e-]+ deg off at [\d.]+ s; "
        r"tool up to [\d.e-]+ mm off at [\d.]+ s; time shift 0\.5 s",
        words,
    )
    ran = knotwork("check", log, "--log", "--scenario", "ur5_deburring", "--full")
    assert "after the log's first sample" in ran.out
    assert "estimated from the samples" in ran.out
    assert not re.search(r"\d (rad|m)\b", ran.out), "the scenario is in mm and degrees"


def test_without_option_log_file_is_checked_exactly(knotwork: Command, log: Path) -> None:
    ran = knotwork("check", log, "--scenario", "ur5_deburring")
    assert ran.code != 0
    assert "recording of a robot, which has noise, use --log" in ran.err


def test_log_against_plan_needs_no_scenario(
    knotwork: Command, log: Path, result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    out = knotwork("check", log, "--against", result).done()
    assert "PASSED ur5_deburring" in out  # which the plan was made for
    assert re.search(r"_joint up to \S+ deg off.*tool up to \S+ mm off", " ".join(out.split()))
    # a plan that does not say what it was made for is compared alone
    (result / "report.json").unlink()
    out = knotwork("check", log, "--against", result).done()
    assert re.search(r"_joint up to \S+ rad off", " ".join(out.split()))
    assert "tool up to" not in out
    assert "PASSED log.csv" in out


def test_json_has_all_findings_of_log(knotwork: Command, log: Path, result: Path) -> None:
    line = ("check", log, "--against", result, "-s", "ur5_deburring", "--json")
    found = {one["quantity"]: one for one in json.loads(knotwork(*line).done())["findings"]}
    assert found["time_shift"]["value"] == pytest.approx(0.5, abs=1e-3)
    assert 0.0 < found["tool_deviation"]["value"] < 1e-3
    assert found["noise"]["value"] == pytest.approx(1e-4, rel=0.2)
    stated = json.loads(knotwork(*line, "--noise", "3e-4").out)
    noise = [one for one in stated["findings"] if one["quantity"] == "noise"]
    assert all(one["value"] == 3e-4 and "as given" in one["message"] for one in noise)


def test_topic_and_unit(knotwork: Command, tmp_path: Path, deburring: Plan, result: Path) -> None:
    samples = record(deburring.trajectory, rate=50.0, noise=1e-4)
    samples.position[:] *= 57.29577951308232
    file = write(tmp_path / "log.csv", samples, 4, topic="/arm/state")
    assert "the unit of the log" in knotwork("check", file, "--against", result).refused()
    line = ("check", file, "--against", result, "--log-unit", "deg")
    assert knotwork(*line, "--topic", "/arm/state").code == 0
    assert "'/other'" in knotwork(*line, "--topic", "/other").refused()


def test_plots_log_and_plan(knotwork: Command, log: Path, result: Path, tmp_path: Path) -> None:
    file = tmp_path / "joints.svg"
    few = ("--joints", "elbow_joint", "--quantities", "position")
    assert knotwork("plot", log, "--against", result, *few, "-o", file).code == 0
    assert "log.csv" in file.read_text()


@pytest.mark.usefixtures("without_plots")
def test_report_shows_findings(knotwork: Command, log: Path, result: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    ran = knotwork("report", log, "--against", result, "--html", page)  # of the plan's scenario
    assert ran.code == 0, ran.err
    tightest = page.read_text().partition('<section id="tightest">')[2].partition("</section>")[0]
    for row in ("tool deviation", "clearance", "smallest singular value"):
        assert row in tightest


def test_unplannable_scenario_says_why(knotwork: Command, log: Path) -> None:
    scenario = Path(__file__).parents[1] / "failing" / "unreachable_far.yaml"
    assert "out of reach" in knotwork("check", log, "--log", "-s", scenario).refused()
