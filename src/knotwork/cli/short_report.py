"""Short reports, without the library that draws tables."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from knotwork.cli.terminal import echo, echo_line

if TYPE_CHECKING:
    from knotwork.planning import Plan
    from knotwork.verification import Report

TEXT_WIDTH = 100
"""Maximum width of lines of text, in characters."""

_WORD_STYLES: dict[str, dict[str, Any]] = {
    "PASSED": {"fg": "green", "bold": True},
    "FAILED": {"fg": "red", "bold": True},
    "FAIL ": {"fg": "red", "bold": True},
    "not proved:": {"fg": "yellow"},
    "warning:": {"fg": "yellow"},
}
"""Styles of the words at the start of a line."""


def describe_left_out(plan: Plan) -> str:
    """Text on the options of the scenario that the planner in place of its own ignores."""
    options = ", ".join(plan.unsupported_options)
    return f"without the scenario's {options}, which {plan.trajectory.origin} does not take"


def print_short(report: Report) -> None:
    """Print a report in some 15 lines."""
    for line in report.brief(min(_width(), TEXT_WIDTH)):
        word = next((word for word in _WORD_STYLES if line.startswith(word)), "")
        echo_line(line, word, **_WORD_STYLES.get(word, {}))


def print_next(words: Sequence[str], *, with_robot: bool) -> None:
    """Print the commands that show a motion.

    Args:
        words: Arguments of these commands that select the motion.
        with_robot: Whether there is an arm to show.
    """
    arguments = shlex.join(words)
    line = f"next: knotwork {'view' if with_robot else 'plot'} {arguments}"
    lines = [f"{line} | report {text} --html FILE | --full" for text in (arguments, "…")]
    echo(next((full for full in lines if len(full) <= _width()), line))


def _width() -> int:
    return shutil.get_terminal_size().columns
