"""Edits of a document's data, and of its text, whose other parts stay unchanged.

Only the text of changed values is replaced, so that comments, order and layout are kept. With
ruamel.yaml, flow collections would lose their comments and line breaks.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import yaml

from knotwork.errors import InputError
from knotwork.files.documents.document import Document, Location, field_path
from knotwork.files.documents.yaml_text import parse, to_block_yaml, to_flow_yaml

REMOVED = object()
"""Value of an edit that removes the key or item."""

Edits = Mapping[Location, Any]
"""New values by location; a key that a mapping does not have is added."""


class Change(NamedTuple):
    """New text for the characters of a text from index `start` to before `end`."""

    start: int
    end: int
    new: str


def apply_edits(document: Document, edits: Edits) -> Document:
    """Return the document with other values.

    >>> apply_edits(Document({"a": 1, "b": [2, 3]}), {("b", 1): 4.5, ("a",): REMOVED}).data
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


def differences(old: Any, new: Any, location: Location = ()) -> Edits:
    """Find the edits that turn old data into new; a whole number equals the same float.

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
        return {} if same else {location: new}
    edits: dict[Location, Any] = {}
    for key, before, after in pairs:
        edits |= differences(before, after, (*location, key))
    return edits


def value_at(data: Any, location: Location) -> Any:
    """The value at a location, or `None`."""
    for key in location:
        if isinstance(data, dict):
            data = data.get(key)
        elif isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def with_values(text: str, edits: Edits) -> str:
    r"""Return the text of a YAML file with other values, and otherwise unchanged.

    Raises:
        InputError: A value can't be changed on its own, for example because it is in an alias.

    >>> print(with_values("a: 1 # one\nb: {c: 2}", {("a",): 0.5, ("b", "d"): [1.0, 2.0]}))
    a: 0.5 # one
    b: {c: 2, d: [1.0, 2.0]}
    """
    wanted = apply_edits(parse(text), edits).data
    changes = _changes(text, edits)
    if any("#" in text[change.start : change.end] for change in changes):
        comments = _comments(text)
        changes = [_with_comments(text, comments, change) for change in changes]
    return _apply_changes(text, changes, wanted, [*edits])


def with_change(text: str, location: Location, value: Any, *, insert: bool = False) -> str:
    r"""Return the text of a YAML file with one value or item changed, added or removed.

    Missing mappings around a new key are added; a mapping that loses its last key is removed.

    Args:
        text: The text.
        location: Location of the value; for an inserted item, its new index.
        value: The new value; `REMOVED` removes the key or item.
        insert: Insert an item into a list, before the item with its index.

    Raises:
        InputError: The location does not exist, or the change can't be written into this text, for
            example because an alias shares the value.

    >>> print(with_change("a: [1, 2] # two", ("a", 1), 5, insert=True))
    a: [1, 5, 2] # two
    >>> print(with_change("- b: 1 # one\n- b: 3", (1,), {"b": 2}, insert=True))
    - b: 1 # one
    - b: 2
    - b: 3
    """
    data = parse(text).data
    if value is REMOVED:
        while len(location) > 1 and isinstance(parent := value_at(data, location[:-1]), dict):
            if len(parent) > 1:
                break
            location = location[:-1]
    else:
        while len(location) > 1 and value_at(data, location[:-1]) is None:
            value = [value] if insert else {location[-1]: value}
            location, insert = location[:-1], False
    parent, last = value_at(data, location[:-1]), location[-1]
    inside = isinstance(parent, list) and isinstance(last, int) and 0 <= last < len(parent) + insert
    exists = value_at(data, location) is not None if value is REMOVED else isinstance(last, str)
    if not inside and not (isinstance(parent, dict) and exists and not insert):
        raise InputError(f"nothing can be changed at {field_path(location)}: no such field")
    if not insert and not (value is REMOVED and isinstance(last, int)):
        return with_values(text, {location: value})
    wanted = copy.deepcopy(data)
    items = value_at(wanted, location[:-1])
    items[int(last) : int(last) + (not insert)] = [value] if insert else []
    if not items or not parent:
        return with_values(text, {location[:-1]: items})
    _, part = _nodes(text)[location[:-1]]
    if insert:
        change = _inserted_item(text, part, int(last), value)
    else:
        change = _removal(text, part, int(last))
    return _apply_changes(text, [change], wanted, [location])


def _apply_changes(
    text: str, changes: Sequence[Change], wanted: Any, locations: Sequence[Location]
) -> str:
    """Change a text, and check that it then has the wanted content.

    Raises:
        InputError: The text has another content.
    """
    result = text
    for start, end, new in sorted(changes, key=lambda change: change[:2], reverse=True):
        result = result[:start] + new + result[end:]
    try:
        content = parse(result).data
    except InputError:
        content = None
    if content != wanted:
        named = ", ".join(map(field_path, locations[:3]))
        raise InputError(
            f"the text of the file can't be changed at {named} or further on; "
            "write out aliases (*), and give each waypoint as a mapping of its own"
        )
    return result


def _nodes(text: str) -> dict[Location, tuple[Any, Any]]:
    """Each node and its index in the enclosing collection, by location."""

    def walk(
        node: Any, location: Location, index: int
    ) -> Iterator[tuple[Location, tuple[int, Any]]]:
        yield location, (index, node)
        for i, entry in enumerate(node.value if isinstance(node, yaml.CollectionNode) else ()):
            if isinstance(entry, tuple):
                yield from walk(entry[1], (*location, entry[0].value), i)
            else:
                yield from walk(entry, (*location, i), i)

    return dict(walk(yaml.compose(text, Loader=yaml.SafeLoader), (), 0))


def _changes(text: str, edits: Edits) -> list[Change]:
    """Changes of the text that make the edits; a new key takes the place of a removed one."""
    nodes, changes = _nodes(text), list[Change]()
    new_keys: dict[Location, list[tuple[Any, Any]]] = {}
    for location, value in edits.items():
        if location not in nodes:
            new_keys.setdefault(location[:-1], []).append((location[-1], value))
    for location, value in edits.items():
        if location not in nodes:
            continue
        (_, part), (index, node) = nodes[location[:-1]], nodes[location]
        column = _indent(text, part)
        if value is not REMOVED:
            # a block list may begin in the column of its key, but its replacement may not
            space = "  " if isinstance(node, yaml.SequenceNode) and not node.flow_style else ""
            new = space + to_flow_yaml(value, column)
            changes.append(Change(node.start_mark.index, _end(node), new))
        elif len(location) > 1 and (new_items := new_keys.get(location[:-1])):
            new = _key_and_value(*new_items.pop(0), column)
            changes.append(Change(_start(part.value[index]), _end(node), new))
        else:
            changes.append(_removal(text, part, index))
    for location, items in new_keys.items():
        part = nodes[location][1]
        changes += [_inserted_key(text, part, key, value, top=not location) for key, value in items]
    return changes


def _removal(text: str, part: Any, index: int) -> Change:
    """Remove an entry of a collection, and its lines if nothing else is on them."""
    entries = part.value
    start, end = _start(entries[index]), _end(entries[index])
    if part.flow_style:
        if index + 1 < len(entries):
            return Change(start, _start(entries[index + 1]), "")
        return Change(_end(entries[index - 1]) if index else start, end, "")
    line_start, line_end = text.rfind("\n", 0, start) + 1, _line_end(text, end)
    if (
        isinstance(part, yaml.SequenceNode)
        or not (text[line_start:start] + text[end:line_end]).strip()
    ):
        return Change(line_start, line_end, "")
    remainder = text[end:line_end].rstrip("\n")
    return Change(start, end + len(remainder) - len(remainder.lstrip()), "")


def _inserted_key(text: str, part: Any, key: str, value: Any, *, top: bool) -> Change:
    """Insert a key: in a nested block mapping after the first key, elsewhere at the end."""
    if part.flow_style:
        at = _end(part.value[-1]) if part.value else part.start_mark.index + 1
        comma = ", " if part.value else ""
        return Change(at, at, comma + _key_and_value(key, value, _indent(text, part)))
    if top:
        at = part.end_mark.index
        return Change(
            at, at, ("" if text[:at].endswith("\n") else "\n") + to_block_yaml({key: value})
        )
    at, column = _start(part.value[min(1, len(part.value) - 1)]), part.start_mark.column
    return Change(at, at, f"{_key_and_value(key, value, column)}\n{' ' * column}")


def _inserted_item(text: str, part: Any, index: int, value: Any) -> Change:
    """Insert an item into a list that is not empty."""
    items = part.value
    if part.flow_style:
        if index < len(items):
            return Change(_start(items[index]), _start(items[index]), to_flow_yaml(value) + ", ")
        return Change(_end(items[-1]), _end(items[-1]), ", " + to_flow_yaml(value))
    column = part.start_mark.column
    lines = [to_flow_yaml(value, column + 2)]
    if isinstance(value, dict) and value:
        lines = [_key_and_value(key, item, column + 2) for key, item in value.items()]
    new = " " * column + "- " + f"\n{' ' * (column + 2)}".join(lines) + "\n"
    at = _line_end(text, _end(items[index - 1])) if index else part.start_mark.index - column
    return Change(at, at, new if text[:at].endswith("\n") or not at else "\n" + new)


def _start(entry: Any) -> int:
    """Index at which a list's item, or the key of a mapping, starts."""
    return int((entry[0] if isinstance(entry, tuple) else entry).start_mark.index)


