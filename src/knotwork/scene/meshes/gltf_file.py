"""Reading glTF with trimesh, after a check for content that trimesh would ignore."""

from __future__ import annotations

import io
import json
from itertools import chain
from typing import Any

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.mesh_part import IndexArray
from knotwork.scene.meshes.size_limits import (
    MOST_NESTED,
    MOST_SHAPES,
    MOST_TRIANGLES,
    check_triangles,
    require_whole,
)
from knotwork.waypoints import FloatArray

_TRIANGLES = 4
"""Mode of a primitive of triangles."""
_LOOKS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_")
"""Prefixes of extensions that do not change surfaces."""


def read_gltf(data: bytes, kind: str) -> tuple[FloatArray, IndexArray]:
    """Read the shape of a glTF file, `"gltf"` or `"glb"`; no other file is opened for it.

    Returns:
        Points, shape (n, 3), and triangles, shape (m, 3).

    Raises:
        InputError: The file needs much memory, its nodes are not a tree, or it has unsupported
            surfaces.
        ValueError: The data is not glTF. trimesh raises other errors for other faults.
    """
    import trimesh

    _check(_content(data, kind))
    scene = trimesh.load_scene(
        io.BytesIO(data), file_type=kind, process=False, skip_materials=True, ignore_broken=False
    )
    shapes = [scene.geometry[name] for _, name in map(scene.graph.get, scene.graph.nodes_geometry)]
    check_triangles(sum(len(shape.faces) for shape in shapes))
    for shape in shapes:
        if len(shape.faces) and not 0 <= shape.faces.min() <= shape.faces.max() < len(
            shape.vertices
        ):
            raise InputError(f"it has an index that is not in 0 to {len(shape.vertices) - 1}")
    if not shapes:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    whole = scene.to_mesh()
    return np.asarray(whole.vertices, dtype=float), np.asarray(whole.faces, dtype=np.int64)


def _content(data: bytes, kind: str) -> Any:
    """Content of the JSON of a glTF file."""
    if kind == "glb":  # a header of 12 bytes, then the length and kind of the first chunk
        length = int.from_bytes(data[8:12], "little")
        fault = f"its header states {length} bytes, and it has {len(data)}"
        require_whole(length == len(data), fault)
        data = data[20 : 20 + int.from_bytes(data[12:16], "little")]
    return json.loads(data)


def _check(content: Any) -> None:
    """Refuse content that needs much memory, or that trimesh ignores."""
    counts = [accessor.get("count", 0) for accessor in content.get("accessors", ())]
    if any(not isinstance(count, int) or count > 3 * MOST_TRIANGLES for count in counts):
        raise InputError(f"an accessor has more than {3 * MOST_TRIANGLES} values")
    nodes = content.get("nodes", [])
    carried = list(chain.from_iterable(node.get("children", ()) for node in nodes))
    if len(nodes) > MOST_SHAPES or len(set(carried)) < len(carried):
        raise InputError(f"it has more than {MOST_SHAPES} nodes, or one that is in two others")
    below = {i: node.get("children", ()) for i, node in enumerate(nodes)}
    level, depth = [i for i in below if i not in set(carried)], 0
    while level:
        level, depth = [one for i in level for one in below[i]], depth + 1
        if depth > MOST_NESTED:
            raise InputError(f"its nodes are in one another more than {MOST_NESTED} deep")
    meshes = len(content.get("meshes", ()))
    for index in (node["mesh"] for node in nodes if "mesh" in node):
        if index not in range(meshes):
            raise InputError(f"a node shows mesh {shown(index)} of {meshes}, counted from 0")
    primitives = [one for mesh in content.get("meshes", ()) for one in mesh["primitives"]]
    extended = [*content.get("extensionsRequired", ())]
    extended += chain.from_iterable(one.get("extensions", ()) for one in (*primitives, *nodes))
    unread = {
        "a skin": any("skin" in node for node in nodes),
        "morph targets": any("targets" in one for one in primitives),
        "primitives that are not triangles (mode 4)": any(
            one.get("mode", _TRIANGLES) != _TRIANGLES for one in primitives
        ),
        "an accessor that is sparse or without a bufferView": any(
            "sparse" in one or "bufferView" not in one for one in content.get("accessors", ())
        ),
        **{f"extension {name}": not name.startswith(_LOOKS) for name in extended},
    }
    for what, found in unread.items():
        require_whole(not found, f"it has {what}, which is not read")
