"""The shapes of a robot's links, from its URDF and mesh files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.urdf_shapes import LinkShape, UrdfShapes
from knotwork.scene.meshes.locating import find_mesh
from knotwork.scene.meshes.mesh_files import read_mesh
from knotwork.view.mesh import GREY, Mesh, drawable, merge_meshes
from knotwork.view.primitive_meshes import rod, solid, sphere

LINE_RADIUS = 0.012
JOINT_COLOUR = (0.9, 0.45, 0.1, 1.0)
MAX_DRAWN_TRIANGLES = 3_000_000
"""Maximum number of triangles of a robot."""
MAX_FILE_BYTES = 512_000_000
"""Maximum size of all mesh files of a robot [bytes]."""


@dataclass(frozen=True, eq=False)
class LinkShapes:
    """Shapes of a robot's links.

    Attributes:
        parts: Meshes by the joint that carries them, length d + 1. The first entry has fixed meshes
            in the axes of the URDF's root; the others are in the axes of their joint.
        warnings: Texts on parts that can't be drawn as described.
    """

    parts: list[list[Mesh]]
    warnings: tuple[str, ...]

    @cached_property
    def shapes(self) -> list[Mesh | None]:
        """All meshes of each joint merged into one; `None` if the joint carries none."""
        return [merge_meshes(parts) if parts else None for parts in self.parts]


def link_shapes(robot: Robot) -> LinkShapes:
    """Read the shapes of all links, including those of locked joints.

    A shape that can't be drawn causes a warning, and its link is drawn as lines to its child links.
    """
    urdf, drawn = UrdfShapes(robot.urdf_files), _Drawn(robot)
    frames = {f.name: f for f in robot.model.frames if f.type == pin.FrameType.BODY}
    links = [link for link in urdf.links if link in frames]
    by_link: dict[str, list[Mesh]] = {}
    warnings: list[str] = []
    for link in links:
        shapes, lost = urdf.link_shapes(link, "visual")
        parts, missing = drawn.meshes(shapes)
        notes = [*(shape.fault for shape in shapes if shape.fault), *lost, *missing]
        if missing or lost:
            parts += _lines(urdf.carried.get(link, ()))
            notes.append("drawn as a line")
        if notes:
            warnings.append(f"link {link!r}: {'; '.join(notes)}")
        by_link[link] = parts
    if not any(by_link.values()):
        warnings.append(f"robot {robot.name!r} has no shapes to draw; its links are drawn as lines")
        ball = sphere(1.6 * LINE_RADIUS, JOINT_COLOUR)
        for link in links:
            origins = urdf.carried.get(link, ())
            balls = [ball.shift(origin) for origin in origins]
            by_link[link] = [*balls, *_lines(origins)]
    carried: list[list[Mesh]] = [[] for _ in range(robot.model.njoints)]
    for link, parts in by_link.items():
        frame = frames[link]
        carried[frame.parentJoint] += [part.place(frame.placement) for part in parts]
    return LinkShapes(carried, tuple(warnings))


def _lines(origins: Sequence[FloatArray]) -> list[Mesh]:
    """Rods from a link's origin to the origins of its child links, in the link's axes."""
    far = [origin for origin in origins if np.linalg.norm(origin) > 1e-6]
    return [rod(np.zeros(3), origin, LINE_RADIUS, GREY) for origin in far]


class _Drawn:
    """Converts shapes to meshes, up to a maximum size of files and number of triangles."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._sizes: dict[Path, int] = {}
        self._triangles = 0

    def meshes(self, shapes: Sequence[LinkShape]) -> tuple[list[Mesh], list[str]]:
        """Meshes of a link's shapes in its axes, and the reasons why shapes are missing."""
        drawn: list[Mesh] = []
        missing: list[str] = []
        for shape in shapes:
            try:
                meshes = self._shape_meshes(shape)
                self._triangles += sum(len(mesh.faces) for mesh in meshes)
                if self._triangles > MAX_DRAWN_TRIANGLES:
                    raise InputError(
                        f"the robot's shapes have more than {MAX_DRAWN_TRIANGLES} triangles"
                    )
                filled = [mesh for mesh in meshes if len(mesh.faces)]
                drawn += [mesh.place(shape.placement) for mesh in filled]
            except InputError as error:
                missing.append(str(error))
        return drawn, missing

    def _shape_meshes(self, shape: LinkShape) -> list[Mesh]:
        if shape.kind != "mesh":
            return [solid(shape.kind, shape.size, shape.colour or GREY)]
        meshes = [mesh.scale(shape.scale) for mesh in self._file(shape.mesh, shape.urdf)]
        colour = shape.colour
        return [mesh.paint(colour) for mesh in meshes] if colour is not None else meshes

    def _file(self, name: str, urdf: Path) -> list[Mesh]:
        path = find_mesh(name, urdf, self._robot.package_paths)
        status = path.stat()
        self._sizes[path] = status.st_size
        if sum(self._sizes.values()) > MAX_FILE_BYTES:
            raise InputError(
                f"mesh {path} is not read: the robot's meshes exceed {MAX_FILE_BYTES} bytes"
            )
        return _read_mesh(path, status.st_mtime_ns)


@lru_cache(maxsize=64)  # a scenario is shown again after each change
def _read_mesh(path: Path, changed: int) -> list[Mesh]:
    """Read a mesh file, cached by its last change."""
    return [drawable(part) for part in read_mesh(path)]
