"""Tables and entries on a terminal."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Mapping, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from knotwork.cli.short_report import TEXT_WIDTH
from knotwork.cli.terminal import cell

ANY_WIDTH = 1000
"""Width of tables before they are fitted to the terminal, in characters.

A table that does not fit is wider than the terminal, because numbers are never truncated.
"""


def console(*, wrap: bool = False) -> Console:
    """Console on standard output, with or without wrapping at the terminal's width."""
    width = ANY_WIDTH
    if wrap:
        width = shutil.get_terminal_size().columns
    return Console(width=width, highlight=False, emoji=False)


def print_table(table: Table) -> None:
    """Print a table at the terminal's width, or wider if its numbers and names need it."""
    title, table.title = table.title, None
    out = console(wrap=True)
    out.print(f"[bold]{title}[/]", soft_wrap=True)
    wide = console()
    for column in table.columns:
        if column.no_wrap:
            texts = (column.header, *column.cells)
            column.min_width = max(wide.measure(text).maximum for text in texts)
    out.width = max(out.width, wide.measure(table).minimum)
    out.print(table)


def plain_table(title: str, columns: Sequence[str], text_columns: int = 1) -> Table:
    """Make a table with text in the first columns and numbers in the others."""
    table = Table(
        title=cell(title),
        header_style="dim",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, column in enumerate(columns):
        table.add_column(
            cell(column, lines=True), justify="left" if i < text_columns else "right", no_wrap=True
        )
    return table


def print_entry(name: str, about: str, rows: Mapping[str, str]) -> None:
    """Print a name and its texts by key, wrapped; empty texts are left out."""
    out = console(wrap=True)
    out.print(f"[bold]{cell(name)}[/]  {cell(about)}", soft_wrap=True)
    indent = max(map(len, rows), default=0) + 4
    for key, text in rows.items():
        if not text:
            continue
        print_wrapped(" ".join(text.split()), f"  {key}".ljust(indent), " " * indent)


def print_wrapped(text: str, first: str, following: str, style: str = "") -> None:
    """Print a text wrapped at the terminal's width, with prefixes of the first and other lines.

    Args:
        text: The text.
        first: Prefix of the first line.
        following: Prefix of the other lines.
        style: Style of `first`.
    """
    out = console(wrap=True)
    lines = textwrap.wrap(
        text,
        min(out.width, TEXT_WIDTH),
        initial_indent=" " * len(first),
        subsequent_indent=following,
        break_long_words=False,
        break_on_hyphens=False,
    )
    for i, line in enumerate(lines or [first]):
        head = first if i == 0 else following
        shown = f"[{style}]{cell(head)}[/]" if style and i == 0 else cell(head)
        out.print(shown + cell(line[len(head) :]), soft_wrap=True)
