"""`JointTree`: the kinematic tree of the joints of a Pinocchio model.

All code that places links, bounds their motion, writes their dynamics or draws them uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
import pinocchio as pin

from knotwork.arrays import BoolArray, FloatArray
from knotwork.errors import InputError


@dataclass(frozen=True, eq=False)
class JointTree:
    """The joints of a Pinocchio model, each of one degree of freedom.

    Attributes:
        parent: Index of each joint's parent; joint 0 is the fixed root; length n + 1.
        column: Index of each joint's position and velocity, -1 for joint 0.
        rotation, translation: Placement in the parent at position 0, shapes (n + 1, 3, 3) and
            (n + 1, 3) [m].
        axis: Unit vector in the joint's axes, shape (n + 1, 3).
        angle_per_unit: Angle per unit of position: 1 or, if prismatic, 0.
        length_per_unit: Distance along the axis per unit of position: 1 if prismatic, the pitch if
            helical.
    """

    parent: tuple[int, ...]
    column: tuple[int, ...]
    rotation: FloatArray
    translation: FloatArray
    axis: FloatArray
    angle_per_unit: FloatArray
    length_per_unit: FloatArray

    @cached_property
    def carriers(self) -> BoolArray:
        """Whether joint j carries joint i, itself included; shape (n + 1, n + 1)."""
        carriers = np.eye(len(self.parent), dtype=bool)
        for i, parent in enumerate(self.parent[1:], 1):
            carriers[i] |= carriers[parent]
        carriers[:, 0] = False  # joint 0 is fixed
        return carriers

    @cached_property
    def offset(self) -> FloatArray:
        """Distance from the parent's origin to each joint's at position 0 [m], shape (n + 1,)."""
        return np.asarray(np.linalg.norm(self.translation, axis=1))

    @cached_property
    def is_angle(self) -> BoolArray:
        """Whether each joint position is an angle, shape (n,), in the order of columns."""
        result = np.zeros(len(self.parent) - 1, dtype=bool)
        result[list(self.column[1:])] = self.angle_per_unit[1:] > 0.0
        return result

    @cached_property
    def alignment(self) -> FloatArray:
        """Rotations of frames with z along the joint's axis, shape (n + 1, 3, 3)."""
        return np.array([np.eye(3), *map(frame_along, self.axis[1:])])

    @cached_property
    def _steps(self) -> FloatArray:
        """Each joint's frame at position 0 in its parent's: rows x, y, z, origin; homogeneous."""
        to_aligned = self.alignment[list(self.parent)].transpose(0, 2, 1)
        steps = np.tile(np.eye(4), (len(self.parent), 1, 1))
        steps[:, :3, :3] = (to_aligned @ self.rotation @ self.alignment).transpose(0, 2, 1)
        steps[:, 3, :3] = (to_aligned @ self.translation[:, :, None])[..., 0]
        return steps

    def frames(self, q: FloatArray, root: Any = None) -> FloatArray:
        """Compute frames on the axes of all joints, with z along them: a product of exponentials.

        The index of the configuration is the last one, for contiguous memory access.

        Args:
            q: Configurations [rad or m], shape (k, d).
            root: Placement of the URDF's root, `pin.SE3`; by default the identity.

        Returns:
            Shape (n + 1, 4, 3, k). The second index selects the x, y or z axis or the origin [m],
            the third one the component.
        """
        root = pin.SE3.Identity() if root is None else root
        q = np.ascontiguousarray(q.T)
        cosine, sine = np.cos(q), np.sin(q)
        sines = np.array((sine, -sine))[:, :, None]
        frames = np.empty((len(self.parent), 4, 3, q.shape[1]))
        frames[0, :3] = root.rotation.T[:, :, None]
        frames[0, 3] = root.translation[:, None]
        flat = frames.reshape(len(frames), 4, -1)
        for i in range(1, len(self.parent)):
            frame, j = frames[i], self.column[i]
            np.matmul(self._steps[i], flat[self.parent[i]], out=flat[i])
            if self.length_per_unit[i]:
                frame[3] += self.length_per_unit[i] * q[j] * frame[2]
            if self.angle_per_unit[i]:  # x and y turn about z
                x_and_y = frame[:2]
                y_and_x = sines[:, j] * frame[1::-1]
                x_and_y *= cosine[j]
                x_and_y += y_and_x
        return frames

    def chain_to(self, joint: int) -> list[int]:
        """Joints from the root to a joint, including it."""
        return [int(i) for i in np.flatnonzero(self.carriers[joint])]


R = TypeVar("R")
T = TypeVar("T")


def cache_per_robot(make: Callable[[R], T]) -> Callable[[R], T]:
    """Cache the results of a function of a robot, or of its model, for its lifetime."""
    results: WeakKeyDictionary[R, T] = WeakKeyDictionary()

    def find(robot: R) -> T:
        if robot not in results:
            results[robot] = make(robot)
        return results[robot]

    return wraps(make)(find)


