"""Bodies of a collision model: links of the robot, its tool, held objects and surroundings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from knotwork.arrays import FloatArray
from knotwork.scene.solids import Placed, Solid

BodyKind = Literal["link", "tool", "held", "object"]


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body: solids carried by one joint.

    Attributes:
        name: Name in reports.
        kind: Kind; an `"object"` is one that the robot does not move.
        joint: Index of the joint that carries it; 0 for a fixed body.
        solids: Its solids.
        start, end: Time interval of its presence [s].
        tool_keeps_clear: Whether the tool must keep clear of it, although it may touch the object
            while it takes or releases it.
        link: Name of a link in its URDF; empty for other bodies.
    """

    name: str
    kind: BodyKind
    joint: int
    solids: tuple[Solid, ...]
    start: float = -math.inf
    end: float = math.inf
    tool_keeps_clear: bool = False
    link: str = ""

    @property
    def identity(self) -> str:
        """Unique name: a link of the robot or a body of the scenario."""
        return f"link:{self.link}" if self.link else f"scenario:{self.name}"


def place_solids(body: Body, rotation: FloatArray, origin: FloatArray) -> Iterator[Placed]:
    """Place the solids of a body, given rotations and origins of all joints.

    Args:
        body: The body.
        rotation: Rotations of all joints, shape (n + 1, 3, 3).
        origin: Origins of all joints [m], shape (n + 1, 3).
    """
    joint_rotation, joint_origin = rotation[body.joint], origin[body.joint]
    for solid in body.solids:
        solid_origin = joint_rotation @ solid.translation + joint_origin
        yield Placed(solid, joint_rotation @ solid.rotation, solid_origin)
