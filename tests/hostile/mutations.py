"""Random changes of data, XML and bytes, the same ones every time for a seed."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

WORDS = [
    *("", " ", "x", "0", "-1", "nan", "inf", "1e999", "-1e308", "1e-320", "0x10", "1_000", "١"),
    *("[/]", "\x1b[2J", "a\nb", " a ", "time", "s", "tool.x", "../../etc/passwd", "~"),
    *(
        "/dev/zero",
        "😀",
        "\u202e",
        "x" * 5000,
        "null",
        "true",
        "universe",
        "base",
        "package://a/b",
        'a,b;c\t"d',
    ),
]
VALUES: list[Any] = [
    *(None, True, False, 0, 1, -1, 2, 0.5, -0.0, 1e-9, 1e9, 1e12, -1e12, 1e300, 10**400, 5e-324),
    *([], {}, [0], [1, 2, 3], [[1, 2], [3]], {"x": 1}, {"position": [0, 0, 0]}, [None] * 20),
]


def places(data: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Keys and indices of all parts of plain data."""
    if at:
        yield at
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from places(value, (*at, key))


def changed_data(rng: random.Random, data: Any) -> Any:
    """Plain data with some parts replaced, scaled, left out, doubled or exchanged."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        known = list(places(data))
        if not known:
            break
        *way, last = rng.choice(known)
        part = data
        for key in way:
            part = part[key]
        kind = rng.randrange(7)
        value = part[last]
        if kind == 0:
            del part[last]
        elif kind == 1 and isinstance(value, int | float):
            part[last] = value * rng.choice((-1, 0, 1e-6, 0.1, 2, 57.3, 1e3, 1e9))
        elif kind == 2 and isinstance(part, list):
            part.insert(rng.randrange(len(part) + 1), copy.deepcopy(value))
        elif kind == 3 and isinstance(part, dict):
            part[rng.choice(WORDS)] = part.pop(last)
        elif kind == 4:
            other: Any = data
            *there, end = rng.choice(known)
            try:
                for key in there:
                    other = other[key]
                part[last] = copy.deepcopy(other[end])
            except (LookupError, TypeError):
                continue
        else:
            part[last] = rng.choice((rng.choice(VALUES), rng.choice(WORDS)))
    return data


def changed_xml(rng: random.Random, text: str) -> str:
    """XML with some attributes, texts and elements changed."""
    root = ElementTree.fromstring(text)
    for _ in range(rng.choice((1, 1, 2, 3))):
        elements = list(root.iter())
        element = rng.choice(elements)
        kind = rng.randrange(6)
        if kind <= 2 and element.attrib:
            name = rng.choice(list(element.attrib))
            words = [word for word in WORDS if word.isprintable()]
            old = element.attrib[name].split()
            element.attrib[name] = rng.choice(
                [rng.choice(words), " ".join([*old, "1"]), " ".join(old[1:]), "0 0 0"]
            )
        elif kind == 3 and element is not root:
            above = next(one for one in elements if element in list(one))
            change = rng.choice((above.remove, above.append))
            change(element)
        elif kind == 4:
            other = copy.deepcopy(rng.choice(elements))
            if other.tag != root.tag:
                element.append(other)
        elif kind == 5:
            element.tag = rng.choice(elements).tag
        elif element.text and element.text.strip():
            words = element.text.split()
            words[rng.randrange(len(words))] = rng.choice(("x", "nan", "-1", "99999999", ""))
            element.text = " ".join(words)
    return ElementTree.tostring(root, encoding="unicode")


def changed_bytes(rng: random.Random, data: bytes) -> bytes:
    """Bytes with some replaced, left out, repeated or put in."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(changed) + 1)
        kind = rng.randrange(4)
        if kind == 0 and at < len(changed):
            changed[at] = rng.randrange(256)
        elif kind == 1:
            del changed[at : at + rng.randint(1, 40)]
        elif kind == 2:
            changed[at:at] = changed[max(0, at - 60) : at]
        else:
            numbers = (b"-1", b"nan", b"1e999", b"4000000000", b"\xff\xff\xff\x7f", b" ", b"\n")
            changed[at:at] = rng.choice(numbers)
    return bytes(changed)


def as_json(data: Any) -> str:
    """JSON with what Python writes beyond the standard, too."""
    return json.dumps(data, ensure_ascii=False)
