"""`RobotSpec`: all data that define a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import UnknownNameError
from knotwork.errors.arguments import require_type
from knotwork.files.documents.values import JointLimitFields
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import Urdf

LimitTables = Mapping[str, Mapping[str, Any]]
"""Limits that override the URDF's, by quantity and joint, in SI: pairs for `position`."""


@dataclass(frozen=True)
class VirtualJoint:
    """A joint that represents a freedom of a pose.

    Attributes:
        name: Name in messages.
        axis: Axis of rotation or translation: `"x"`, `"y"` or `"z"` of the TCP after the previous
            joints.
        lower, upper: Limits of its position [rad or m], which may be infinite.
        unit: `"rad"`, or `"m"` if prismatic.
        axes: Rotation of its axes relative to the TCP, or `None`.
        mobility: Factor on its velocity in the minimum norm of joint velocities.
        slows_at_limits: Whether its mobility decreases towards its limits.
    """

    name: str
    axis: str
    lower: float
    upper: float
    unit: str = "rad"
    axes: Any = None
    mobility: float = 30.0
    slows_at_limits: bool = True


@dataclass(frozen=True, eq=False)
class RobotSpec:
    """All data that define a robot.

    Attributes:
        name, description: Name and description.
        source: File of the description.
        urdf: The URDF.
        base_frame, tool_frame: Links; `None` for the root, and for no tool.
        tool_offset: TCP in the tool frame.
        payload: Payload of the tool frame, in its axes.
        held_payloads: Objects held by the tool, in the axes of the TCP.
        gravity: Gravity in the axes of the base frame [m/s²], or `None` for 9.81 along -z of the
            root.
        locked: Positions of the joints that the description locks [rad or m].
        unplanned: Positions of other joints that are not planned [rad or m]; by default the
            position within the limits that is nearest to 0.
        configurations: Name to joint to position [rad or m].
        limits: Limits that override the URDF's.
        used_fraction: Fraction of the limits of magnitudes that is used.
        package_paths: Additional folders with meshes.
        ignored_pairs: Pairs of links that are not checked for collisions.
        srdf: SRDF file with more such pairs, or `None`.
        virtual_joints: Virtual joints after the TCP, in order.
        world_frame: Link of the world frame if `base_frame` moves, or `None`.
        weights: Weights of joints, by default 1.
    """

    name: str
    source: Path
    urdf: Urdf
    description: str = ""
    base_frame: str | None = None
    tool_frame: str | None = None
    tool_offset: Any = field(default_factory=pin.SE3.Identity)
    payload: Payload | None = None
    held_payloads: tuple[Payload, ...] = ()
    gravity: FloatArray | None = None
    locked: Mapping[str, float] = field(default_factory=dict)
    unplanned: Mapping[str, float] = field(default_factory=dict)
    configurations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    limits: LimitTables = field(default_factory=dict)
    used_fraction: float = 1.0
    package_paths: tuple[Path, ...] = ()
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    srdf: Path | None = None
    virtual_joints: tuple[VirtualJoint, ...] = ()
    world_frame: str | None = None
    weights: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for payload in (*self.held_payloads, *([] if self.payload is None else [self.payload])):
            require_type(payload, Payload, "payload", "a knotwork.robot.payload.Payload")
        for joint in self.virtual_joints:
            require_type(joint, VirtualJoint, "virtual joint", "a VirtualJoint")

    def configuration(self, name: str) -> Mapping[str, float]:
        """Positions of joints in a named configuration [rad or m].

        Raises:
            UnknownNameError: No configuration has this name.
        """
        if name not in self.configurations:
            where = f"robot {self.name!r}"
            raise UnknownNameError("configuration", name, self.configurations, where=where)
        return self.configurations[name]


def limits_by_joint(limits: JointLimitFields, urdf: Urdf) -> LimitTables:
    """Limits by joint; a number is the limit of all joints of the URDF."""
    return {
        kind: table if isinstance(table, Mapping) else dict.fromkeys(urdf.types, table)
        for kind, table in limits
        if table is not None
    }
