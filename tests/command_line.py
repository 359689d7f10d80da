"""What a run of the command line gives, for the tests that run it."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from patience import PATIENCE


@dataclass(frozen=True)
class Ran:
    """What a command left behind."""

    code: int
    out: str
    err: str


Command = Callable[..., Ran]


def python(*arguments: Any, **options: Any) -> subprocess.CompletedProcess[str]:
    """A Python in a process of its own."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        **{"capture_output": True, "text": True, "timeout": PATIENCE, "check": False, **options},
    )


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
