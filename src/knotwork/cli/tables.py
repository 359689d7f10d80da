"""Tables, entries and a line that says what to do next, on a terminal."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from knotwork.cli.terminal import cell, echo

# Numbers are never cut short: a table takes the width it needs, and a terminal wraps what is more.
ANY_WIDTH = 1000
WIDEST = 100
"""Of lines of text, on wider terminals too."""


def console(*, wrap: bool = False) -> Console:
    """Console on standard output, that wraps text at the terminal's width or not at all."""
    width = ANY_WIDTH
    if wrap:
        width = shutil.get_terminal_size().columns
    return Console(width=width, highlight=False, emoji=False)


def plain_table(title: str, columns: Sequence[str], left: int = 1) -> Table:
    """Make a table whose first columns are text and all others numbers."""
    table = Table(
        title=cell(title),
        title_justify="left",
        title_style="bold",
        header_style="dim",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, column in enumerate(columns):
        table.add_column(
            cell(column, lines=True), justify="left" if i < left else "right", no_wrap=True
        )
    return table


def print_rows(title: str, rows: Sequence[Mapping[str, Any]], columns: Mapping[str, str]) -> None:
    """Print plain data, a line for each row; the last column is text that can be wrapped.

    Args:
        title: Title of the table.
        rows: Values by key.
        columns: The key of each column, by its heading.
    """
    table = plain_table(title, list(columns), len(columns))
    table.columns[-1].no_wrap = False
    for column, key in zip(table.columns, columns.values(), strict=True):
        if any(isinstance(row[key], int | float) for row in rows):
            column.justify = "right"
    for row in rows:
        table.add_row(*(cell(_plain_text(row[key])) for key in columns.values()))
    console(wrap=True).print(table)


def print_entry(name: str, about: str, rows: Mapping[str, str]) -> None:
    """Print a name and texts about it, which are wrapped; empty ones are left out."""
    out = console(wrap=True)
    out.print(f"[bold]{cell(name)}[/]  {cell(about)}", soft_wrap=True)
    indent = max(map(len, rows)) + 4
    for key, text in rows.items():
        print_wrapped(" ".join(text.split()), f"  {key}".ljust(indent), " " * indent)


def print_wrapped(text: str, first: str, others: str) -> None:
    """Print a text wrapped at the terminal's width, after what begins its first and other lines."""
    out = console(wrap=True)
    width = min(out.width, WIDEST) - len(others)
    for i, line in enumerate(textwrap.wrap(text, width, break_long_words=False)):
        out.print(cell((others if i else first) + line), soft_wrap=True)


def _plain_text(value: Any) -> str:
    """A value of plain data in a cell; of a mapping how many there are."""
    if isinstance(value, float):
        return f"{value:g}"
    return str(len(value) if isinstance(value, Mapping) else value or "-").strip()


def print_summary(rows: Sequence[tuple[str, str]]) -> None:
    """Print one line a scenario."""
    table = plain_table("Scenarios", ["scenario", "verdict"], 2)
    for name, word in rows:
        colour = "green" if word == "passed" else "bold red"
        table.add_row(cell(name), f"[{colour}]{word}[/]")
    console(wrap=True).print(table)


def print_next(given: str) -> None:
    """Print what can be done next.

    Args:
        given: What the command was given, as it was typed.
    """
    forms = (
        f"next: knotwork view {given} | report {given} --html FILE | --full",
        f"next: knotwork view {given} | report … --html FILE | --full",
        "next: knotwork view … | report … --html FILE | --full",
    )
    width = console(wrap=True).width
    echo(next((said for said in forms if len(said) <= width), forms[-1]))
