"""Reading meshes from COLLADA files (`.dae`), with the colours of their materials.

As in ROS, the unit of length of the file counts and its upward axis does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from knotwork.view.mesh import Colour, IndexArray, Mesh, from_triangles, merged, normalised
from knotwork.waypoints import FloatArray

GREY: Colour = (0.75, 0.75, 0.75, 1.0)
# With more corners of their own than this the faces are shaded flat: rounded parts look faceted.
MOST_CORNERS = 0.6
_TRIANGLES = ("triangles", "polylist", "polygons")

_Element = ElementTree.Element


class ColladaError(ValueError):
    """A file that isn't COLLADA or lacks what it refers to."""


def read_collada(path: Path) -> Mesh:
    """Read a COLLADA file as one mesh [m].

    Raises:
        ColladaError: The file isn't COLLADA, or holds no triangles.
        OSError: The file can't be read.
    """
    try:
        root = ElementTree.parse(path).getroot()
        for element in root.iter():
            element.tag = element.tag.rpartition("}")[2]
        meshes = list(_Collada(root).meshes())
    except (ElementTree.ParseError, KeyError, IndexError, ValueError, AttributeError) as error:
        raise ColladaError(f"{path} is no COLLADA file that can be read: {error}") from error
    if not meshes:
        raise ColladaError(f"{path} holds no triangles")
    return merged(meshes)


class _Collada:
    """A document, its elements found by id."""

    def __init__(self, root: _Element) -> None:
        self.root = root
        self.by_id = {e.get("id"): e for e in root.iter() if e.get("id")}
        unit = root.find("asset/unit")
        self.scale = float(unit.get("meter", "1")) if unit is not None else 1.0

    def target(self, reference: str | None) -> _Element:
        return self.by_id[(reference or "").lstrip("#")]

    def meshes(self) -> Iterator[Mesh]:
        instance = self.root.find("scene/instance_visual_scene")
        if instance is None:
            raise ColladaError("it shows no scene")
        frame = np.diag([self.scale, self.scale, self.scale, 1.0])
        for node in self.target(instance.get("url")).findall("node"):
            yield from self.node(node, frame)

    def node(self, node: _Element, frame: FloatArray) -> Iterator[Mesh]:
        for step in node:
            numbers = _numbers(step.text) if step.tag in _STEPS else np.zeros(0)
            if step.tag in _STEPS:
                frame = frame @ _STEPS[step.tag](numbers)
        for instance in node.findall("instance_geometry"):
            yield from self.geometry(instance, frame)
        for instance in node.findall("instance_node"):
            yield from self.node(self.target(instance.get("url")), frame)
        for child in node.findall("node"):
            yield from self.node(child, frame)

    def geometry(self, instance: _Element, frame: FloatArray) -> Iterator[Mesh]:
        bound = {
            str(material.get("symbol")): material.get("target")
            for material in instance.iter("instance_material")
        }
        mesh = self.target(instance.get("url")).find("mesh")
        for part in mesh if mesh is not None else ():
            if part.tag in _TRIANGLES:
                symbol = part.get("material", "")
                yield from self.part(part, frame, self.colour(bound.get(symbol)))

    def colour(self, material: str | None) -> Colour:
        """Diffuse colour of a material; grey where it is a texture or there is none."""
        if material is None:
            return GREY
        effect = self.target(material).find("instance_effect")
        if effect is None:
            return GREY
        found = self.target(effect.get("url")).find(".//diffuse/color")
        if found is None:
            return GREY
        red, green, blue, opacity = (*_numbers(found.text), 1.0)[:4]
        return (float(red), float(green), float(blue), float(opacity))

    def source(self, reference: str | None) -> FloatArray:
        """Numbers of a source in rows, shape (n, stride)."""
        source = self.target(reference)
        accessor, data = source.find("technique_common/accessor"), source.find("float_array")
        stride = int(accessor.get("stride", "1")) if accessor is not None else 3
        return _numbers(data.text if data is not None else "").reshape(-1, stride)

    def part(self, part: _Element, frame: FloatArray, colour: Colour) -> Iterator[Mesh]:
        inputs = {e.get("semantic"): e for e in part.findall("input")}
        width = 1 + max(int(e.get("offset", "0")) for e in inputs.values())
        rows = _triangles(part, width)
        if not len(rows):
            return
        vertex = inputs["VERTEX"]
        inner = {e.get("semantic"): e for e in self.target(vertex.get("source")).findall("input")}
        points = self.source(inner["POSITION"].get("source"))
        at = rows[:, int(vertex.get("offset", "0"))]
        given = inputs.get("NORMAL")
        directions = np.zeros((1, 3))
        towards = np.zeros_like(at)
        if given is not None:
            directions = self.source(given.get("source"))
            towards = rows[:, int(given.get("offset", "0"))]
        elif "NORMAL" in inner:
            directions, towards = self.source(inner["NORMAL"].get("source")), at
        pairs, faces = np.unique(at * len(directions) + towards, return_inverse=True)
        if len(directions) == 1 or len(pairs) > MOST_CORNERS * len(at):
            corners = points[at].reshape(-1, 3, 3) @ frame[:3, :3].T + frame[:3, 3]
            yield from_triangles(corners, colour)
            return
        vertices = points[pairs // len(directions)] @ frame[:3, :3].T + frame[:3, 3]
        normals = directions[pairs % len(directions)] @ np.linalg.inv(frame[:3, :3])
        faces = faces.reshape(-1, 3)
        if np.linalg.det(frame[:3, :3]) < 0:
            faces = faces[:, ::-1]
        yield Mesh(vertices, normalised(normals), faces, np.zeros_like(vertices)).painted(colour)


def _numbers(text: str | None) -> FloatArray:
    return np.array((text or "").split(), dtype=float)


def _triangles(part: _Element, width: int) -> IndexArray:
    """Rows of indices, three for each triangle, shape (3 m, width); polygons are cut into fans."""
    texts = [e.text for e in part.findall("p")]
    blocks = [np.array((text or "").split(), dtype=np.int64).reshape(-1, width) for text in texts]
    if not blocks:
        return np.zeros((0, width), dtype=np.int64)
    rows = np.concatenate(blocks)
    if part.tag == "triangles":
        return rows
    if part.tag == "polylist":
        count = part.find("vcount")
        sizes = np.array((count.text or "" if count is not None else "").split(), dtype=np.int64)
    else:
        sizes = np.array([len(block) for block in blocks], dtype=np.int64)
    starts = np.cumsum(sizes) - sizes
    fans = np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    step = np.arange(len(fans)) - np.searchsorted(fans, fans)
    corners = np.stack([starts[fans], starts[fans] + step + 1, starts[fans] + step + 2], axis=1)
    return np.asarray(rows[corners.reshape(-1)])


def _rotation(numbers: FloatArray) -> FloatArray:
    axis, angle = numbers[:3] / np.linalg.norm(numbers[:3]), np.radians(numbers[3])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def _translation(numbers: FloatArray) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, 3] = numbers
    return matrix


_STEPS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "matrix": lambda numbers: numbers.reshape(4, 4),
    "translate": _translation,
    "rotate": _rotation,
    "scale": lambda numbers: np.diag([*numbers, 1.0]),
}
