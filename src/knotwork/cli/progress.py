"""Progress on standard error: one line of a terminal, or lines of a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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
    """Show how far a solve has come.

    Args:
        name: Of the scenario.
        quiet: Show nothing.
    """
    with _line(quiet) as write:

        def show(at: Progress) -> None:
            if write is not None and at.seconds >= SHOWN_AFTER:
                write(
                    f"{name}: choosing times, {at.seconds:.0f} s, step {at.iterations}, "
                    f"{100 * at.done:.0f} % of the waypoints done, limits off by {at.violation:.1e}"
                )

        yield show if write is not None else None


@contextmanager
def shown_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass.

    Where no terminal is, as in a log, a line is added every half minute.
    """
    last = time.monotonic()

    def log(text: str) -> None:
        nonlocal last
        if time.monotonic() - last >= LOG_INTERVAL:
            last = time.monotonic()
            echo(text, err=True)

    with _line(quiet) as write:
        if quiet or sys.stderr is None:
            yield None
            return
        if write is not None:
            write("planning some rows, to learn how long they take")
        yield lambda at: (write or log)(progress_line(at))


@contextmanager
def _line(quiet: bool) -> Iterator[Callable[[str], None] | None]:
    """A line of a terminal to write text into, cleared in the end; `None` where there is none."""
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    status = Console(stderr=True).status("", spinner="line")

    def write(text: str) -> None:
        status.update(text)
        status.start()

    try:
        yield write
    finally:
        status.stop()


def progress_line(at: SweepProgress) -> str:
    """Progress of a sweep in a line."""
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
