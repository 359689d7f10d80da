"""Description of a robot: its URDF, tool and overridden limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pinocchio as pin

from knotwork.robot.joint_limits import LimitTables
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import Urdf
from knotwork.waypoints import FloatArray


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
        ease: Factor on its mobility in the minimum norm of joint velocities.
        soft: Whether its mobility decreases towards its limits.
    """

    name: str
    axis: str
    lower: float
    upper: float
    unit: str = "rad"
    axes: Any = None
    ease: float = 30.0
    soft: bool = True


@dataclass(frozen=True, eq=False)
class Description:
    """All data of a robot.

    Attributes:
        name, description: Name and description.
        source: File of the description.
        urdf: The URDF.
        base_frame, tool_frame: Links; `None` for the root, and for no tool.
        tool_offset: TCP in the tool frame.
        payload: Payload of the tool frame, in its axes.
        held: Objects held by the tool, in the axes of the TCP.
        gravity: Gravity in the axes of the base frame [m/s²], or `None` for 9.81 along -z of the
            root.
        locked: Positions of the joints that the description locks [rad or m].
        rest: Positions of other joints that are not planned, 0 by default [rad or m].
        configurations: Name to joint to position [rad or m].
        limits: Limits that override the URDF's.
        package_paths: Additional folders with meshes.
        ignored_pairs: Pairs of links that are not checked for collisions.
        srdf: SRDF file with more such pairs, or `None`.
        virtual: Virtual joints after the TCP, in order.
        standing: Link of the world frame if `base_frame` moves, or `None`.
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
    held: tuple[Payload, ...] = ()
    gravity: FloatArray | None = None
    locked: Mapping[str, float] = field(default_factory=dict)
    rest: Mapping[str, float] = field(default_factory=dict)
    configurations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    limits: LimitTables = field(default_factory=dict)
    package_paths: tuple[Path, ...] = ()
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    srdf: Path | None = None
    virtual: tuple[VirtualJoint, ...] = ()
    standing: str | None = None
    weights: Mapping[str, float] = field(default_factory=dict)
