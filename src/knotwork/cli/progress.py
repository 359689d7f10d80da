"""Progress of a long solve, on standard error of a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

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
    status: Status | None = None
    with ExitStack() as shown:

        def show(progress: Progress) -> None:
            nonlocal status
            if progress.seconds < SHOWN_AFTER:
                return
            if status is None:
                from rich.console import Console

                made = Console(stderr=True).status("", spinner="line")
                status = shown.enter_context(made)
            status.update(
                f"{name}: choosing times, {progress.seconds:.0f} s, step {progress.iterations}, "
                f"{100 * progress.done:.0f} % of the waypoints done, "
                f"limits off by {progress.violation:.1e}"
            )

        yield show
