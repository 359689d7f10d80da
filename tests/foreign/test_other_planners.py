"""Motions of other planners, read by every command, with and without a scenario."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import knotwork as kw
from command_line import Command
from knotwork.errors import InputError
from knotwork.files.foreign import read_trajectory
from plans import planned
from sweeps import mostly_exhaustive
from texts import written

STEP = 0.02


@pytest.fixture(scope="module")
def motion() -> kw.JointTrajectory:
    return planned("panda_pick_place").trajectory


def arrays(motion: kw.JointTrajectory, names: tuple[str, ...], *, batch: bool) -> dict[str, Any]:
    time = np.arange(0.0, motion.end_time, STEP)
    rows = [motion(time, nu).tolist() for nu in range(len(names))]
    return dict(zip(names, ([row] if batch else row for row in rows), strict=True))


def moveit(motion: kw.JointTrajectory) -> dict[str, Any]:
    """`ros2 topic echo` of a DisplayTrajectory."""
    empty = {"header": {"frame_id": ""}, "joint_names": [], "points": []}
    robot = {
        "joint_trajectory": yaml.safe_load(motion.to_ros2()),
        "multi_dof_joint_trajectory": empty,
    }
    return {"model_id": "panda", "trajectory": [robot], "trajectory_start": {"is_diff": False}}


def write(folder: Path, kind: str, motion: kw.JointTrajectory) -> Path:
    names = list(motion.joint_names)
    if kind == "drake":
        drake = pytest.importorskip("pydrake.common.yaml")
        text = drake.yaml_dump_typed(motion.to_drake())
    elif kind == "moveit":
        text = yaml.safe_dump(moveit(motion)) + "---\n"
    elif kind == "curobo":  # the fields of its JointState
        fields = arrays(motion, ("position", "velocity", "acceleration", "jerk"), batch=True)
        text = json.dumps({**fields, "joint_names": names, "dt": [STEP], "knot": None})
    else:  # the fields of roboplan's JointTrajectory
        fields = arrays(motion, ("positions", "velocities", "accelerations"), batch=False)
        fields["times"] = np.arange(0.0, motion.end_time, STEP).tolist()
        if kind == "npz":
            np.savez(folder / "motion.npz", joint_names=np.array(names), **fields)
            return folder / "motion.npz"
        text = json.dumps({**fields, "joint_names": names})
    return written(folder / f"motion.{'yaml' if kind in ('drake', 'moveit') else 'json'}", text)


@pytest.mark.parametrize("kind", ["moveit", "drake", "curobo", "roboplan", "npz"])
def test_reads_motion_of_planners(tmp_path: Path, motion: kw.JointTrajectory, kind: str) -> None:
    file = write(tmp_path, kind, motion)
    found, faults = read_trajectory(file, motion.joint_names[::-1], motion.joint_units)
    if kind == "drake":  # it has no names
        found, faults = read_trajectory(file, motion.joint_names, motion.joint_units)
    assert not faults
    found = found.reordered(motion.joint_names, motion.joint_units)
    at = np.linspace(0.0, found.end_time, 301)
    assert np.abs(found(at) - motion(at)).max() < 1e-8
    assert np.abs(found(at, 1) - motion(at, 1)).max() < 1e-6


@pytest.mark.parametrize(
    ("suffix", "text", "words"),
    [
        ("npz", "nothing", "not an npz"),
        ("yaml", "breaks: [0, 1]\npolynomials: []", "has 0 segments"),
        ("yaml", "breaks: [0, 1]\npolynomials: [[[[1]]]]", "7 rows, one for each joint"),
        ("yaml", "breaks: [1, 0]\npolynomials: [[" + "[[1]], " * 7 + "]]", "must be later"),
        ("yaml", "breaks: [0, 1]\npolynomials: [[]]\njoint_names: [a]", "differs from that of"),
        (
            "json",
            '{"joint_names": NAMES, "position": [[0]], "dt": -1}',
            "dt: -1: must be greater than 0",
        ),
        ("json", '{"trajectory": [{}, {}]}', "has 2 trajectories"),
    ],
)
def test_what_is_none_of_their_motions_is_refused(
    tmp_path: Path, motion: kw.JointTrajectory, suffix: str, text: str, words: str
) -> None:
    file = tmp_path / f"motion.{suffix}"
    file.write_text(text.replace("NAMES", json.dumps(motion.joint_names)))
    with pytest.raises(InputError, match=words):
        read_trajectory(file, motion.joint_names, motion.joint_units)


CELL = """
robot: panda
units: {length: mm}
scene: {objects: {bench: {box: [600, 1000, 30], position: [500, 0, HEIGHT]}}}
"""


def test_needs_no_scenario(knotwork: Command, tmp_path: Path, motion: kw.JointTrajectory) -> None:
    file = write(tmp_path, "moveit", motion)
    cell = written(tmp_path / "cell.yaml", CELL.replace("HEIGHT", "34"))
    high = written(tmp_path / "high.yaml", CELL.replace("HEIGHT", "200"))
    accelerations = planned("panda_pick_place").trajectory.extrema("acceleration").peak
    for line, code, words in (
        (("--robot", "panda"), 0, "PASSED motion.yaml"),
        (("--scene", cell), 0, "Collisions"),
        (("--scene", high), 1, "bench"),
        (("--robot", "panda", "--limits", f"{{acceleration: {accelerations.max()}}}"), 0, "100 %"),
        (("--robot", "panda", "--limits", f"{{acceleration: {accelerations.max() - 0.1}}}"), 1, ""),
        (("--robot", "panda", "--limits", "fast"), 2, "limits are 'fast'"),
        (("--robot", "panda", "--limits", "{accel: 5}"), 2, "command line: limits.accel"),
        (("--robot", "ur5"), 2, "robot 'ur5' has no joint"),
        (("--limits", "{jerk: 1}"), 2, "give one of them, or leave out --limits"),
        (("--robot", "panda", "-s", "panda_pick_place"), 2, "leave out --scenario"),
        (("--scene", tmp_path / "none.yaml"), 2, "there is no file"),
        ((), 2, "--robot"),
    ):
        ran = knotwork("check", file, *line)
        assert ran.code == code, (line, ran)
        assert words in ran.out + ran.err
    # what is required of its ends, which are given, is not counted
    report = json.loads(knotwork("check", file, "--robot", "panda", "--json").out)
    assert {one["subject"] for one in report["findings"]} == {"joint", "motion", "pair", "tool"}
    for name in ("ur5_deburring", "paper_case"):
        kw.plan(name).save(tmp_path / name)
        assert knotwork("check", tmp_path / name, "--robot", "panda").code == 2


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


def file_of(name: str, run: Command) -> str:
    """A file of a kind, in the current folder."""
    if name == "planned":
        assert run("plan", SCENARIO, "-o", name).code == 0
    elif name == "other.txt":
        Path(name).write_text(OTHER_TOOL)
    else:
        assert run("export", SCENARIO, "-f", *EXPORTS[name], "-o", name).code == 0
    return name


@pytest.mark.usefixtures("without_plots")
@pytest.mark.parametrize("name", mostly_exhaustive([*EXPORTS, "planned", "other.txt"], "other.txt"))
def test_every_command_reads_every_kind_of_file(name: str, run: Command) -> None:
    source = file_of(name, run)
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
def test_files_of_other_tools_need_the_names_of_joints(name: str, run: Command) -> None:
    source = file_of(name, run)
    for command in (("plot", "-o", "a.png"), ("view", "--html", "a.html")):
        err = run(command[0], source, *command[1:]).refused()
        assert err.startswith(f"error: {source} needs its scenario: give --scenario")
    # The robot says as much as the scenario about the joints, but not what is required of them.
    ran = run("view", source, "--robot", "planar2", "--html", "a.html")
    assert (ran.code, ran.out) == (0, "wrote a.html\n"), ran.err
    assert Path("a.html").is_file()


def test_report_and_page_of_a_plan_find_its_scenario(run: Command) -> None:
    source = file_of("planned", run)
    ran = run("report", source, "--html", "a.html")
    assert (ran.code, ran.out) == (0, f"{SCENARIO}: passed; wrote a.html\n")
    ran = run("view", source, "--html", "b.html", "--beside", source)
    assert (ran.code, ran.out) == (0, "wrote b.html\n")
    Path("a.html").unlink()
    Path(source, "report.json").unlink()
    for line, words in (
        ((source,), "--scenario"),
        ((SCENARIO, "-s", SCENARIO), "leave out --scenario"),
        ((source, "-s", SCENARIO, "--planner", "cubic"), "leave out --planner"),
    ):
        assert words in run("report", *line, "--html", "a.html").refused()
    assert not Path("a.html").exists()
