"""Comments in YAML text, kept when the text is changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import yaml


class Change(NamedTuple):
    """New text that replaces the old one from start to end."""

    start: int
    end: int
    new: str


class _Comment(NamedTuple):
    """Start and text of a comment."""

    start: int
    text: str


def with_comments(text: str, changes: Sequence[Change]) -> list[Change]:
    """The changes, each with the comments of the replaced text in front, one a line."""
    if not any("#" in text[change.start : change.end] for change in changes):
        return list(changes)
    comments = _comments(text)
    return [_with_comments(text, comments, change) for change in changes]


def _with_comments(text: str, comments: Sequence[_Comment], change: Change) -> Change:
    start, end, new = change
    texts = [comment.text for comment in comments if start <= comment.start < end]
    if not texts:
        return change
    old = text[start:end]
    spaces = old[: len(old) - len(old.lstrip(" "))]
    before = text[text.rfind("\n", 0, start) + 1 : start] + spaces
    indent = len(before) - len(before.lstrip(" -"))
    line = "\n" + " " * (indent if indent == len(before) else indent + 2)
    if start and not spaces and not text[start - 1].isspace():
        spaces = " "  # required before a comment
    below = "" if new.startswith("\n") else "\n" if old.endswith("\n") else line
    return Change(start, end, spaces + line.join(texts) + below + new)


def _comments(text: str) -> list[_Comment]:
    """All comments, in order; they are between the tokens."""
    comments: list[_Comment] = []
    done = 0
    for token in yaml.scan(text, Loader=yaml.SafeLoader):
        while (start := text.find("#", done, token.start_mark.index)) >= 0:
            done = text.find("\n", start)
            done = len(text) if done < 0 else done
            comments.append(_Comment(start, text[start:done].rstrip()))
        done = max(done, token.end_mark.index)
    return comments
