"""Bounds on the derivatives of the motion of every link of a tree of joints.

The bounds of a quantity are an array whose entry k bounds the norm of its k-th time derivative, one
column per time interval. Sums of quantities add their bounds; products follow Leibniz's rule.

There is one recursion from the base to the tips. With W the bounds of a link's angular velocity, a
unit vector fixed in the link has the bounds `unit_bounds(W)`. The axis of a joint is fixed in the
parent, so a joint adds |q'| times those of the parent's unit vectors to the parent's W. The offset
between two joints is also fixed in the parent.
"""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot.joint_tree import JointTree

RATE_ORDERS = 5
"""Number of bounds on derivatives of joint positions, of orders 0 … 4: two are for effort, and two
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


def tree_motion(tree: JointTree, rates: FloatArray) -> TreeMotion:
    """Bound the motion of every link.

    Args:
        tree: The joints.
        rates: Bounds of |q|, |q'|, … |q''''| of each joint, shape (5, d, n).
    """
    n = rates.shape[2]
    still = np.zeros((RATE_ORDERS - 1, n))
    fixed = unit_bounds(still)
    nowhere = np.zeros((RATE_ORDERS, n))
    angular, unit, offset, origin = [still], [fixed], [nowhere], [nowhere]
    for i, parent in enumerate(tree.parent[1:], 1):
        q = rates[:, tree.column[i]]
        axis = unit[parent]
        step = tree.offset[i] * axis
        if tree.length_per_unit[i]:
            step = step + abs(tree.length_per_unit[i]) * product(q, axis)
        if tree.angle_per_unit[i]:
            angular.append(angular[parent] + tree.angle_per_unit[i] * product(q[1:], axis))
            unit.append(unit_bounds(angular[i]))
        else:
            angular.append(angular[parent])
            unit.append(axis)
        offset.append(step)
        origin.append(origin[parent] + step)
    return TreeMotion(tree, tuple(angular), tuple(unit), tuple(offset), tuple(origin))


def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Bound the derivatives of a product: |(ab)^(k)| <= sum of C(k, m) |a^(m)| |b^(k-m)|.

    This holds for every product with |ab| <= |a| |b|: of numbers, of a number and a vector, dot and
    cross product, and a matrix applied to a vector.

    Args:
        a: Bounds of the first factor, shape (orders, n).
        b: Bounds of the second factor, possibly with another number of orders.

    Returns:
        Bounds of the common orders.
    """
    orders = min(len(a), len(b))
    result = np.asarray(a[0] * b[:orders])
    for m in range(1, orders):
        result[m:] += _choose(orders)[m:, m] * (a[m] * b[: orders - m])
    return result


def unit_bounds(angular: FloatArray, constant: float = 1.0) -> FloatArray:
    """Bound the derivatives of a unit vector fixed in a body, from its angular velocity.

    Args:
        angular: Bounds of the body's angular velocity, shape (k, n).
        constant: Factor of the rate: 1 for vectors, 2 for tensors T, whose rate is ωT - Tω.

    Returns:
        Bounds of orders 0 … k, shape (k+1, n).
    """
    orders = len(angular)
    result = np.empty((orders + 1, *angular.shape[1:]))
    result[0] = 1.0
    for k in range(orders):
        factor = constant * _choose(orders)[k, : k + 1, 0]
        np.einsum("m,mn,mn->n", factor, angular[: k + 1], result[k::-1], out=result[k + 1])
    return result


@lru_cache(maxsize=16)
def _choose(orders: int) -> FloatArray:
    """C(k, m), zero for m above k, shape (orders, orders, 1)."""
    return np.array([[[float(comb(k, m))] for m in range(orders)] for k in range(orders)])
