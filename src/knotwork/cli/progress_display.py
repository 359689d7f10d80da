"""Progress of long tasks, on standard error: a bar on a terminal, else lines of a log."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from knotwork.cli.terminal import echo
from knotwork.errors.plain_text import to_one_line

if TYPE_CHECKING:
    from rich.console import Console

    from knotwork.planning.sweeps import SweepProgress
    from knotwork.planning.timing import Progress

SHOWN_AFTER = 0.5
"""Time after which progress is shown on a terminal [s]."""
BAR_PERIOD = 0.1
"""Interval between updates of a bar [s]."""
PLAN_INTERVAL, SWEEP_INTERVAL, LOG_SHARE = 5.0, 30.0, 0.1
"""Interval between lines of a log: a time [s], or a fraction of the elapsed time if longer."""

State: TypeAlias = tuple[float | None, str]
"""The completed fraction, `None` if unknown, and a line on the state."""


@contextmanager
def show_planning(name: str, quiet: bool = False) -> Iterator[Callable[[Progress], None] | None]:
    """Show that a scenario is being planned, and its progress as far as it is reported."""
    begin = time.monotonic()

    def describe(update: Progress | None) -> State:
        share, text = (None, "planning") if update is None else plan_state(update)
        return share, f"{name}: {time.monotonic() - begin:.0f} s, {text}"

    with _show(describe, quiet, PLAN_INTERVAL) as report:
        yield report


@contextmanager
def show_sweep(quiet: bool) -> Iterator[Callable[[SweepProgress], None] | None]:
    """Show rows, rate, time left and how many pass."""
    with _show(_sweep_state, quiet, SWEEP_INTERVAL) as report:
        yield report


def plan_state(update: Progress) -> State:
    """Progress of choosing times, or of the search for a collision-free motion."""
    share = update.fraction if 0.0 < update.fraction < 1.0 else None  # unknown within a part
    words = [] if share is None else [f"{100 * share:.0f} % done"]
    if update.trying:
        time_found = update.duration
        motion = "no motion yet" if time_found is None else f"a motion of {time_found:.2f} s"
        words += [motion, update.trying]
    else:
        words += ["choosing times", f"step {update.iterations}"]
    return share, ", ".join(words)


def _sweep_state(update: SweepProgress | None) -> State:
    if update is None:
        return None, "planning"
    remaining = "" if update.left is None else f", {timedelta(seconds=round(update.left))} left"
    passed = 100.0 * update.passed / update.done if update.done else 0.0
    return update.done / max(update.total, 1), (
        f"{update.done} of {update.total} rows, {update.rate:.3g} a second{remaining}, "
        f"{update.passed} pass ({passed:.0f} %)"
    )


@contextmanager
def _show(
    describe: Callable[[Any], State], quiet: bool, interval: float
) -> Iterator[Callable[[Any], None] | None]:
    """Show the state of a task during the block, which may report updates."""
    if quiet or sys.stderr is None:
        yield None
        return
    updates: list[Any] = [None]
    ended, console = threading.Event(), _terminal()
    draw = partial(_draw, console=console) if console else partial(_log, interval=interval)
    show = threading.Thread(target=draw, args=(lambda: describe(updates[0]), ended), daemon=True)
    show.start()
    try:
        yield lambda update: updates.__setitem__(0, update)
    finally:
        ended.set()
        show.join()


def _draw(state: Callable[[], State], ended: threading.Event, console: Console) -> None:
    """Draw a bar and one line, cleared at the end; the bar pulses if the fraction is unknown."""
    from rich.progress import BarColumn, Progress, TextColumn
    from rich.table import Column

    if SHOWN_AFTER and ended.wait(SHOWN_AFTER):
        return
    cut = Column(no_wrap=True, overflow="ellipsis")
    line = TextColumn("{task.description}", markup=False, table_column=cut)
    bar = BarColumn(bar_width=12, table_column=Column(min_width=12))
    with Progress(bar, line, console=console, transient=True) as progress:
        progress.add_task("", total=None)
        task, is_running = progress.tasks[0], True
        while is_running:
            is_running = not ended.wait(BAR_PERIOD)
            share, text = state()
            task.total, task.completed = (None, 0.0) if share is None else (1.0, share)
            task.description = to_one_line(text)
            progress.refresh()


def _log(state: Callable[[], State], ended: threading.Event, interval: float) -> None:
    begin, pause = time.monotonic(), interval
    while not ended.wait(pause):
        echo(state()[1], err=True)
        pause = max(interval, LOG_SHARE * (time.monotonic() - begin))


def _terminal() -> Console | None:
    """The terminal of standard error, if its lines can be overwritten."""
    if not sys.stderr.isatty():
        return None
    from rich.console import Console

    console = Console(stderr=True)
    return None if console.is_dumb_terminal else console
