"""Which solutions of poses were chosen, and why, as tables on a terminal."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.table import Table

from knotwork.cli.tables import plain_table
from knotwork.cli.terminal import cell

if TYPE_CHECKING:
    from knotwork.task_to_joint import Choice


def choice_table(choices: Sequence[Choice]) -> Table:
    """Which solutions of poses were taken, and why; waypoints where all is the same share a row."""
    columns = ["waypoints", "branch", "turns", "of", "why"]
    table = plain_table("Solutions chosen", columns, len(columns))
    for column in table.columns:
        column.no_wrap, column.overflow = False, "fold"
    for taken, group in itertools.groupby(choices, key=_taken):
        first, *others = (one.waypoint for one in group)
        span = f"{first} to {others[-1]}" if others else first
        table.add_row(*map(cell, (span, *taken)))
    return table


def _taken(choice: Choice) -> tuple[str, ...]:
    kind = "branch" if choice.branches == 1 else "branches"
    count = f"{choice.branches} {kind}, {choice.solutions} with turns"
    if choice.sampled:
        count = f"{choice.branches} samples of its self-motion"
    return choice.branch or "-", _turns(choice.turns), count, choice.reason


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"
