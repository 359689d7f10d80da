"""Edits of a document: in its data, or in its text, of which the rest stays unchanged.

Only the text of changed values is replaced, so that comments, order and layout are kept. Writing
whole text anew by ruamel.yaml would lose comments inside flow collections, and their line breaks.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import yaml

from knotwork.errors import InputError
from knotwork.files.documents.document import Document, Location, field_path
from knotwork.files.documents.yaml_text import Dumper, parse

REMOVED = object()
"""Removes a key, in place of its value."""

Edits = Mapping[Location, Any]
"""New values by location; a key that is new to a mapping is added."""

LINE_WIDTH = 100
"""Number of characters after which new values are broken into lines."""
LAST_VALUE_WIDTH = 20
"""Reserve for the last value of a line, before which PyYAML does not break."""


_Places = Mapping[Location, tuple[Any, Any]]


def edited(document: Document, edits: Edits) -> Document:
    """A document with other values.

    >>> edited(Document({"a": 1, "b": [2, 3]}), {("b", 1): 4.5, ("a",): REMOVED}).data
    {'b': [2, 4.5]}
    """
    data = copy.deepcopy(document.data)
    for location, value in edits.items():
        *parents, last = location
        part = data
        for key in parents:
            part = part[key]
        if value is REMOVED:
            del part[last]
        else:
            part[last] = value
    return replace(document, data=data)


def differences(old: Any, new: Any, place: Location = ()) -> Edits:
    """The edits that turn one set of data into another; a whole number equals the same float.

    >>> differences({"a": 1, "b": [2, 3]}, {"a": 1, "b": [2, 5], "d": 6})
    {('b', 1): 5, ('d',): 6}
    """
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        keys = [*old, *(key for key in new if key not in old)]
        pairs = [(key, old.get(key, REMOVED), new.get(key, REMOVED)) for key in keys]
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = [(i, *pair) for i, pair in enumerate(zip(old, new, strict=True))]
    else:
        same = old == new and isinstance(old, bool) == isinstance(new, bool)
        return {} if same else {place: new}
    edits: dict[Location, Any] = {}
    for key, before, after in pairs:
        edits |= differences(before, after, (*place, key))
    return edits


def edited_text(text: str, edits: Edits) -> str:
    r"""The text of a YAML file with other values, otherwise unchanged.

    Raises:
        InputError: A value can't be changed on its own, for example because it is in an alias.

    >>> print(edited_text("a: 1 # one\nb: {c: 2}", {("a",): 0.5, ("b", "d"): [1.0, 2.0]}))
    a: 0.5 # one
    b: {c: 2, d: [1.0, 2.0]}
    """
    wanted = edited(parse(text), edits).data
    places = dict(places_of(yaml.compose(text, Loader=yaml.SafeLoader)))
    changes = with_comments(text, list(_changes(text, places, edits)))
    result = text
    for start, end, new in sorted(changes, key=lambda change: change[:2], reverse=True):
        result = result[:start] + new + result[end:]
    return written(result, wanted, ", ".join(field_path(location) for location in list(edits)[:3]))


def written(text: str, wanted: Any, named: str) -> str:
    """A changed text, if it has the wanted content.

    Raises:
        InputError: The text has another content.
    """
    try:
        done = parse(text).data
    except InputError:
        done = None
    if done != wanted:
        raise InputError(
            f"the numbers can't be written into the text of the file, at {named} or further on; "
            "write out aliases (*), and give each waypoint as a mapping of its own"
        )
    return text


def places_of(node: Any, place: Location = (), key: Any = None) -> Iterator[tuple[Location, Any]]:
    """Give the nodes of key (`None` for items of lists) and value by location."""
    yield place, (key, node)
    if isinstance(node, yaml.MappingNode):
        for name, value in node.value:
            yield from places_of(value, (*place, name.value), name)
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            yield from places_of(value, (*place, i))


def _changes(text: str, places: _Places, edits: Edits) -> Iterator[Change]:
    """The changes of a text; new keys take the place of removed ones."""
    put_in: dict[Location, list[tuple[Any, Any]]] = {}
    for place, value in edits.items():
        if place not in places:
            put_in.setdefault(place[:-1], []).append((place[-1], value))
    for place, value in edits.items():
        if place not in places:
            continue
        (_, part), (key, node) = places[place[:-1]], places[place]
        if value is not REMOVED:
            yield _replacement(text, part, key, node, value)
        elif len(place) > 1 and (new := put_in.get(place[:-1])):
            item = _item(*new.pop(0), _indent(text, part))
            yield Change(key.start_mark.index, end_of(node), item)
        else:
            yield _removal(text, part, key, node)
    for place, items in put_in.items():
        for key, value in items:
            yield _insertion(text, places[place][1], key, value, top=not place)


def _replacement(text: str, part: Any, key: Any, node: Any, value: Any) -> Change:
    if key is not None and part.flow_style and isinstance(value, Mapping | list):
        start, name = key.start_mark.index, key.value
        return _item_in_flow(text, part, start, end_of(node), name, value)
    # a list in block style may begin at the column of its key, at most
    space = "  " if isinstance(node, yaml.SequenceNode) and not node.flow_style else ""
    return Change(node.start_mark.index, end_of(node), space + flow(value, _indent(text, part)))


def _insertion(text: str, part: yaml.MappingNode, key: str, value: Any, *, top: bool) -> Change:
    """Insert a key into a mapping: after its first key, if there are more, or at the end.

    At the end of a file, or of a mapping in flow style.
    """
    if part.flow_style and part.value:
        at = end_of(part.value[-1][1])
        start, end, new = _item_in_flow(text, part, at, at, key, value)
        return Change(start, end, f",{new}" if new[0].isspace() else f", {new}")
    if part.flow_style:
        at = part.start_mark.index + 1
        return Change(at, at, _item(key, value, _indent(text, part)))
    if top:
        at = part.end_mark.index
        return Change(at, at, ("" if text[:at].endswith("\n") else "\n") + block({key: value}))
    at = part.value[min(1, len(part.value) - 1)][0].start_mark.index
    column = part.value[0][0].start_mark.column
    return Change(at, at, f"{_item(key, value, column)}\n{' ' * column}")


def _item_in_flow(text: str, part: Any, start: int, end: int, key: str, value: Any) -> Change:
    """Insert a key and its value into a mapping in flow style, on a new line if it is long."""
    column, at = _indent(text, part), start - text.rfind("\n", 0, start) - 1
    new, before = _item(key, value, column), text[:start].rstrip()
    if before.endswith("{") or ("\n" not in new and at + len(new) <= LINE_WIDTH):
        return Change(start, end, new)
    below = f"\n{' ' * (column + 2)}{_item(key, value, column + 2)}"
    return Change(len(text[:start].rstrip(" ")), end, below)


def _removal(text: str, part: yaml.MappingNode, key: Any, node: Any) -> Change:
    """Remove a key from a mapping, and its line if nothing else is on it."""
    start, end = key.start_mark.index, end_of(node)
    if part.flow_style:
        i = next(i for i, (name, _) in enumerate(part.value) if name is key)
        if i + 1 < len(part.value):
            return Change(start, part.value[i + 1][0].start_mark.index, "")
        return Change(end_of(part.value[i - 1][1]) if i else start, end, "")
    line_start, line_end = text.rfind("\n", 0, start) + 1, text.find("\n", end) + 1 or len(text)
    if not (text[line_start:start] + text[end:line_end]).strip():
        return Change(line_start, line_end, "")
    remainder = text[end:line_end].rstrip("\n")
    return Change(start, end + len(remainder) - len(remainder.lstrip()), "")


def _indent(text: str, node: Any) -> int:
    """Column where the text of a node's line begins, after the dashes of lists."""
    line = text[node.start_mark.index - node.start_mark.column :]
    return len(line) - len(line.lstrip(" -"))


