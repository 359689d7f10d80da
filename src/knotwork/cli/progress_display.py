"""Progress of long tasks, on standard error: a bar on a terminal, else lines of a log."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING, TypeAlias

from knotwork.cli.terminal import echo
from knotwork.errors.plain_text import one_line

if TYPE_CHECKING:
    from rich.console import Console

    from knotwork.planning.timing import Progress
    from knotwork.sweeps import SweepProgress

SHOWN_AFTER = 0.5
"""Nothing is shown on a terminal before this time [s]."""
PERIOD = 0.1
"""Interval between updates of a bar [s]."""
PLAN_INTERVAL, SWEEP_INTERVAL, SHARE = 5.0, 30.0, 0.1
"""Interval between lines without a terminal: a time [s], or a share of the elapsed time."""

State: TypeAlias = tuple[float | None, str]
"""The completed share, `None` if unknown, and a line on the state."""


@contextmanager
def shown_progress(name: str, quiet: bool = False) -> Iterator[Callable[[Progress], None] | None]:
    """Show the progress of planning, with or without reports from it.

    Args:
        name: Name of the scenario.
        quiet: Show nothing.
    """
    begun, updates = time.monotonic(), list["Progress"]()

    def state() -> State:
        share, known = plan_state(updates[-1]) if updates else (None, "planning")
        return share, f"{name}: {time.monotonic() - begun:.0f} s, {known}"

    with _shown(state, quiet, PLAN_INTERVAL):
        yield None if quiet else lambda at: updates.__setitem__(slice(None), [at])


def plan_state(at: Progress) -> State:
    """Progress of choosing times, or of the search for a collision-free motion."""
    share = at.done if 0.0 < at.done < 1.0 else None  # unknown within a part
    words = [] if share is None else [f"{100 * share:.0f} % done"]
    if at.trying:
        exists = "no motion yet" if at.duration is None else f"a motion of {at.duration:.2f} s"
        words += [exists, at.trying]
    else:
        words += ["choosing times", f"step {at.iterations}"]
    return share, ", ".join(words)


@contextmanager
def shown_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass."""
    updates = list["SweepProgress"]()

    def state() -> State:
        if not updates:
            return None, "planning"
        return updates[-1].done / max(updates[-1].total, 1), progress_line(updates[-1])

    with _shown(state, quiet, SWEEP_INTERVAL):
        yield None if quiet else lambda at: updates.__setitem__(slice(None), [at])


@contextmanager
def _shown(state: Callable[[], State], quiet: bool, interval: float) -> Iterator[None]:
    """Show a state during the block, which need not report it."""
    if quiet or sys.stderr is None:
        yield
        return
    ended = threading.Event()
    console = _terminal()
    if console is None:
        show = threading.Thread(target=_log, args=(state, ended, interval), daemon=True)
    else:
        show = threading.Thread(target=_draw, args=(state, ended, console), daemon=True)
    show.start()
    try:
        yield
    finally:
        ended.set()
        show.join()


def _draw(state: Callable[[], State], ended: threading.Event, console: Console) -> None:
    """A bar and one line, cleared at the end; without a known share the bar is indeterminate."""
    from rich.progress import BarColumn, Progress, TextColumn
    from rich.table import Column

    if SHOWN_AFTER and ended.wait(SHOWN_AFTER):
        return
    column = Column(no_wrap=True, overflow="ellipsis")
    line = TextColumn("{task.description}", markup=False, table_column=column)
    share_of = BarColumn(bar_width=12, table_column=Column(min_width=12))
    bar = Progress(share_of, line, console=console, transient=True)
    bar.add_task("", total=None)
    (task,) = bar.tasks

    def tell() -> None:
        share, text = state()
        task.total, task.completed = (None, 0.0) if share is None else (1.0, share)
        task.description = one_line(text)

    tell()
    with bar:
        while not ended.wait(PERIOD):
            tell()
        tell()
        bar.refresh()


def _log(state: Callable[[], State], ended: threading.Event, interval: float) -> None:
    begun, rest = time.monotonic(), interval
    while not ended.wait(rest):
        echo(state()[1], err=True)
        rest = max(interval, SHARE * (time.monotonic() - begun))


def _terminal() -> Console | None:
    """The terminal of standard error, if its lines can be overwritten."""
    if not sys.stderr.isatty():
        return None
    from rich.console import Console

    console = Console(stderr=True)
    return None if console.is_dumb_terminal else console


def progress_line(at: SweepProgress) -> str:
    """Progress of a sweep as a line."""
    left = "" if at.left is None else f", {timedelta(seconds=round(at.left))} left"
    share = 100.0 * at.passed / at.done if at.done else 0.0
    return (
        f"{at.done} of {at.total} rows, {at.rate:.3g} a second{left}, "
        f"{at.passed} pass ({share:.0f} %)"
    )
