"""A fault of our own is no traceback on the user's screen, and no verdict either."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

from command_line import Command, python
from knotwork.verification import CHECKS


@pytest.fixture
def fault(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Make a check of one's own that ends with an exception."""

    def check(error: BaseException) -> None:
        def broken(*_: object) -> NoReturn:
            raise error

        monkeypatch.setitem(CHECKS, "broken", broken)

    return check


def test_a_fault_of_our_own_is_said_in_a_line(
    monkeypatch: pytest.MonkeyPatch, knotwork: Command, fault: Callable[[BaseException], None]
) -> None:
    fault(ZeroDivisionError("boom"))
    monkeypatch.delenv("KNOTWORK_TRACEBACK", raising=False)
    ran = knotwork("plan", "paper_case")
    assert ran.code == 3
    assert "ZeroDivisionError: boom" in ran.err
    assert "Traceback" not in ran.err


def test_too_little_memory_is_no_fault_of_our_own(
    knotwork: Command, fault: Callable[[BaseException], None]
) -> None:
    fault(MemoryError())
    ran = knotwork("plan", "paper_case")
    assert ran.code == 2
    assert "error: out of memory; use a lower rate or fewer scenarios" in ran.err


def test_an_interrupt_is_said_and_no_traceback(
    knotwork: Command, fault: Callable[[BaseException], None]
) -> None:
    fault(KeyboardInterrupt())
    ran = knotwork("plan", "paper_case")
    assert ran.code == 128 + signal.SIGINT
    assert ran.err.strip() == "interrupted"
    assert not ran.out


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
