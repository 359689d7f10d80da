"""The robot: forward kinematics (eq 1) and Jacobian (eq 2) of a chain, and its limits."""

from __future__ import annotations

import importlib
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.description import Description
from knotwork.robot.joint_chain import select_chain
from knotwork.robot.joint_limits import chain_limits
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import read_urdf
from knotwork.robot.variants import Variants
from knotwork.waypoints import FloatArray, read_only

_KINEMATICS = f"{__package__.partition('.')[0]}.kinematics"


class Robot(Variants):
    """A serial chain of joints between a base frame and a tool centre point (TCP).

    A joint position is one number, for unbounded joints as well. All poses are of the TCP in the
    base frame. All arrays over joints have shape (d,) and are read-only. A robot may be shared by
    threads: each has its own working memory.

    Attributes:
        name: Name of the robot.
        description: Description of the robot.
        source: File of the description.
        urdf: File with its links, masses and shapes.
        urdf_files: URDF files of the robot and of positioners, each with its links.
        package_paths: Additional folders with meshes.
        joint_names: Names of the d joints, base first.
        joint_units: `"rad"` or `"m"` for each joint.
        lower_position_limit, upper_position_limit: Position limits [rad or m], infinite where there
            are none.
        velocity_limit: Velocity limits [rad/s or m/s], infinite where not given.
        acceleration_limit: Acceleration limits [rad/s² or m/s²], infinite where not given.
        jerk_limit: Jerk limits [rad/s³ or m/s³], infinite where not given.
        effort_limit: Effort limits [N m or N], infinite where not given.
        limits: The limits from `velocity_limit` on, by name of the quantity.
        base_frame: Link of the frame of poses.
        standing_frame: Link of the world frame: the base frame, unless joints move it.
        base_moves: Whether joints move the base frame. Then efforts are unknown.
        tool_frame: Link that carries the TCP, or `None` if it has not been chosen.
        tool_offset: TCP in the tool frame.
        payload: `Payload` of the tool frame, or `None`.
        held: Objects held by the tool, in the axes of the TCP.
        gravity: Gravity in the axes of the base frame [m/s²], shape (3,).
        virtual: Whether each joint is a virtual one, shape (d,).
        virtual_joints: The virtual joints, which are the last joints.
        weights: Weight of each joint's motion, shape (d,).
        tool_candidates: Links without children, possible tool frames.
        configurations: Named configurations with all joints [rad or m].
        locked: Positions of the joints that do not move [rad or m].
        followers: Locked joints that mimic a moving joint, with that joint.
        ignored_pairs: Pairs of links that are not checked for collisions.
        srdf: SRDF file with more such pairs, or `None`.
        model: Pinocchio model of the chain, nq = nv = d.
        data: Pinocchio's working memory, one per thread.

    >>> from knotwork import load_robot
    >>> arm = load_robot("planar2")
    >>> arm.forward([0.0, 0.0]).translation
    array([0.9, 0. , 0. ])
    >>> arm.jacobian([0.0, 0.0])[:2]
    array([[0. , 0. ],
           [0.9, 0.4]])
    """

    def __init__(self, description: Description) -> None:
        super().__init__(description)
        self.name, self.description = description.name, description.description
        self.source, self.urdf_files = description.source, description.urdf.files
        self.urdf = self.urdf_files[0].path
        self.package_paths = description.package_paths
        self.tool_frame = description.tool_frame
        self.ignored_pairs, self.srdf = description.ignored_pairs, description.srdf
        self.tool_offset = description.tool_offset.copy()
        self.tool_candidates = description.urdf.leaves
        self.payload, self.held = description.payload, description.held
        chain = select_chain(
            description.urdf,
            description.name,
            base_frame=description.base_frame,
            tool_frame=description.tool_frame,
            locked=description.locked,
            rest=description.rest,
        )
        self.base_frame, self.joint_names = chain.base_frame, chain.joint_names
        self.standing_frame = description.standing or chain.base_frame
        self.base_moves = description.standing is not None
        self.locked = MappingProxyType(dict(chain.locked))
        self.followers = MappingProxyType(dict(chain.followers))
        self.model = chain.model
        self._add_frames(description.gravity, description.virtual)
        names = self.joint_names
        self.joint_units = tuple(
            "m" if description.urdf.types[name] == "prismatic" else "rad" for name in names
        )
        self._set_limits()
        extra = self.virtual_joints = description.virtual
        self.virtual = np.array([False] * len(names) + [True] * len(extra))
        self.joint_names += tuple(joint.name for joint in extra)
        self.joint_units += tuple(joint.unit for joint in extra)
        weights = [description.weights.get(name, 1.0) for name in self.joint_names]
        self.weights = read_only(weights, (self.dof,), "weights")
        self.configurations = MappingProxyType(
            {
                name: read_only(
                    [*(values[j] for j in names), *(0.0 for _ in extra)], (self.dof,), name
                )
                for name, values in description.configurations.items()
                if all(joint in values for joint in names)
            }
        )

    def _set_limits(self) -> None:
        description = self._given
        planned = self.tool_frame is not None
        lower, upper, magnitudes = chain_limits(
            description.urdf, description.limits, self.joint_names, self.name, planned=planned
        )
        if description.virtual:
            lower = np.append(lower, [joint.lower for joint in description.virtual])
            upper = np.append(upper, [joint.upper for joint in description.virtual])
            endless = np.full(len(description.virtual), np.inf)
            magnitudes = {kind: np.append(most, endless) for kind, most in magnitudes.items()}
        if self.base_moves:
            magnitudes = {**magnitudes, "effort": np.full(len(lower), np.inf)}
        self.lower_position_limit, self.upper_position_limit = lower, upper
        self.limits = MappingProxyType(magnitudes)
        self.velocity_limit = magnitudes["velocity"]
        self.acceleration_limit = magnitudes["acceleration"]
        self.jerk_limit, self.effort_limit = magnitudes["jerk"], magnitudes["effort"]

    @property
    def joined_links(self) -> frozenset[frozenset[str]]:
        """Pairs of parent and child links of the joints of the URDF."""
        return frozenset(map(frozenset, self._given.urdf.parents.items()))

    @property
    def external_axes(self) -> tuple[str, ...]:
        """Names of the joints that the robot's file adds to its URDF.

        >>> kw.load_robot("ur5_rail").external_axes
        ('rail',)
        """
        return self._given.urdf.added

    @property
    def carrying_joints(self) -> dict[str, frozenset[str]]:
        """For each joint of its URDF, planned or not, the joints that carry it, including itself.

        >>> sorted(kw.load_robot("ur5_rail").carrying_joints["shoulder_pan_joint"])
        ['rail', 'shoulder_pan_joint']
        """
        urdf = self._given.urdf
        tree = read_urdf(urdf.files[0].path, self.name, urdf.axes).model
        return {
            name: frozenset(tree.names[k] for k in tree.supports[joint].tolist()[1:])
            for joint, name in enumerate(tree.names[1:], 1)
        }

    def __reduce__(self) -> tuple[type[Robot], tuple[Description]]:
        return type(self), (self._given,)  # each copy gets its own working memory

    def __repr__(self) -> str:
        return (
            f"<Robot {self.name!r}: {self.dof} joints from {self.base_frame!r} "
            f"to {self.tool_frame!r}>"
        )

    def with_tool(
        self, frame: str | None = None, offset: Any = None, payload: Payload | None = None
    ) -> Robot:
        """Choose the tool, which determines the planned joints.

        Args:
            frame: Link that carries the tool; by default unchanged.
            offset: TCP in the tool frame, `pin.SE3`; by default unchanged, or none for a new
                frame.
            payload: Payload of the tool frame, in its axes, in addition to the masses of the URDF;
                by default unchanged, or none for a new frame. It counts in `torque`.

        Raises:
            UnknownNameError: There is no such link.
            RobotError: The link can't be a tool frame: see `load_robot`.

        >>> import pinocchio as pin
        >>> arm = kw.load_robot("planar2")
        >>> longer = arm.with_tool(offset=pin.SE3(np.eye(3), np.array([0.1, 0, 0])))
        >>> longer.forward([0.0, 0.0]).translation
        array([1., 0., 0.])
        """
        changes: dict[str, Any] = {}
        if frame is not None and frame != self.tool_frame:
            changes = {"tool_frame": frame, "tool_offset": pin.SE3.Identity()}
            changes |= {"payload": None, "held": ()}
        if offset is not None:
            finite = isinstance(offset, pin.SE3) and np.isfinite(offset.homogeneous).all()
            if not finite:
                raise RobotError(self.name, f"tool offset must be a finite pin.SE3, not {offset!r}")
            changes["tool_offset"] = offset.copy()
        if payload is not None:
            changes["payload"] = payload
        robot = Robot(replace(self._given, **changes))
        if payload is not None:
            robot.require_tool()
        return robot

    def with_base(self, link: str) -> Robot:
        """Use a moving link, such as a turntable, as the frame of poses.

        The chain then consists of the inverse joints from that link to the world frame, and of the
        joints of the arm. All of these joints are planned.

        Args:
            link: Link of the URDF or of an external axis.

        Raises:
            UnknownNameError: There is no such link.
            RobotError: No joint moves the tool relative to it, or a joint is not supported.

        >>> arm = kw.load_robot("ur5_turntable")
        >>> arm.dof, arm.with_base("table").joint_names[0]
        (6, 'table')
        """
        description = self._given
        urdf = read_urdf(self.urdf, self.name, description.urdf.axes, link)
        standing = None if link == self.standing_frame else self.standing_frame
        return Robot(replace(description, urdf=urdf, base_frame=link, standing=standing))

    @cached_property
    def _at_rest(self) -> Robot:
        return self.with_base(self.standing_frame) if self.base_moves else self

    def in_frame(self, *, standing: bool) -> tuple[Robot, list[int]]:
        """The robot with poses in the base or the world frame, and the indices of its joints.

        Args:
            standing: Whether poses are in the world frame.
        """
        robot = self._at_rest if standing else self
        return robot, [self.joint_names.index(name) for name in robot.joint_names]

    def tool_seen(self, q: FloatArray, *, standing: bool) -> Any:
        """Pose of the TCP in the base or the world frame, `pin.SE3`.

        Args:
            q: Joint positions [rad or m], shape (d,).
            standing: Whether the pose is in the world frame.
        """
        robot, joints = self.in_frame(standing=standing)
        return robot.forward(q[joints])

    def configuration(self, name: str) -> FloatArray:
        """A named configuration [rad or m], shape (d,).

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: The configuration has no position for a joint of the chain.
        """
        if name not in self._given.configurations:
            raise UnknownNameError(
                "configuration", name, self._given.configurations, where=f"robot {self.name!r}"
            )
        if name not in self.configurations:
            values = self._given.configurations[name]
            missing = next(joint for joint in self.joint_names if joint not in values)
            raise RobotError(
                self.name,
                f"configuration {name!r} gives no position for joint {missing!r}",
                joint=missing,
            )
        return self.configurations[name]

    def solve_pose_ik_all(self, pose: Any, **options: Any) -> tuple[Any, ...]:
        """Find every branch that takes the TCP to a pose, as `Branch`.

        Args:
            pose: Pose of the TCP in the base frame, `pin.SE3`.
            options: See `knotwork.solve_pose_ik_all`.
        """
        # imported on call: `kinematics` imports `robot`
        return tuple(importlib.import_module(_KINEMATICS).solve_pose_ik_all(self, pose, **options))
