"""All that is printed: text from files can't move the cursor, colour the screen or hide a line."""

from __future__ import annotations

import re
import sys

import click

# Control characters but tab and line feed, separators of lines, and what turns the direction of
# writing around.
_CONTROLS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff]"
)


def plain(text: str) -> str:
    r"""Write control characters as Python would, `\x1b` for escape; lines stay lines.

    >>> print(plain("PASSED \x1b[8m but not"))
    PASSED \x1b[8m but not
    """
    return _CONTROLS.sub(lambda found: ascii(found.group())[1:-1], text)


def cell(text: str, *, lines: bool = False) -> str:
    """Write text for a table or a line of Rich's, where brackets would be markup.

    Args:
        text: From a file.
        lines: Line feeds stay; by default they are written out, so that a name is in one line.
    """
    from rich.markup import escape

    text = text if lines else text.replace("\n", r"\n").replace("\t", r"\t")
    # a backslash at the end would take the markup behind it for text
    return escape(plain(text))


def echo(text: str, *, err: bool = False) -> None:
    """Print text, control characters written out."""
    click.echo(plain(text), err=err)


def echo_data(text: str | bytes) -> None:
    """Print data for other programs as they are; for eyes, control characters are written out."""
    if isinstance(text, str) and sys.stdout.isatty():
        text = plain(text)
    click.echo(text, nl=False)
