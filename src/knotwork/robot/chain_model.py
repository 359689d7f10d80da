"""`ChainModel`: the Pinocchio model of a chain of joints with its TCP, loads and virtual joints."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from knotwork.robot.description import Description
from knotwork.waypoints import FloatArray, checked_array

_TCP = "knotwork: tool centre point"
_VIRTUAL = {
    "rad": {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ},
    "m": {"x": pin.JointModelPX, "y": pin.JointModelPY, "z": pin.JointModelPZ},
}


class ChainModel:
    """Forward kinematics (eq 1), Jacobian (eq 2) and efforts of a chain.

    Poses and twists are in the axes of the base frame. Joint positions q, velocities v and
    accelerations a have shape (d,), and are checked.

    Args:
        model: Pinocchio model of the planned joints, which is changed.
        base_frame: Link of the frame of poses.
        description: Tool, loads, gravity and virtual joints.

    Attributes:
        model: The model, nq = nv = d.
        base_placement: Base frame in the axes of the URDF's root, `pin.SE3`.
        tcp: Index of the frame of the TCP; `None` without a tool frame.
        gravity: Gravity in the axes of the base frame [m/s²], shape (3,).
        links: Names of the links.
    """

    def __init__(self, model: Any, base_frame: str, description: Description) -> None:
        self.model = model
        self.base_placement = model.frames[model.getFrameId(base_frame, pin.BODY)].placement.copy()
        self._base_from_root = self.base_placement.inverse()
        self.tcp = None if description.tool_frame is None else self._add_tcp(description)
        turn = self.base_placement.rotation
        if description.gravity is not None:
            model.gravity.linear = turn @ description.gravity
        self.gravity = checked_array(turn.T @ model.gravity.linear, (3,), "gravity")
        bodies = (frame for frame in model.frames if frame.type == pin.FrameType.BODY)
        self.links = tuple(str(frame.name) for frame in bodies)
        self._memory = threading.local()

    def _add_tcp(self, description: Description) -> int:
        """Add loads, virtual joints and the TCP to the model, and return its frame."""
        model = self.model
        tool = model.frames[model.getFrameId(description.tool_frame, pin.BODY)]
        carrier, placement = tool.parentJoint, tool.placement * description.tool_offset
        loads = [(load, placement) for load in description.held]
        if description.payload is not None:
            loads.append((description.payload, tool.placement))
        for load, axes in loads:
            body = pin.Inertia(load.mass, load.centre_of_mass, load.inertia)
            model.appendBodyToJoint(carrier, body, axes)
        for joint in description.virtual:
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

    def checked(self, values: ArrayLike, name: str) -> FloatArray:
        """Values of the joints as an array.

        Raises:
            WaypointDataError: A value is not finite, or there is a wrong number of them.
        """
        array = np.asarray(values)
        fine = array.shape == (self.model.nq,) and array.dtype == np.float64
        # Faster than np.isfinite(array).all(): a sum is finite only if no term is nan or infinite.
        if fine and np.isfinite(array.dot(array)):
            return array
        return checked_array(values, (self.model.nq,), name)

    def pose(self, q: ArrayLike) -> Any:
        """Pose of the TCP, as `pin.SE3`."""
        pin.forwardKinematics(self.model, self.data, self.checked(q, "q"))
        return self._base_from_root * pin.updateFramePlacement(self.model, self.data, self.tcp)

    def pose_and_jacobian(self, q: ArrayLike) -> tuple[Any, FloatArray]:
        """Pose and Jacobian of the TCP, its rows in base axes."""
        pin.computeJointJacobians(self.model, self.data, self.checked(q, "q"))
        pose = self._base_from_root * pin.updateFramePlacement(self.model, self.data, self.tcp)
        J = pin.getFrameJacobian(self.model, self.data, self.tcp, pin.LOCAL_WORLD_ALIGNED)
        J = J.reshape(6, self.model.nv)  # a single column comes as a vector
        base = self._base_from_root.rotation
        return pose, np.vstack([base @ J[:3], base @ J[3:]])

    def twist(self, q: ArrayLike, v: ArrayLike) -> Any:
        """Velocity of the TCP in base axes, as `pin.Motion`."""
        pin.forwardKinematics(self.model, self.data, self.checked(q, "q"), self.checked(v, "v"))
        pin.updateFramePlacement(self.model, self.data, self.tcp)
        twist = pin.getFrameVelocity(self.model, self.data, self.tcp, pin.LOCAL_WORLD_ALIGNED)
        turn = self._base_from_root.rotation
        return pin.Motion(turn @ twist.linear, turn @ twist.angular)

    def efforts(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
        """Joint efforts by inverse dynamics [N m or N], shape (d,)."""
        motion = self.checked(q, "q"), self.checked(v, "v"), self.checked(a, "a")
        return np.array(pin.rnea(self.model, self.data, *motion))
