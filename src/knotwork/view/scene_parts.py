"""Parts of a scene as plain data, ready for JSON."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.view.mesh import Mesh


def pack_mesh(mesh: Mesh) -> dict[str, Any]:
    """Pack a mesh into plain data, with arrays in base64, little-endian.

    Raises:
        InputError: The mesh has points that are not finite.
    """
    if not np.isfinite(mesh.vertices).all():
        raise InputError("a mesh of the robot has points that are not finite")
    wide = len(mesh.vertices) > 65535
    colours = np.round(255 * np.clip(mesh.colours, 0.0, 1.0)).astype(np.uint8)
    plain = bool(len(colours) and (colours == colours[0]).all())
    return {
        "vertices": pack_numbers(mesh.vertices.astype("<f4")),
        "normals": pack_numbers(np.round(127 * mesh.normals).astype(np.int8)),
        "faces": pack_numbers(mesh.faces.astype("<u4" if wide else "<u2")),
        "wide": wide,
        "colours": colours[0].tolist() if plain else pack_numbers(colours),
        "opacity": mesh.opacity,
    }


class SceneParts:
    """Meshes, labels and warnings of a scene, collected for its page.

    Attributes:
        meshes: Meshes with their names.
        labels: Texts at points.
        warnings: Texts on parts that can't be drawn as described.
        corners: Points of the surroundings that must be in view [m], each of shape (n, 3).
    """

    def __init__(self, warnings: Iterable[str] = ()) -> None:
        self.meshes: list[dict[str, Any]] = []
        self.labels: list[dict[str, Any]] = []
        self.warnings = list(warnings)
        self.corners: list[FloatArray] = []

    def draw(self, name: str, mesh: Mesh | None, *, lit: bool = True, **more: Any) -> None:
        """Add a mesh, if there is one; `None` values in `more` are left out."""
        if mesh is not None:
            details = {key: value for key, value in more.items() if value is not None}
            self.meshes.append(
                {"name": name, "mesh": pack_mesh(mesh), "lit": lit, "hidden": False} | details
            )

    def write(self, text: str, kind: str, at: FloatArray, detail: str, **more: Any) -> None:
        """Add a text at a point [m], with detail on demand.

        Args:
            text: The text.
            kind: Kind of label, for example `"waypoint"`.
            at: The point [m], in the axes of the joint `carrier` if one carries it, shape (3,).
            detail: Text that is shown on demand.
            more: The `carrier`, and a `time` [s] near which the text is shown.
        """
        details = {key: value for key, value in more.items() if value is not None}
        label = {"text": text, "kind": kind, "at": at.tolist(), "detail": detail}
        self.labels.append(label | details)


def pack_numbers(array: np.ndarray[Any, Any]) -> str:
    """Pack an array's bytes into base64."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def unpack_mesh(mesh: Mapping[str, Any]) -> Mesh:
    """Restore a mesh from its plain data."""
    vertices = unpack_numbers(mesh["vertices"], "<f4").reshape(-1, 3)
    faces = unpack_numbers(mesh["faces"], "<u4" if mesh["wide"] else "<u2").reshape(-1, 3)
    normals = unpack_numbers(mesh["normals"], "i1").reshape(-1, 3) / 127.0
    colours = mesh["colours"]
    if isinstance(colours, str):
        painted = unpack_numbers(colours, "u1").reshape(-1, 3) / 255.0
    else:
        painted = np.tile(np.asarray(colours) / 255.0, (len(vertices), 1))
    return Mesh(vertices, normals, faces, painted, mesh["opacity"])


def unpack_numbers(text: str, kind: str) -> np.ndarray[Any, Any]:
    """Restore an array from its bytes in base64."""
    return np.frombuffer(base64.b64decode(text), kind)
