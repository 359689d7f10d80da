"""Forward kinematics (eq 1), Jacobian (eq 2) and inverse dynamics of a chain."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.errors import RobotError, UnknownNameError
from knotwork.robot.description import VirtualJoint
from knotwork.robot.payload import Payload
from knotwork.waypoints import FloatArray, read_only

_TCP = "knotwork: tool centre point"
_VIRTUAL = {
    "rad": {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ},
    "m": {"x": pin.JointModelPX, "y": pin.JointModelPY, "z": pin.JointModelPZ},
}


class ChainKinematics:
    """Kinematics and dynamics of a chain of joints; the attributes are those of `Robot`."""

    name: str
    model: Any
    base_frame: str
    joint_names: tuple[str, ...]
    tool_frame: str | None
    tool_offset: Any
    tool_candidates: tuple[str, ...]
    payload: Payload | None
    base_moves: bool
    held: tuple[Payload, ...]

    def _add_frames(self, gravity: FloatArray | None, virtual: Sequence[VirtualJoint]) -> None:
        """Add the TCP, the payload and the gravity (by default the URDF's) to `model`."""
        model = self.model
        base = model.frames[model.getFrameId(self.base_frame, pin.BODY)].placement
        self._world_from_base = None if base.isIdentity(0.0) else base.copy()
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
        return self._in_base(pin.updateFramePlacement(self.model, self.data, frame))

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
        pose = self._in_base(pin.updateFramePlacement(self.model, self.data, frame))
        J = pin.getFrameJacobian(self.model, self.data, frame, pin.LOCAL_WORLD_ALIGNED)
        J = J.reshape(6, self.dof)  # a single column comes as a vector
        if self._world_from_base is not None:
            base_from_world = self._base_from_world.rotation
            J = np.vstack([base_from_world @ J[:3], base_from_world @ J[3:]])
        return pose, J

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
        if self._world_from_base is None:
            return twist
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

    def _in_base(self, placement: Any) -> Any:
        if self._world_from_base is None:
            return placement.copy()
        return self._base_from_world * placement
