"""Printing: text from files can't move the cursor, colour the screen or hide a line."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from typing import Any

import click

from knotwork.errors.plain_text import one_line, plain


def cell(text: str, *, lines: bool = False) -> str:
    """Write text for a table or a line of Rich's, where brackets would be markup.

    Args:
        text: From a file.
        lines: Line feeds stay; by default they are written out, so that a name is in one line.
    """
    from rich.markup import escape

    # a backslash at the end would take the markup behind it for text
    return escape(plain(text) if lines else one_line(text))


def echo(text: str, *, err: bool = False) -> None:
    """Print text, control characters written out.

    On a terminal messages are wrapped between words.

    Where nothing can be written to standard error, the exit code still reports the error.
    """
    text = plain(text)
    try:
        if err and sys.stderr is not None and sys.stderr.isatty():
            text = "\n".join(map(_wrapped, text.split("\n")))
        click.echo(text, err=err)
    except OSError:
        if not err:
            raise


def _wrapped(line: str) -> str:
    width = shutil.get_terminal_size().columns
    if len(line) <= width:
        return line
    return textwrap.fill(
        line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def echo_line(text: str, word: str = "", **style: Any) -> None:
    """Print one line, a word of it in a style where the output is a terminal that has colours.

    Args:
        text: From a file.
        word: The first one of these has the style.
        style: As for `click.style`.
    """
    line = one_line(text)
    plainly = "NO_COLOR" in os.environ or os.environ.get("TERM") in ("dumb", "unknown")
    if word and not plainly and sys.stdout.isatty():
        line = line.replace(word, click.style(word, **style), 1)
    click.echo(line)


def internal_error(error: Exception) -> str:
    """Explain an error that is no fault of the input."""
    return (
        f"internal error: {type(error).__name__}: {error}\nThis is a fault of Knotwork, not of "
        "your input. Please report it; KNOTWORK_TRACEBACK=1 shows where it happened."
    )


def echo_data(text: str | bytes) -> None:
    """Print data for other programs as they are; for eyes, control characters are written out."""
    if isinstance(text, str) and sys.stdout.isatty():
        text = plain(text)
    click.echo(text, nl=False)


def offer(address: str, shown: str, no_open: bool) -> None:
    """Print a line on a served page, and open its address in a browser."""
    from knotwork.view.page_server import open_browser

    echo(f"{shown} until Ctrl-C")
    if not no_open and not open_browser(address):
        echo("no browser could be opened here; open the address in one", err=True)
