"""Edits of a document: in its data, and in its text, of which all else stays as it is.

The text is changed only where a value is, so that comments, order and layout are kept.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import yaml

from knotwork.documents.comments import Change, with_comments
from knotwork.documents.document import Document, Location, field_path
from knotwork.errors import InputError

REMOVED = object()
"""In place of a value: its key is taken out."""

Edits = Mapping[Location, Any]
"""New values by location; a key that a mapping does not have yet is put in."""

WIDTH = 100
"""Values are broken into lines of about this many characters."""


def edited(document: Document, edits: Edits) -> Document:
    """A document with other values.

    >>> edited(Document({"a": 1, "b": [2, 3]}), {("b", 1): 4.5, ("a",): REMOVED}).data
    {'b': [2, 4.5]}
    """
    data = copy.deepcopy(document.data)
    for location, value in edits.items():
        *way, last = location
        part = data
        for key in way:
            part = part[key]
        if value is REMOVED:
            del part[last]
        else:
            part[last] = value
    return replace(document, data=data)


def differences(old: Any, new: Any, place: Location = ()) -> Edits:
    """The edits that make of some data other data.

    >>> differences({"a": 1, "b": [2, 3]}, {"a": 1, "b": [2, 5], "d": 6})
    {('b', 1): 5, ('d',): 6}
    """
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        keys = [*old, *(key for key in new if key not in old)]
        pairs = [(key, old.get(key, REMOVED), new.get(key, REMOVED)) for key in keys]
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = [(i, *pair) for i, pair in enumerate(zip(old, new, strict=True))]
    else:
        return {} if old == new and type(old) is type(new) else {place: new}
    found: dict[Location, Any] = {}
    for key, before, after in pairs:
        found |= differences(before, after, (*place, key))
    return found


def edited_text(text: str, edits: Edits) -> str:
    r"""The text of a YAML file with other values, and all else as it is.

    Raises:
        InputError: A value stands where it can't be changed alone, for example in an alias.

    >>> print(edited_text("a: 1 # one\nb: {c: 2}", {("a",): 0.5, ("b", "d"): [1.0, 2.0]}))
    a: 0.5 # one
    b: {c: 2, d: [1.0, 2.0]}
    """
    from knotwork.documents.yaml_text import parse

    root = yaml.compose(text, Loader=yaml.SafeLoader)
    changes = [_change(text, root, location, value) for location, value in _paired(root, edits)]
    result = text
    for start, end, new in sorted(
        with_comments(text, changes), key=lambda one: one[:2], reverse=True
    ):
        result = result[:start] + new + result[end:]
    wanted = edited(parse(text), edits).data
    try:
        done = parse(result).data
    except InputError:
        done = None
    if done != wanted:
        places = ", ".join(field_path(location) for location in list(edits)[:3])
        raise InputError(
            f"the numbers can't be written into the text of the file, at {places} or further on; "
            "write out aliases (*), and give each waypoint as a mapping of its own"
        )
    return result


def _change(text: str, root: Any, location: Location, value: Any) -> Change:
    """Start, end and new text of one edit."""
    *way, last = location
    part = root
    for key in way:
        part = _child(part, key)
    pairs = part.value if isinstance(part, yaml.MappingNode) else []
    found = next((i for i, (key, _) in enumerate(pairs) if key.value == last), None)
    if found is None and isinstance(part, yaml.MappingNode):
        return _insertion(text, part, str(last), value, top=not way)
    if value is REMOVED and found is not None:
        return _removal(text, part, found)
    node = _child(part, last)
    pair = pairs[found][0] if found is not None else None
    if isinstance(value, _Renamed) and pair is not None:
        new = _item(value.key, value.value, _indent(text, part), pair.start_mark.column)
        return Change(pair.start_mark.index, _end(node), new)
    if pair is not None and part.flow_style and isinstance(value, Mapping | list):
        key = text[pair.start_mark.index : pair.end_mark.index]
        return _item_in_flow(text, part, pair.start_mark.index, _end(node), key, value)
    # a list in block style may begin no further right than its key
    space = "  " if isinstance(node, yaml.SequenceNode) and not node.flow_style else ""
    new = flow(value, _indent(text, part), node.start_mark.column)
    return Change(node.start_mark.index, _end(node), space + new)


class _Renamed(NamedTuple):
    """A key and a value in place of another key and its value."""

    key: str
    value: Any


def _paired(root: Any, edits: Edits) -> list[tuple[Location, Any]]:
    """The edits, with keys that are put into a mapping in place of those taken out of it."""
    removed: dict[Location, list[Location]] = {}
    for location, value in edits.items():
        if value is REMOVED and len(location) > 1:
            removed.setdefault(location[:-1], []).append(location)
    found: dict[Location, Any] = {}
    for location, value in edits.items():
        free = removed.get(location[:-1], [])
        if value is not REMOVED and free and not _has(root, location):
            found[free.pop()] = _Renamed(_key(str(location[-1])), value)
        elif location not in found:
            found[location] = value
    return list(found.items())


def _has(root: Any, location: Location) -> bool:
    for key in location[:-1]:
        root = _child(root, key)
    return not isinstance(root, yaml.MappingNode) or any(
        key.value == location[-1] for key, _ in root.value
    )


def _child(node: Any, key: str | int) -> Any:
    if isinstance(node, yaml.SequenceNode):
        return node.value[key]
    return next(value for name, value in node.value if name.value == key)


def _end(node: Any) -> int:
    """Where a node ends, without the blank lines and comments after a block."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)


