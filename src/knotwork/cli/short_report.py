"""Short reports, without the library that draws tables."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

from knotwork.cli.parameters import typed_arguments
from knotwork.cli.terminal import echo, echo_line

if TYPE_CHECKING:
    from knotwork.planning import Plan
    from knotwork.verification import Report

TEXT_WIDTH = 100
"""Width of lines of text, on wider terminals too."""

_LINE_WORDS: dict[str, tuple[str, dict[str, Any]]] = {
    "passed": ("PASSED", {"fg": "green", "bold": True}),
    "failed": ("FAILED", {"fg": "red", "bold": True}),
    "failure": ("FAIL ", {"fg": "red", "bold": True}),
    "sampled": ("not proved:", {"fg": "yellow"}),
    "warning": ("warning:", {"fg": "yellow"}),
}
"""Coloured word of a line, by its kind."""


def print_short_plan(plan: Plan) -> None:
    """Print the verdict on a plan and the tightest cases."""
    print_short(plan.report)
    if plan.left_out:
        echo(f"planned {describe_left_out(plan)}")


def describe_left_out(plan: Plan) -> str:
    """Name the options of the scenario that its replaced planner ignores."""
    options = ", ".join(plan.left_out)
    return f"without the scenario's {options}, which {plan.trajectory.planner} does not take"


def print_short(report: Report) -> None:
    """Print a report in some 15 lines."""
    for line in report.brief(min(_width(), TEXT_WIDTH)):
        word, style = _LINE_WORDS.get(line.kind, ("", {}))
        echo_line(line.text, word, **style)


def print_next(*, with_robot: bool, with_scenario: bool = True) -> None:
    """Print the commands that show the checked motion.

    Args:
        with_robot: Whether there is an arm to show.
        with_scenario: Whether the motion has a task, which a page needs.
    """
    arguments = typed_arguments()
    first = f"next: knotwork {'view' if with_robot and with_scenario else 'plot'} {arguments}"
    page = " | report {} --html FILE" if with_scenario else ""
    pages = (page.format(arguments), page.format("…"), "")
    forms = [f"{first}{page} | --full" for page in pages]
    width = _width()
    echo(next((form for form in forms if len(form) <= width), first))


def _width() -> int:
    return shutil.get_terminal_size().columns
