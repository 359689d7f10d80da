"""Progress of a long solve, on standard error of a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from knotwork.timing import Progress

SHOWN_AFTER = 0.5
"""Solves that are over sooner say nothing [s]."""


@contextmanager
def shown_progress(name: str, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """Show how far a solve has come, in one line that is cleared in the end.

    Args:
        name: What is solved.
        quiet: Show nothing.
    """
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True)
    with console.status("", spinner="line") as status:
        status.stop()

        def show(progress: Progress) -> None:
            if progress.seconds < SHOWN_AFTER:
                return
            status.start()
            status.update(
                f"{name}: choosing times, {progress.seconds:.0f} s, step {progress.iterations}, "
                f"{100 * progress.done:.0f} % of the waypoints done, "
                f"limits off by {progress.violation:.1e}"
            )

        yield show