def end_of(node: Any) -> int:
    """End of a node, without blank lines and comments after a block."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style:
        return int(node.end_mark.index)
    last = node.value[-1]
    return end_of(last[1] if isinstance(last, tuple) else last)


def _item(key: Any, value: Any, column: int) -> str:
    return flow({key: value}, column - 2)[1:-1]


def flow(value: Any, column: int = 0, width: int = LINE_WIDTH) -> str:
    """Plain data in YAML's flow style, in lines that begin right of a column."""
    text = _dump_yaml([value], default_flow_style=True, width=width - column - LAST_VALUE_WIDTH)
    return text.strip()[1:-1].replace("\n  ", "\n" + " " * column)


def block(value: Mapping[str, Any]) -> str:
    """Plain data in YAML's block style; parts without nested parts in flow style."""
    styles = {
        key: None if isinstance(part, Mapping | list) else False for key, part in value.items()
    }
    return "".join(
        _dump_yaml({key: part}, default_flow_style=styles[key], width=LINE_WIDTH - LAST_VALUE_WIDTH)
        for key, part in value.items()
    )


def _dump_yaml(value: Any, **style: Any) -> str:
    text = yaml.dump(value, Dumper=Dumper, sort_keys=False, allow_unicode=True, **style)
    return str(text)


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
