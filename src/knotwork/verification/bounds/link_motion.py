"""Bounds on the derivatives of the motion of every link of a tree of joints.

There is one recursion from the base to the tips. With W the bounds of a link's angular velocity, a
unit vector fixed in the link has the bounds `unit_bounds(W)`. The axis of a joint is fixed in the
parent, so a joint adds |q'| times those of the parent's unit vectors to the parent's W. The offset
between two joints is also fixed in the parent.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from knotwork.robot.joint_tree import JointTree
from knotwork.verification.bounds.derivatives import product, unit_bounds
from knotwork.waypoints import FloatArray

RATE_ORDERS = 5
"""Number of bounds on derivatives of joint positions, of orders 0 … 4: two are for torque, and two
more for its bound.
"""


def carrier_of(model: Any, frame: int) -> tuple[int, float]:
    """The joint that carries a frame, and the distance of the frame from it [m]."""
    placed = model.frames[frame]
    return int(placed.parentJoint), float(np.linalg.norm(placed.placement.translation))


class TreeMotion(NamedTuple):
    """Bounds on the derivatives of the motion of every link, each of shape (orders, n).

    Attributes:
        tree: The joints.
        angular: Angular velocity [rad/s], orders 0 … 3.
        unit: A unit vector fixed in the link, orders 0 … 4.
        offset: Vector from the parent's origin [m], orders 0 … 4.
        origin: Position of the link's origin [m], orders 0 … 4.
    """

    tree: JointTree
    angular: tuple[FloatArray, ...]
    unit: tuple[FloatArray, ...]
    offset: tuple[FloatArray, ...]
    origin: tuple[FloatArray, ...]

    def point(self, joint: int, distance: float) -> FloatArray:
        """Bounds of the position of a point of a link, at a distance from its origin [m]."""
        return np.asarray(self.origin[joint] + distance * self.unit[joint])

    def rotation(self, joint: int) -> FloatArray:
        """Bounds of the Frobenius norm of a link's rotation matrix R, orders 1 and 2; (2, n).

        R' = [ω] R and R'' = ([ω'] + [ω]²) R, and [ω] has the norm √2 |ω|.
        """
        spin = self.angular[joint]
        return np.asarray(np.sqrt(2.0) * np.stack((spin[0], spin[1] + spin[0] ** 2)))


def tree_motion(joints: JointTree, rates: FloatArray) -> TreeMotion:
    """Bound the motion of every link.

    Args:
        joints: The joints.
        rates: Bounds of |q|, |q'|, … |q''''| of each joint, shape (5, d, n).
    """
    n = rates.shape[2]
    still = np.zeros((RATE_ORDERS - 1, n))
    fixed = unit_bounds(still)
    nowhere = np.zeros((RATE_ORDERS, n))
    angular, unit, offset, origin = [still], [fixed], [nowhere], [nowhere]
    for i, parent in enumerate(joints.parent[1:], 1):
        q = rates[:, joints.column[i]]
        axis = unit[parent]
        step = joints.offset[i] * axis
        if joints.slides[i]:
            step = step + abs(joints.slides[i]) * product(q, axis)
        if joints.turns[i]:
            angular.append(angular[parent] + joints.turns[i] * product(q[1:], axis))
            unit.append(unit_bounds(angular[i]))
        else:
            angular.append(angular[parent])
            unit.append(axis)
        offset.append(step)
        origin.append(origin[parent] + step)
    return TreeMotion(joints, tuple(angular), tuple(unit), tuple(offset), tuple(origin))
