"""Progress of a sweep, on standard error: a line that changes, or lines of a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from knotwork.cli.terminal import echo

if TYPE_CHECKING:
    from knotwork.sweeps import SweepProgress

LOG_INTERVAL = 30.0
"""Between lines of progress where there is no terminal [s]."""


@contextmanager
def shown_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass: in one line, which is cleared in the end.

    Where no terminal is, as in a log, a line is added every half minute.
    """
    if quiet or sys.stderr is None:
        yield None
        return
    if not sys.stderr.isatty():
        yield _Lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    line = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with line:
        task = line.add_task("planning some rows, to learn how long they take", total=None)

        def show(at: SweepProgress) -> None:
            line.update(task, description=progress_line(at), total=at.total, completed=at.done)

        yield show


class _Lines:
    """Progress as lines of a log."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, at: SweepProgress) -> None:
        if time.monotonic() - self._last >= LOG_INTERVAL:
            self._last = time.monotonic()
            echo(progress_line(at), err=True)


def progress_line(at: SweepProgress) -> str:
    """Say how far a sweep has come."""
    left = "" if at.left is None else f", {_duration(at.left)} left"
    share = 100.0 * at.passed / at.done if at.done else 0.0
    return (
        f"{at.done} of {at.total} rows, {at.rate:.3g} a second{left}, "
        f"{at.passed} pass ({share:.0f} %)"
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
