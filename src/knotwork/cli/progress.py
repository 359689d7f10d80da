"""Progress of what takes long, on standard error: a line of a terminal, or lines of a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING

from knotwork.cli.terminal import echo

if TYPE_CHECKING:
    from knotwork.sweeps import SweepProgress
    from knotwork.timing import Progress

SHOWN_AFTER = 0.5
"""Shorter solves show nothing [s]."""
LOG_INTERVAL = 30.0
"""Between lines of progress where there is no terminal [s]."""


@contextmanager
def shown_progress(name: str, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Show how far a solve has come, in a line of a terminal that is cleared in the end.

    Args:
        name: Of the scenario.
        quiet: Show nothing.
    """
    if quiet or not _on_terminal():
        yield None
        return
    from rich.console import Console

    status = Console(stderr=True).status("", spinner="line")

    def show(at: Progress) -> None:
        if at.seconds >= SHOWN_AFTER:
            status.update(f"{name}: {_choosing(at)}")
            status.start()

    try:
        yield show
    finally:
        status.stop()


def _choosing(at: Progress) -> str:
    """How far the choice of times has come, in a line."""
    done = f"{100 * at.done:.0f} % of the waypoints done"
    if not at.trying:
        return (
            f"choosing times, {at.seconds:.0f} s, step {at.iterations}, {done}, limits off by "
            f"{at.violation:.1e}"
        )
    exists = "no motion yet" if at.duration is None else f"a motion of {at.duration:.2f} s exists"
    return f"{exists}; {at.trying}, {at.seconds:.0f} s, {done}"


@contextmanager
def shown_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass, with a bar that is cleared in the end.

    Where no terminal is, as in a log, a line is added every half minute.
    """
    if quiet or sys.stderr is None:
        yield None
    elif _on_terminal():
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        columns = BarColumn(bar_width=12), TextColumn("{task.description}", markup=False)
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("planning", total=None)
            yield lambda at: bar.update(
                task, total=at.total, completed=at.done, description=progress_line(at)
            )
    else:
        last = time.monotonic()

        def log(at: SweepProgress) -> None:
            nonlocal last
            if time.monotonic() - last >= LOG_INTERVAL:
                last = time.monotonic()
                echo(progress_line(at), err=True)

        yield log


def _on_terminal() -> bool:
    return sys.stderr is not None and sys.stderr.isatty()


def progress_line(at: SweepProgress) -> str:
    """Progress of a sweep in a line."""
    left = "" if at.left is None else f", {timedelta(seconds=round(at.left))} left"
    share = 100.0 * at.passed / at.done if at.done else 0.0
    return (
        f"{at.done} of {at.total} rows, {at.rate:.3g} a second{left}, "
        f"{at.passed} pass ({share:.0f} %)"
    )
