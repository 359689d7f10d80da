"""Reading PLY whole: trimesh takes what it finds of rows that the header counts and are missing."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.part import IndexArray
from knotwork.scene.meshes.polygons import fans
from knotwork.scene.meshes.size_limits import MOST_TRIANGLES, require_whole
from knotwork.waypoints import FloatArray

_TYPES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
    "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class _Property(NamedTuple):
    """Type of a value, or of those of a list and of its length; that is empty for others."""

    kind: str
    length: str = ""


class _Element(NamedTuple):
    name: str
    rows: int
    properties: dict[str, _Property]


def read_ply(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read the vertices and faces of a PLY file; polygons become triangles.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: It has fewer or more rows than its header counts, or triangle strips.
    """
    elements, order, body = _header(data)
    if not order:
        lines = sum(1 for line in body.splitlines() if line.strip())
        require_whole(
            lines == sum(element.rows for element in elements),
            f"its header counts {_listed(elements)}, a line each, and it has {lines} lines",
        )
    rows = _Rows(body, order)
    points, triangles = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    for element in elements:
        columns = rows.read(element)
        if element.name == "vertex":
            if not all(axis in columns and np.ndim(columns[axis]) == 1 for axis in "xyz"):
                raise InputError("its vertices have no x, y and z, a number each")
            points = np.column_stack([np.asarray(columns[axis]) for axis in "xyz"])
        elif element.name == "face" and element.rows:
            given = [name for name in ("vertex_indices", "vertex_index") if name in columns]
            if not given or not element.properties[given[0]].length:
                raise InputError("its faces have no list vertex_indices or vertex_index")
            triangles = fans(columns[given[0]])
        elif element.name == "tristrips" and element.rows:
            raise InputError(f"it has {element.rows} triangle strips, and none are read")
        else:
            require_whole(
                not (element.rows and {"vertex_indices", "vertex_index"}.intersection(columns)),
                f"it has {element.rows} of {element.name!r} with lists of vertices, and only those "
                "of 'face' are read",
            )
    require_whole(
        not rows.left,
        f"its header counts {_listed(elements)}, and after them are {rows.left} "
        f"{'bytes' if order else 'numbers'}",
    )
    return points, triangles


def _listed(elements: Sequence[_Element]) -> str:
    return ", ".join(f"{element.rows} of {element.name!r}" for element in elements)


def _header(data: bytes) -> tuple[list[_Element], str, bytes]:
    """The elements, the order of bytes (empty for text), and what follows the header."""
    end = next((end for end in (b"\r\n", b"\n", b"\r") if data.startswith(b"ply" + end)), None)
    if end is None:
        raise InputError("its first line is not 'ply'")
    head, found, body = data.partition(end + b"end_header" + end)
    require_whole(bool(found), "its header has no line 'end_header'")
    elements: list[_Element] = []
    order = None
    for line in head.decode("ascii", errors="replace").splitlines()[1:]:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                _, name, count = words
                elements.append(_Element(name, int(count), {}))
            elif words[:1] == ["property"]:
                *kinds, name = words[1:]
                length, kind = kinds[1:] if kinds[0] == "list" else ("", kinds[0])
                if name in elements[-1].properties:
                    raise ValueError(name)
                made = _Property(_TYPES[kind], _TYPES[length] if length else "")
                elements[-1].properties[name] = made
            elif words and words[0] not in ("comment", "obj_info"):
                raise KeyError(words[0])
        except (KeyError, IndexError, ValueError) as error:
            fault = f"its header has a line {shown(line)}, which is not known or there twice"
            raise InputError(fault) from error
    names = [element.name for element in elements]
    if order is None or len(set(names)) < len(names):
        raise InputError("its header names no format, or an element twice")
    if any(not 0 <= element.rows <= 3 * MOST_TRIANGLES for element in elements):
        raise InputError(
            f"its header counts {_listed(elements)}; at most {3 * MOST_TRIANGLES} are read"
        )
    return elements, order, body


class _Rows:
    """What follows a header: numbers of text, or bytes."""

    def __init__(self, body: bytes, order: str) -> None:
        self._order, self._place = order, 0
        words = () if order else body.split()
        self._values = np.fromiter(map(float, words), float, len(words))
        self._bytes = body

    @property
    def left(self) -> int:
        """Bytes, or numbers, that are not read yet."""
        return len(self._bytes if self._order else self._values) - self._place

    def read(self, element: _Element) -> dict[str, FloatArray | list[FloatArray]]:
        """The values of each property: shape (n,), of lists (n, k) or one array for each row.

        Raises:
            InputError: Rows are missing.
        """
        properties = element.properties
        try:
            if not any(one.length for one in properties.values()):
                table = self._take("".join(one.kind for one in properties.values()), element.rows)
                return dict(zip(properties, table.T, strict=True))
            if len(properties) == 1 and (same := self._same_length(element)) is not None:
                return dict.fromkeys(properties, same)
            columns: dict[str, list[FloatArray]] = {name: [] for name in properties}
            for _ in range(element.rows):
                for name, one in properties.items():
                    count = self._count(one) if one.length else 1
                    columns[name].append(self._take(one.kind, count)[:, 0])
        except EOFError as error:
            raise InputError(
                f"it is not read whole: its header counts {element.rows} of {element.name!r}, and "
                "some are cut off or damaged"
            ) from error
        return {
            name: list(column) if properties[name].length else np.concatenate([*column, []])
            for name, column in columns.items()
        }

    def _same_length(self, element: _Element) -> FloatArray | None:
        """Lists that are as long as the first one, shape (n, k); `None` if they are not."""
        start, (one,) = self._place, element.properties.values()
        count = self._count(one) if element.rows else 0
        self._place = start
        kinds = one.length + count * one.kind
        if self._size(kinds) * element.rows <= self.left:
            table = self._take(kinds, element.rows)
            if (table[:, 0] == count).all():
                return table[:, 1:]
        self._place = start
        return None

    def _count(self, one: _Property) -> int:
        """The length of the next list."""
        count = int(self._take(one.length, 1)[0, 0])
        if not 0 <= count <= self.left:
            raise EOFError
        return count

    def _size(self, kinds: str) -> int:
        """Of a row, in bytes or numbers."""
        return struct.calcsize(self._order + kinds) if self._order else len(kinds)

    def _take(self, kinds: str, rows: int) -> FloatArray:
        """The next numbers, shape (rows, len(kinds)).

        Raises:
            EOFError: There are fewer.
        """
        start, size = self._place, rows * self._size(kinds)
        if size > self.left:
            raise EOFError
        self._place += size
        if not self._order:
            return self._values[start : self._place].reshape(rows, len(kinds))
        fields = [(str(i), self._order + kind) for i, kind in enumerate(kinds)]
        table = np.frombuffer(self._bytes, fields, rows, start)
        with np.errstate(invalid="ignore"):
            return np.stack([table[name].astype(float) for name, _ in fields], axis=1)
