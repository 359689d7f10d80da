"""The shapes of a robot's links, from its URDF; their meshes are read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.meshes.locating import find_mesh, mesh_package
from knotwork.meshes.mesh_files import read_mesh
from knotwork.robot import Robot
from knotwork.robot.shapes import Shape, UrdfShapes
from knotwork.view.mesh import GREY, Mesh, drawable, merged
from knotwork.view.primitive_meshes import rod, solid, sphere
from knotwork.waypoints import FloatArray

LINE_RADIUS = 0.012
MOST_TRIANGLES = 3_000_000
"""Of all shapes of a robot."""
MOST_BYTES = 512_000_000
"""Of all mesh files of a robot."""
# Mesh files kept in memory: a scenario that is written is shown after each change.
MOST_KEPT = 32


@dataclass(frozen=True, eq=False)
class LinkShapes:
    """Shapes of a robot's links.

    Attributes:
        parts: For each joint of the chain the meshes that it carries, in the joint's axes, and
            first what does not move, in the axes of the URDF's root; length d + 1.
        warnings: Parts that can't be drawn as described.
    """

    parts: list[list[Mesh]]
    warnings: tuple[str, ...]

    @cached_property
    def shapes(self) -> list[Mesh | None]:
        """The parts in one for each joint, without images; `None` for what carries nothing."""
        return [merged(parts) if parts else None for parts in self.parts]


def link_shapes(robot: Robot) -> LinkShapes:
    """Read the shapes of all links, those of locked joints included.

    A shape that can't be drawn is a warning: the link is drawn from its collision shape, or as a
    line to the links that it carries.
    """
    urdf, drawn = UrdfShapes(robot.urdf), _Drawn(robot)
    model = robot.model
    frames = {f.name: f for f in model.frames if f.type == pin.FrameType.BODY}
    carried: list[list[Mesh]] = [[] for _ in range(model.njoints)]
    warnings: list[str] = []
    plain: list[str] = []
    for link in urdf.links:
        if link not in frames:
            continue
        shapes, lost = urdf.of(link, "visual")
        parts, missing, notes = drawn.meshes(shapes)
        notes += [shape.fault for shape in shapes if shape.fault]
        if not all(part.coloured for part in parts):
            plain.append(link)
        if missing or lost:
            notes += [*lost, *missing]
            shapes, lost = urdf.of(link, "collision")
            instead, missing, _ = drawn.meshes(shapes)
            if instead and not (lost or missing):
                parts = instead
                notes.append("drawn from its collision shape")
            else:
                parts += _lines(urdf.carried.get(link, ()))
                notes.append("drawn as a line")
        if notes:
            warnings.append(f"link {link!r}: {'; '.join(notes)}")
        frame = frames[link]
        carried[frame.parentJoint] += [part.placed(frame.placement) for part in parts]
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


@dataclass(frozen=True, eq=False)
class _MeshFile:
    """A mesh file that was read: its parts, faults of their images, or why it can't be read."""

    meshes: list[Mesh] = field(default_factory=list)
    faults: tuple[str, ...] = ()
    unread: str = ""


_KEPT: dict[tuple[Path, int], _MeshFile] = {}


class _Drawn:
    """Shapes as meshes; each mesh file is read once, and all together are bounded."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._files: dict[Path, _MeshFile] = {}
        self._triangles = self._bytes = 0

    def meshes(self, shapes: Sequence[Shape]) -> tuple[list[Mesh], list[str], list[str]]:
        """Shapes of a link in its axes, why others are missing, and why images are."""
        found: list[Mesh] = []
        missing: list[str] = []
        faults: dict[str, None] = {}
        for shape in shapes:
            try:
                if shape.kind == "mesh":
                    file = self._file(shape.mesh)
                    self._count(file.meshes)
                    meshes = _changed(file.meshes, shape)
                    if shape.colour is None:
                        faults |= dict.fromkeys(file.faults)
                else:
                    meshes = [solid(shape.kind, shape.size, shape.colour or GREY)]
                    self._count(meshes)
                shown = [mesh for mesh in meshes if len(mesh.faces)]
                found += [mesh.moved(shape.rotation, shape.translation) for mesh in shown]
            except InputError as error:
                missing.append(str(error))
        return found, missing, list(faults)

    def _count(self, meshes: Sequence[Mesh]) -> None:
        count = sum(len(mesh.faces) for mesh in meshes)
        if self._triangles + count > MOST_TRIANGLES:
            raise InputError(f"the robot's shapes have more than {MOST_TRIANGLES} triangles")
        self._triangles += count

    def _file(self, name: str) -> _MeshFile:
        path = find_mesh(name, self._robot.urdf, self._robot.package_paths)
        real = path.resolve()
        if real not in self._files:
            self._files[real] = self._opened(path)
        if self._files[real].unread:
            raise InputError(self._files[real].unread)
        return self._files[real]

    def _opened(self, path: Path) -> _MeshFile:
        found = path.stat()
        self._bytes += found.st_size
        if self._bytes > MOST_BYTES:
            unread = f"mesh {path} is not read: the robot's have more than {MOST_BYTES} bytes"
            return _MeshFile(unread=unread)
        return _read(path, found.st_mtime_ns)


def _read(path: Path, changed: int) -> _MeshFile:
    """Read a mesh file as it was when it was changed last; one without images is kept."""
    if (path, changed) in _KEPT:
        return _KEPT[path, changed]
    try:
        parts = read_mesh(path, mesh_package(path))
    except InputError as error:
        return _MeshFile(unread=str(error))
    faults = tuple(dict.fromkeys(part.fault for part in parts if part.fault))
    made = _MeshFile([drawable(part) for part in parts], faults)
    if not faults and all(mesh.image is None for mesh in made.meshes):
        if len(_KEPT) >= MOST_KEPT:
            _KEPT.pop(next(iter(_KEPT)))
        _KEPT[path, changed] = made
    return made


def _changed(meshes: list[Mesh], shape: Shape) -> list[Mesh]:
    """The meshes of a file in the size and colour that a URDF gives them."""
    if (shape.scale != 1.0).any():
        meshes = [mesh.scaled(shape.scale) for mesh in meshes]
    colour = shape.colour
    return [mesh.painted(colour) for mesh in meshes] if colour is not None else meshes
