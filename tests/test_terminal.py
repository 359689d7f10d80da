"""What is printed: safe text, few lines for long tasks, no traceback for a fault of our own."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import threading
from pathlib import Path
from typing import Any, NoReturn

import pytest

import knotwork as kw
from command_line import Command, python, shell, without_progress
from knotwork.cli.progress_display import plan_state
from knotwork.verification import CHECKS
from patience import PATIENCE
from sweeps import mostly_exhaustive
from texts import written

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


@pytest.mark.parametrize("name", mostly_exhaustive(NAMES, *[*NAMES][::2]))
def test_names_from_files_are_printed_as_text(name: str, tmp_path: Path, run: Command) -> None:
    path = written(tmp_path / "task.yaml", scenario(name))
    shown = NAMES[name]
    drawn = [("plot", path, "-o", "a.png"), ("view", path, "--html", "a.html")]
    for command in (
        ("plan", path, "--out", "made"),
        ("compare", path, "--planners", "cubic,quintic"),
        ("check", "made", "--scenario", path),
        *(drawn if "\x1b" in name or "[" in name else ()),
        ("export", path, "-f", "csv", "--allow-failed", "-o", f"{len(name)}.csv"),
    ):
        ran = run(*command)
        assert ran.code in (0, 1, 2), ran.err
        assert not CONTROL.search(ran.out + ran.err)
        if command[0] in ("plan", "compare"):
            assert shown in ran.out
    path.write_text(scenario(name).replace("after: 1", "after: -1"), encoding="utf-8")
    for command in (("plan", path), ("plan", path, "--json")):
        ran = run(*command)
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


def test_a_closed_output_is_reported(tmp_path: Path) -> None:
    ran = shell("plan paper_case --out made >&-", tmp_path)
    assert ran.returncode == 2
    assert ran.stderr == "error: can't write the output: standard output is closed\n"
    assert not list(tmp_path.iterdir())


def test_closed_messages_stop_nothing(tmp_path: Path) -> None:
    ran = shell("plan paper_case --out made 2>&-", tmp_path)
    assert ran.returncode == 0
    assert len(list((tmp_path / "made").iterdir())) == 3
    assert shell("plan no_such_case 2>&-", tmp_path).returncode == 2
    assert shell("plan paper_case >/dev/full 2>/dev/full", tmp_path).returncode == 2


@pytest.mark.parametrize("full", [[], ["--full"]])
def test_keys_that_another_planner_refuses_are_named(full: list[str], knotwork: Command) -> None:
    out = " ".join(knotwork("plan", "ur3_lid", "--planner", "cubic", *full).out.split())
    assert "without the scenario's end_acceleration, which cubic does not take" in out


FASTEST = "panda_pick_place_fastest"
WALL = "ur5_wall"


def test_quiet_plan_shows_progress(
    knotwork: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The check reports no progress; here it lasts until a line has been printed."""
    monkeypatch.setattr("knotwork.cli.progress_display.PLAN_INTERVAL", 0.001)
    lines: list[str] = []
    printed = threading.Event()

    def echo(line: str, err: bool) -> None:
        assert err
        lines.append(line)
        printed.set()

    monkeypatch.setattr("knotwork.cli.progress_display.echo", echo)
    monkeypatch.setitem(CHECKS, "lasts", lambda *_: (printed.wait(PATIENCE), ())[1])
    picture = tmp_path / "a.png"
    for command, *options in (("plan",), ("plot", "-o", picture), ("compare",)):
        printed.clear()
        lines.clear()
        assert knotwork(command, "paper_case", *options).code in (0, 1)
        assert lines
        assert all(re.match(r"paper_case[^\n:]*: \d+ s, planning$", line) for line in lines)
    lines.clear()
    printed.set()
    assert not knotwork("plan", "paper_case", "--json").err
    assert not lines


def test_progress_names_the_check_and_the_duration_found() -> None:
    states: list[Any] = []
    plan = kw.plan(WALL, progress=states.append)
    assert (states[-1].trying, states[-1].fraction) == ("check", 1.0)
    assert states[-1].duration == pytest.approx(plan.trajectory.duration)
    shares = [one.fraction for one in states]
    assert shares == sorted(shares)
    lines = [plan_state(one) for one in states]
    assert any(re.match(r"50 % done, a motion of [\d.]+ s, way 2 of 2", line) for _, line in lines)
    assert not [line for _, line in lines if line.startswith("0 %")]  # its share is not known
    states.clear()
    kw.plan(FASTEST, progress=states.append)
    assert any(re.search(r"step \d+", plan_state(one)[1]) for one in states)


