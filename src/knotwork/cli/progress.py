"""Progress of what takes long, on standard error: a line of a terminal, or lines of a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, TypeAlias

from knotwork.cli.terminal import echo

if TYPE_CHECKING:
    from knotwork.sweeps import SweepProgress
    from knotwork.timing import Progress

SHOWN_AFTER = 0.5
"""What is shorter shows nothing [s]."""
PLAN_INTERVAL, SWEEP_INTERVAL = 5.0, 30.0
"""Between lines of progress where there is no terminal [s]."""

# Told a line, and the part that is done, from 0 to 1, or `None` where it is not known
_Tell: TypeAlias = Callable[[str, "float | None"], None]


@contextmanager
def shown_progress(name: str, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Show how far a solve has come: in a line that is cleared in the end, or in a log.

    Args:
        name: Of the scenario.
        quiet: Show nothing.
    """
    with _shown(quiet, PLAN_INTERVAL) as tell:
        yield tell and (lambda at: tell(f"{name}: {plan_line(at)}", at.done or None))


def plan_line(at: Progress) -> str:
    """How far the choice of times, or the search for a way, has come, in a line."""
    if at.trying:
        exists = "no motion yet" if at.duration is None else f"a motion of {at.duration:.2f} s"
        words = [exists, at.trying, f"{at.seconds:.0f} s"]
    else:
        words = ["choosing times", f"{at.seconds:.0f} s", f"step {at.iterations}"]
        words.append(f"limits off by {at.violation:.1e}")
    if at.done:  # of parts that are solved by themselves; within one nobody knows
        words.insert(2, f"{100 * at.done:.0f} % of the waypoints done")
    return ", ".join(words)


@contextmanager
def shown_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass, as `shown_progress` shows a solve."""
    with _shown(quiet, SWEEP_INTERVAL) as tell:
        yield tell and (lambda at: tell(progress_line(at), at.done / max(at.total, 1)))


def progress_line(at: SweepProgress) -> str:
    """Progress of a sweep in a line."""
    left = "" if at.left is None else f", {timedelta(seconds=round(at.left))} left"
    share = 100.0 * at.passed / at.done if at.done else 0.0
    return (
        f"{at.done} of {at.total} rows, {at.rate:.3g} a second{left}, "
        f"{at.passed} pass ({share:.0f} %)"
    )


@contextmanager
def _shown(quiet: bool, interval: float) -> Iterator[_Tell | None]:
    if quiet or sys.stderr is None:
        yield None
    elif not sys.stderr.isatty():
        yield _log(interval)
    else:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn
        from rich.table import Column

        words = TextColumn(
            "{task.description}",
            markup=False,
            table_column=Column(no_wrap=True, overflow="ellipsis"),
        )
        share = BarColumn(bar_width=12, table_column=Column(min_width=12))
        bar = Progress(share, words, console=Console(stderr=True), transient=True)
        task = bar.add_task("", total=None)
        begun = time.monotonic()

        def tell(line: str, done: float | None) -> None:
            total = None if done is None else 1.0
            bar.update(task, total=total, completed=done or 0.0, description=line)
            if time.monotonic() - begun >= SHOWN_AFTER:
                bar.start()

        try:
            yield tell
        finally:
            bar.stop()


def _log(interval: float) -> _Tell:
    """A line at most each interval [s]."""
    last = time.monotonic()

    def tell(line: str, done: float | None) -> None:
        nonlocal last
        if time.monotonic() - last >= interval:
            last = time.monotonic()
            echo(line, err=True)

    return tell
