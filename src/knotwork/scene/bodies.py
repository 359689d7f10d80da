"""Bodies that may collide: links of the robot, its tool, what it holds, and what stands around."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.external_axes import UrdfFile
from knotwork.robot.shapes import Shape as UrdfShape
from knotwork.robot.shapes import UrdfShapes
from knotwork.scenario import Shape
from knotwork.scene.meshes.locating import find_mesh, ros_folders
from knotwork.scene.solids import Placed, Solid, solid
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: solids that one joint carries.

    Attributes:
        name: What it is called in reports.
        kind: `"link"`, `"tool"`, `"held"` or, of what the robot does not move, `"object"`.
        joint: Index of the joint that carries it; 0 for what stands still.
        solids: Its shapes.
        start, end: From when to when [s] it is there.
        apart: Whether it is to be held or was held, and the tool is away from it.
        link: Name of a link in its URDF; empty for other bodies.
    """

    name: str
    kind: str
    joint: int
    solids: tuple[Solid, ...]
    start: float = -math.inf
    end: float = math.inf
    apart: bool = False
    link: str = ""

    @property
    def identity(self) -> str:
        """What it is: a link of the robot or something of the scenario, whatever its name is."""
        return f"link:{self.link}" if self.link else f"scenario:{self.name}"


def placed_solids(body: Body, rotation: FloatArray, origin: FloatArray) -> Iterator[Placed]:
    """The solids of a body, from rotations and origins of all joints.

    Args:
        body: The body.
        rotation: Of all joints, shape (n + 1, 3, 3).
        origin: Of all joints [m], shape (n + 1, 3).
    """
    turn, shift = rotation[body.joint], origin[body.joint]
    for one in body.solids:
        yield Placed(one, turn @ one.rotation, turn @ one.translation + shift)


class LinkBodies(NamedTuple):
    """The links of a robot that have collision shapes.

    Attributes:
        bodies: One for each such link.
        missing: Sentences on links whose shapes can't be had.
        bare: Names of links that have shapes to be seen, but none for collisions.
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]
    bare: tuple[str, ...]


# The URDF that names a mesh, and how.
_MeshName: TypeAlias = tuple[Path, str]


class LinkSources(NamedTuple):
    """What decides which shapes a robot's links have, and where: two that are equal give the same.

    Attributes:
        files: The URDFs.
        changed: When each was written last [ns].
        placed: Of each link what `placed_links` says.
        packages: Folders of the robot's meshes.
        ros: Folders that ROS looks in.
        meshes: Of each mesh of a collision shape its URDF and name, and its path and when it was
            written last [ns]; `None` for one that is not there.
    """

    files: tuple[UrdfFile, ...]
    changed: tuple[int, ...]
    placed: tuple[tuple[Any, ...], ...]
    packages: tuple[Path, ...]
    ros: tuple[Path, ...]
    meshes: tuple[tuple[_MeshName, tuple[Path, int] | None], ...]


def link_sources(robot: Robot) -> LinkSources:
    """What decides the shapes of a robot's links, as the files are now."""
    files, packages, ros = robot.urdf_files, tuple(robot.package_paths), ros_folders()
    changed = tuple(file.path.stat().st_mtime_ns for file in files)
    known = _collision_meshes(files, changed, packages, ros)
    # Looking for a mesh takes much longer than seeing that it is still where it was.
    paths = ((name, path or _found(name, packages, ros)) for name, path in known)
    meshes = tuple((name, _written(path)) for name, path in paths)
    return LinkSources(files, changed, placed_links(robot), packages, ros, meshes)


@lru_cache(maxsize=32)
def _collision_meshes(
    files: tuple[UrdfFile, ...],
    changed: tuple[int, ...],
    packages: tuple[Path, ...],
    ros: tuple[Path, ...],
) -> tuple[tuple[_MeshName, Path | None], ...]:
    """Names of the meshes of all collision shapes, each once, and where they are."""
    given = _shapes(files, changed)
    shapes = (shape for link in given.links for shape in given.of(link, "collision")[0])
    names = dict.fromkeys((shape.urdf, shape.mesh) for shape in shapes if shape.kind == "mesh")
    return tuple((name, _found(name, packages, ros)) for name in names)


@lru_cache(maxsize=1)
def _shapes(files: tuple[UrdfFile, ...], changed: tuple[int, ...]) -> UrdfShapes:
    """Shapes of all links; those of the last robot are kept, as they are asked for twice."""
    return UrdfShapes(files)


def _found(name: _MeshName, packages: tuple[Path, ...], ros: tuple[Path, ...]) -> Path | None:
    urdf, mesh = name
    try:
        return find_mesh(mesh, urdf, packages, ros)
    except InputError:
        return None


def _written(path: Path | None) -> tuple[Path, int] | None:
    try:
        return (path, path.stat().st_mtime_ns) if path is not None else None
    except OSError:
        return None


def placed_links(robot: Robot) -> tuple[tuple[Any, ...], ...]:
    """Name, carrying joint and the numbers of the placement of each link."""
    return tuple(
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY
    )


@lru_cache(maxsize=32)
def link_bodies(sources: LinkSources) -> LinkBodies:
    """Read the collision shapes of a robot's links; what was read is kept for the next time.

    Raises:
        InputError: A mesh is there and can't be read whole.
    """
    given = _shapes(sources.files, sources.changed)
    bodies, missing, bare = [], [], []
    for link, joint, *numbers in sources.placed:
        if link not in given.links:
            continue
        carrier = pin.SE3(np.array(numbers).reshape(4, 4))
        shapes, lost = given.of(link, "collision")
        missing += [f"link {link!r}: {fault}" for fault in lost]
        if not shapes and not lost and any(given.of(link, "visual")):
            bare.append(link)
        solids = []
        for shape in shapes:
            try:
                placed = _placed(shape, sources)
            except InputError as error:
                missing.append(f"link {link!r}: {error}")
                continue
            try:
                solids.append(solid(placed, carrier))
            except InputError as error:
                error.locate(f"{shape.urdf}: collision shape of link {link!r}")
                raise
        if solids:
            bodies.append(Body(link, "link", joint, tuple(solids), link=link))
    return LinkBodies(tuple(bodies), tuple(missing), tuple(bare))


def _placed(given: UrdfShape, sources: LinkSources) -> Shape:
    """A link's shape as the URDF gives it, as one that solids are made of.

    Raises:
        InputError: There is no such mesh where meshes are taken from.
    """
    placement, path = pin.SE3(given.rotation, given.translation), None
    if given.kind == "mesh":
        known = dict(sources.meshes).get((given.urdf, given.mesh))
        look = given.mesh, given.urdf, sources.packages, sources.ros
        path = known[0] if known is not None else find_mesh(*look)
    x, y, z = (float(factor) for factor in given.scale)
    return Shape(given.kind, given.size, placement, path, (x, y, z))
