"""`Robot`: a chain of joints that can be given another tool, base, load and other limits."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.robot.chain_model import ChainModel
from knotwork.robot.description import Description, VirtualJoint
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import carrying_joints, read_urdf


class Robot(ChainModel):
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

        base_frame: Link in whose frame poses are given.
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
        limits: Limits of the joints, `JointLimits`; its arrays also have these names:
        lower_position_limit, upper_position_limit: `limits.lower` and `limits.upper`.
        velocity_limit, acceleration_limit, jerk_limit, effort_limit: `limits.velocity`, and so on.
        weights: Weight of each joint's motion.
        virtual: Whether each joint is a virtual one.
        virtual_joints: The virtual joints, which are the last joints.
        configurations: Named configurations with all joints [rad or m].

        locked: Positions of the joints that do not move [rad or m].
        followers: The moving joint that a locked joint mimics, by the name of the latter.
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
        super().__init__(description)
        self.description = description.description
        self.source = description.source
        self.urdf_files = description.urdf.files
        self.urdf = self.urdf_files[0].path
        self.package_paths = description.package_paths
        self.ignored_pairs = description.ignored_pairs
        self.srdf = description.srdf
        self.tool_frame = description.tool_frame
        self.tool_offset = description.tool_offset.copy()
        self.tool_candidates = description.urdf.leaves
        self.payload = description.payload
        self.held = description.held
        self.external_axes = description.urdf.added
        self.joined_links = description.urdf.joined_links

    @property
    def is_redundant(self) -> bool:
        """Whether there are more joints than the six coordinates of a pose."""
        return self.dof > 6

    @property
    def carrying_joints(self) -> dict[str, frozenset[str]]:
        """The joints that carry each joint of the URDF, including itself."""
        return carrying_joints(self._description.urdf, self.name)

    def __reduce__(self) -> tuple[type[Robot], tuple[Description]]:
        return type(self), (self._description,)  # each copy gets its own working memory

    def __repr__(self) -> str:
        chain = f"{self.dof} joints from {self.base_frame!r} to {self.tool_frame!r}"
        return f"<Robot {self.name!r}: {chain}>"

    def with_held(self, *held: Payload) -> Robot:
        """Let the tool hold objects, given in the axes of the TCP; they count in `effort`."""
        self.require_tool()
        return Robot(replace(self._description, held=held))

    def with_virtual_joints(self, *joints: VirtualJoint) -> Robot:
        """Add virtual joints after the TCP, which move its frame.

        They are last in all arrays, and have no mass and only position limits.
        """
        self.require_tool()
        return Robot(replace(self._description, virtual_joints=joints))

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

    def with_unplanned_at(self, name: str) -> Robot:
        """Set the joints that are not planned to a named configuration.

        Joints under `locked` in its file, and joints that mimic others, are unchanged.

        Raises:
            UnknownNameError: No configuration has this name.
            RobotError: A joint is outside its limits, or an earlier configuration has it elsewhere.
        """
        changed = self._description.with_unplanned_at(name, self.joint_names)
        return self if changed.unplanned == self._description.unplanned else Robot(changed)

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

        >>> kw.load_robot("planar2").with_limits(velocity={"elbow": 0.5}).limits.velocity
        array([3. , 0.5])
        """
        limits = {"position": position, **magnitudes}
        return Robot(self._description.with_limits(limits, self.joint_names))

    def with_limits_scaled(self, fraction: float) -> Robot:
        """Use only a fraction of every limit, except those of position."""
        return Robot(replace(self._description, used_fraction=fraction))

    def with_tool(
        self, frame: str | None = None, offset: Any = None, payload: Payload | None = None
    ) -> Robot:
        """Choose the tool, which determines the planned joints.

        What is not given is unchanged; a new frame begins without offset and payload.

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
        robot = Robot(self._description.with_tool(frame, offset, payload))
        if payload is not None:
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

    def solve_pose_ik_all(self, pose: Any, **options: Any) -> tuple[Any, ...]:
        """Find every `Branch` that takes the TCP to a pose; see `knotwork.solve_pose_ik_all`."""
        kinematics = importlib.import_module(f"{__package__}.kinematics")  # which imports `robot`
        return tuple(kinematics.solve_pose_ik_all(self, pose, **options))
