"""A fault of our own is no traceback on the user's screen, and no verdict either."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from knotwork import pipeline
from knotwork.cli import main as command_line


def broken(*_: object, **__: object) -> None:
    raise ZeroDivisionError("boom")


def test_a_fault_of_our_own_is_said_in_a_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "plan", broken)
    monkeypatch.setattr(sys, "argv", ["knotwork", "plan", "paper_case"])
    monkeypatch.delenv("KNOTWORK_TRACEBACK", raising=False)
    with pytest.raises(SystemExit) as stop:
        command_line.main()
    assert stop.value.code == 3
    said = capsys.readouterr().err
    assert "ZeroDivisionError: boom" in said
    assert "Traceback" not in said


def test_the_traceback_is_shown_when_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "plan", broken)
    monkeypatch.setattr(sys, "argv", ["knotwork", "plan", "paper_case"])
    monkeypatch.setenv("KNOTWORK_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        command_line.main()


def out_of_memory(*_: object, **__: object) -> None:
    raise MemoryError


def test_too_little_memory_is_no_fault_of_our_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pipeline, "plan", out_of_memory)
    monkeypatch.setattr(sys, "argv", ["knotwork", "plan", "paper_case"])
    with pytest.raises(SystemExit) as stop:
        command_line.main()
    assert stop.value.code == 2
    assert "error: out of memory; use a lower rate or fewer scenarios" in capsys.readouterr().err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize(
    "arguments", [("export", "paper_case", "-f", "csv", "--rate", "1000"), ("scenarios",)]
)
def test_a_full_disk_is_no_fault_of_our_own(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        ran = subprocess.run(
            [sys.executable, "-m", "knotwork", *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert ran.returncode == 2
    assert ran.stderr == "error: can't write the output: No space left on device\n"
