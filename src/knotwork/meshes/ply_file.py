"""Reading PLY whole: trimesh takes what it finds of rows that the header counts and are missing."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.meshes.part import IndexArray
from knotwork.meshes.polygons import fans
from knotwork.meshes.size_limits import MOST_TRIANGLES
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
        if lines != sum(element.rows for element in elements):
            raise InputError(
                f"it is not read whole: its header counts {_listed(elements)}, a line each, and "
                f"it has {lines} lines"
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
        elif element.rows and {"vertex_indices", "vertex_index"}.intersection(columns):
            raise InputError(
                f"it is not read whole: it has {element.rows} of {element.name!r} with lists of "
                "vertices, and only those of 'face' are read"
            )
    if rows.left:
        raise InputError(
            f"it is not read whole: its header counts {_listed(elements)}, and after them are "
            f"{rows.left} {'bytes' if order else 'numbers'}"
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
    if not found:
        raise InputError("it is not read whole: its header has no line 'end_header'")
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
                made = _Property(_TYPES[kind], _TYPES[length] if length else "")
                if elements[-1].properties.setdefault(name, made) is not made:
                    raise InputError(f"its header has property {name!r} twice")
            elif words and words[0] not in ("comment", "obj_info"):
                raise KeyError(words[0])
        except (KeyError, IndexError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"its header has a line {shown(line)}, which is not known") from error
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
        self._bytes = body
        words = () if order else body.split()
        self._values = np.fromiter(map(float, words), float, len(words))

    @property
    def left(self) -> int:
        """Bytes, or numbers, that are not read yet."""
        return len(self._bytes if self._order else self._values) - self._place

    def read(self, element: _Element) -> dict[str, FloatArray | list[FloatArray]]:
        """The values of each property: shape (n,), of lists (n, k) or one array for each row."""
        if not element.rows:
            return {
                name: np.zeros((0, 3) if kind.length else 0)
                for name, kind in element.properties.items()
            }
        start = self._place
        first = self._row(element, 0)
        kinds = [
            one.length + len(value) * one.kind
            for one, value in zip(element.properties.values(), first, strict=True)
        ]
        self._place = start
        if self._size("".join(kinds)) * element.rows <= self.left:
            columns = self._alike(element, kinds)
            if columns is not None:
                return columns
            self._place = start
        rows = [self._row(element, i) for i in range(element.rows)]
        values = zip(element.properties.items(), zip(*rows, strict=True), strict=True)
        return {
            name: list(column) if kind.length else np.concatenate(column)
            for (name, kind), column in values
        }

    def _alike(
        self, element: _Element, kinds: list[str]
    ) -> dict[str, FloatArray | list[FloatArray]] | None:
        """Rows that are as long as the first one, or `None` where their lists are not."""
        table = self._take("".join(kinds), element.rows)
        columns: dict[str, FloatArray | list[FloatArray]] = {}
        at = 0
        for (name, one), part in zip(element.properties.items(), kinds, strict=True):
            values = table[:, at : at + len(part)]
            at += len(part)
            if one.length and (values[:, 0] != len(part) - 1).any():
                return None
            columns[name] = values[:, 1:] if one.length else values[:, 0]
        return columns

    def _row(self, element: _Element, index: int) -> list[FloatArray]:
        row = []
        for one in element.properties.values():
            length = 1
            if one.length:
                (counted,) = self._take_of(element, index, one.length)
                length = int(counted)
                if not 0 <= length <= self.left:
                    raise self._cut_off(element, index)
            row.append(self._take_of(element, index, one.kind * length))
        return row

    def _take_of(self, element: _Element, index: int, kinds: str) -> FloatArray:
        if self._size(kinds) > self.left:
            raise self._cut_off(element, index)
        values: FloatArray = self._take(kinds, 1)[0]
        return values

    def _cut_off(self, element: _Element, index: int) -> InputError:
        return InputError(
            f"it is not read whole: its header counts {element.rows} of {element.name!r}, and "
            f"number {index + 1} is cut off or damaged"
        )

    def _size(self, kinds: str) -> int:
        """Of a row, in bytes or numbers."""
        return struct.calcsize(self._order + kinds) if self._order else len(kinds)

    def _take(self, kinds: str, rows: int) -> FloatArray:
        """The next numbers, shape (rows, len(kinds)); there are as many."""
        start, self._place = self._place, self._place + rows * self._size(kinds)
        if not self._order:
            return self._values[start : self._place].reshape(rows, len(kinds))
        if rows == 1:
            found = struct.unpack_from(self._order + kinds, self._bytes, start)
            return np.array([found], dtype=float)
        fields = [(str(i), self._order + kind) for i, kind in enumerate(kinds)]
        table = np.frombuffer(self._bytes[start : self._place], dtype=fields)
        with np.errstate(invalid="ignore"):
            return np.column_stack([table[name].astype(float) for name, _ in fields])
