"""Errors of plans in child processes."""

from __future__ import annotations

from knotwork.errors.base import KnotworkError


class PlanningTimeoutError(KnotworkError):
    """A plan in a child process that took longer than its time limit.

    Attributes:
        time_limit: The time limit [s].
    """

    time_limit: float = 0.0


class PlanningCrashError(KnotworkError):
    """A child process that ended while it planned, or an internal error in it.

    Attributes:
        exit_code: Exit code or signal of the process, for example `"SIGSEGV(-11)"`; else empty.
    """

    exit_code: str = ""
