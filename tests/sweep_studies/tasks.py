"""Small tasks to sweep over, and the processes that plan them."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import psutil

import knotwork as kw
from patience import PATIENCE

LIFT: dict[str, Any] = {
    "name": "lift",
    "limits": {"velocity": 1.2},
    "waypoints": [
        {"name": "down", "joints": {"lift": 0}},
        {"name": "up", "joints": {"lift": 1}, "after": 1},
    ],
}
"""A motion of one joint, which one second is too short for."""


def without_time(study: kw.Study) -> list[dict[str, Any]]:
    """The rows without the one column that differs between runs."""
    return [{**row, "plan_time": None} for row in study.rows()]


def planning(process: psutil.Process) -> list[psutil.Process]:
    """Processes below one that plan rows."""
    found = []
    for one in process.children(recursive=True):
        try:
            if any("LokyProcess" in part for part in one.cmdline()):
                found.append(one)
        except psutil.Error:  # it has ended meanwhile
            continue
    return found


def ended(process: psutil.Process) -> bool:
    """Whether a process has ended, even if nobody has waited for its exit code."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def all_end(processes: Iterable[psutil.Process]) -> bool:
    """Wait until processes have ended."""
    left, until = list(processes), time.monotonic() + PATIENCE
    while left and time.monotonic() < until:
        time.sleep(0.05)
        left = [one for one in left if not ended(one)]
    return not left
