"""The shapes of a robot's links, from its URDF; their meshes are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.dom import expatbuilder
from xml.dom.minidom import Element

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.meshes.finding import find_mesh
from knotwork.meshes.reading import Colour, read_mesh
from knotwork.robot import Robot
from knotwork.robot.urdf import child_elements
from knotwork.view.mesh import GREY, Mesh, drawable, merged
from knotwork.view.solids import box, capsule, cylinder, rod, sphere
from knotwork.waypoints import FloatArray

LINE_RADIUS = 0.012


@dataclass(frozen=True, eq=False)
class LinkShapes:
    """Shapes of a robot's links.

    Attributes:
        parts: For each joint of the chain the meshes that it carries, in the joint's axes, and
            first what does not move, in the axes of the URDF's root; length d + 1.
        warnings: What could not be drawn as described.
    """

    parts: list[list[Mesh]]
    warnings: tuple[str, ...]

    @cached_property
    def shapes(self) -> list[Mesh | None]:
        """The parts in one for each joint, without images; `None` for what carries nothing."""
        return [merged(parts) if parts else None for parts in self.parts]


def link_shapes(robot: Robot) -> LinkShapes:
    """Read the shapes of all links, those of locked joints included.

    A mesh that is missing is a warning: the link is drawn from its collision shape, or as a line
    to the links that it carries.
    """
    urdf = _Shapes(robot.urdf)
    model = robot.model
    frames = {f.name: f for f in model.frames if f.type == pin.FrameType.BODY}
    carried: list[list[Mesh]] = [[] for _ in range(model.njoints)]
    warnings: list[str] = []
    plain: list[str] = []
    for link, element in urdf.links.items():
        if link not in frames:
            continue
        parts, missing = urdf.shapes(element, "visual")
        if not all(part.coloured for part in parts):
            plain.append(link)
        if missing:
            instead, worse = urdf.shapes(element, "collision")
            if instead and not worse:
                parts, how = instead, "drawn from its collision shape"
            else:
                how = "drawn as a line"
                parts += _lines(urdf.carried.get(link, ()))
            warnings.append(f"link {link!r}: {'; '.join(missing)}; {how}")
        placement = frames[link].placement
        joint = frames[link].parentJoint
        carried[joint] += [part.moved(placement.rotation, placement.translation) for part in parts]
    if plain:
        warnings.append(f"no colour is given for parts of {', '.join(plain)}; they are drawn grey")
    if not any(carried):
        warnings.append(f"robot {robot.name!r} has no shapes to draw; its links are drawn as lines")
        carried = _skeleton(robot)
    return LinkShapes(carried, tuple(warnings))


def _lines(origins: Sequence[FloatArray]) -> list[Mesh]:
    """Rods from a link's origin to those of the links that it carries, in its axes."""
    far = [origin for origin in origins if np.linalg.norm(origin) > 1e-6]
    return [rod(np.zeros(3), origin, LINE_RADIUS, GREY) for origin in far]


def _skeleton(robot: Robot) -> list[list[Mesh]]:
    """Rods from each joint to those that it carries, and to the tool."""
    model = robot.model
    carried: list[list[Mesh]] = [[] for _ in range(model.njoints)]
    ends = [
        (model.parents[i], model.jointPlacements[i].translation) for i in range(1, model.njoints)
    ]
    if robot.tcp_frame_id is not None:
        tool = model.frames[robot.tcp_frame_id]
        ends.append((tool.parentJoint, tool.placement.translation))
    for parent, end in ends:
        carried[parent].append(sphere(1.6 * LINE_RADIUS, (0.9, 0.45, 0.1, 1.0)))
        if np.linalg.norm(end) > 1e-6:
            carried[parent].append(rod(np.zeros(3), end, LINE_RADIUS, GREY))
    return carried


class _Shapes:
    """A URDF's links and materials."""

    def __init__(self, path: Path) -> None:
        self.path = path
        text = path.read_bytes()
        root = expatbuilder.parseString(text, namespaces=False).documentElement
        if root is None:
            raise ValueError(f"{path} is empty")  # it has been read as a robot before
        self.links = {e.getAttribute("name"): e for e in child_elements(root, "link")}
        self.materials: dict[str, Colour] = {}
        for material in root.getElementsByTagName("material"):
            colour = _colour(material)
            if colour is not None:
                self.materials.setdefault(material.getAttribute("name"), colour)
        self.carried: dict[str, list[FloatArray]] = {}
        for joint in child_elements(root, "joint"):
            for parent in child_elements(joint, "parent"):
                origins = self.carried.setdefault(parent.getAttribute("link"), [])
                origins.append(_origin(joint)[1])
        self._read: dict[Path, list[Mesh]] = {}

    def shapes(self, element: Element, kind: str) -> tuple[list[Mesh], list[str]]:
        """Shapes of a link in its axes, and what is missing of them."""
        found: list[Mesh] = []
        missing: list[str] = []
        for item in child_elements(element, kind):
            try:
                meshes = [mesh for mesh in self._shape(item) if len(mesh.faces)]
                found += [mesh.moved(*_origin(item)) for mesh in meshes]
            except InputError as error:
                missing.append(str(error))
        return found, missing

    def _shape(self, item: Element) -> list[Mesh]:
        colour = None
        for material in child_elements(item, "material"):
            colour = _colour(material) or self.materials.get(material.getAttribute("name"))
        plain = colour or GREY
        geometries = child_elements(item, "geometry")
        for shape in (shape for geometry in geometries for shape in child_elements(geometry)):
            if shape.tagName == "mesh":
                return self._mesh(shape, colour)
            if shape.tagName == "box":
                return [box(_numbers(shape.getAttribute("size")), plain)]
            radius = float(shape.getAttribute("radius"))
            if shape.tagName == "sphere":
                return [sphere(radius, plain)]
            make = capsule if shape.tagName == "capsule" else cylinder
            return [make(radius, float(shape.getAttribute("length")), plain)]
        return []

    def _mesh(self, shape: Element, colour: Colour | None) -> list[Mesh]:
        name = shape.getAttribute("filename")
        path = find_mesh(name, self.path)
        if path is None:
            raise InputError(f"there is no mesh {name}")
        if path not in self._read:
            self._read[path] = [drawable(part) for part in read_mesh(path)]
        meshes = self._read[path]
        if shape.hasAttribute("scale"):
            scale = _numbers(shape.getAttribute("scale"))
            meshes = [mesh.scaled(scale) for mesh in meshes]
        return [mesh.painted(colour) for mesh in meshes] if colour is not None else meshes


def _numbers(text: str) -> Sequence[float]:
    return [float(part) for part in text.split()]


def _colour(material: Element) -> Colour | None:
    for colour in child_elements(material, "color"):
        red, green, blue, opacity = (*_numbers(colour.getAttribute("rgba")), 1.0)[:4]
        return (red, green, blue, opacity)
    return None


def _origin(element: Element) -> tuple[FloatArray, FloatArray]:
    """Rotation and translation of an element's origin."""
    for origin in child_elements(element, "origin"):
        xyz = _numbers(origin.getAttribute("xyz") or "0 0 0")
        rpy = _numbers(origin.getAttribute("rpy") or "0 0 0")
        return np.asarray(pin.rpy.rpyToMatrix(np.array(rpy))), np.array(xyz)
    return np.eye(3), np.zeros(3)