@cache_per_robot
def joint_tree(model: Any) -> JointTree:
    """Read the joints of a Pinocchio model; cached.

    Raises:
        InputError: A joint has several degrees of freedom.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    n = model.njoints
    axis = np.zeros((n, 3))
    angle_per_unit = np.zeros(n)
    length_per_unit = np.zeros(n)
    for i in range(1, n):
        joint = model.joints[i]
        if joint.nv != 1:
            raise InputError(
                f"joint {model.names[i]!r} has {joint.nv} degrees of freedom; accepted: revolute, "
                "continuous, prismatic and helical joints"
            )
        local = pin.getJointJacobian(model, data, i, pin.LOCAL).reshape(6, -1)
        column = local[:, joint.idx_v]
        linear, angular = column[:3], column[3:]
        angle, length = np.linalg.norm(angular), np.linalg.norm(linear)
        axis[i] = angular / angle if angle else linear / length
        angle_per_unit[i] = angle
        length_per_unit[i] = length * np.sign(axis[i] @ linear or 1.0)
    return JointTree(
        parent=tuple(int(parent) for parent in model.parents),
        column=(-1, *(int(model.joints[i].idx_v) for i in range(1, n))),
        rotation=np.array([placement.rotation for placement in model.jointPlacements]),
        translation=np.array([placement.translation for placement in model.jointPlacements]),
        axis=axis,
        angle_per_unit=angle_per_unit,
        length_per_unit=length_per_unit,
    )


def make_serial_chain(
    placements: Sequence[Any], axis: FloatArray, is_revolute: Sequence[bool]
) -> JointTree:
    """Make a serial chain of joints.

    Args:
        placements: Placement of each joint in the previous one at position 0, `pin.SE3`.
        axis: Unit vectors, shape (n, 3).
        is_revolute: Whether each joint is revolute; otherwise prismatic.
    """
    n = len(placements)
    angle_per_unit = np.array([0.0, *map(float, is_revolute)])
    length_per_unit = 1.0 - angle_per_unit
    length_per_unit[0] = 0.0
    return JointTree(
        parent=(0, *range(n)),
        column=(-1, *range(n)),
        rotation=np.array([np.eye(3), *(placement.rotation for placement in placements)]),
        translation=np.array([np.zeros(3), *(placement.translation for placement in placements)]),
        axis=np.vstack((np.zeros(3), axis)),
        angle_per_unit=angle_per_unit,
        length_per_unit=length_per_unit,
    )


def invert_chain(tree: JointTree, joint: int, placement: Any) -> tuple[JointTree, list[int]]:
    """Make the chain of inverse joints from a link to the root of a tree.

    Args:
        tree: A tree.
        joint: Joint that carries the link.
        placement: Placement of the link in the joint's axes, `pin.SE3`.

    Returns:
        The chain, whose joints have opposite axes, and the column of each joint in the tree. A
        further joint at the end of the chain stays at 0 and has the axes of the root.
    """
    joints = tree.chain_to(joint)[::-1]
    steps = [pin.SE3(tree.rotation[i], tree.translation[i]).inverse() for i in joints]
    axes = np.array([*(-tree.axis[i] for i in joints), [0.0, 0.0, 1.0]])
    is_revolute = [*(bool(tree.angle_per_unit[i]) for i in joints), True]
    return make_serial_chain([placement.inverse(), *steps], axes, is_revolute), [
        tree.column[i] for i in joints
    ]


def join_trees(first: JointTree, second: JointTree, placement: Any, carrier: int = 0) -> JointTree:
    """Join two trees: joints and positions of the second follow those of the first.

    Args:
        first: A tree.
        second: Another tree; its joint 0 is dropped.
        placement: Placement of the second's root in its carrier, `pin.SE3`.
        carrier: Joint of the first tree that carries the second.
    """
    n = len(first.parent) - 1
    at_root = [parent == 0 for parent in second.parent[1:]]
    rotation, translation = np.array(second.rotation[1:]), np.array(second.translation[1:])
    translation[at_root] = translation[at_root] @ placement.rotation.T + placement.translation
    rotation[at_root] = placement.rotation @ rotation[at_root]
    parents = [n + parent if parent else carrier for parent in second.parent[1:]]
    return JointTree(
        parent=(*first.parent, *parents),
        column=(*first.column, *(n + column for column in second.column[1:])),
        rotation=np.concatenate((first.rotation, rotation)),
        translation=np.concatenate((first.translation, translation)),
        axis=np.concatenate((first.axis, second.axis[1:])),
        angle_per_unit=np.concatenate((first.angle_per_unit, second.angle_per_unit[1:])),
        length_per_unit=np.concatenate((first.length_per_unit, second.length_per_unit[1:])),
    )


def place_joints(tree: JointTree, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute rotations and origins of all joints, in the axes of the URDF's root.

    Args:
        tree: The joints.
        q: Configurations [rad or m], shape (k, d).

    Returns:
        Shapes (k, n + 1, 3, 3) and (k, n + 1, 3) [m].
    """
    frames = tree.frames(q)
    columns = tree.alignment @ frames[:, :3].reshape(len(frames), 3, -1)
    rotation = columns.reshape(len(frames), 3, 3, -1).transpose(3, 0, 2, 1)
    return np.ascontiguousarray(rotation), frames[:, 3].transpose(2, 0, 1)


def frame_along(axis: FloatArray) -> FloatArray:
    """Make a rotation matrix whose third column is a unit vector, shape (3, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = helper - helper.dot(axis) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])
