"""Bodies that may collide: links of the robot, its tool, what it holds, and what stands around."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import InputError
from knotwork.robot import Robot
from knotwork.scene.link_shapes import LinkElements
from knotwork.scene.solids import Solid, solid


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: solids that one joint carries.

    Attributes:
        name: Of the link or object; `tool` for the tool's shapes.
        kind: `"link"`, `"tool"`, `"held"` or `"object"`.
        joint: Index of the joint that carries it; 0 for what stands still.
        solids: Its shapes.
        start, end: From when to when [s] it is there.
    """

    name: str
    kind: str
    joint: int
    solids: tuple[Solid, ...]
    start: float = -math.inf
    end: float = math.inf


@dataclass(frozen=True, eq=False)
class LinkBodies:
    """The links of a robot that have collision shapes.

    Attributes:
        bodies: One for each such link.
        missing: Sentences on links whose shapes can't be had.
    """

    bodies: tuple[Body, ...]
    missing: tuple[str, ...]


def link_bodies(robot: Robot) -> LinkBodies:
    """Read the collision shapes of a robot's links; what was read is kept for the next time."""
    return _link_bodies(robot.urdf, robot.urdf.stat().st_mtime_ns, placed_links(robot))


def placed_links(robot: Robot) -> tuple[tuple[Any, ...], ...]:
    """Name, carrying joint and the numbers of the placement of each link."""
    return tuple(
        (str(frame.name), int(frame.parentJoint), *frame.placement.homogeneous.ravel().tolist())
        for frame in robot.model.frames
        if frame.type == pin.FrameType.BODY
    )


@lru_cache(maxsize=32)
def _link_bodies(urdf: Path, changed: int, placed: tuple[tuple[Any, ...], ...]) -> LinkBodies:
    elements = LinkElements(urdf)
    bodies, missing = [], []
    for link, joint, *numbers in placed:
        if link not in elements.links:
            continue
        carrier = pin.SE3(np.array(numbers).reshape(4, 4))
        solids = []
        for one in elements.shapes(link, "collision"):
            try:
                if isinstance(one, InputError):
                    raise one
                solids.append(solid(one.shape, carrier))
            except InputError as error:
                missing.append(f"link {link!r}: {error}")
        if solids:
            bodies.append(Body(link, "link", joint, tuple(solids)))
    return LinkBodies(tuple(bodies), tuple(missing))
