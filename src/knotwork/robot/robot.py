"""The robot: forward kinematics (eq 1) and Jacobian (eq 2) of a chain, and its limits."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.chain_model import ChainModel
from knotwork.robot.description import Description, VirtualJoint
from knotwork.robot.joint_chain import select_chain
from knotwork.robot.payload import Payload
from knotwork.robot.planned_joints import PlannedJoints
from knotwork.robot.urdf import carrying_joints, read_urdf
from knotwork.waypoints import FloatArray, checked_array


class Robot:
    """A serial chain of joints between a base frame and a tool centre point (TCP).

    A joint position is one number, for unbounded joints as well. All poses are of the TCP in the
    base frame. All arrays over joints have shape (d,) and are read-only. Arguments q are joint
    positions [rad or m], v velocities [rad/s or m/s] and a accelerations [rad/s² or m/s²]. A
    `WaypointDataError` refuses values that are not finite and wrong shapes, and a `RobotError`
    kinematics without a tool frame. Threads may share a robot.

    Attributes:
        name, description: Name and description of the robot.
        source: File of the description.
        urdf: File with its links, masses and shapes.
        urdf_files: URDF files of the robot and of positioners, each with its links.
        package_paths: Additional folders with meshes.

        base_frame: Link whose frame poses are given in.
        base_placement: Base frame in the axes of the URDF's root, as `pin.SE3`.
        base_moves: Whether joints move the base frame. Then efforts are unknown.
        world_frame: Link of the world frame: the base frame, unless joints move it.
        tool_frame: Link that carries the TCP, or `None` if it has not been chosen.
        tool_offset: TCP in the tool frame.
        tool_candidates: Links without children, possible tool frames.
        payload: `Payload` of the tool frame, or `None`.
        held: Objects held by the tool, in the axes of the TCP.
        gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        dof: Number of planned joints, d.
        joint_names: Names of the d joints, base first.
        joint_units: `"rad"` or `"m"` for each joint.
        lower_position_limit, upper_position_limit: Position limits [rad or m], infinite where there
            are none.
        velocity_limit, acceleration_limit, jerk_limit, effort_limit: Other limits [rad/s or m/s, …;
            N m or N], infinite where not given.
        limits: All of these as `JointLimits`.
        weights: Weight of each joint's motion.
        virtual: Whether each joint is a virtual one.
        virtual_joints: The virtual joints, which are the last joints.
        configurations: Named configurations with all joints [rad or m].

        locked: Positions of the joints that do not move [rad or m].
        followers: Locked joints that mimic a moving joint, with that joint.
        external_axes: Names of the joints that the robot's file adds to its URDF.

        frame_names: Names of the links, each of which may be the base or the tool frame.
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

    def __init__(self, description: Description) -> None:
        self._description = description
        self.name, self.description = description.name, description.description
        self.source, self.urdf_files = description.source, description.urdf.files
        self.urdf = self.urdf_files[0].path
        self.package_paths = description.package_paths
        self.tool_frame = description.tool_frame
        self.ignored_pairs, self.srdf = description.ignored_pairs, description.srdf
        self.tool_offset = description.tool_offset.copy()
        self.tool_candidates = description.urdf.leaves
        self.payload, self.held = description.payload, description.held
        self.external_axes = description.urdf.added
        self.joined_links = description.urdf.joined_links
        chain = select_chain(description)
        self.base_frame = chain.base_frame
        self.world_frame = description.world_frame or chain.base_frame
        self.base_moves = description.world_frame is not None
        self.locked = MappingProxyType(dict(chain.locked))
        self.followers = MappingProxyType(dict(chain.followers))
        self._chain = ChainModel(chain.model, chain.base_frame, description)
        self.model, self.base_placement = chain.model, self._chain.base_placement
        self.tcp_frame_id, self.gravity = self._chain.tcp, self._chain.gravity
        self.frame_names = self._chain.links
        self._joints = joints = PlannedJoints(description, chain.joint_names)
        self.joint_names, self.joint_units = joints.names, joints.units
        self.dof, self.weights = len(joints.names), joints.weights
        self.virtual, self.virtual_joints = joints.virtual, description.virtual
        self.configurations, self.limits = joints.configurations, joints.limits
        limits = joints.limits
        self.lower_position_limit, self.upper_position_limit = limits.lower, limits.upper
        self.velocity_limit, self.acceleration_limit = limits.velocity, limits.acceleration
        self.jerk_limit, self.effort_limit = limits.jerk, limits.effort

    @property
    def carrying_joints(self) -> dict[str, frozenset[str]]:
        """The joints that carry each joint of the URDF, including itself."""
        return carrying_joints(self._description.urdf, self.name)

    def __reduce__(self) -> tuple[type[Robot], tuple[Description]]:
        return type(self), (self._description,)  # each copy gets its own working memory

    def __repr__(self) -> str:
        chain = f"{self.dof} joints from {self.base_frame!r} to {self.tool_frame!r}"
        return f"<Robot {self.name!r}: {chain}>"

    @property
    def data(self) -> Any:
        """Pinocchio's working memory, one per thread."""
        return self._chain.data

    def frame_index(self, name: str) -> int:
        """Index in `model` of a link's frame.

        Raises:
            UnknownNameError: There is no such link.
        """
        if name not in self.frame_names:
            raise UnknownNameError("frame", name, self.frame_names, where=f"robot {self.name!r}")
        return int(self.model.getFrameId(name, pin.BODY))

    def require_tool(self) -> int:
        """Return the index of the TCP's frame in `model`.

        Raises:
            RobotError: No tool frame has been chosen.
        """
        if self.tcp_frame_id is None:
            raise self._description.no_tool_error(self.frame_names)
        return self.tcp_frame_id

    def forward(self, q: ArrayLike) -> Any:
        """Pose of the TCP in the base frame (eq 1), as `pin.SE3`."""
        self.require_tool()
        return self._chain.pose(q)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian of the TCP (eq 2), shape (6, d): twist = J(q) v.

        Rows are linear [m/s], then angular [rad/s], at the TCP, in base axes
        (`local_world_aligned`).
        """
        return self.forward_and_jacobian(q)[1]

    def forward_and_jacobian(self, q: ArrayLike) -> tuple[Any, FloatArray]:
        """Pose and Jacobian of the TCP (eqs 1 and 2) at once: see `forward` and `jacobian`."""
        self.require_tool()
        return self._chain.pose_and_jacobian(q)

    def twist(self, q: ArrayLike, v: ArrayLike) -> Any:
        """Velocity of the TCP in base axes (`local_world_aligned`), as `pin.Motion`."""
        self.require_tool()
        return self._chain.twist(q, v)

    def torque(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """Joint efforts [N m or N] of the motion under gravity, by inverse dynamics, shape (d,).

        Payload, held objects and `gravity` are included, friction and other loads that are not in
        the URDF are not.

        Raises:
            RobotError: Joints move the base frame.

        >>> still = np.zeros(6)
        >>> kw.load_robot("ur5").torque(still, still, still)[1:3].round(1)
        array([-59.2, -15.7])
        """
        if self.base_moves:
            raise RobotError(self.name, f"efforts are not known where {self.base_frame!r} moves")
        return self._chain.efforts(q, v, a)

    def with_held(self, *held: Payload) -> Robot:
        """Let the tool hold objects, given in the axes of the TCP; they count in `torque`."""
        self.require_tool()
        return Robot(replace(self._description, held=held))

    def with_virtual_joints(self, *joints: VirtualJoint) -> Robot:
        """Add virtual joints after the TCP, which move its frame.

        They are last in all arrays, and have no mass and only position limits.
        """
        self.require_tool()
        return Robot(replace(self._description, virtual=joints))

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
        return Robot(self._description.with_weights(weights, self.joint_names, self.locked))

    def with_rest(self, name: str) -> Robot:
        """Set the joints that are not planned to a named configuration.

        Joints under `locked` in its file, and joints that mimic others, are unchanged.

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: A joint is outside its limits, or elsewhere in another configuration used.
        """
        changed = self._description.with_rest(name, self.joint_names)
        return self if changed.rest == self._description.rest else Robot(changed)

    def with_gravity(self, gravity: ArrayLike) -> Robot:
        """Mount the robot differently: on a wall, on a ceiling, or without gravity.

        Args:
            gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        Raises:
            WaypointDataError: The value is not three finite numbers.

        >>> kw.load_robot("ur5").with_gravity([0, 0, 9.81]).gravity
        array([0.  , 0.  , 9.81])
        """
        return Robot(replace(self._description, gravity=checked_array(gravity, (3,), "gravity")))

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

        >>> kw.load_robot("planar2").with_limits(velocity={"elbow": 0.5}).velocity_limit
        array([3. , 0.5])
        """
        limits = {"position": position, **magnitudes}
        return Robot(self._description.with_limits(limits, self.joint_names))

    def with_limit_margin(self, margin: float) -> Robot:
        """Use only a fraction of every limit but those of position."""
        return Robot(replace(self._description, limit_margin=margin))

    def with_tool(
        self, frame: str | None = None, offset: Any = None, payload: Payload | None = None
    ) -> Robot:
        """Choose the tool, which determines the planned joints.

        What is not given is unchanged; a new frame begins without offset and payload.

        Args:
            frame: Link that carries the tool.
            offset: TCP in the tool frame, `pin.SE3`.
            payload: Payload of the tool frame, in its axes, in addition to the masses of the URDF.
                It counts in `torque`.

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
        robot = Robot(self._description.with_tool(frame, offset, payload))
        if payload is not None:
            robot.require_tool()
        return robot

    def with_base(self, link: str) -> Robot:
        """Use a moving link, such as a turntable, as the frame of poses.

        Thus a task on a turntable is one of an ordinary serial chain. The chain then consists of
        the inverse joints from that link to the world frame, and of the joints of the arm. All of
        these joints are planned. The link may be one of an external axis.

        Raises:
            UnknownNameError: There is no such link.
            RobotError: No joint moves the tool relative to it, or a joint is not supported.

        >>> arm = kw.load_robot("ur5_turntable")
        >>> arm.dof, arm.with_base("table").joint_names[0]
        (6, 'table')
        """
        description = self._description
        urdf = read_urdf(self.urdf, self.name, description.urdf.axes, link)
        world = None if link == self.world_frame else self.world_frame
        return Robot(replace(description, urdf=urdf, base_frame=link, world_frame=world))

    @cached_property
    def _in_world_frame(self) -> Robot:
        return self.with_base(self.world_frame) if self.base_moves else self

    def in_frame(self, *, in_world_frame: bool) -> tuple[Robot, list[int]]:
        """The robot with poses in the base or the world frame, and the indices of its joints."""
        robot = self._in_world_frame if in_world_frame else self
        return robot, [self.joint_names.index(name) for name in robot.joint_names]

    def tool_pose(self, q: FloatArray, *, in_world_frame: bool) -> Any:
        """Pose of the TCP in the base or the world frame, `pin.SE3`."""
        robot, joints = self.in_frame(in_world_frame=in_world_frame)
        return robot.forward(q[joints])

    def configuration(self, name: str) -> FloatArray:
        """A named configuration [rad or m], shape (d,).

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: The configuration has no position for a joint of the chain.
        """
        return self._joints.configuration(name)

    def solve_pose_ik_all(self, pose: Any, **options: Any) -> tuple[Any, ...]:
        """Find every `Branch` that takes the TCP to a pose; see `knotwork.solve_pose_ik_all`."""
        kinematics = importlib.import_module(f"{__package__}.kinematics")  # which imports `robot`
        return tuple(kinematics.solve_pose_ik_all(self, pose, **options))