def _insertion(text: str, part: yaml.MappingNode, key: str, value: Any, *, top: bool) -> Change:
    """Put a key into a mapping: after its first key, if there are more, or at the end.

    At the end of a file, and of a mapping in flow style.
    """
    if part.flow_style and part.value:
        at = _end(part.value[-1][1])
        start, end, new = _item_in_flow(text, part, at, at, _key(key), value)
        return Change(start, end, f",{new}" if new[0].isspace() else f", {new}")
    if part.flow_style:
        at = part.start_mark.index + 1
        new = _item(_key(key), value, _indent(text, part), part.start_mark.column)
        return Change(at, at, new)
    if top:
        at = part.end_mark.index
        before = "" if text[:at].endswith("\n") else "\n"
        return Change(at, at, before + block({key: value}))
    at = part.value[min(1, len(part.value) - 1)][0].start_mark.index
    column = part.value[0][0].start_mark.column
    return Change(at, at, f"{_item(_key(key), value, column, column)}\n{' ' * column}")


def _item(key: str, value: Any, column: int, start: int) -> str:
    """A key, as it is written, and its value: see `flow`."""
    return f"{key}: {flow(value, column, start + len(key) + 2)}"


def _item_in_flow(
    text: str, part: yaml.MappingNode, start: int, end: int, key: str, value: Any
) -> Change:
    """Put a key with its value into a mapping in flow style, on a line of its own if it is long."""
    column, at = _indent(text, part), start - text.rfind("\n", 0, start) - 1
    new = _item(key, value, column, at)
    first = text[:start].rstrip().endswith("{")
    if first or ("\n" not in new and at + len(new) + 2 <= WIDTH):
        return Change(start, end, new)
    below = f"\n{' ' * (column + 2)}{_item(key, value, column + 2, column + 2)}"
    return Change(len(text[:start].rstrip(" ")), end, below)


def _indent(text: str, node: Any) -> int:
    """Where the text of the line begins in which a node does, after the dashes of lists."""
    line = text[node.start_mark.index - node.start_mark.column :]
    return len(line) - len(line.lstrip(" -"))


def _removal(text: str, part: yaml.MappingNode, i: int) -> Change:
    """Take a key out of a mapping, and its line if nothing else is in it."""
    key, value = part.value[i]
    start, end = key.start_mark.index, _end(value)
    if part.flow_style:
        if i + 1 < len(part.value):
            return Change(start, part.value[i + 1][0].start_mark.index, "")
        return Change(_end(part.value[i - 1][1]) if i else start, end, "")
    line_end = text.find("\n", end)
    line_end = len(text) if line_end < 0 else line_end
    if not text[end:line_end].strip():
        below = line_end + 1 if line_end < len(text) else line_end
        line_start = text.rfind("\n", 0, start) + 1
        if not text[line_start:start].strip():
            return Change(line_start, below, "")
    spaces = len(text[end:line_end]) - len(text[end:line_end].lstrip())
    return Change(start, end + spaces, "")


def flow(value: Any, column: int = 0, start: int | None = None) -> str:
    """Plain data in YAML's flow style, broken into lines.

    Args:
        value: The data.
        column: Further lines begin right of it.
        start: Where the first line begins; by default there.
    """
    start = column if start is None else start
    if isinstance(value, Mapping):
        items, ends = [(f"{_key(k)}: ", v) for k, v in value.items()], "{}"
    elif isinstance(value, list):
        items, ends = [("", v) for v in value], "[]"
    else:
        return _scalar(value)
    text, at = ends[0], start + 1
    for i, (key, one) in enumerate(items):
        item = key + flow(one, column + 2, column + 2 + len(key))
        first = item.find("\n")
        if i and at + 2 + (len(item) if first < 0 else first) > WIDTH:
            text, at = f"{text}\n{' ' * (column + 2)}", column + 2
        elif i:
            text, at = f"{text} ", at + 1
        text += item + ("," if i + 1 < len(items) else "")
        at = len(text) - text.rfind("\n") - 1 if "\n" in text else start + len(text)
    return text + ends[1]


def block(value: Any, column: int = 0) -> str:
    """Plain data in YAML's block style; lists of plain values in flow style."""
    text, space = "", " " * column
    for key, one in value.items():
        if isinstance(one, Mapping) and any(isinstance(v, Mapping | list) for v in one.values()):
            text += f"{space}{_key(key)}:\n{block(one, column + 2)}"
        elif isinstance(one, list) and one and all(isinstance(v, Mapping) for v in one):
            items = (block(v, column + 4) for v in one)
            text += f"{space}{_key(key)}:\n" + "".join(
                f"{space}  - {item[column + 4 :]}" for item in items
            )
        else:
            text += f"{space}{_item(_key(key), one, column, column)}\n"
    return text


def _key(key: str) -> str:
    return _scalar(key)


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        plain = value.replace("_", "a").replace(" ", "a").isalnum() and value[0].isalpha()
        if plain and value.lower() not in ("true", "false", "null") and value == value.strip():
            return value
        return yaml.safe_dump(value, default_style='"', width=10**6, allow_unicode=True).strip()
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "null"}[value]
    return repr(float(value)) if isinstance(value, float) else str(value)
