"""Reader of COLLADA, by pycollada: shapes as nodes place them, and their colours.

As in ROS, the unit of length of a file is used and its upward axis ignored. Nodes can show other
nodes, so a short file can show millions of shapes. Therefore shapes are counted first. Lines
have no surface and are not read.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from functools import cache
from typing import Any
from xml.etree import ElementTree

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError, format_value
from knotwork.files.documents import check_xml
from knotwork.scene.meshes.mesh_part import (
    MAX_SHOWN_SHAPES,
    MeshPart,
    check_triangles,
    require_whole,
)

MAX_COLLADA_ELEMENTS = 100_000
"""Maximum number of XML elements of a COLLADA file; few elements hold all of its numbers."""

_MATERIAL_ELEMENTS = ("library_images", "library_effects", "library_materials", "bind_material")
"""Elements of COLLADA that define the appearance of surfaces."""

_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans", "lines", "linestrips")
"""Elements of COLLADA that are part of a geometry."""
_UNREAD = {
    "instance_controller": "a skin or morph (<instance_controller>)",
    "ph": "a polygon with holes (<ph>)",
}


def read_collada(data: bytes) -> tuple[MeshPart, ...]:
    """Read a COLLADA file, without colours if its materials have a fault.

    Args:
        data: The content.

    Raises:
        InputError: The data is not XML, or too large.
        ValueError: The file shows no scene. pycollada raises other errors for other faults.
    """
    import collada

    check_xml(data, MAX_COLLADA_ELEMENTS)
    root = ElementTree.fromstring(data)
    _check_shapes(root)
    _check_whole(root)
    try:
        try:
            document = collada.Collada(io.BytesIO(data))
        except collada.common.DaeError:
            document = collada.Collada(_remove_materials(data))
    except collada.common.DaeError as error:
        raise ValueError(str(error)) from error
    if document.scene is None:
        raise ValueError("it shows no scene")
    scale = document.assetInfo.unitmeter
    scale = 1.0 if scale is None else scale
    unit = np.diag([scale, scale, scale, 1.0])
    parts: list[MeshPart] = []
    triangles = 0
    for shape in document.scene.objects("geometry"):
        for part in _place_parts(shape, unit @ shape.matrix):
            parts.append(part)
            triangles += len(part.triangles)
            check_triangles(triangles)
    return tuple(parts)


def _tag(element: ElementTree.Element) -> str:
    """Name of an element without its namespace; empty for comments."""
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else ""


def _check_whole(root: ElementTree.Element) -> None:
    """Check that all shapes of a file are of supported kinds.

    pycollada expects contiguous values, replaces text that is not a number by zeros,
    and uses the first of several lists of corners.

    Raises:
        InputError: A shape is not supported.
    """
    for element in root.iter():
        kind = _tag(element)
        require_whole(kind not in _UNREAD, f"it has {_UNREAD.get(kind)}, which is not read")
        if kind == "unit":
            _check_unit(element.get("meter", "1"))
        elif kind in ("p", "float_array") and "n" in (element.text or "").lower():
            raise InputError(f"<{kind}> has numbers that are not finite")
        elif kind == "accessor":
            offset, stride = element.get("offset", "0"), element.get("stride", "1")
            named = sum(_tag(child) == "param" for child in element)
            require_whole(
                offset == "0" and stride == str(named),
                f"an accessor has offset {format_value(offset)} and stride {format_value(stride)}; "
                f"accepted: offset 0, and the number of its values as stride, {named}",
            )
        elif kind in ("triangles", "polylist"):
            lists = sum(_tag(child) == "p" for child in element)
            require_whole(lists <= 1, f"<{kind}> has {lists} <p>; only one is read")


def _check_unit(metres: str) -> None:
    """Refuse a unit that is not a number, which pycollada would read as a metre."""
    try:
        is_length = 0.0 <= float(metres) < float("inf")
    except ValueError:
        is_length = False
    if not is_length:
        raise InputError(f"its unit of length is {format_value(metres)}, not a number of metres")


def _check_shapes(root: ElementTree.Element) -> None:
    """Count the shapes shown by nodes, and by the nodes that they show.

    Each part of a geometry counts wherever it is shown.

    Raises:
        InputError: There are more than `MAX_SHOWN_SHAPES`.
        RecursionError: A node shows itself.
    """
    named = {e.get("id"): e for e in root.iter() if _tag(e) in ("node", "geometry")}

    @cache
    def shape_count(element: ElementTree.Element) -> int:
        kind, url = _tag(element), element.get("url", "")
        if kind.startswith("instance_"):
            shown_element = named.get(url.removeprefix("#"))
            return 1 if shown_element is None else max(1, shape_count(shown_element))
        if kind == "geometry":
            return sum(_tag(part) in _PRIMITIVES for part in element.iter())
        return sum(map(shape_count, element))

    shapes = sum(shape_count(scene) for scene in root.iter() if _tag(scene) == "visual_scene")
    if shapes > MAX_SHOWN_SHAPES:
        raise InputError(f"its nodes show {shapes:.3g} shapes; at most {MAX_SHOWN_SHAPES} are read")


def _remove_materials(data: bytes) -> io.BytesIO:
    """Remove the materials from a COLLADA document."""
    root = ElementTree.fromstring(data)
    for element in list(root.iter()):
        for child in list(element):
            if _tag(child) in _MATERIAL_ELEMENTS:
                element.remove(child)
    return io.BytesIO(ElementTree.tostring(root))


def _place_parts(shape: Any, placement: FloatArray) -> Iterator[MeshPart]:
    """Place the parts of a `collada.geometry.BoundGeometry` as its nodes do."""
    import collada

    turn = placement[:3, :3]
    for primitive in shape.original.primitives:
        polygons = isinstance(primitive, collada.polylist.Polylist)
        faces = primitive.triangleset() if polygons else primitive
        if not isinstance(faces, collada.triangleset.TriangleSet) or not len(faces):
            continue
        # a mirroring placement reverses the triangles
        order = slice(None, None, -1 if np.linalg.det(turn) < 0 else 1)
        material = shape.materialnodebysymbol.get(primitive.material)
        diffuse = material.target.effect.diffuse if material else None
        colour = None
        if isinstance(diffuse, tuple):  # otherwise it is an image
            red, green, blue, opacity = (*diffuse, 1.0)[:4]
            colour = (red, green, blue, opacity)
        points = faces.vertex @ turn.T + placement[:3, 3]
        triangles = faces.vertex_index[:, order].astype(np.int64)
        yield MeshPart(points, triangles, colour)
