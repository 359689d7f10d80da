"""Bodies of a collision model: links of the robot, its tool, held objects and surroundings."""

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
from knotwork.robot.shapes import LinkShape as UrdfShape
from knotwork.robot.shapes import UrdfShapes
from knotwork.scene.meshes.locating import find_mesh, ros_folders
from knotwork.scene.solids import Placed, Solid, solid
from knotwork.task.scenario import PlacedShape
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: solids carried by one joint.

    Attributes:
        name: Name in reports.
        kind: `"link"`, `"tool"`, `"held"`, or `"object"` if the robot does not move it.
        joint: Index of the joint that carries it; 0 for a fixed body.
        solids: Its solids.
        start, end: Time interval of its presence [s].
        apart: Whether it is an object before the tool comes or after the tool has left.
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
        """Unique name: a link of the robot or a body of the scenario."""
        return f"link:{self.link}" if self.link else f"scenario:{self.name}"


def placed_solids(body: Body, rotation: FloatArray, origin: FloatArray) -> Iterator[Placed]:
    """The solids of a body, from rotations and origins of all joints.

    Args:
        body: The body.
        rotation: Rotations of all joints, shape (n + 1, 3, 3).
        origin: Origins of all joints [m], shape (n + 1, 3).
    """
    turn, shift = rotation[body.joint], origin[body.joint]
    for part in body.solids:
        yield Placed(part, turn @ part.rotation, turn @ part.translation + shift)


class LinkBodies(NamedTuple):
    """The links of a robot with collision shapes.

    Attributes:
        bodies: A body for each such link.
        missing: Sentences on links whose shapes are not available.
        bare: Names of links with visual shapes but no collision shapes.
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]
    bare: tuple[str, ...]


# The URDF that names a mesh, and the name in it.
_MeshName: TypeAlias = tuple[Path, str]


class LinkSources(NamedTuple):
    """Sources of the shapes and placements of a robot's links; equal ones give equal shapes.

    Attributes:
        files: The URDFs.
        changed: Time of the last change of each [ns].
        placed: Output of `placed_links` for each link.
        packages: Folders of the robot's meshes.
        ros: Folders of ROS packages.
        meshes: URDF and name of the mesh of each collision shape, with its path and the time of its
            last change [ns]; `None` for a missing file.
    """

    files: tuple[UrdfFile, ...]
    changed: tuple[int, ...]
    placed: tuple[tuple[Any, ...], ...]
    packages: tuple[Path, ...]
    ros: tuple[Path, ...]
    meshes: tuple[tuple[_MeshName, tuple[Path, int] | None], ...]


def link_sources(robot: Robot) -> LinkSources:
    """Sources of the shapes of a robot's links, in the present state of the files."""
    files, packages, ros = robot.urdf_files, tuple(robot.package_paths), ros_folders()
    changed = tuple(file.path.stat().st_mtime_ns for file in files)
    known = _collision_meshes(files, changed, packages, ros)
    # The search for a mesh takes much longer than the check that its file still exists.
    paths = ((name, path or _find_mesh_file(name, packages, ros)) for name, path in known)
    meshes = tuple((name, _file_state(path)) for name, path in paths)
    return LinkSources(files, changed, placed_links(robot), packages, ros, meshes)


@lru_cache(maxsize=32)
def _collision_meshes(
    files: tuple[UrdfFile, ...],
    changed: tuple[int, ...],
    packages: tuple[Path, ...],
    ros: tuple[Path, ...],
) -> tuple[tuple[_MeshName, Path | None], ...]:
    """Names of the meshes of all collision shapes, each once, and their files."""
    urdf_shapes = _shapes(files, changed)
    shapes = (
        shape
        for link in urdf_shapes.links
        for shape in urdf_shapes.link_shapes(link, "collision")[0]
    )
    names = dict.fromkeys((shape.urdf, shape.mesh) for shape in shapes if shape.kind == "mesh")
    return tuple((name, _find_mesh_file(name, packages, ros)) for name in names)


@lru_cache(maxsize=1)
def _shapes(files: tuple[UrdfFile, ...], changed: tuple[int, ...]) -> UrdfShapes:
    """Shapes of all links; cached for the last robot, as they are used twice."""
    return UrdfShapes(files)


def _find_mesh_file(
    name: _MeshName, packages: tuple[Path, ...], ros: tuple[Path, ...]
) -> Path | None:
    urdf, mesh = name
    try:
        return find_mesh(mesh, urdf, packages, ros)
    except InputError:
        return None


def _file_state(path: Path | None) -> tuple[Path, int] | None:
    try:
        return (path, path.stat().st_mtime_ns) if path is not None else None
    except OSError:
        return None


def placed_links(robot: Robot) -> tuple[tuple[Any, ...], ...]:
    """Name, carrying joint and placement (as numbers) of each link."""
    return tuple(
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY
    )


@lru_cache(maxsize=32)
def link_bodies(sources: LinkSources) -> LinkBodies:
    """Read the collision shapes of a robot's links; cached.

    Raises:
        InputError: A mesh file exists, but can't be read whole.
    """
    urdf_shapes = _shapes(sources.files, sources.changed)
    bodies, missing, bare = [], [], []
    for link, joint, *numbers in sources.placed:
        if link not in urdf_shapes.links:
            continue
        carrier = pin.SE3(np.array(numbers).reshape(4, 4))
        shapes, lost = urdf_shapes.link_shapes(link, "collision")
        missing += [f"link {link!r}: {fault}" for fault in lost]
        if not shapes and not lost and any(urdf_shapes.link_shapes(link, "visual")):
            bare.append(link)
        solids = []
        for shape in shapes:
            try:
                placed = _place_shape(shape, sources)
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


def _place_shape(shape: UrdfShape, sources: LinkSources) -> PlacedShape:
    """A link's shape in the URDF as a `PlacedShape`.

    Raises:
        InputError: The mesh is not in the permitted folders.
    """
    placement, path = pin.SE3(shape.rotation, shape.translation), None
    if shape.kind == "mesh":
        known = dict(sources.meshes).get((shape.urdf, shape.mesh))
        look = shape.mesh, shape.urdf, sources.packages, sources.ros
        path = known[0] if known is not None else find_mesh(*look)
    x, y, z = (float(factor) for factor in shape.scale)
    return PlacedShape(shape.kind, shape.size, placement, path, (x, y, z))
