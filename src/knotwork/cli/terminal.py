"""Printing that is safe: text from files can't move the cursor, or colour or hide anything."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from knotwork.errors.plain_text import escape_controls, to_one_line


def cell(text: str, *, lines: bool = False) -> str:
    """Escape text for a table or line of Rich, where brackets are markup.

    Args:
        text: Text from a file.
        lines: Whether to keep line feeds; by default they are escaped, so a name is on one line.
    """
    from rich.markup import escape

    # A backslash at the end would escape the markup after it.
    return escape(escape_controls(text) if lines else to_one_line(text))


def echo(text: str, *, err: bool = False) -> None:
    """Print text, control characters escaped.

    If standard error can't be written to, the exit code still reports the error.
    """
    try:
        click.echo(escape_controls(text), err=err)
    except OSError:
        if not err:
            raise


def echo_line(text: str, word: str = "", **style: Any) -> None:
    """Print one line, one word of it in a style if the output is a terminal with colours.

    Args:
        text: Text from a file.
        word: Word whose first occurrence gets the style.
        style: Style as for `click.style`.
    """
    line = to_one_line(text)
    plainly = "NO_COLOR" in os.environ or os.environ.get("TERM") in ("dumb", "unknown")
    if word and not plainly and sys.stdout.isatty():
        line = line.replace(word, click.style(word, **style), 1)
    click.echo(line)


def print_note(note: str) -> None:
    """Print a note on standard error, if it is not empty."""
    if note:
        echo(f"note: {note}", err=True)


def internal_error(error: Exception) -> str:
    """Text on an internal error, which asks for a report of it."""
    return (
        f"internal error: {type(error).__name__}: {error}\nThis is a fault of Knotwork, not of "
        "your input. Please report it; KNOTWORK_TRACEBACK=1 shows where it happened."
    )


def error_to_dict(error: Exception) -> dict[str, str]:
    """Return an error as plain data, for `--json`."""
    return {"type": type(error).__name__, "message": str(error)}


def echo_json(data: object) -> None:
    """Print plain data as JSON."""
    echo(json.dumps(data, indent=1, allow_nan=False))


def echo_data(text: str | bytes) -> None:
    """Print data for other programs unchanged; on a terminal, control characters are escaped."""
    if isinstance(text, str) and sys.stdout.isatty():
        text = escape_controls(text)
    click.echo(text, nl=False)


@contextmanager
def offered(address: str, shown: str, no_open: bool) -> Iterator[None]:
    """Print where a page is served, and open it in a browser; Ctrl-C ends the `with` block."""
    from knotwork.view.page_server import open_browser

    echo(f"{shown} at {address} until Ctrl-C")
    if not no_open and not open_browser(address):
        echo("no browser could be opened here; open the address in one", err=True)
    try:
        yield
    except KeyboardInterrupt:
        echo("stopped")
