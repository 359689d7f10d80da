"""`JointTree`: how the joints of a Pinocchio model carry one another, and where they are.

What places links, bounds their motion, writes their dynamics or draws them reads the joints here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from knotwork.errors import InputError
from knotwork.waypoints import FloatArray


@dataclass(frozen=True, eq=False)
class JointTree:
    """The joints of a Pinocchio model, each of one degree of freedom.

    Attributes:
        parent: Index of each joint's parent, joint 0 is what stands still; length n + 1.
        column: Index of each joint's position and velocity, -1 for joint 0.
        rotation, translation: Placement in the parent at position 0, shapes (n + 1, 3, 3) and
            (n + 1, 3) [m].
        axis: In the joint's own axes, of length 1, shape (n + 1, 3).
        turns: Angle for one unit of the position: 1 or, if prismatic, 0.
        slides: Distance along the axis for one unit: 1 if prismatic, the pitch if helical.
    """

    parent: tuple[int, ...]
    column: tuple[int, ...]
    rotation: FloatArray
    translation: FloatArray
    axis: FloatArray
    turns: FloatArray
    slides: FloatArray

    @cached_property
    def carriers(self) -> NDArray[np.bool_]:
        """Whether joint j carries joint i, itself included; shape (n + 1, n + 1)."""
        carriers = np.eye(len(self.parent), dtype=bool)
        for i, parent in enumerate(self.parent[1:], 1):
            carriers[i] |= carriers[parent]
        carriers[:, 0] = False  # nothing moves it
        return carriers

    @cached_property
    def offset(self) -> FloatArray:
        """Distance from the parent's origin to each joint's at position 0 [m], shape (n + 1,)."""
        return np.asarray(np.linalg.norm(self.translation, axis=1))

    @cached_property
    def angles(self) -> NDArray[np.bool_]:
        """Which joint positions are angles, shape (n,), in the order of columns."""
        result = np.zeros(len(self.parent) - 1, dtype=bool)
        result[list(self.column[1:])] = self.turns[1:] > 0.0
        return result

    @cached_property
    def crosses(self) -> tuple[FloatArray, FloatArray]:
        """Matrices of the cross products with the axes, and their squares, (n + 1, 3, 3) each."""
        x, y, z = self.axis.T
        zero = np.zeros_like(x)
        cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1).copy()
        return cross, cross @ cross

    def path(self, joint: int) -> list[int]:
        """Joints that carry one, itself the last."""
        return [int(i) for i in np.flatnonzero(self.carriers[joint])]


def joint_tree(model: Any) -> JointTree:
    """Read the joints of a model.

    Raises:
        InputError: A joint has several degrees of freedom.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    n = model.njoints
    axis, turns, slides = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    for i in range(1, n):
        joint = model.joints[i]
        if joint.nv != 1:
            raise InputError(
                f"joint {model.names[i]!r} has {joint.nv} degrees of freedom; accepted: revolute, "
                "continuous, prismatic and helical joints"
            )
        local = pin.getJointJacobian(model, data, i, pin.LOCAL).reshape(6, -1)
        column = local[:, joint.idx_v]
        turns[i], slides[i] = np.linalg.norm(column[3:]), np.linalg.norm(column[:3])
        axis[i] = column[3:] / turns[i] if turns[i] else column[:3] / slides[i]
        slides[i] *= np.sign(axis[i] @ column[:3] or 1.0)
    return JointTree(
        tuple(int(parent) for parent in model.parents),
        (-1, *(int(model.joints[i].idx_v) for i in range(1, n))),
        np.array([placement.rotation for placement in model.jointPlacements]),
        np.array([placement.translation for placement in model.jointPlacements]),
        axis,
        turns,
        slides,
    )


def place_joints(joints: JointTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations and origins of all joints, in the axes of the URDF's root.

    Args:
        joints: The joints.
        q: Configurations [rad or m], shape (k, d).

    Returns:
        Shapes (k, n + 1, 3, 3) and (k, n + 1, 3) [m].
    """
    k, n = len(q), len(joints.parent)
    rotation, origin = np.empty((k, n, 3, 3)), np.empty((k, n, 3))
    rotation[:, 0], origin[:, 0] = np.eye(3), 0.0
    turned = _turned(joints, q)
    for i in range(1, n):
        up, value = joints.parent[i], q[:, joints.column[i]]
        rotation[:, i] = rotation[:, up] @ joints.rotation[i]
        origin[:, i] = origin[:, up] + rotation[:, up] @ joints.translation[i]
        if joints.slides[i]:
            along = rotation[:, i] @ joints.axis[i]
            origin[:, i] += (joints.slides[i] * value)[:, None] * along
        if joints.turns[i]:
            rotation[:, i] = rotation[:, i] @ turned[i]
    return rotation, origin


def frame_motion(
    joints: JointTree, frame: Any, q: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, rotation and velocity of a frame, in the axes of the URDF's root.

    Args:
        joints: The joints.
        frame: Pinocchio's.
        q: Configurations [rad or m], shape (k, d).
        v: Their velocities [rad/s or m/s], shape (k, d).

    Returns:
        Shapes (k, 3) [m], (k, 3, 3) and (k, 3) [m/s].
    """
    joint = int(frame.parentJoint)
    rotation, origin = place_joints(joints, q)
    position = origin[:, joint] + rotation[:, joint] @ np.array(frame.placement.translation)
    path = joints.path(joint)
    axis = (rotation[:, path] @ joints.axis[path][..., None])[..., 0]
    moved = np.cross(axis, position[:, None] - origin[:, path]) * joints.turns[path][:, None]
    moved += axis * joints.slides[path][:, None]
    velocity = np.einsum("kj,kji->ki", v[:, [joints.column[i] for i in path]], moved)
    return position, rotation[:, joint] @ np.array(frame.placement.rotation), velocity


def _turned(joints: JointTree, q: FloatArray) -> FloatArray:
    """Rotation matrices of all joints about their axes, shape (n + 1, k, 3, 3) (Rodrigues)."""
    angle = joints.turns[:, None] * q.T[list(joints.column)]
    sine, cosine = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    cross, square = (one[:, None] for one in joints.crosses)
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * square)
