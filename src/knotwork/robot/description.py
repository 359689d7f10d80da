"""What a robot is made from: its URDF, the tool it carries, and what replaces its limits."""

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
    """A joint of a task: what a pose leaves open.

    Attributes:
        name: For messages.
        axis: That it turns about or slides along: `"x"`, `"y"` or `"z"` of the TCP, as the joints
            before leave it.
        lower, upper: Limits of its position [rad or m], which may be infinite.
        unit: `"rad"`, or `"m"` if it slides.
        axes: Rotation of the axes that it turns about, in those of the TCP; or `None`.
        ease: How much easier than others it moves in the least norm of joint velocities.
    """

    name: str
    axis: str
    lower: float
    upper: float
    unit: str = "rad"
    axes: Any = None
    ease: float = 30.0


@dataclass(frozen=True, eq=False)
class Description:
    """Everything a robot is made from.

    Attributes:
        name, description: What it is called, and what it is.
        source: File that describes it.
        urdf: Its URDF.
        base_frame, tool_frame: Links, or `None` for the root and for none.
        tool_offset: TCP in the tool frame.
        payload: What the tool frame carries, in its axes.
        held: What the tool holds, in the axes of the TCP.
        gravity: In the axes of the base frame [m/s²], or `None` for 9.81 along -z of the root.
        locked: Joints locked on purpose [rad or m].
        rest: Where others stand that are not planned for, 0 by default [rad or m].
        configurations: Name to joint to position [rad or m].
        limits: Limits that replace the URDF's.
        package_paths: Folders that meshes are also looked for in.
        ignored_pairs: Pairs of links that are not checked for collisions.
        srdf: File that names more of them, or `None`.
        virtual: Joints of a task after the TCP, in order.
        standing: Link that stands still where `base_frame` moves, or `None`.
        weights: Of joints whose motion counts more or less than that of others, 1 for these.
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
