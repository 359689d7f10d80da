"""`Description`: all data that define a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import RobotError, UnknownNameError
from knotwork.errors.arguments import require_number, require_type
from knotwork.files.documents import Document, validate
from knotwork.files.documents.values import JointLimitFields
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import Urdf

# Limits that override the URDF's: by quantity and joint, in SI; a pair for "position".
LimitTables = Mapping[str, Mapping[str, Any]]


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
class Description:
    """All data that define a robot.

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
    held: tuple[Payload, ...] = ()
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
        for payload in (*self.held, *([] if self.payload is None else [self.payload])):
            require_type(payload, Payload, "payload", "a kw.Payload")
        for joint in self.virtual_joints:
            require_type(joint, VirtualJoint, "virtual joint", "a VirtualJoint")

    def with_tool(self, frame: str | None, offset: Any, payload: Payload | None) -> Description:
        """Change the tool; see `Robot.with_tool`."""
        changed = self
        if frame is not None and frame != self.tool_frame:
            no_offset = pin.SE3.Identity()
            changed = replace(self, tool_frame=frame, tool_offset=no_offset, payload=None, held=())
        if offset is not None:
            if not (isinstance(offset, pin.SE3) and np.isfinite(offset.homogeneous).all()):
                raise RobotError(self.name, f"tool offset must be a finite pin.SE3, not {offset!r}")
            changed = replace(changed, tool_offset=offset.copy())
        return changed if payload is None else replace(changed, payload=payload)

    def configuration(self, name: str) -> Mapping[str, float]:
        """Positions of joints in a named configuration [rad or m].

        Raises:
            UnknownNameError: No configuration has this name.
        """
        if name not in self.configurations:
            where = f"robot {self.name!r}"
            raise UnknownNameError("configuration", name, self.configurations, where=where)
        return self.configurations[name]

    def with_unplanned_at(self, name: str, planned: Sequence[str]) -> Description:
        """Set the joints that are not planned to a named configuration, as `Robot` does."""
        unplanned = dict(self.unplanned)
        for joint, value in self.configuration(name).items():
            if joint in planned or joint in self.locked or joint in self.urdf.mimics:
                continue
            if unplanned.setdefault(joint, value) != value:
                raise RobotError(
                    self.name,
                    f"configuration {name!r} has joint {joint!r} at {value:g}, another one of the "
                    f"task has it at {unplanned[joint]:g}, and nothing in the task moves it; "
                    "accepted: the same position in both, or a pose on what it carries",
                    joint=joint,
                )
        return replace(self, unplanned=unplanned)

    def with_weights(
        self, weights: Mapping[str, float], planned: Sequence[str], locked: Mapping[str, float]
    ) -> Description:
        """Change weights; see `Robot.with_weights`."""
        require_type(weights, Mapping, "weights", "a mapping of joints to weights")
        for name, weight in weights.items():
            if name in locked:
                raise RobotError(
                    self.name,
                    f"joint {name!r} does not move: it is locked, or no pose is on what it "
                    f"carries; joints that move: {', '.join(planned)}",
                    joint=name,
                )
            if name not in planned:
                raise UnknownNameError("joint", name, planned, where=f"robot {self.name!r}")
            require_number(weight, f"weight of joint {name!r}", positive=True)
        return replace(self, weights=dict(weights))

    def with_limits(self, limits: Mapping[str, Any], planned: Sequence[str]) -> Description:
        """Override limits; see `Robot.with_limits`."""
        given = {
            kind: table.tolist() if isinstance(table, np.generic | np.ndarray) else table
            for kind, table in limits.items()
            if table is not None and (not isinstance(table, Mapping) or table)
        }
        tables = list_limits(validate(JointLimitFields, Document(given)), self.urdf)
        for kind, table in given.items():
            for joint in table if isinstance(table, Mapping) else ():
                if joint not in planned:
                    where = f"robot {self.name!r}: limits.{kind}"
                    raise UnknownNameError("joint", joint, planned, where=where)
        merged = {kind: {**self.limits.get(kind, {}), **table} for kind, table in tables.items()}
        return replace(self, limits={**self.limits, **merged})

    def no_tool_error(self, links: Sequence[str]) -> RobotError:
        """Make the error for the use of a tool before its link is chosen."""
        leaves = self.urdf.leaves
        inner = ", ".join(name for name in links if name not in leaves)
        return RobotError(
            self.name,
            "needs a tool frame; name the link that carries the tool with `tool: {frame: "
            "NAME}` in the scenario or `tool_frame: NAME` in a robot file "
            f"(links: {inner}; links at the end of a chain: {', '.join(leaves)})",
        )


def list_limits(limits: JointLimitFields, urdf: Urdf) -> LimitTables:
    """List limits by joint; a number is the limit of all joints of the URDF."""
    return {
        kind: table if isinstance(table, Mapping) else dict.fromkeys(urdf.types, table)
        for kind, table in limits
        if table is not None
    }
