"""`ChainModel`: the Pinocchio model of a robot's joints with its TCP, loads and virtual joints."""

from __future__ import annotations

import threading
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.errors import RobotError, UnknownNameError
from knotwork.errors.old_names import OldAttribute
from knotwork.robot.joint_chain import select_chain
from knotwork.robot.planned_joints import PlannedJoints
from knotwork.robot.robot_spec import RobotSpec

_TCP = "knotwork: tool centre point"
_VIRTUAL = {
    "rad": {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ},
    "m": {"x": pin.JointModelPX, "y": pin.JointModelPY, "z": pin.JointModelPZ},
}


class ChainModel(PlannedJoints):
    """A chain of joints with its Pinocchio model: kinematics (eqs 1, 2) and efforts.

    Args:
        spec: All data of the robot.
    """

    def __init__(self, spec: RobotSpec) -> None:
        chain = select_chain(spec)
        super().__init__(spec, chain.joint_names)
        self.model = model = chain.model
        self.base_frame = chain.base_frame
        self.world_frame = spec.world_frame or chain.base_frame
        self.base_moves = spec.world_frame is not None
        self.locked = MappingProxyType(dict(chain.locked))
        self.followers = MappingProxyType(dict(chain.followers))
        base = model.frames[model.getFrameId(self.base_frame, pin.BODY)]
        self.base_placement = base.placement.copy()
        self._base_from_root = self.base_placement.inverse()
        self.tcp_frame_id = None if spec.tool_frame is None else self._add_tcp(spec)
        to_root = self.base_placement.rotation
        if spec.gravity is not None:
            model.gravity.linear = to_root @ spec.gravity
        self.gravity = checked_array(to_root.T @ model.gravity.linear, (3,), "gravity")
        bodies = (frame for frame in model.frames if frame.type == pin.FrameType.BODY)
        self.link_names = tuple(str(frame.name) for frame in bodies)
        self._memory = threading.local()

    def _add_tcp(self, spec: RobotSpec) -> int:
        """Add loads, virtual joints and the TCP to the model, and return the TCP's frame index."""
        model = self.model
        tool = model.frames[model.getFrameId(spec.tool_frame, pin.BODY)]
        carrier, placement = tool.parentJoint, tool.placement * spec.tool_offset
        loads = [(load, placement) for load in spec.held_payloads]
        if spec.payload is not None:
            loads.append((spec.payload, tool.placement))
        for load, axes in loads:
            body = pin.Inertia(load.mass, load.centre_of_mass, load.inertia)
            model.appendBodyToJoint(carrier, body, axes)
        for joint in spec.virtual_joints:
            axes = pin.SE3.Identity()
            axes.rotation = axes.rotation if joint.axes is None else joint.axes
            kind = _VIRTUAL[joint.unit][joint.axis]()
            carrier = model.addJoint(carrier, kind, placement * axes, joint.name)
            placement = axes.inverse()
        return int(model.addFrame(pin.Frame(_TCP, carrier, placement, pin.OP_FRAME)))

    @property
    def data(self) -> Any:
        """Pinocchio's working memory, one per thread."""
        memory = self._memory
        try:
            return memory.data
        except AttributeError:
            memory.data = self.model.createData()
            return memory.data

    def link_index(self, name: str) -> int:
        """Index in `model` of a link's frame.

        Raises:
            UnknownNameError: There is no such link.
        """
        if name not in self.link_names:
            raise UnknownNameError("link", name, self.link_names, where=f"robot {self.name!r}")
        return int(self.model.getFrameId(name, pin.BODY))

    def require_tool(self) -> int:
        """Return the index of the TCP's frame in `model`.

        Raises:
            RobotError: No tool frame has been chosen.
        """
        if self.tcp_frame_id is None:
            leaves = self._spec.urdf.leaves
            inner = ", ".join(name for name in self.link_names if name not in leaves)
            raise RobotError(
                self.name,
                "needs a tool frame; name the link that carries the tool with `tool: {frame: "
                "NAME}` in the scenario or `tool_frame: NAME` in a robot file "
                f"(links: {inner}; links at the end of a chain: {', '.join(leaves)})",
            )
        return self.tcp_frame_id

    def forward(self, q: ArrayLike) -> Any:
        """Pose of the TCP in the base frame (eq 1), as `pin.SE3`."""
        tcp = self.require_tool()
        pin.forwardKinematics(self.model, self.data, self._checked(q, "q"))
        return self._base_from_root * pin.updateFramePlacement(self.model, self.data, tcp)

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """Jacobian of the TCP (eq 2), shape (6, d): twist = J(q) v.

        Rows are linear [m/s], then angular [rad/s], at the TCP, in base axes
        (`local_world_aligned`).
        """
        return self.forward_and_jacobian(q)[1]

    def forward_and_jacobian(self, q: ArrayLike) -> tuple[Any, FloatArray]:
        """Pose and Jacobian of the TCP (eqs 1 and 2) at once: see `forward` and `jacobian`."""
        tcp = self.require_tool()
        pin.computeJointJacobians(self.model, self.data, self._checked(q, "q"))
        pose = self._base_from_root * pin.updateFramePlacement(self.model, self.data, tcp)
        J = pin.getFrameJacobian(self.model, self.data, tcp, pin.LOCAL_WORLD_ALIGNED)
        J = J.reshape(6, self.dof)  # a single column comes as a vector
        to_base = self._base_from_root.rotation
        return pose, np.vstack([to_base @ J[:3], to_base @ J[3:]])

    def twist(self, q: ArrayLike, v: ArrayLike) -> Any:
        """Velocity of the TCP in base axes (`local_world_aligned`), as `pin.Motion`."""
        tcp = self.require_tool()
        pin.forwardKinematics(self.model, self.data, self._checked(q, "q"), self._checked(v, "v"))
        pin.updateFramePlacement(self.model, self.data, tcp)
        twist = pin.getFrameVelocity(self.model, self.data, tcp, pin.LOCAL_WORLD_ALIGNED)
        to_base = self._base_from_root.rotation
        return pin.Motion(to_base @ twist.linear, to_base @ twist.angular)

    def effort(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """Joint efforts [N m or N] of the motion under gravity, by inverse dynamics, shape (d,).

        Payload, held objects and `gravity` are included, friction and other loads that are not in
        the URDF are not.

        Raises:
            RobotError: Joints move the base frame.

        >>> still = np.zeros(6)
        >>> kw.load_robot("ur5").effort(still, still, still)[1:3].round(1)
        array([-59.2, -15.7])
        """
        if self.base_moves:
            raise RobotError(self.name, f"efforts are not known where {self.base_frame!r} moves")
        motion = self._checked(q, "q"), self._checked(v, "v"), self._checked(a, "a")
        return np.array(pin.rnea(self.model, self.data, *motion))

    torque = OldAttribute("effort")

    def _checked(self, values: ArrayLike, name: str) -> FloatArray:
        """Check values of the joints, and return them as an array.

        Raises:
            ArrayError: A value is not finite, or there is a wrong number of them.
        """
        array = np.asarray(values)
        is_vector = array.shape == (self.dof,) and array.dtype == np.float64
        # Faster than np.isfinite(array).all(): a sum is finite only if no term is NaN or infinite.
        if is_vector and np.isfinite(array.dot(array)):
            return array
        return checked_array(values, (self.dof,), name)
