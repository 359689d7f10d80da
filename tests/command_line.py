"""What a run of the command line gives, for the tests that run it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from patience import PATIENCE


@dataclass(frozen=True)
class Ran:
    """What a command left behind."""

    code: int
    out: str
    err: str

    def done(self) -> str:
        """What it printed, having succeeded."""
        assert self.code == 0, self.out + self.err
        return self.out

    def failed(self) -> str:
        """What it printed, a check having failed."""
        assert self.code == 1, self.out + self.err
        return self.out

    def refused(self) -> str:
        """Its error, on one line, of what is given; nothing else was printed."""
        assert (self.code, self.out) == (2, ""), self.out + self.err
        assert not re.search("Traceback|internal error:", self.err)
        return " ".join(self.err.split())


Command = Callable[..., Ran]


def process(*command: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """A program that is run until its end, its output as text."""
    given = {"capture_output": True, "text": True, "timeout": PATIENCE, "check": False}
    return subprocess.run([str(part) for part in command], **{**given, **options})


def python(*arguments: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """A Python in a process of its own."""
    return process(sys.executable, *arguments, **options)


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run `knotwork` and what follows it in a shell, which fails if a part of a pipe does."""
    command = f"{sys.executable} -m knotwork {line}"
    return process("bash", "-o", "pipefail", "-c", command, cwd=folder)


def without_progress(err: str) -> str:
    """Standard error but for lines of progress, which slow machines see."""
    return re.sub(r"^\S+: \d+ s, .*\n", "", err, flags=re.MULTILINE)


PEAK_MEMORY = (
    "def used():\n"
    "    lines = open('/proc/self/status').read().splitlines()\n"
    "    return next(int(line.split()[1]) for line in lines if line.startswith('VmHWM'))\n"
)
"""Code for a process of its own: `used()` is the most memory it has had [kB].

`getrusage` begins with what the process that started it has, so that it may miss all.
"""
