"""Reading STL here, since importing trimesh alone takes 0.4 s of processor time."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.mesh_part import IndexArray
from knotwork.scene.meshes.size_limits import check_triangles
from knotwork.waypoints import FloatArray

_HEADER, _FACET = 84, 50
"""Bytes before the first facet of a binary file, and of each facet."""

_VERTEX_NUMBERS = 3 * rb"\s+([^\s]{1,32})"
_NORMAL = 3 * rb"\s+[^\s]{1,32}"
_TEXT_FACET = re.compile(
    rb"\s*facet\s+normal" + _NORMAL + rb"\s+outer\s+loop" + 3 * (rb"\s+vertex" + _VERTEX_NUMBERS)
    + rb"\s+endloop\s+endfacet(?=\s|$)",
    re.IGNORECASE,
)  # fmt: skip
_START = re.compile(rb"\s*solid(?:[ \t][^\r\n]*)?(?=[\r\n]|$)", re.IGNORECASE)
_END = re.compile(rb"\s*endsolid(?:[ \t][^\r\n]*)?(?=[\r\n]|$)", re.IGNORECASE)


def read_stl(data: bytes) -> tuple[FloatArray, IndexArray]:
    """Read all facets of an STL file, binary or text with one or more solids.

    Some programs begin binary files with `solid` as well, so zero bytes and the length decide.

    Returns:
        The corners, three of each facet, shape (3 n, 3), and their indices, shape (n, 3).

    Raises:
        InputError: The file has other parts than facets, or another number than its header.
    """
    facets = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    length = _HEADER + _FACET * facets
    if len(data) >= _HEADER and len(data) == length:
        check_triangles(facets)
        rows = np.frombuffer(data[_HEADER:], [("v", "<f4", (4, 3)), ("attribute", "<u2")])
        with np.errstate(invalid="ignore"):
            return _facets(rows["v"][:, 1:])
    if _START.match(data) and b"\0" not in data:
        return _read_text(data)
    if len(data) < _HEADER:
        raise InputError(
            f"it has {len(data)} bytes: binary files have {_HEADER} or more, and text begins with "
            "'solid'"
        )
    raise InputError(
        f"it is not read whole: its header counts {facets} facets, which is a file of {length} "
        f"bytes, and it has {len(data)}"
    )


def _facets(corners: Any) -> tuple[FloatArray, IndexArray]:
    points = np.asarray(corners, dtype=float).reshape(-1, 3)
    return points, np.arange(len(points)).reshape(-1, 3)


def _read_text(data: bytes) -> tuple[FloatArray, IndexArray]:
    facets: list[tuple[bytes, ...]] = []
    place, inside = 0, False
    while match := (inside and _TEXT_FACET.match(data, place)) or (
        (_END if inside else _START).match(data, place)
    ):
        place = match.end()
        if match.re is _TEXT_FACET:
            facets.append(match.groups())
        else:
            inside = not inside
    unread = data[place:].lstrip()
    if inside or unread:
        line = data.count(b"\n", 0, len(data) - len(unread)) + 1
        words = " ".join(unread[:200].decode(errors="replace").split())
        wanted = "a facet of three vertices or 'endsolid'" if inside else "'solid' or its end"
        raise InputError(
            f"it is not read whole: {shown(words) if unread else 'its end'} is in line {line}, "
            f"after {len(facets)} facets, where {wanted} must be"
        )
    check_triangles(len(facets))
    return _facets(np.array(facets, dtype="S32"))