COUNT = 140


@pytest.fixture
def task(tmp_path: Path) -> Path:
    waypoints = [
        {"name": f"w{i:03d}", "time": i, "joints": {"a": 0.01 * (i % 7)}, "stop": True}
        for i in range(COUNT)
    ]
    return written(tmp_path / "long.json", {"waypoints": waypoints})


def rows(text: str) -> list[str]:
    lines = (line.split() for line in text.splitlines())
    return [words[0] for words in lines if words and words[0][1:].isdigit()]


def test_long_report_is_short_unless_in_full(task: Path, knotwork: Command, tmp_path: Path) -> None:
    out = knotwork("plan", task, "--out", tmp_path / "out").done()
    assert len(out.splitlines()) <= 12
    full = knotwork("plan", task, "--full")
    assert rows(full.out)[:COUNT] == [f"w{i:03d}" for i in range(COUNT)]
    assert out.splitlines()[0].startswith(full.out.splitlines()[-1])  # the verdict
    checked = knotwork("check", tmp_path / "out", "--scenario", task)
    assert checked.out.splitlines()[0] == out.splitlines()[0]
    assert len(rows(knotwork("check", tmp_path / "out", "-s", task, "--full").out)) >= COUNT


@pytest.mark.usefixtures("without_plots")
def test_the_worst_of_many_failures_is_shown(task: Path, knotwork: Command, tmp_path: Path) -> None:
    plan = kw.plan(task)
    plan.save(tmp_path / "out")
    data = json.loads(task.read_text())
    for i, angle in ((121, 0.4), (123, 0.5), (125, 0.3)):
        data["waypoints"][i]["joints"]["a"] = angle
    task.write_text(json.dumps(data))
    text = " ".join(knotwork("check", tmp_path / "out", "--scenario", task).failed().split())
    assert "FAIL waypoint 'w123' at 123 s: error of the joint position " in text
    assert "(and 2 more like it)" in text
    # on a page each is a line of its own, which goes there, the worst first
    page = tmp_path / "page.html"
    assert knotwork("report", tmp_path / "out", "--scenario", task, "--html", page).code == 1
    listed = page.read_text().partition('<h2 id="fails">')[2].partition("</header>")[0]
    assert "more like it" not in listed
    assert re.findall(r'data-at="([\d.]+)"[^>]*>waypoint &#39;(w\d+)', listed) == [
        ("123.0", "w123"),
        ("121.0", "w121"),
        ("125.0", "w125"),
    ]


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (ZeroDivisionError("boom"), 3, "internal error: ZeroDivisionError: boom"),
        (MemoryError(), 2, "error: out of memory; use a lower rate or fewer scenarios"),
        (KeyboardInterrupt(), 128 + signal.SIGINT, "interrupted"),
        (
            ModuleNotFoundError(name="rich"),
            2,
            "error: the package 'rich' is missing; install it, or knotwork by pip",
        ),
    ],
)
def test_errors_end_a_command_without_a_traceback(
    error: BaseException, code: int, line: str, knotwork: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> NoReturn:
        raise error

    monkeypatch.setitem(CHECKS, "broken", broken)
    monkeypatch.delenv("KNOTWORK_TRACEBACK", raising=False)
    ran = knotwork("plan", "paper_case")
    first, *others = without_progress(ran.err).strip().splitlines()
    assert (ran.code, ran.out, first) == (code, "", line)
    assert len(others) == (code == 3)  # an internal error asks for a report


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize(
    "arguments", [("export", "paper_case", "-f", "csv", "--rate", "1000"), ("scenarios",)]
)
def test_a_full_disk_is_no_fault_of_our_own(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        streams = {"capture_output": False, "stdout": full, "stderr": subprocess.PIPE}
        ran = python("-m", "knotwork", *arguments, **streams)
    assert ran.returncode == 2
    assert ran.stderr == "error: can't write the output: No space left on device\n"
