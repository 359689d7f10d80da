"""Reading glTF with trimesh, after a check for content that trimesh would ignore."""

from __future__ import annotations

import io
import json
from itertools import chain
from typing import Any

import numpy as np

from knotwork.errors import InputError, shown
from knotwork.scene.meshes.mesh_part import (
    MOST_MESH_TRIANGLES,
    MOST_SHOWN_SHAPES,
    MeshPart,
    check_triangles,
    require_whole,
)

_TRIANGLES = 4
"""Mode of a primitive of triangles."""
_MATERIALS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_")
"""Prefixes of extensions that do not change surfaces."""


def read_gltf(data: bytes, kind: str) -> tuple[MeshPart, ...]:
    """Read the shapes of a glTF file, `"gltf"` or `"glb"`; no other file is opened for it.

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
    placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
    check_triangles(sum(len(scene.geometry[name].faces) for _, name in placed))
    shapes = (scene.geometry[name].copy().apply_transform(place) for place, name in placed)
    return tuple(MeshPart(np.array(shape.vertices), np.array(shape.faces)) for shape in shapes)


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
    accessors = content.get("accessors", ())
    counts = [accessor.get("count", 0) for accessor in accessors]
    if any(not isinstance(count, int) or count > 3 * MOST_MESH_TRIANGLES for count in counts):
        raise InputError(f"an accessor has more than {3 * MOST_MESH_TRIANGLES} values")
    nodes = content.get("nodes", [])
    carried = list(chain.from_iterable(node.get("children", ()) for node in nodes))
    if len(nodes) > MOST_SHOWN_SHAPES or len(set(carried)) < len(carried):
        raise InputError(
            f"it has more than {MOST_SHOWN_SHAPES} nodes, or one that is in two others"
        )
    meshes = len(content.get("meshes", ()))
    for index in (node["mesh"] for node in nodes if "mesh" in node):
        if index not in range(meshes):
            raise InputError(f"a node shows mesh {shown(index)} of {meshes}, counted from 0")
    primitives = [part for mesh in content.get("meshes", ()) for part in mesh["primitives"]]
    extensions = [*content.get("extensionsRequired", ())]
    extensions += chain.from_iterable(part.get("extensions", ()) for part in (*primitives, *nodes))
    unread = {
        "a skin": any("skin" in node for node in nodes),
        "morph targets": any("targets" in part for part in primitives),
        "primitives that are not triangles (mode 4)": any(
            part.get("mode", _TRIANGLES) != _TRIANGLES for part in primitives
        ),
        "an accessor that is sparse or without a bufferView": any(
            "sparse" in accessor or "bufferView" not in accessor for accessor in accessors
        ),
        **{f"extension {name}": not name.startswith(_MATERIALS) for name in extensions},
    }
    for content_kind, is_present in unread.items():
        require_whole(not is_present, f"it has {content_kind}, which is not read")
