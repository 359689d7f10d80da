"""Which solutions of poses were chosen, and why, as tables on a terminal."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rich.table import Table

from knotwork.cli.tables import plain_table
from knotwork.cli.terminal import cell

if TYPE_CHECKING:
    from knotwork.task_to_joint import Choice


def choice_table(choices: Sequence[Choice]) -> Table:
    """Which solutions of poses were taken, and why; waypoints where all is the same share a row."""
    columns = ["waypoints", "branch", "turns", "of", "why"]
    return _shared_rows(
        "Solutions chosen", columns, ((one.waypoint, _taken(one)) for one in choices)
    )


def alternative_table(choices: Sequence[Choice]) -> Table:
    """The next best sequence and its cost; waypoints where both are the same share a row."""
    title = "Best sequence with another solution there"
    columns = ["waypoints", "next best", "against the one chosen"]
    cells = ((one.waypoint, _alternative(one)) for one in choices)
    return _shared_rows(title, columns, cells)


def _shared_rows(
    title: str, columns: Sequence[str], cells: Iterable[tuple[str, tuple[str, ...] | None]]
) -> Table:
    """A table of text; neighbours with the same cells share a row, and without cells have none."""
    table = plain_table(title, columns, len(columns))
    for column in table.columns:
        column.no_wrap, column.overflow = False, "fold"
    for found, group in itertools.groupby(cells, key=lambda one: one[1]):
        if found is not None:
            names = [name for name, _ in group]
            span = names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"
            table.add_row(*map(cell, (span, *found)))
    return table


def _taken(choice: Choice) -> tuple[str, ...]:
    kind = "branch" if choice.branches == 1 else "branches"
    count = f"{choice.branches} {kind}, {choice.solutions} with turns"
    if choice.sampled:
        count = f"{choice.branches} samples of its self-motion"
    return choice.branch or "-", _turns(choice.turns), count, choice.reason


def _turns(turns: Sequence[tuple[str, int]]) -> str:
    return ", ".join(f"{joint} {turn:+d}" for joint, turn in turns) or "-"


def _alternative(choice: Choice) -> tuple[str, str] | None:
    """The next best branch, or the turns where it is the same one, and what is against it."""
    other = choice.alternative
    if other is None:
        return None
    way = other.branch
    if other.branch == choice.branch:
        way = f"turns {_turns(other.turns)}" if other.turns != choice.turns else "another"
    return way, other.hindrance or f"{other.extra:.3g} s more"
