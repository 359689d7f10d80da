"""Bounds on the derivatives of how every link of a tree of joints moves.

One recursion from the base to the tips. With W the bounds of a link's angular velocity, a unit
vector fixed in the link has the bounds `turning(W)`. The axis of a joint is fixed in the parent, so
the joint adds |q'| times those of the parent's unit vectors to the parent's W. The offset between
two joints is fixed in the parent too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from knotwork.errors import InputError
from knotwork.verification.bounds.derivatives import product, turning
from knotwork.waypoints import FloatArray

ORDERS = 5
"""Derivatives 0 … 4 of joint positions are bounded: torque has two orders, its bound two more."""


class Tree(NamedTuple):
    """The joints of a Pinocchio model, as far as the bounds need them.

    Attributes:
        parent: Index of each joint's parent; joint 0 is the base.
        column: Index of each joint's velocity.
        turns: Angle that a joint turns for one unit of its position: 1 or, if prismatic, 0.
        slides: Distance that it slides for one unit: 1 if prismatic, the pitch if helical.
        offset: Distance from the parent's origin to the joint's at position 0 [m].
    """

    parent: tuple[int, ...]
    column: tuple[int, ...]
    turns: tuple[float, ...]
    slides: tuple[float, ...]
    offset: tuple[float, ...]

    @property
    def angles(self) -> NDArray[np.bool_]:
        """Which joint positions are angles, shape (d,)."""
        result = np.zeros(len(self.parent) - 1, dtype=bool)
        result[list(self.column[1:])] = np.array(self.turns[1:]) > 0.0
        return result

    def path(self, joint: int) -> list[int]:
        """Joints that carry one, itself the last."""
        joints = []
        while joint:
            joints.append(joint)
            joint = self.parent[joint]
        return joints[::-1]


def tree(model: Any) -> Tree:
    """Read joints and offsets from a Pinocchio model.

    Raises:
        InputError: A joint has several degrees of freedom.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    turns, slides, offset = [0.0], [0.0], [0.0]
    for i in range(1, model.njoints):
        joint = model.joints[i]
        if joint.nv != 1:
            raise InputError(
                f"joint {model.names[i]!r} has {joint.nv} degrees of freedom; derivatives are "
                "bounded for revolute, continuous, prismatic and helical joints"
            )
        axis = pin.getJointJacobian(model, data, i, pin.LOCAL).reshape(6, -1)[:, joint.idx_v]
        slides.append(float(np.linalg.norm(axis[:3])))
        turns.append(float(np.linalg.norm(axis[3:])))
        offset.append(float(np.linalg.norm(model.jointPlacements[i].translation)))
    return Tree(
        tuple(model.parents),
        (-1, *(model.joints[i].idx_v for i in range(1, model.njoints))),
        tuple(turns),
        tuple(slides),
        tuple(offset),
    )


def carried(model: Any, frame: int) -> tuple[int, float]:
    """The joint that carries a frame, and the distance of the frame from it [m]."""
    placed = model.frames[frame]
    return int(placed.parentJoint), float(np.linalg.norm(placed.placement.translation))


class TreeMotion(NamedTuple):
    """Bounds on the derivatives of the motion of every link, each of shape (orders, n).

    Attributes:
        tree: The joints.
        angular: Angular velocity [rad/s], orders 0 … 3.
        unit: A unit vector fixed in the link, orders 0 … 4.
        offset: From the parent's origin to this one [m], orders 0 … 4.
        origin: Position of the link's origin [m], orders 0 … 4.
    """

    tree: Tree
    angular: tuple[FloatArray, ...]
    unit: tuple[FloatArray, ...]
    offset: tuple[FloatArray, ...]
    origin: tuple[FloatArray, ...]

    def point(self, joint: int, distance: float) -> FloatArray:
        """Bounds of the position of a point of a link, its distance from the origin given [m]."""
        return np.asarray(self.origin[joint] + distance * self.unit[joint])

    def rotation(self, joint: int) -> FloatArray:
        """Bounds of the Frobenius norm of a link's rotation matrix R, orders 1 and 2; (2, n).

        R' = [ω] R and R'' = ([ω'] + [ω]²) R, and [ω] has the norm √2 |ω|.
        """
        spin = self.angular[joint]
        return np.asarray(np.sqrt(2.0) * np.stack((spin[0], spin[1] + spin[0] ** 2)))


def tree_motion(joints: Tree, rates: FloatArray) -> TreeMotion:
    """Bound how every link moves.

    Args:
        joints: The joints.
        rates: Bounds of |q|, |q'|, … |q''''| of each joint, shape (5, d, n).
    """
    n = rates.shape[2]
    still = np.zeros((ORDERS - 1, n))
    fixed = turning(still)
    nowhere = np.zeros((ORDERS, n))
    angular, unit, offset, origin = [still], [fixed], [nowhere], [nowhere]
    for i, parent in enumerate(joints.parent[1:], 1):
        q = rates[:, joints.column[i]]
        axis = unit[parent]
        step = joints.offset[i] * axis
        if joints.slides[i]:
            step = step + joints.slides[i] * product(q, axis)
        if joints.turns[i]:
            angular.append(angular[parent] + joints.turns[i] * product(q[1:], axis))
            unit.append(turning(angular[i]))
        else:
            angular.append(angular[parent])
            unit.append(axis)
        offset.append(step)
        origin.append(origin[parent] + step)
    return TreeMotion(joints, tuple(angular), tuple(unit), tuple(offset), tuple(origin))
