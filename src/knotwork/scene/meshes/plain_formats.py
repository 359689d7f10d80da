"""Mesh files without materials: STL, OBJ and PLY.

STL is read here, because importing trimesh takes 0.4 s, and OBJ, because trimesh leaves out what it
does not understand.
"""

from __future__ import annotations

import io
import re
from itertools import pairwise

import numpy as np

from knotwork.errors import InputError, format_value
from knotwork.scene.meshes.mesh_part import MeshPart, check_triangles, require_whole

_HEADER, _FACET = 84, 50
"""Bytes before the first facet of a binary file, and of each facet."""
_MAX_WORD = 32
_SOLID = re.compile(rb"^[ \t]*(end)?solid(?:[ \t][^\n]*)?$", re.IGNORECASE | re.MULTILINE)
_TEXT_FACET = (
    b"facet normal # # # outer loop vertex # # # vertex # # # vertex # # # endloop endfacet"
).split()
_WORDS = [i for i, word in enumerate(_TEXT_FACET) if word != b"#"]
_COORDINATES = [8, 9, 10, 12, 13, 14, 16, 17, 18]
_OBJ_WITHOUT_SURFACE = (
    "l", "p", "vt", "vn", "vp", "g", "o", "s", "mg", "usemtl", "mtllib", "usemap", "maplib",
    "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj",
)  # fmt: skip
"""Keywords of OBJ that define no surface."""
_PLY_ELEMENT = re.compile(rb"^element +(\S+) +(\d+)((?:\s+(?:property|comment) .*)*)", re.MULTILINE)


def read_stl(data: bytes) -> MeshPart:
    """Read all facets of an STL file, binary or text with one or more solids.

    Some programs begin binary files with `solid`, too, so zero bytes and the length decide.

    Raises:
        InputError: The file has other parts than facets, or another number than its header.
    """
    facets = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    length = _HEADER + _FACET * facets
    if len(data) == length:
        check_triangles(facets)
        rows = np.frombuffer(data[_HEADER:], [("v", "<f4", (4, 3)), ("attribute", "<u2")])
        return _facets(rows["v"][:, 1:])
    text = data.lstrip().replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"\0" not in text and _SOLID.match(text):
        return _read_text_stl(text)
    raise InputError(
        f"it is not read whole: it is no text, its header counts {facets} facets, which is a file "
        f"of {length} bytes, and it has {len(data)}"
    )


def _read_text_stl(data: bytes) -> MeshPart:
    ends = [bool(match[1]) for match in _SOLID.finditer(data)]
    is_closed = ends == [False, True] * (len(ends) // 2)
    require_whole(is_closed, "its lines 'solid' and 'endsolid' do not alternate")
    words = _SOLID.sub(b"", data).split()
    is_short = all(len(word) <= _MAX_WORD for word in words)
    require_whole(is_short, f"it has a word of more than {_MAX_WORD} characters")
    count, rest = divmod(len(words), len(_TEXT_FACET))
    fields = np.array(words[: len(words) - rest], dtype=f"S{_MAX_WORD}").reshape(
        count, len(_TEXT_FACET)
    )
    expected = np.array(_TEXT_FACET)[_WORDS]
    is_facet = (np.char.lower(fields[:, _WORDS]) == expected).all(axis=1)
    read = count if is_facet.all() else int(is_facet.argmin())
    if rest or read < count:
        line = b" ".join(words[read * len(_TEXT_FACET) :][:12]).decode(errors="replace")
        raise InputError(
            f"it is not read whole: {format_value(line)} after {read} facets is no facet"
        )
    check_triangles(count)
    return _facets(fields[:, _COORDINATES].astype(float))


def _facets(corners: np.ndarray) -> MeshPart:
    with np.errstate(invalid="ignore"):
        points = np.asarray(corners, dtype=float).reshape(-1, 3)
    return MeshPart(points, np.arange(len(points)).reshape(-1, 3))


def read_obj(data: bytes) -> MeshPart:
    """Read vertices and faces of an OBJ file, which does not state their number.

    Raises:
        InputError: The file has surfaces that are not polygons, or a line that can't be read.
    """
    points: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    text = data.replace(b"\\\r\n", b"  \n").replace(b"\\\n", b" ").decode("latin-1")
    for number, line in enumerate(text.split("\n"), 1):
        kind, *words = line.partition("#")[0].split() or ["g"]
        try:
            if kind == "v" and len(words) in (3, 4, 6, 7):
                points.append([float(word) for word in words[:3]])
            elif kind in ("f", "fo") and len(words) >= 3:
                numbers = [int(word.partition("/")[0]) for word in words]
                first, *others = [i - 1 if i >= 0 else i + len(points) for i in numbers]
                if min(first, *others) < 0:
                    raise ValueError
                triangles += [(first, *pair) for pair in pairwise(others)]
            elif kind not in _OBJ_WITHOUT_SURFACE:
                raise ValueError
        except ValueError as error:
            raise InputError(
                f"it is not read whole: line {number} is {format_value(line.strip())}; accepted: v "
                "with 3, 4, 6 or 7 numbers, and f with the numbers of three vertices or more"
            ) from error
    shape = (-1, 3)
    return MeshPart(
        np.array(points, dtype=float).reshape(shape),
        np.array(triangles, dtype=np.int64).reshape(shape),
    )


def read_ply(data: bytes) -> MeshPart:
    """Read the vertices and faces of a PLY file; polygons become triangles.

    Raises:
        InputError: The number of rows differs from the header, or other elements have surfaces,
            or it is binary, and its faces differ in their number of corners. trimesh raises other
            errors for other faults.
    """
    from trimesh.exchange.ply import load_ply
    from trimesh.geometry import triangulate_quads

    head, separator, body = data.partition(b"end_header")
    require_whole(bool(separator), "its header has no line 'end_header'")
    counts = {}
    for kind, count, properties in _PLY_ELEMENT.findall(head):
        name = kind.decode(errors="replace")
        counts[name] = int(count)
        require_whole(
            name == "face" or b"property list" not in properties or not int(count),
            f"it has {int(count)} of {name!r} with lists of vertices, and only those of 'face' are "
            "read",
        )
    listed = ", ".join(f"{count} of {name!r}" for name, count in counts.items())
    lines = sum(1 for line in body.splitlines() if line.strip())
    require_whole(
        b"ascii" not in head or lines == sum(counts.values()),
        f"its header counts {listed}, a line each, and it has {lines} lines",
    )
    fault = (
        f"its header counts {listed}, and it is cut off, damaged, has faces of fewer than 3 "
        "corners, or is binary with faces of different numbers of corners"
    )
    try:
        read = load_ply(io.BytesIO(data), fix_texture=False, skip_materials=True)
    except ValueError as error:
        raise InputError(f"it is not read whole: {fault}") from error
    points = np.asarray(read.get("vertices", np.zeros((0, 3))), dtype=float)
    faces = read.get("faces")
    triangles = np.zeros((0, 3), dtype=np.int64)
    if faces is not None and len(faces):
        triangles = np.asarray(triangulate_quads(faces), dtype=np.int64)
    is_whole = len(points) == counts.get("vertex", 0) and len(triangles) >= counts.get("face", 0)
    require_whole(is_whole, fault)
    return MeshPart(points, triangles)
