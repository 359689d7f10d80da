"""Scenarios that must fail, each with the error it must give in comments at its top."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from command_line import Command
from knotwork import plan
from knotwork.errors import CheckFailedError, KnotworkError

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
    said = ran.err if ran.code == 2 else re.sub(r"\s+", " ", ran.out)
    assert wanted["says"], "the file says nothing of its error"
    for fragment in wanted["says"]:
        assert fragment in said
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
