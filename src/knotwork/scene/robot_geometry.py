"""The robot in a collision model: its links, and the pairs that touch at home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.robot.external_axes import UrdfFile
from knotwork.robot.joint_tree import JointTree, joint_tree, place_joints
from knotwork.robot.shapes import UrdfShapes
from knotwork.scene.bodies import Body
from knotwork.scene.distances import DistanceMeter, nearest_of_bodies
from knotwork.scene.meshes.locating import find_mesh, ros_folders
from knotwork.scene.solids import solid
from knotwork.task.scenario import PlacedShape
from knotwork.task.scene_shapes import Collisions
from knotwork.waypoints import FloatArray

TOUCHING_DISTANCE = Collisions.model_construct().resolution
"""Distance of bodies [m] below which they touch, because no check finds them clear."""

Touching = dict[tuple[int, int], float]
"""Pairs of bodies that touch at home, by index, with their penetration depth [m]."""


class LinkBodies(NamedTuple):
    """The links of a robot with collision shapes.

    Attributes:
        bodies: A body for each such link.
        missing: Sentences on links whose shapes are not available.
        bare: Names of links with visual shapes but no collision shapes.
        meshes: Their mesh files, each with the time of its last change [ns].
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]
    bare: tuple[str, ...]
    meshes: tuple[tuple[Path, int | None], ...]


class RobotGeometry(NamedTuple):
    """The part of a collision model that depends on the robot only.

    Attributes:
        joints: Its joints.
        links: Its links.
        touching: Pairs of links that touch at home.
    """

    joints: JointTree
    links: LinkBodies
    touching: Touching


@dataclass(frozen=True)
class _Key:
    """All inputs of the relative placement of a robot's links, except their meshes."""

    files: tuple[tuple[UrdfFile, int | None], ...]
    placed: tuple[tuple[Any, ...], ...]
    folders: tuple[tuple[Path, ...], ...]
    home: tuple[float, ...]
    robot: Robot = field(compare=False)


def robot_geometry(robot: Robot) -> RobotGeometry:
    """The geometry of a robot, common to all its scenarios; cached until a file changes.

    Raises:
        InputError: A mesh file exists, but can't be read whole.
    """
    placed = (
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in _links(robot)
    )
    files = tuple((file, _last_change(file.path)) for file in robot.urdf_files)
    folders = tuple(robot.package_paths), ros_folders()
    key = _Key(files, tuple(placed), folders, tuple(home_of(robot).tolist()), robot)
    geometry = _build_geometry(key)
    links = geometry.links
    if links.missing or any(_last_change(path) != time for path, time in links.meshes):
        _build_geometry.cache_clear()
        geometry = _build_geometry(key)
    return geometry


@lru_cache(maxsize=32)
def _build_geometry(key: _Key) -> RobotGeometry:
    joints, links = joint_tree(key.robot.model), _link_bodies(key.robot)
    n = len(links.bodies)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    return RobotGeometry(joints, links, touching_pairs(joints, links.bodies, pairs, key.robot))


def _links(robot: Robot) -> list[Any]:
    """Pinocchio's frames of the links."""
    return [frame for frame in robot.model.frames if frame.type == pin.FrameType.BODY]


def _last_change(path: Path) -> int | None:
    """Time of the last change of a file [ns]; `None` without a file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _link_bodies(robot: Robot) -> LinkBodies:
    """Read the collision shapes of a robot's links."""
    urdf_shapes, ros = UrdfShapes(robot.urdf_files), ros_folders()
    bodies, missing, bare = [], [], []
    meshes: dict[Path, int | None] = {}
    for frame in _links(robot):
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
                    path = find_mesh(shape.mesh, shape.urdf, robot.package_paths, ros)
                except InputError as error:
                    missing.append(f"link {link!r}: {error}")
                    continue
                meshes[path] = _last_change(path)
            x, y, z = shape.scale.tolist()
            placement = pin.SE3(shape.rotation, shape.translation)
            placed = PlacedShape(shape.kind, shape.size, placement, path, (x, y, z))
            try:
                solids.append(solid(placed, frame.placement))
            except InputError as error:
                error.locate(f"{shape.urdf}: collision shape of link {link!r}")
                raise
        if solids:
            bodies.append(Body(link, "link", int(frame.parentJoint), tuple(solids), link=link))
    return LinkBodies(tuple(bodies), tuple(missing), tuple(bare), tuple(meshes.items()))


def home_of(robot: Robot) -> FloatArray:
    """The home configuration, or the one nearest to zero within the limits."""
    low, high = robot.lower_position_limit, robot.upper_position_limit
    return robot.configurations.get("home", np.clip(np.zeros(robot.dof), low, high))


def touching_pairs(
    joints: JointTree,
    bodies: Sequence[Body],
    pairs: Sequence[tuple[int, int]],
    robot: Robot,
) -> Touching:
    """Pairs of bodies that move relative to each other and touch at home."""
    rotation, origin = (poses[0] for poses in place_joints(joints, home_of(robot)[None]))
    meter = DistanceMeter()
    touching = {}
    for i, j in pairs:
        if bodies[i].joint == bodies[j].joint:
            continue
        distance = nearest_of_bodies(meter, bodies[i], bodies[j], rotation, origin).distance
        if distance < TOUCHING_DISTANCE:
            touching[i, j] = -distance
    return touching
