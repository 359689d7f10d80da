"""What is refused, in tables: tasks, with their line, and command lines; scenarios that must fail.

Each file of the folder `refused` has a task and cases. A case is what the error says (`says`, or
patterns, `like`) of the task with other values (`with`, by place); `~` takes a value away.
"""

from __future__ import annotations

import copy
import importlib
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

import knotwork as kw
from cases import cases
from command_line import Command
from knotwork import plan
from knotwork.errors import CheckFailedError, KnotworkError
from shipped import ROBOT_FILES
from texts import written

TABLES = {
    path.stem: cases(path, ROBOT_FILES=ROBOT_FILES)
    for path in sorted((Path(__file__).parent / "refused").glob("*.yaml"))
}
COMMANDS = cases(Path(__file__).with_name("refused_commands.yaml"))
CASES = [(name, i) for name, table in TABLES.items() for i in range(len(table["cases"]))]


def put(task: Any, place: str, value: Any) -> None:
    """Change a value of a task, `a.b[2].c`, or take it away."""
    *parents, last = (
        int(index) if index else key
        for key, index in re.findall(r"([^.\[\]]+)(?!\])|\[(\d+)\]", place)
    )
    for key in parents:
        task = task[key]
    if value == "~":
        del task[last]
    elif isinstance(task, list) and last == len(task):
        task.append(copy.deepcopy(value))
    else:
        task[last] = copy.deepcopy(value)


def write(folder: Path, name: str, change: dict[str, Any]) -> Path:
    table = TABLES[name]
    for file, text in table.get("files", {}).items():
        written(folder / file, text)
    task = copy.deepcopy(table["task"])
    for place, value in change.items():
        put(task, place, value)
    return written(folder / "task.yaml", task)


@pytest.mark.parametrize("name", TABLES)
def test_the_task_that_is_changed_is_right(name: str, tmp_path: Path) -> None:
    kw.load_scenario(write(tmp_path, name, {}))


@pytest.mark.parametrize(("name", "index"), CASES)
def test_refuses_with_line(name: str, index: int, knotwork: Command, tmp_path: Path) -> None:
    case = TABLES[name]["cases"][index]
    output = knotwork("plan", write(tmp_path, name, case["with"])).refused()
    assert re.search(r"task\.yaml: line \d+: ", output), output
    wanted = case.get("says", [])
    for words in [wanted] if isinstance(wanted, str) else wanted:
        assert words in output
    assert re.search(case.get("like", ""), output), output


@pytest.mark.parametrize("line", COMMANDS["refused"])
def test_a_wrong_command_writes_nothing_but_why(line: str, run: Command, tmp_path: Path) -> None:
    for name, text in COMMANDS["files"].items():
        written(tmp_path / name, text)
    assert COMMANDS["refused"][line] in run(*shlex.split(line)).refused()
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == set(COMMANDS["files"])
    assert (tmp_path / "there.yaml").read_text(encoding="utf-8") == "mine"


FILES = sorted((Path(__file__).parent / "failing").glob("*.yaml"))


def expected(path: Path) -> dict[str, list[str]]:
    """The comments `# key: value` of a file, by key."""
    found: dict[str, list[str]] = {"exit": [], "error": [], "says": []}
    for key, value in re.findall(r"^# (exit|error|says): (.+)$", path.read_text(), re.MULTILINE):
        found[key].append(value)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_command_line_says_what_is_wrong(path: Path, knotwork: Command, tmp_path: Path) -> None:
    wanted = expected(path)
    out = tmp_path / "out"
    ran = knotwork("plan", path, "--out", out)
    assert [str(ran.code)] == wanted["exit"], ran.out + ran.err
    output = ran.err if ran.code == 2 else re.sub(r"\s+", " ", ran.out)
    assert wanted["says"], "the file says nothing of its error"
    for fragment in wanted["says"]:
        assert fragment in output
    assert "Traceback" not in ran.out + ran.err
    if ran.code == 2:
        assert ran.err.startswith("error: ")
        assert not ran.out
        assert not out.exists()
    else:
        assert "FAILED" in ran.out
        # A motion that breaks a limit is written for whoever wants to see it, and says so.
        assert '"ok": false' in (out / "report.json").read_text()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_python_raises_what_the_file_says(path: Path) -> None:
    wanted = expected(path)
    kind = getattr(importlib.import_module("knotwork.errors"), wanted["error"][0])
    with pytest.raises(KnotworkError) as caught:
        plan(path).report.raise_if_failed()
    assert type(caught.value) is kind
    assert isinstance(caught.value, CheckFailedError) == (wanted["exit"] == ["1"])
    for fragment in wanted["says"]:
        assert fragment in str(caught.value)
