"""What a run of the command line gives, for the tests that run it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Ran:
    """What a command left behind."""

    code: int
    out: str
    err: str


Command = Callable[..., Ran]


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
