"""Docstrings say first what a thing is, or what a function does: a noun or an imperative verb."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from syntax_trees import FILES, ROOT, SOURCE, tree_of

ROOMS = sorted(
    path.name
    for path in SOURCE.iterdir()
    if path.suffix == ".py" or (path / "__init__.py").exists()
)
CLAUSE = re.compile(r"(What|Which|Who|Where|When|Whoever|How|Those|That|It|They|Of|From when)\b")
NO_NOUN = re.compile(
    r"\b(?<![Tt]here )(is|are|be) (no|none)\b(?! (more|less|longer|later|shorter|\w+er)\b)"
)
ENTRY = re.compile(r"\s*[\w*, ]+: (\S.*)")


def heads(text: str) -> Iterator[str]:
    """The summary of a docstring, and what it says first of each argument, attribute and error."""
    yield text
    section = False
    for line in text.splitlines():
        section = line.strip() in {"Args:", "Attributes:", "Raises:"} or (
            section and bool(line.strip())
        )
        if section and (entry := ENTRY.match(line)):
            yield entry[1]


@pytest.mark.parametrize("room", ROOMS)
def test_docstrings_begin_with_nouns_and_verbs(room: str) -> None:
    wrong = []
    for path in (path for path in FILES if path.is_relative_to(SOURCE / room)):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                text = str(node.value.value)
                found = [head.splitlines()[0] for head in heads(text) if CLAUSE.match(head)]
                found += [match[0] for match in NO_NOUN.finditer(" ".join(text.split()))]
                wrong += [f"{path.name}:{node.lineno}: {head}" for head in found]
    assert not wrong, "\n".join(wrong)


def test_the_changelog_is_short_and_has_each_heading_once() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    unreleased = text.split("## [Unreleased]")[1].split("## [1.0.0]")[0]
    headings = re.findall(r"^#+ .+$", unreleased, re.MULTILINE)
    assert sorted(set(headings)) == sorted(headings)
    entries = [entry.split() for entry in re.split(r"^[-|] ", unreleased, flags=re.MULTILINE)[1:]]
    assert [" ".join(words) for words in entries if len(words) > 60] == []
