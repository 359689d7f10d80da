"""Bodies that may collide: links of the robot, its tool, what it holds, and what stands around."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.meshes.finding import find_mesh, ros_folders
from knotwork.robot import Robot
from knotwork.robot.shapes import Shape as UrdfShape
from knotwork.robot.shapes import UrdfShapes
from knotwork.scenario import Shape
from knotwork.scene.solids import Placed, Solid, solid
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: solids that one joint carries.

    Attributes:
        name: Of the link or object; `tool` for the tool's shapes.
        kind: `"link"`, `"tool"`, `"held"` or `"object"`.
        joint: Index of the joint that carries it; 0 for what stands still.
        solids: Its shapes.
        start, end: From when to when [s] it is there.
        apart: Whether it is to be held or was held, and the tool is away from it.
    """

    name: str
    kind: str
    joint: int
    solids: tuple[Solid, ...]
    start: float = -math.inf
    end: float = math.inf
    apart: bool = False


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


@dataclass(frozen=True, eq=False)
class LinkBodies:
    """The links of a robot that have collision shapes.

    Attributes:
        bodies: One for each such link.
        missing: Sentences on links whose shapes can't be had.
        bare: Names of links that have shapes to be seen, but none for collisions.
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]
    bare: tuple[str, ...]


def link_bodies(robot: Robot) -> LinkBodies:
    """Read the collision shapes of a robot's links; what was read is kept for the next time."""
    changed = robot.urdf.stat().st_mtime_ns
    return _link_bodies(robot.urdf, changed, placed_links(robot), *mesh_folders(robot))


def mesh_folders(robot: Robot) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Folders that meshes are looked for in beside the URDF's own: the robot's, those of ROS."""
    return tuple(robot.package_paths), ros_folders()


def placed_links(robot: Robot) -> tuple[tuple[Any, ...], ...]:
    """Name, carrying joint and the numbers of the placement of each link."""
    return tuple(
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY
    )


@lru_cache(maxsize=32)
def _link_bodies(
    urdf: Path,
    changed: int,
    placed: tuple[tuple[Any, ...], ...],
    packages: tuple[Path, ...],
    ros: tuple[Path, ...],
) -> LinkBodies:
    given = UrdfShapes(urdf)
    bodies, missing, bare = [], [], []
    for link, joint, *numbers in placed:
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
                solids.append(solid(_placed(shape, urdf, packages, ros), carrier))
            except InputError as error:
                missing.append(f"link {link!r}: {error}")
        if solids:
            bodies.append(Body(link, "link", joint, tuple(solids)))
    return LinkBodies(tuple(bodies), tuple(missing), tuple(bare))


def _placed(
    given: UrdfShape, urdf: Path, packages: tuple[Path, ...], ros: tuple[Path, ...]
) -> Shape:
    """A link's shape as the URDF gives it, as one that solids are made of.

    Raises:
        InputError: There is no such mesh where meshes are taken from.
    """
    placement, path = pin.SE3(given.rotation, given.translation), None
    if given.kind == "mesh":
        path = find_mesh(given.mesh, urdf, packages, ros)
    x, y, z = (float(factor) for factor in given.scale)
    return Shape(given.kind, given.size, placement, path, (x, y, z))
