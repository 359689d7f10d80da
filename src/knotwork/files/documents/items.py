"""Items inserted into, or removed from, lists of a YAML text; the rest stays unchanged."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import yaml

from knotwork.errors import InputError
from knotwork.files.documents.document import Location, field_path
from knotwork.files.documents.edits import REMOVED, edited_text, end_of, flow, places_of, written
from knotwork.files.documents.yaml_text import parse


def changed_text(text: str, place: Location, value: Any, *, insert: bool = False) -> str:
    r"""The text of a YAML file with one change, whatever is at its place.

    Missing mappings around a new key are added; a mapping that loses its last key is removed.

    Args:
        text: The text.
        place: Location of the value; for an inserted item, its new index.
        value: The new value; `REMOVED` removes the key or item.
        insert: Insert an item into a list, before the item with its index.

    Raises:
        InputError: The place does not exist, or the change can't be written into this text.

    Aliases of changed parts are first written out with their values.

    >>> print(changed_text("a: &a {b: 1}\nc: *a", ("c", "b"), 2))
    a: &a {b: 1}
    c: {b: 2}
    >>> print(changed_text("a: [1, 2] # two", ("a", 1), 5, insert=True))
    a: [1, 5, 2] # two
    >>> print(changed_text("- b: 1 # one\n- b: 3", (1,), {"b": 2}, insert=True))
    - b: 1 # one
    - b: 2
    - b: 3
    """
    data = parse(text).data
    text = _without_aliases(text, data, place, inner=value is REMOVED)
    if value is REMOVED:
        while len(place) > 1 and isinstance(around := part_of(data, place[:-1]), dict):
            if len(around) > 1:
                break
            place = place[:-1]
    else:
        while len(place) > 1 and part_of(data, place[:-1]) is None:
            place, value, insert = place[:-1], [value] if insert else {place[-1]: value}, False
    around, last = part_of(data, place[:-1]), place[-1]
    inside = isinstance(around, list) and isinstance(last, int) and 0 <= last < len(around) + insert
    exists = part_of(data, place) is not None if value is REMOVED else isinstance(last, str)
    if not inside and not (isinstance(around, dict) and exists and not insert):
        raise InputError(f"nothing can be changed at {field_path(place)}: no such field")
    if not insert and not (value is REMOVED and isinstance(place[-1], int)):
        return edited_text(text, {place: value})
    return _with_items(text, data, place, value)


def _without_aliases(text: str, data: Any, place: Location, *, inner: bool) -> str:
    """The text with values for the aliases at a place, around it or, `inner`, in it."""
    if "*" not in text:
        return text
    shared: dict[int, Location] = {}
    for at, (_, node) in places_of(yaml.compose(text, Loader=yaml.SafeLoader)):
        if place[: len(at)] == at or (inner and at[: len(place)] == place):
            shared.setdefault(node.start_mark.index, at)
    events: list[Any] = [*yaml.parse(text, yaml.SafeLoader)]
    anchored = [event for event in events if getattr(event, "anchor", None)]
    anchors = {
        event.anchor: shared.get(event.start_mark.index)
        for event in anchored
        if not _is_alias(event)
    }
    result = text
    for alias in reversed([event for event in anchored if _is_alias(event)]):
        value_at = anchors[alias.anchor]
        if value_at is not None:
            start, end = alias.start_mark.index, alias.end_mark.index
            result = result[:start] + flow(part_of(data, value_at)) + result[end:]
    return written(result, data, field_path(place))


def _is_alias(event: Any) -> bool:
    return isinstance(event, yaml.AliasEvent)


def part_of(data: Any, place: Location) -> Any:
    """The value at a place, or `None`."""
    for key in place:
        if isinstance(data, dict):
            data = data.get(key)
        elif isinstance(data, list) and isinstance(key, int) and 0 <= key < len(data):
            data = data[key]
        else:
            return None
    return data


def _with_items(text: str, data: Any, place: Location, value: Any) -> str:
    around, index = place[:-1], int(place[-1])
    wanted = copy.deepcopy(data)
    items = part_of(wanted, around)
    if value is REMOVED:
        del items[index]
    else:
        items.insert(index, value)
    if not items or len(items) == 1 == len(part_of(data, around)) + 1:
        return edited_text(text, {around: items})
    _, node = dict(places_of(yaml.compose(text, Loader=yaml.SafeLoader)))[around]
    change = _in_flow if node.flow_style else _in_block
    start, end, new = change(text, node.value, index, value)
    return written(text[:start] + new + text[end:], wanted, field_path(place))


def _in_flow(text: str, nodes: Sequence[Any], index: int, value: Any) -> tuple[int, int, str]:
    starts = [node.start_mark.index for node in nodes]
    if value is REMOVED and index + 1 < len(nodes):
        return starts[index], starts[index + 1], ""
    if value is REMOVED:
        return end_of(nodes[index - 1]), end_of(nodes[index]), ""
    if index < len(nodes):
        return starts[index], starts[index], flow(value) + ", "
    return end_of(nodes[-1]), end_of(nodes[-1]), ", " + flow(value)


def _in_block(text: str, nodes: Sequence[Any], index: int, value: Any) -> tuple[int, int, str]:
    column = nodes[0].start_mark.column - len(_dash(text, nodes[0]))
    if value is REMOVED:
        node = nodes[index]
        start = node.start_mark.index - node.start_mark.column
        return start, _line_end(text, end_of(node)), ""
    inner = " " * (column + 2)
    lines = (
        [f"{key}: {flow(item, column + 2)}" for key, item in value.items()]
        if isinstance(value, dict) and value
        else [flow(value, column + 2)]
    )
    item = " " * column + "- " + f"\n{inner}".join(lines) + "\n"
    if index:
        at = _line_end(text, end_of(nodes[index - 1]))
        return at, at, item if text[:at].endswith("\n") else "\n" + item
    first = nodes[0].start_mark
    at = first.index - first.column
    return at, at, item


def _dash(text: str, node: Any) -> str:
    """The text from the start of an item's dash to the item."""
    line = text[node.start_mark.index - node.start_mark.column : node.start_mark.index]
    return line[line.rindex("-") :]


def _line_end(text: str, at: int) -> int:
    """Start of the next line."""
    return text.find("\n", at) + 1 or len(text)
