"""`Robot`: a chain of joints that can be given another tool, base, load and other limits."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import RobotError, UnknownNameError
from knotwork.errors.arguments import require_number, require_type
from knotwork.errors.old_names import OldAttribute
from knotwork.files.documents import Document, validate
from knotwork.files.documents.values import JointLimitFields
from knotwork.robot.chain_model import ChainModel
from knotwork.robot.payload import Payload
from knotwork.robot.robot_spec import RobotSpec, VirtualJoint, limits_by_joint
from knotwork.robot.urdf import read_urdf


class Robot(ChainModel):
    """A serial chain of joints between a base frame and a tool centre point (TCP).

    A joint position is one number, for unbounded joints as well. All poses are of the TCP in the
    base frame. All arrays over joints have shape (d,) and are read-only. Arguments q are joint
    positions [rad or m], v velocities [rad/s or m/s] and a accelerations [rad/s² or m/s²]. Wrong
    shapes, and values that are not finite, raise an `ArrayError`. Kinematics without a tool frame
    raises a `RobotError`. Threads may share a robot.

    Attributes:
        name, description: Name and description of the robot.
        source: File of the description.
        urdf: File with its links, masses and shapes.
        urdf_files: URDF files of the robot and of positioners, each with its links.
        package_paths: Additional folders with meshes.

        base_frame: Link in whose frame poses are given.
        base_placement: Base frame in the axes of the URDF's root, as `pin.SE3`.
        base_moves: Whether joints move the base frame. Then efforts are unknown.
        world_frame: Link of the world frame: the base frame, unless joints move it.
        tool_frame: Link that carries the TCP, or `None` if it has not been chosen.
        tool_offset: TCP in the tool frame.
        tool_candidates: Links without children, possible tool frames.
        payload: `Payload` of the tool frame, or `None`.
        held_payloads: `Payload` of each object held by the tool, in the axes of the TCP.
        gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        dof: Number of planned joints, d.
        joint_names: Names of the d joints, base first.
        joint_units: `"rad"` or `"m"` for each joint.
        limits: Limits of the joints, `JointLimits`.
        weights: Weight of each joint's motion.
        is_virtual: Whether each joint is a virtual one.
        virtual_joints: The virtual joints, which are the last joints.
        configurations: Named configurations with all joints [rad or m].

        locked: Positions of the joints that do not move [rad or m].
        followers: The moving joint that a locked joint mimics, by the name of the latter.
        external_axes: Names of the joints that the robot's file adds to its URDF.

        link_names: Names of the links, each of which may be the base or the tool frame.
        joined_links: Pairs of parent and child links of the joints of the URDF.
        ignored_pairs: Pairs of links that are not checked for collisions.
        srdf: SRDF file with more such pairs, or `None`.

        model: Pinocchio model of the chain, nq = nv = d.
        tcp_frame_id: Index of the frame of the TCP in `model`, or `None`.

    >>> arm = kw.load_robot("planar2")
    >>> arm.forward([0.0, 0.0]).translation
    array([0.9, 0. , 0. ])
    >>> arm.jacobian([0.0, 0.0])[:2]
    array([[0. , 0. ],
           [0.9, 0.4]])
    """

    def __init__(self, spec: RobotSpec) -> None:
        super().__init__(spec)
        self.description = spec.description
        self.source = spec.source
        self.urdf_files = spec.urdf.files
        self.urdf = self.urdf_files[0].path
        self.package_paths = spec.package_paths
        self.ignored_pairs = spec.ignored_pairs
        self.srdf = spec.srdf
        self.tool_frame = spec.tool_frame
        self.tool_offset = spec.tool_offset.copy()
        self.tool_candidates = spec.urdf.leaves
        self.payload = spec.payload
        self.held_payloads = spec.held_payloads
        self.external_axes = spec.urdf.added
        self.joined_links = spec.urdf.joined_links

    frame_index = OldAttribute("link_index")
    frame_names = OldAttribute("link_names")
    held = OldAttribute("held_payloads")
    in_frame = OldAttribute("robot_and_columns")
    virtual = OldAttribute("is_virtual")

    @property
    def is_redundant(self) -> bool:
        """Whether there are more joints than the six coordinates of a pose."""
        return self.dof > 6

    @cached_property
    def carrying_joints(self) -> dict[str, frozenset[str]]:
        """The joints that carry each joint of the URDF, including itself."""
        urdf = self._spec.urdf
        tree = read_urdf(self.urdf, self.name, urdf.axes).model  # its root is that of the URDF
        return {
            name: frozenset(tree.names[k] for k in tree.supports[joint].tolist()[1:])
            for joint, name in enumerate(tree.names[1:], 1)
        }

    def __reduce__(self) -> tuple[type[Robot], tuple[RobotSpec]]:
        return type(self), (self._spec,)  # each copy gets its own working memory

    def __repr__(self) -> str:
        chain = f"{self.dof} joints from {self.base_frame!r} to {self.tool_frame!r}"
        return f"<Robot {self.name!r}: {chain}>"

    def with_held(self, *held: Payload) -> Robot:
        """Let the tool hold objects, given in the axes of the TCP; they count in `effort`."""
        self.require_tool()
        return Robot(replace(self._spec, held_payloads=held))

    def with_virtual_joints(self, *joints: VirtualJoint) -> Robot:
        """Add virtual joints after the TCP, which move its frame.

        They are last in all arrays, and have no mass and only position limits.
        """
        self.require_tool()
        return Robot(replace(self._spec, virtual_joints=joints))

    def with_weights(self, weights: Mapping[str, float]) -> Robot:
        """Set weights of the motion of joints.

        They affect the minimum norm of joint velocities of a redundant arm, and the travel by which
        solutions are chosen. A joint with a weight of 0.2 moves more; by default weights are 1.

        Raises:
            InputError: A weight is not a positive number.
            UnknownNameError: There is no such joint.
            RobotError: A joint does not move.

        >>> eager = kw.load_robot("ur5_rail").with_weights({"rail": 0.2})
        >>> home = eager.configuration("home")
        >>> kw.solve_velocity_ik(eager, home, [0, 0.1, 0, 0, 0, 0])[:2].round(3)
        array([0.098, 0.004])
        """
        require_type(weights, Mapping, "weights", "a mapping of joints to weights")
        for name, weight in weights.items():
            if name in self.locked:
                raise RobotError(
                    self.name,
                    f"joint {name!r} does not move: it is locked, or no pose is on what it "
                    f"carries; joints that move: {', '.join(self.joint_names)}",
                    joint=name,
                )
            self._require_joint(name, f"robot {self.name!r}")
            require_number(weight, f"weight of joint {name!r}", positive=True)
        return Robot(replace(self._spec, weights=dict(weights)))

    def _require_joint(self, name: str, where: str) -> None:
        if name not in self.joint_names:
            raise UnknownNameError("joint", name, self.joint_names, where=where)

    def with_unplanned_at(self, name: str) -> Robot:
        """Set the joints that are not planned to a named configuration.

        Joints under `locked` in its file, and joints that mimic others, are unchanged.

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: A joint is outside its limits, or an earlier configuration has it elsewhere.
        """
        spec = self._spec
        unplanned = dict(spec.unplanned)
        followers = spec.urdf.mimics
        for joint, value in spec.configuration(name).items():
            if joint in self.joint_names or joint in spec.locked or joint in followers:
                continue
            if unplanned.setdefault(joint, value) != value:
                raise RobotError(
                    self.name,
                    f"joint {joint!r} is not planned; configuration {name!r} has it at {value:g}, "
                    f"an earlier one at {unplanned[joint]:g}; accepted: the same position in both, "
                    "or a pose in a frame that the joint carries",
                    joint=joint,
                )
        if unplanned == spec.unplanned:
            return self
        return Robot(replace(spec, unplanned=unplanned))

    def with_gravity(self, gravity: ArrayLike) -> Robot:
        """Mount the robot differently: on a wall, on a ceiling, or without gravity.

        Args:
            gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        Raises:
            ArrayError: The value is not three finite numbers.

        >>> kw.load_robot("ur5").with_gravity([0, 0, 9.81]).gravity
        array([0.  , 0.  , 9.81])
        """
        return Robot(replace(self._spec, gravity=checked_array(gravity, (3,), "gravity")))

    def with_limits(
        self,
        position: Mapping[str, tuple[float, float]] | None = None,
        **magnitudes: float | Mapping[str, float] | None,
    ) -> Robot:
        """Override limits, each by joint or as one number for all joints.

        Args:
            position: Joint to lower and upper limit [rad or m].
            magnitudes: `velocity` [rad/s or m/s], `acceleration` [rad/s² or m/s²], `jerk`
                [rad/s³ or m/s³], `effort` [N m or N].

        Raises:
            DocumentError: There is no such limit, a number is not finite, a magnitude isn't
                positive, or lower isn't below upper.
            UnknownNameError: The robot has no such joint.

        >>> kw.load_robot("planar2").with_limits(velocity={"elbow": 0.5}).limits.velocity
        array([3. , 0.5])
        """
        plain_tables = {
            kind: table.tolist() if isinstance(table, np.generic | np.ndarray) else table
            for kind, table in {"position": position, **magnitudes}.items()
            if table is not None and (not isinstance(table, Mapping) or table)
        }
        if not plain_tables:
            return self
        spec = self._spec
        tables = limits_by_joint(validate(JointLimitFields, Document(plain_tables)), spec.urdf)
        for kind, table in plain_tables.items():
            for joint in table if isinstance(table, Mapping) else ():
                self._require_joint(joint, f"robot {self.name!r}: limits.{kind}")
        earlier = spec.limits
        merged = {kind: {**earlier.get(kind, {}), **table} for kind, table in tables.items()}
        return Robot(replace(spec, limits={**earlier, **merged}))

    def with_used_fraction(self, fraction: float) -> Robot:
        """Use this fraction, in place of an earlier one, of all limits except those of position.

        Raises:
            InputError: The fraction is not a positive number.
        """
        fraction = require_number(fraction, "used_fraction", positive=True)
        if fraction == self._spec.used_fraction:
            return self
        return Robot(replace(self._spec, used_fraction=fraction))

    def with_tool(
        self, frame: str | None = None, offset: Any = None, payload: Payload | None = None
    ) -> Robot:
        """Choose the tool, which determines the planned joints.

        Values that are not given stay unchanged; a new frame begins without offset and payload.

        Args:
            frame: Link that carries the tool.
            offset: TCP in the tool frame, `pin.SE3`.
            payload: Payload of the tool frame, in its axes, in addition to the masses of the URDF.
                It counts in `effort`.

        Raises:
            InputError: The payload is not a `Payload`.
            UnknownNameError: There is no such link.
            RobotError: The offset is not finite, or the link can't carry a tool: see `load_robot`.

        >>> import pinocchio as pin
        >>> arm = kw.load_robot("planar2")
        >>> longer = arm.with_tool(offset=pin.SE3(np.eye(3), np.array([0.1, 0, 0])))
        >>> longer.forward([0.0, 0.0]).translation
        array([1., 0., 0.])
        """
        changed = self._spec
        if frame is not None and frame != self.tool_frame:
            no_offset = pin.SE3.Identity()
            changed = replace(
                changed, tool_frame=frame, tool_offset=no_offset, payload=None, held_payloads=()
            )
        if offset is not None:
            if not (isinstance(offset, pin.SE3) and np.isfinite(offset.homogeneous).all()):
                raise RobotError(self.name, f"tool offset must be a finite pin.SE3, not {offset!r}")
            changed = replace(changed, tool_offset=offset.copy())
        if payload is None:
            return Robot(changed)
        robot = Robot(replace(changed, payload=payload))
        robot.require_tool()
        return robot

    def with_base(self, link: str) -> Robot:
        """Use a moving link, such as a turntable, as the frame of poses.

        The turntable and the arm are then one serial chain, of the inverse joints from that link to
        the world frame and of the joints of the arm. All of them are planned. The link may be that
        of an external axis.

        Raises:
            UnknownNameError: There is no such link.
            RobotError: No joint moves the tool relative to it, or a joint is not supported.

        >>> arm = kw.load_robot("ur5_turntable")
        >>> arm.dof, arm.with_base("table").joint_names[0]
        (6, 'table')
        """
        spec = self._spec
        urdf = read_urdf(self.urdf, self.name, spec.urdf.axes, link)
        world = None if link == self.world_frame else self.world_frame
        return Robot(replace(spec, urdf=urdf, base_frame=link, world_frame=world))

    @cached_property
    def _in_world_frame(self) -> Robot:
        return self.with_base(self.world_frame) if self.base_moves else self

    def robot_and_columns(self, *, in_world_frame: bool) -> tuple[Robot, list[int]]:
        """The robot with poses in the base or the world frame, and columns of its joints in `q`."""
        robot = self._in_world_frame if in_world_frame else self
        return robot, [self.joint_names.index(name) for name in robot.joint_names]

    def tool_pose(self, q: FloatArray, *, in_world_frame: bool) -> Any:
        """Pose of the TCP in the base or the world frame, `pin.SE3`."""
        robot, joints = self.robot_and_columns(in_world_frame=in_world_frame)
        return robot.forward(q[joints])

    def solve_pose_ik_all(self, pose: Any, **options: Any) -> tuple[Any, ...]:
        """Find every `PoseSolution` of a pose of the TCP; see `knotwork.solve_pose_ik_all`."""
        kinematics = importlib.import_module("knotwork.robot.kinematics")  # which imports `robot`
        return tuple(kinematics.solve_pose_ik_all(self, pose, **options))
