"""The shapes of a URDF's links: boxes, spheres, cylinders, capsules and names of meshes.

An invalid shape is left out, and its fault is returned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias
from xml.dom.minidom import Element

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import InputError, format_value
from knotwork.files.documents import read_text
from knotwork.robot.external_axes import UrdfFile
from knotwork.robot.urdf import MAX_URDF_BYTES, parse_root
from knotwork.robot.urdf_rules import child_elements

MAX_LENGTH = 1e6
"""Maximum length of a shape [m], factor of a mesh and angle [rad]."""
_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {},
}
"""Attributes of each kind of shape, with the number of their values."""

Colour: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class LinkShape:
    """A shape of a link.

    Attributes:
        kind: `"box"`, `"sphere"`, `"cylinder"`, `"capsule"` or `"mesh"`.
        size: Lengths of a box along x, y and z; radius and length of others [m].
        mesh: Name of the mesh file as the URDF gives it, or empty.
        urdf: The URDF, for the search of meshes.
        scale: Factors of the mesh along its axes, shape (3,).
        placement: `pin.SE3` in the axes of the link.
        colour: Red, green, blue and opacity in 0 … 1, or `None`.
        fault: Fault of the colour in the file, or empty.
    """

    kind: str
    size: tuple[float, ...] = ()
    mesh: str = ""
    urdf: Path = Path()
    scale: FloatArray = field(default_factory=lambda: np.ones(3))
    placement: Any = field(default_factory=pin.SE3.Identity)
    colour: Colour | None = None
    fault: str = ""


class _Link(NamedTuple):
    urdf: Path
    element: Element
    materials: Mapping[str, Element]


class UrdfShapes:
    """The links of a robot's URDFs and their shapes.

    Attributes:
        links: Names of the links in the tree, in the order of the files.
        carried: Origins of the joints that each link carries, in its axes [m].
    """

    def __init__(self, files: Sequence[UrdfFile]) -> None:
        """Read URDFs.

        Raises:
            DocumentError: A URDF can't be read.
            InputError: A URDF is not XML, or above the maximum size.
        """
        self._links: dict[str, _Link] = {}
        self.carried: dict[str, list[FloatArray]] = {}
        for file in files:
            self._read(file.path, dict(file.links))
        self.links = tuple(self._links)

    def _read(self, path: Path, names: Mapping[str, str]) -> None:
        text = read_text(path, max_bytes=MAX_URDF_BYTES)
        root = parse_root(text)
        materials: dict[str, Element] = {}
        for material in root.getElementsByTagName("material"):
            if child_elements(material, "color"):
                materials.setdefault(material.getAttribute("name"), material)
        for element in child_elements(root, "link"):
            name = element.getAttribute("name")
            self._links[names.get(name, name)] = _Link(path, element, materials)
        for joint in child_elements(root, "joint"):
            for parent in child_elements(joint, "parent"):
                name = parent.getAttribute("link")
                origins = self.carried.setdefault(names.get(name, name), [])
                origins.append(_read_origin(joint).translation.copy())

    def link_shapes(self, link: str, kind: str) -> tuple[list[LinkShape], list[str]]:
        """Read a link's valid shapes, `"visual"` or `"collision"`, and the faults of others."""
        valid: list[LinkShape] = []
        faults: list[str] = []
        path, element, materials = self._links[link]
        for item in child_elements(element, kind):
            geometries = child_elements(item, "geometry")
            shapes = [shape for geometry in geometries for shape in child_elements(geometry)]
            if len(geometries) != 1 or len(shapes) != 1:
                faults.append(
                    f"<{kind}> has {len(geometries)} <geometry> with {len(shapes)} shapes in all; "
                    f"each <{kind}> has one"
                )
                if len(shapes) != 1:
                    continue
            colour = None
            fault = ""
            try:
                colour = _read_colour(item, materials)
            except InputError as error:
                fault = f"{error}; it is drawn grey"
            try:
                shape = _read_shape(shapes[0])
                placement = _read_origin(item)
            except InputError as error:
                faults.append(str(error))
                continue
            valid.append(replace(shape, urdf=path, placement=placement, colour=colour, fault=fault))
        return valid, faults


def _read_colour(item: Element, materials: Mapping[str, Element]) -> Colour | None:
    colour = None
    for material in child_elements(item, "material"):
        named = materials.get(material.getAttribute("name"))
        definition = material if child_elements(material, "color") else named
        if definition is not None:
            element = child_elements(definition, "color")[0]
            red, green, blue, *opacity = _read_numbers(element, "rgba", 3, 4)
            colour = (red, green, blue, opacity[0] if opacity else 1.0)
            if not all(0.0 <= part <= 1.0 for part in colour):
                text = format_value(element.getAttribute("rgba"))
                raise InputError(f"color has rgba {text}; each must be from 0 to 1")
    return colour


def _read_shape(element: Element) -> LinkShape:
    kind = element.tagName
    if kind not in _SIZES:
        raise InputError(f"there is no shape <{kind}>; accepted: {', '.join(_SIZES)}")
    size = [
        number for name, n in _SIZES[kind].items() for number in _read_numbers(element, name, n)
    ]
    if any(number <= 0.0 for number in size):
        raise InputError(f"{kind} has sizes {format_value(size)}; each must be greater than 0")
    mesh, scale = "", np.ones(3)
    if kind == "mesh":
        mesh = element.getAttribute("filename")
        if element.hasAttribute("scale"):
            scale = np.array(_read_numbers(element, "scale", 3))
        if not scale.all():
            raise InputError(
                f"mesh {format_value(mesh)} has scale {format_value(scale.tolist())}; none may be 0"
            )
    return LinkShape(kind, tuple(size), mesh, scale=scale)


def _read_numbers(
    element: Element, name: str, min_count: int, max_count: int | None = None
) -> list[float]:
    """Read the numbers of an attribute.

    Raises:
        InputError: Their count is wrong, or a value is not a number in range.
    """
    text = element.getAttribute(name)
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        numbers = []
    max_count = min_count if max_count is None else max_count
    if not min_count <= len(numbers) <= max_count or not all(
        abs(number) <= MAX_LENGTH for number in numbers
    ):
        count = f"{min_count}" if min_count == max_count else f"{min_count} or {max_count}"
        noun = "number" if count == "1" else "numbers"
        raise InputError(
            f"{element.tagName} has {name} {format_value(text)}; it must be {count} {noun} of at "
            f"most {MAX_LENGTH:g}"
        )
    return numbers


def _read_origin(element: Element) -> Any:
    """Read the placement of an element, `pin.SE3`.

    Raises:
        InputError: Values are not numbers.
    """
    for origin in child_elements(element, "origin"):
        xyz = _read_numbers(origin, "xyz", 3) if origin.hasAttribute("xyz") else [0.0] * 3
        rpy = _read_numbers(origin, "rpy", 3) if origin.hasAttribute("rpy") else [0.0] * 3
        return pin.SE3(pin.rpy.rpyToMatrix(np.array(rpy)), np.array(xyz))
    return pin.SE3.Identity()
