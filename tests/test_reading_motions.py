"""What `check` reads, `plot`, `view` and `report` read: ours and other tools', by every command."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import Command
from sweeps import mostly_exhaustive

SCENARIO = "planar2_closed_form"
EXPORTS = {
    "ros2.yaml": ("ros2",),
    "goal.yml": ("ros2", "--goal"),
    "samples.csv": ("csv", "--rate", "10"),
    "knots.csv": ("csv", "--knots-only"),
    "drive.csv": ("pvt", "--degrees", "--incremental"),
    "samples.json": ("json", "--rate", "10"),
    "knots.json": ("json", "--knots-only"),
}
OTHER_TOOL = """\
# written by another tool
time;elbow [deg];shoulder [deg]
0;30;0
1;45;10
"""


@pytest.fixture
def run(knotwork: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    return knotwork


def written(name: str, run: Command) -> str:
    """A file of a kind, in the current folder."""
    if name == "planned":
        assert run("plan", SCENARIO, "-o", name).code == 0
    elif name == "other.txt":
        Path(name).write_text(OTHER_TOOL)
    else:
        assert run("export", SCENARIO, "-f", *EXPORTS[name], "-o", name).code == 0
    return name


@pytest.mark.parametrize(
    "name", mostly_exhaustive([*EXPORTS, "planned", "other.txt"], "ros2.yaml", "other.txt")
)
def test_every_command_reads_every_kind_of_file(name: str, run: Command) -> None:
    source = written(name, run)
    checked = run("check", source, "-s", SCENARIO)
    failed = name == "other.txt"
    assert checked.code == failed
    plotted = run("plot", source, "-s", SCENARIO, "--joints", "elbow", "-o", "a.png")
    assert (plotted.code, plotted.out) == (0, "wrote a.png\n"), plotted.err
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    viewed = run("view", source, "-s", SCENARIO, "--html", "view.html")
    assert (viewed.code, viewed.out) == (0, "wrote view.html\n"), viewed.err
    reported = run("report", source, "-s", SCENARIO, "--html", "report.html")
    assert reported.code == failed, reported.err
    word = "FAILED" if failed else "passed"
    assert reported.out == f"{SCENARIO}: {word}; wrote report.html\n"
    page = Path("report.html").read_text(encoding="utf-8")
    assert ("What fails</h2>" in page) == failed
    for ran in (plotted, viewed):
        assert ("the check FAILS" in ran.err) == failed


@pytest.mark.parametrize("name", ["ros2.yaml", "samples.csv", "samples.json"])
def test_other_tools_files_need_to_be_told_their_joints(name: str, run: Command) -> None:
    source = written(name, run)
    for command in (("plot", "-o", "a.png"), ("view", "--html", "a.html")):
        ran = run(command[0], source, *command[1:])
        assert ran.code == 2
        needs = f"error: {source} needs its scenario: give --scenario"
        assert ran.err.startswith(needs)
    # The robot says as much as the scenario about the joints, but not what is asked of them.
    ran = run("view", source, "--robot", "planar2", "--html", "a.html")
    assert (ran.code, ran.out) == (0, "wrote a.html\n"), ran.err
    assert Path("a.html").is_file()


def test_a_report_of_a_trajectory_needs_its_scenario(run: Command) -> None:
    source = written("planned", run)
    ran = run("report", source, "--html", "a.html")
    assert ran.code == 2
    assert "--scenario" in ran.err
    ran = run("report", SCENARIO, "-s", SCENARIO, "--html", "a.html")
    assert ran.code == 2
    assert "leave out --scenario" in ran.err
    ran = run("report", source, "-s", SCENARIO, "--planner", "cubic", "--html", "a.html")
    assert ran.code == 2
    assert "leave out --planner" in ran.err
    assert not Path("a.html").exists()


@pytest.mark.parametrize("command", ["check", "plot"])
def test_a_file_of_another_kind_is_told_which_are_read(command: str, run: Command) -> None:
    Path("arm.urdf").write_text("<robot name='a'/>", encoding="utf-8")
    ran = run(command, "arm.urdf", "-s", SCENARIO)
    assert ran.code == 2
    assert "arm.urdf: not a trajectory" in ran.err
    assert ".json, .csv, .tsv, .txt, .yaml, .yml" in ran.err
    assert "valid JSON" not in ran.err
