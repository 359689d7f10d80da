"""Text of messages: names of waypoints, and text from files, escaped so that it hides nothing."""

from __future__ import annotations

import re

_CONTROLS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff]"
)
"""Control characters except tab and line feed, line separators, and characters that change the
writing direction.
"""


def escape_controls(text: str) -> str:
    r"""Escape control characters as Python does, `\x1b` for escape; lines are kept.

    >>> print(escape_controls("PASSED \x1b[8m but not"))
    PASSED \x1b[8m but not
    """
    return _CONTROLS.sub(lambda match: ascii(match.group())[1:-1], text)


def to_one_line(text: str) -> str:
    r"""Escape control characters, line feeds and tabs, so that the text is one line."""
    return escape_controls(text.replace("\n", r"\n").replace("\t", r"\t"))


def default_waypoint_name(index: int) -> str:
    """Name of a waypoint without a name, from its index, counted from 0."""
    return f"waypoint {index + 1}"


def waypoint_text(name: str) -> str:
    """Write a waypoint in a sentence: its name is in quotes unless it is only a number.

    >>> waypoint_text("pick"), waypoint_text("waypoint 3")
    ("waypoint 'pick'", 'waypoint 3')
    """
    quoted = quoted_waypoint(name)
    return quoted if quoted == name else f"waypoint {quoted}"


def quoted_waypoint(name: str) -> str:
    """Name of a waypoint in quotes, or as it is if it is only a number.

    >>> quoted_waypoint("pick"), quoted_waypoint("waypoint 3")
    ("'pick'", 'waypoint 3')
    """
    return name if re.fullmatch(r"waypoint \d+", name) else repr(name)