def _end(entry: Any) -> int:
    """Index at which an entry or node ends, before blank lines and comments after a block."""
    node = entry[1] if isinstance(entry, tuple) else entry
    if isinstance(node, yaml.ScalarNode) or node.flow_style:
        return int(node.end_mark.index)
    return _end(node.value[-1])


def _line_end(text: str, at: int) -> int:
    """Index at which the next line starts."""
    return text.find("\n", at) + 1 or len(text)


def _indent(text: str, node: Any) -> int:
    """Column where the text of a node's line begins, after the dashes of lists."""
    line = text[node.start_mark.index - node.start_mark.column :]
    return len(line) - len(line.lstrip(" -"))


def _key_and_value(key: Any, value: Any, column: int) -> str:
    return to_flow_yaml({key: value}, column - 2)[1:-1]


def _with_comments(text: str, comments: Sequence[tuple[int, str]], change: Change) -> Change:
    """Put the comments of the replaced text in front of the new one, each on its own line."""
    start, end, new = change
    texts = [comment for at, comment in comments if start <= at < end]
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


def _comments(text: str) -> list[tuple[int, str]]:
    """Index and text of each comment, in order. Comments are only between tokens."""
    comments: list[tuple[int, str]] = []
    done = 0
    for token in yaml.scan(text, Loader=yaml.SafeLoader):
        while (start := text.find("#", done, token.start_mark.index)) >= 0:
            done = text.find("\n", start)
            done = len(text) if done < 0 else done
            comments.append((start, text[start:done].rstrip()))
        done = max(done, token.end_mark.index)
    return comments
