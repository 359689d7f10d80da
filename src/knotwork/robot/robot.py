"""The robot: forward kinematics (eq 1) and Jacobian (eq 2) of a chain, and its limits."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.description import Description, VirtualJoint
from knotwork.robot.joint_chain import select_chain
from knotwork.robot.joint_limits import chain_limits, limit_tables
from knotwork.robot.payload import Payload
from knotwork.robot.urdf import read_urdf
from knotwork.waypoints import FloatArray, read_only

_TCP = "knotwork: tool centre point"
_VIRTUAL = {
    "rad": {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ},
    "m": {"x": pin.JointModelPX, "y": pin.JointModelPY, "z": pin.JointModelPZ},
}
_KINEMATICS = f"{__package__}.kinematics"


class Robot:
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

    def _add_frames(self, gravity: FloatArray | None, virtual: Sequence[VirtualJoint]) -> None:
        """Add the TCP, the payload and the gravity (by default the URDF's) to `model`."""
        model = self.model
        base = model.frames[model.getFrameId(self.base_frame, pin.BODY)].placement
        self._base_from_world = base.inverse()
        self.tcp_frame_id: int | None = None
        if self.tool_frame is not None:
            tool = model.frames[model.getFrameId(self.tool_frame, pin.BODY)]
            placement = tool.placement * self.tool_offset
            carrier = tool.parentJoint
            carried = [(load, placement) for load in self.held]
            carried += [] if self.payload is None else [(self.payload, tool.placement)]
            for load, axes in carried:
                body = pin.Inertia(load.mass, load.centre_of_mass, load.inertia)
                model.appendBodyToJoint(carrier, body, axes)
            for joint in virtual:
                axes = pin.SE3.Identity()
                axes.rotation = axes.rotation if joint.axes is None else joint.axes
                kind = _VIRTUAL[joint.unit][joint.axis]()
                carrier = model.addJoint(carrier, kind, placement * axes, joint.name)
                placement = axes.inverse()
            frame = pin.Frame(_TCP, carrier, placement, pin.OP_FRAME)
            self.tcp_frame_id = model.addFrame(frame)
        if gravity is not None:
            model.gravity.linear = base.rotation @ gravity
        self.gravity = read_only(base.rotation.T @ model.gravity.linear, (3,), "gravity")
        self._memory = threading.local()

    def _set_limits(self) -> None:
        description = self._description
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
        return frozenset(map(frozenset, self._description.urdf.parents.items()))

    @property
    def external_axes(self) -> tuple[str, ...]:
        """Names of the joints that the robot's file adds to its URDF.

        >>> kw.load_robot("ur5_rail").external_axes
        ('rail',)
        """
        return self._description.urdf.added

    @property
    def carrying_joints(self) -> dict[str, frozenset[str]]:
        """For each joint of its URDF, planned or not, the joints that carry it, including itself.

        >>> sorted(kw.load_robot("ur5_rail").carrying_joints["shoulder_pan_joint"])
        ['rail', 'shoulder_pan_joint']
        """
        urdf = self._description.urdf
        tree = read_urdf(urdf.files[0].path, self.name, urdf.axes).model
        return {
            name: frozenset(tree.names[k] for k in tree.supports[joint].tolist()[1:])
            for joint, name in enumerate(tree.names[1:], 1)
        }

    def __reduce__(self) -> tuple[type[Robot], tuple[Description]]:
        return type(self), (self._description,)  # each copy gets its own working memory

    def __repr__(self) -> str:
        return (
            f"<Robot {self.name!r}: {self.dof} joints from {self.base_frame!r} "
            f"to {self.tool_frame!r}>"
        )

    @property
    def data(self) -> Any:
        """Pinocchio's working memory, one per thread."""
        memory = self._memory
        try:
            return memory.data
        except AttributeError:
            memory.data = self.model.createData()
            return memory.data

    @property
    def dof(self) -> int:
        """Number of joints, d."""
        return len(self.joint_names)

    @property
    def base_placement(self) -> Any:
        """Base frame in the axes of the URDF's root, as `pin.SE3`."""
        return self._base_from_world.inverse()

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Names of the links, each of which may be the base or the tool frame."""
        return tuple(
            str(frame.name) for frame in self.model.frames if frame.type == pin.FrameType.BODY
        )

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
            leaves = self.tool_candidates
            links = ", ".join(name for name in self.frame_names if name not in leaves)
            raise RobotError(
                self.name,
                "needs a tool frame; name the link that carries the tool with `tool: {frame: "
                "NAME}` in the scenario or `tool_frame: NAME` in a robot file "
                f"(links: {links}; links at the end of a chain: {', '.join(leaves)})",
            )
        return self.tcp_frame_id

    def forward(self, q: ArrayLike) -> Any:
        """Pose of the TCP in the base frame (eq 1), as `pin.SE3`.

        Args:
            q: Joint positions [rad or m], shape (d,).

        Raises:
            WaypointDataError: `q` is not finite or has a wrong shape.
            RobotError: No tool frame has been chosen.

        >>> kw.load_robot("planar2").forward([0.0, np.pi / 2]).translation.round(6)
        array([0.5, 0.4, 0. ])
        """
        frame = self.require_tool()
        pin.forwardKinematics(self.model, self.data, self._check_array(q, "q"))
        return self._base_from_world * pin.updateFramePlacement(self.model, self.data, frame)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian of the TCP (eq 2), shape (6, d): twist = J(q) v.

        Rows are linear [m/s], then angular [rad/s], at the TCP, in base axes
        (`local_world_aligned`).

        Args:
            q: Joint positions [rad or m], shape (d,).

        Raises:
            WaypointDataError: A value is not finite, or an array has a wrong shape.
            RobotError: No tool frame has been chosen.

        >>> arm = kw.load_robot("planar2")
        >>> arm.jacobian([0.0, 0.0]) @ [1.0, 0.0]
        array([0. , 0.9, 0. , 0. , 0. , 1. ])
        """
        return self.forward_and_jacobian(q)[1]

    def forward_and_jacobian(self, q: ArrayLike) -> tuple[Any, FloatArray]:
        """Pose and Jacobian of the TCP (eqs 1 and 2) at once: see `forward` and `jacobian`."""
        frame = self.require_tool()
        pin.computeJointJacobians(self.model, self.data, self._check_array(q, "q"))
        pose = self._base_from_world * pin.updateFramePlacement(self.model, self.data, frame)
        J = pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        J = J.reshape(6, self.dof)  # a single column comes as a vector
        base = self._base_from_world.rotation
        return pose, np.vstack([base @ J[:3], base @ J[3:]])

    def twist(self, q: ArrayLike, v: ArrayLike) -> Any:
        """Velocity of the TCP in base axes (`local_world_aligned`), as `pin.Motion`.

        Args:
            q: Joint positions [rad or m], shape (d,).
            v: Joint velocities [rad/s or m/s], shape (d,).

        Raises:
            WaypointDataError: A value is not finite, or an array has a wrong shape.
            RobotError: No tool frame has been chosen.

        >>> twist = kw.load_robot("planar2").twist([0.0, 0.0], [1.0, 0.0])
        >>> twist.linear, twist.angular
        (array([0. , 0.9, 0. ]), array([0., 0., 1.]))
        """
        frame = self.require_tool()
        q, v = self._check_array(q, "q"), self._check_array(v, "v")
        pin.forwardKinematics(self.model, self.data, q, v)
        pin.updateFramePlacement(self.model, self.data, frame)
        twist = pin.getFrameVelocity(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        turn = self._base_from_world.rotation
        return pin.Motion(turn @ twist.linear, turn @ twist.angular)

    def torque(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """Joint efforts [N m or N] of the motion under gravity, by inverse dynamics, shape (d,).

        Payload, held objects and `gravity` are included, friction and other loads that are not in
        the URDF are not.

        Args:
            q: Joint positions [rad or m], shape (d,).
            v: Joint velocities [rad/s or m/s], shape (d,).
            a: Joint accelerations [rad/s² or m/s²], shape (d,).

        Raises:
            WaypointDataError: An array is not finite or has a wrong shape.
            RobotError: Joints move the base frame.

        >>> still = np.zeros(6)
        >>> kw.load_robot("ur5").torque(still, still, still)[1:3].round(1)
        array([-59.2, -15.7])
        """
        if self.base_moves:
            raise RobotError(self.name, f"efforts are not known where {self.base_frame!r} moves")
        q, v, a = self._check_array(q, "q"), self._check_array(v, "v"), self._check_array(a, "a")
        return np.array(pin.rnea(self.model, self.data, q, v, a))

    def _check_array(self, values: ArrayLike, name: str) -> FloatArray:
        array = np.asarray(values)
        fine = array.shape == (self.model.nq,) and array.dtype == np.float64
        # Faster than np.isfinite(array).all(): a sum is finite only if no term is nan or infinite.
        if fine and np.isfinite(array.dot(array)):
            return array
        return read_only(values, (self.dof,), name)

    def _replace(self, **changes: Any) -> Robot:
        return Robot(replace(self._description, **changes))

    def with_held(self, *held: Payload) -> Robot:
        """The arm with objects held by its tool, in the axes of the TCP; they count in `torque`."""
        self.require_tool()
        return self._replace(held=held)

    def with_virtual_joints(self, *joints: VirtualJoint) -> Robot:
        """The chain with virtual joints after the TCP, which move its frame.

        They are last in all arrays, and have no mass and only position limits.
        """
        self.require_tool()
        return self._replace(virtual=joints)

    def with_weights(self, weights: Mapping[str, float]) -> Robot:
        """Set weights of the motion of joints.

        They affect the minimum norm of joint velocities of a redundant arm, and the travel by which
        solutions are chosen. A joint with a weight of 0.2 moves more.

        Args:
            weights: Weight of each joint; 1 for others.

        Raises:
            UnknownNameError: There is no such joint.
            RobotError: A joint does not move.

        >>> arm = kw.load_robot("ur5_rail")
        >>> eager, q = arm.with_weights({"rail": 0.2}), arm.configuration("home")
        >>> twist = [0, 0.1, 0, 0, 0, 0]
        >>> [kw.solve_velocity_ik(one, q, twist)[:2].round(3) for one in (arm, eager)]
        [array([0.067, 0.068]), array([0.098, 0.004])]
        """
        for name in weights:
            if name in self.locked:
                raise RobotError(
                    self.name,
                    f"joint {name!r} does not move: it is locked, or no pose is on what it "
                    f"carries; joints that move: {', '.join(self.joint_names)}",
                    joint=name,
                )
            if name not in self.joint_names:
                raise UnknownNameError(
                    "joint", name, self.joint_names, where=f"robot {self.name!r}"
                )
        return self._replace(weights=dict(weights))

    def with_rest(self, name: str) -> Robot:
        """Set the joints that are not planned to a named configuration.

        Joints under `locked` in its file, and joints that mimic others, are unchanged.

        Raises:
            RobotError: Another configuration of the task has a joint at another position, or a
                position is outside the limits.
        """
        description, rest = self._description, dict(self._description.rest)
        for joint, value in description.configurations[name].items():
            if (
                joint in self.joint_names
                or joint in description.locked
                or joint in description.urdf.mimics
            ):
                continue
            if rest.setdefault(joint, value) != value:
                raise RobotError(
                    self.name,
                    f"configuration {name!r} has joint {joint!r} at {value:g}, another one of the "
                    f"task at {rest[joint]:g}, and nothing in the task moves it; accepted: the "
                    "same position in both, or a pose on what it carries",
                    joint=joint,
                )
        return self if rest == description.rest else self._replace(rest=rest)

    def with_gravity(self, gravity: ArrayLike) -> Robot:
        """Mount the robot differently: on a wall, on a ceiling, or without gravity.

        Args:
            gravity: Gravity in the axes of the base frame [m/s²], shape (3,).

        Raises:
            WaypointDataError: The value is not three finite numbers.

        >>> hanging = kw.load_robot("ur5").with_gravity([0, 0, 9.81])
        >>> still = np.zeros(6)
        >>> hanging.torque(still, still, still)[1:3].round(1)
        array([59.2, 15.7])
        """
        return self._replace(gravity=read_only(gravity, (3,), "gravity"))

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
            UnknownNameError: The robot has no such joint or limit.
            RobotError: A magnitude isn't positive, or lower isn't below upper.

        >>> kw.load_robot("planar2").with_limits(velocity={"elbow": 0.5}).velocity_limit
        array([3. , 0.5])
        """
        limits, old = {"position": position, **magnitudes}, self._description.limits
        new = limit_tables(limits, self.joint_names, self._description.urdf, self.name)
        merged = {kind: {**old.get(kind, {}), **table} for kind, table in new.items()}
        return self._replace(limits={**old, **merged})

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
        robot = Robot(replace(self._description, **changes))
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
        description = self._description
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
        known = self._description.configurations
        if name not in known:
            raise UnknownNameError("configuration", name, known, where=f"robot {self.name!r}")
        if name not in self.configurations:
            missing = next(joint for joint in self.joint_names if joint not in known[name])
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
