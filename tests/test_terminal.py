"""What is printed: text from files changes nothing of the terminal, and closed streams are said."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from command_line import Command

CLI = Path(__file__).resolve().parents[1] / "src" / "knotwork" / "cli"
# Names, and how they are shown.
NAMES = {
    "[/]": "[/]",
    "[bold]x[/bold]": "[bold]x[/bold]",
    "\x1b[2J\x1b[8mhidden": r"\x1b[2J\x1b[8mhidden",
    "a\nPASSED": r"a\nPASSED",
    "\u202eabc": r"\u202eabc",
    "\x9b31m": r"\x9b31m",
    "\\": "\\",
    ":smile:": ":smile:",
    "c é": "c é",
}
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e]")


def scenario(name: str) -> str:
    quoted = "".join(f"\\u{ord(one):04x}" for one in name)
    return f"""name: "{quoted}"
description: "{quoted}"
waypoints:
  - {{name: "{quoted}", joints: {{"{quoted}": 0}}}}
  - {{joints: {{"{quoted}": 1}}, after: 1}}
limits: {{velocity: 0.5}}
"""


@pytest.mark.parametrize("name", NAMES)
def test_names_from_files_are_printed_as_text(
    name: str, tmp_path: Path, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(scenario(name), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    shown = NAMES[name]
    for command in (
        ("plan", path),
        ("plan", path, "--out", "made"),
        ("compare", path, "--planners", "cubic,quintic"),
        ("check", "made", "--scenario", path),
        ("plot", path, "-o", "a.png"),
        ("view", path, "--html", "a.html"),
        ("export", path, "-f", "csv", "--allow-failed", "-o", f"{len(name)}.csv"),
    ):
        ran = knotwork(*command)
        assert ran.code in (0, 1, 2), ran.err
        assert not CONTROL.search(ran.out + ran.err)
        if command[0] in ("plan", "compare"):
            assert shown in ran.out
    path.write_text(scenario(name).replace("after: 1", "after: -1"), encoding="utf-8")
    for command in (("plan", path), ("plan", path, "--json")):
        ran = knotwork(*command)
        assert ran.code == 2
        assert not CONTROL.search(ran.out + ran.err)


def test_only_one_module_prints() -> None:
    """So that nothing from a file gets past it."""
    for path in CLI.glob("*.py"):
        if path.name != "terminal.py":
            text = path.read_text(encoding="utf-8")
            assert "click.echo(" not in text, path
            assert "rich.markup" not in text, path
            assert not re.search(r"(?<!\.)\bprint\(", text), path


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    line = f"{sys.executable} -m knotwork {command}"
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, cwd=folder, check=False
    )


def test_a_closed_output_is_said(tmp_path: Path) -> None:
    ran = shell("plan paper_case --out made >&-", tmp_path)
    assert ran.returncode == 2
    assert ran.stderr == "error: can't write the output: standard output is closed\n"
    assert not list(tmp_path.iterdir())


def test_closed_messages_stop_nothing(tmp_path: Path) -> None:
    ran = shell("plan paper_case --out made 2>&-", tmp_path)
    assert ran.returncode == 0
    assert len(list((tmp_path / "made").iterdir())) == 3
    assert shell("plan no_such_case 2>&-", tmp_path).returncode == 2
    assert shell("plan paper_case >&- 2>&-", tmp_path).returncode == 2
    assert shell("plan no_such_case 2>/dev/full", tmp_path).returncode == 2
    assert shell("plan --no-such-option 2>/dev/full", tmp_path).returncode == 2
    assert shell("plan paper_case >/dev/full 2>/dev/full", tmp_path).returncode == 2


@pytest.mark.parametrize(
    "arguments",
    [
        ("plan", "paper_case", "--out", ""),
        ("compare", "paper_case", "--out", ""),
        ("plot", "paper_case", "-o", ""),
        ("view", "ur5_deburring", "--html", ""),
        ("report", "paper_case", "--html", ""),
        ("plan", "paper_case", "--package-path", ""),
        ("check", "", "--scenario", "paper_case"),
    ],
)
def test_an_empty_path_is_refused(
    arguments: tuple[str, ...],
    tmp_path: Path,
    knotwork: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = knotwork(*arguments)
    assert ran.code == 2
    assert "an empty path is not accepted" in ran.err
    assert not list(tmp_path.iterdir())


def test_texts_are_wrapped_between_words_and_numbers_stay_whole(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    out = knotwork("plan", "ur5_deburring", "--planner", "cubic", "--full").out
    assert "\nTool at the waypoints\n" in out
    assert "-23.62   -183.3   159.7   1.500    ok    exact" in out
    texts = [line for line in out.splitlines() if line.startswith(("FAIL ", "robot", "   not"))]
    assert len(texts) > 10
    assert max(map(len, texts)) <= 40
    panda = knotwork("robots", "panda").out.split()
    assert "429700" in panda  # in deg/s³, not 4.297e+05


@pytest.mark.parametrize("full", [[], ["--full"]])
def test_what_another_planner_does_not_take_is_told(full: list[str], knotwork: Command) -> None:
    out = " ".join(knotwork("plan", "ur3_lid", "--planner", "cubic", *full).out.split())
    assert "without the scenario's end_acceleration, which cubic does not take" in out


def test_errors_are_wrapped_on_a_terminal_alone(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    whole = knotwork("robots", "nosuch").err
    assert whole.count("\n") == 1
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    wrapped = knotwork("robots", "nosuch").err
    assert max(map(len, wrapped.splitlines())) <= 60
    assert wrapped.split() == whole.split()


def test_a_task_without_a_description_has_its_name(knotwork: Command, tmp_path: Path) -> None:
    path = tmp_path / "lift.yaml"
    path.write_text("{waypoints: [{joints: {a: 0}}, {joints: {a: 1}, after: 1}]}")
    assert knotwork("plan", path, "--full").out.splitlines()[0] == "lift"


FASTEST = "panda_pick_place_fastest"
WALL = "ur5_wall"


@pytest.mark.parametrize("task", [FASTEST, WALL])
def test_a_log_of_a_plan_has_lines_of_progress(
    task: str, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("knotwork.cli.progress.PLAN_INTERVAL", 0.02)
    ran = knotwork("plan", task)
    lines = ran.err.splitlines()
    assert len(lines) > 3
    assert all(re.match(rf"{task}: \d+ s, ", line) for line in lines)
    assert not [line for line in lines if " 0 %" in line]  # of one part nobody knows the share
    said = r"step \d+" if task == FASTEST else r"50 % done, a motion of [\d.]+ s, way 2 of 2"
    assert re.search(said, ran.err)


def test_a_plan_that_tells_nothing_is_not_silent(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Inverse kinematics and check say nothing of how far they are; the time is known."""
    monkeypatch.setattr("knotwork.cli.progress.PLAN_INTERVAL", 0.02)
    picture = tmp_path / "a.png"
    for command, *options in (("plan",), ("plot", "-o", picture), ("compare",)):
        err = knotwork(command, "ur3_lid", *options).err
        assert re.match(r"ur3_lid[^\n:]*: \d+ s, planning\n", err)
    assert not knotwork("plan", "ur3_lid", "--json").err


def test_the_check_is_told_with_the_motion_that_there_is() -> None:
    told: list[Any] = []
    made = kw.plan(WALL, progress=told.append)
    assert (told[-1].trying, told[-1].done) == ("check", 1.0)
    assert told[-1].duration == pytest.approx(made.trajectory.duration)
    shares = [one.done for one in told]
    assert shares == sorted(shares)
    assert 0.5 in shares  # the second of two ways is tried


def test_progress_on_a_narrow_terminal_keeps_to_a_line(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("knotwork.cli.progress.SHOWN_AFTER", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "50")
    monkeypatch.setenv("TERM", "xterm")
    shown = knotwork("plan", FASTEST).err
    plain = re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", shown)
    lines = [line for line in re.split(r"[\r\n]", plain) if line]
    assert max(map(len, lines)) <= 50
    assert any(FASTEST in line and line.endswith("…") for line in lines)  # what is cut says so
