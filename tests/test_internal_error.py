"""A fault of our own is no traceback on the user's screen, and no verdict either."""

from __future__ import annotations

import sys

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
