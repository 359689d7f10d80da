"""Reading meshes from COLLADA files (`.dae`), with the colours and images of their materials.

As in ROS, the unit of length of the file counts and its upward axis does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np

from knotwork.view.mesh import Colour, IndexArray, Mesh, Skin, from_triangles, merged, normalised
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
        meshes = list(_Collada(root, path.parent).meshes())
    except (ElementTree.ParseError, KeyError, IndexError, ValueError, AttributeError) as error:
        raise ColladaError(f"{path} is no COLLADA file that can be read: {error}") from error
    if not meshes:
        raise ColladaError(f"{path} holds no triangles")
    return merged(meshes)


@dataclass(frozen=True)
class _Look:
    """What a material looks like: a colour, `None` where none is given, or an image."""

    colour: Colour | None = None
    image: Path | None = None


class _Collada:
    """A document, its elements found by id."""

    def __init__(self, root: _Element, folder: Path) -> None:
        self.root, self.folder = root, folder
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
                yield from self.part(part, frame, self.look(bound.get(symbol)))

    def look(self, material: str | None) -> _Look:
        """Diffuse colour or image of a material."""
        instance = self.target(material).find("instance_effect") if material else None
        if instance is None:
            return _Look()
        effect = self.target(instance.get("url"))
        colour, texture = effect.find(".//diffuse/color"), effect.find(".//diffuse/texture")
        if texture is not None:
            return _Look(image=self.image(effect, texture.get("texture")))
        if colour is None:
            return _Look()
        red, green, blue, opacity = (*_numbers(colour.text), 1.0)[:4]
        return _Look((float(red), float(green), float(blue), float(opacity)))

    def image(self, effect: _Element, name: str | None) -> Path | None:
        """File of a texture: by way of its sampler and surface, or named at once."""
        parameters = {e.get("sid"): e for e in effect.iter("newparam")}
        for step in ("sampler2D/source", "surface/init_from"):
            found = parameters[name].findtext(step) if name in parameters else None
            name = found.strip() if found else name
        image = self.by_id.get(name)
        source = image.findtext("init_from") if image is not None else None
        path = self.folder / unquote((source or "").strip().removeprefix("file://"))
        return path if path.is_file() else None

    def source(self, reference: str | None) -> FloatArray:
        """Numbers of a source in rows, shape (n, stride)."""
        source = self.target(reference)
        accessor, data = source.find("technique_common/accessor"), source.find("float_array")
        stride = int(accessor.get("stride", "1")) if accessor is not None else 3
        return _numbers(data.text if data is not None else "").reshape(-1, stride)

    def part(self, part: _Element, frame: FloatArray, look: _Look) -> Iterator[Mesh]:
        # of several sets of places in images the first counts
        inputs = {e.get("semantic"): e for e in reversed(part.findall("input"))}
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
        if look.image is not None and "TEXCOORD" in inputs:
            given = inputs["TEXCOORD"]
            places = self.source(given.get("source"))[rows[:, int(given.get("offset", "0"))], :2]
            corners = points[at] @ frame[:3, :3].T + frame[:3, 3]
            yield _skinned(corners.reshape(-1, 3, 3), places, look.image)
            return
        mesh = self.coloured_part(points, at, directions, towards, frame).painted(
            look.colour or GREY
        )
        yield mesh if look.colour is not None else replace(mesh, coloured=False)

    @staticmethod
    def coloured_part(
        points: FloatArray,
        at: IndexArray,
        directions: FloatArray,
        towards: IndexArray,
        frame: FloatArray,
    ) -> Mesh:
        """Make a mesh of corners, given by their indices of points and of normals."""
        pairs, faces = np.unique(at * len(directions) + towards, return_inverse=True)
        if len(directions) == 1 or len(pairs) > MOST_CORNERS * len(at):
            corners = points[at].reshape(-1, 3, 3) @ frame[:3, :3].T + frame[:3, 3]
            return from_triangles(corners, GREY)
        vertices = points[pairs // len(directions)] @ frame[:3, :3].T + frame[:3, 3]
        normals = directions[pairs % len(directions)] @ np.linalg.inv(frame[:3, :3])
        faces = faces.reshape(-1, 3)
        if np.linalg.det(frame[:3, :3]) < 0:
            faces = faces[:, ::-1]
        return Mesh(vertices, normalised(normals), faces, np.zeros_like(vertices))


def _skinned(corners: FloatArray, places: FloatArray, image: Path) -> Mesh:
    """A mesh that an image colours, from loose triangles, shape (m, 3, 3)."""
    mesh = from_triangles(corners, (1.0, 1.0, 1.0, 1.0), places.reshape(-1, 3, 2))
    return replace(mesh, skins=(Skin(0, len(mesh.faces), image),))


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
