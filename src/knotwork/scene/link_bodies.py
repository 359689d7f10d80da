"""Bodies of a robot's links, from the collision shapes of its URDFs."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.external_axes import UrdfFile
from knotwork.robot.shapes import UrdfShapes
from knotwork.scene.bodies import Body
from knotwork.scene.meshes.locating import find_mesh, list_ros_folders
from knotwork.scene.solids import make_solid
from knotwork.task.scenario import PlacedShape


class LinkBodies(NamedTuple):
    """Bodies of the links of a robot that have collision shapes.

    Attributes:
        bodies: A body for each such link.
        missing: Sentences on links whose shapes are not available.
        bare: Names of links with visual shapes but no collision shapes.
        meshes: Their mesh files, each with the time of its last change [ns].
        lost: Names of the meshes that are not found, each with its URDF.
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]
    bare: tuple[str, ...]
    meshes: tuple[tuple[Path, int | None], ...]
    lost: tuple[tuple[str, Path], ...]


@dataclass(frozen=True)
class _Key:
    """All inputs of the bodies of a robot's links, except the meshes themselves."""

    files: tuple[tuple[UrdfFile, int | None], ...]
    placed: tuple[tuple[Any, ...], ...]
    folders: tuple[tuple[Path, ...], tuple[Path, ...]]
    robot: Robot = field(compare=False)


def read_link_bodies(robot: Robot) -> LinkBodies:
    """Read the bodies of a robot's links; they are cached until a file changes.

    Raises:
        InputError: A mesh file exists, but can't be read whole.
    """
    placed = (
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in _link_frames(robot)
    )
    files = tuple((file, _last_change(file.path)) for file in robot.urdf_files)
    key = _Key(files, tuple(placed), (tuple(robot.package_paths), list_ros_folders()), robot)
    links = _read_bodies(key)
    if not _are_current(links, key):
        _read_bodies.cache_clear()
        links = _read_bodies(key)
    return links


def _are_current(links: LinkBodies, key: _Key) -> bool:
    """Whether no mesh file has changed since it was read, and lost ones are still not found."""
    for name, urdf in links.lost:
        with contextlib.suppress(InputError):
            find_mesh(name, urdf, *key.folders)
            return False
    return all(_last_change(path) == time for path, time in links.meshes)


def _link_frames(robot: Robot) -> list[Any]:
    """Pinocchio's frames of the links."""
    return [frame for frame in robot.model.frames if frame.type == pin.FrameType.BODY]


def _last_change(path: Path) -> int | None:
    """Time of the last change of a file [ns]; `None` without a file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


@lru_cache(maxsize=32)
def _read_bodies(key: _Key) -> LinkBodies:
    """Read the collision shapes of a robot's links."""
    urdf_shapes = UrdfShapes(key.robot.urdf_files)
    bodies, missing, bare = [], [], []
    meshes: dict[Path, int | None] = {}
    lost: dict[tuple[str, Path], None] = {}
    for frame in _link_frames(key.robot):
        link = str(frame.name)
        if link not in urdf_shapes.links:
            continue
        shapes, faults = urdf_shapes.link_shapes(link, "collision")
        missing += [f"link {link!r}: {fault}" for fault in faults]
        if not shapes and not faults and any(urdf_shapes.link_shapes(link, "visual")):
            bare.append(link)
        solids = []
        for shape in shapes:
            path = None
            if shape.kind == "mesh":
                try:
                    path = find_mesh(shape.mesh, shape.urdf, *key.folders)
                except InputError as error:
                    lost[shape.mesh, shape.urdf] = None
                    missing.append(f"link {link!r}: {error}")
                    continue
                meshes[path] = _last_change(path)
            x, y, z = shape.scale.tolist()
            placement = pin.SE3(shape.rotation, shape.translation)
            placed = PlacedShape(shape.kind, shape.size, placement, path, scale=(x, y, z))
            try:
                solids.append(make_solid(placed, frame.placement))
            except InputError as error:
                error.locate(f"{shape.urdf}: collision shape of link {link!r}")
                raise
        if solids:
            bodies.append(Body(link, "link", int(frame.parentJoint), tuple(solids), link=link))
    return LinkBodies(
        tuple(bodies), tuple(missing), tuple(bare), meshes=tuple(meshes.items()), lost=tuple(lost)
    )
