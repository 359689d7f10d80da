"""An arm relative to a moving frame: the inverse of the frame's joints, followed by the arm's.

If the frame is at P₁J₁(q₁) P₂J₂(q₂) …, a point x of the base is at … J₂(−q₂) P₂⁻¹ J₁(−q₁) P₁⁻¹ x in
the frame. A joint with the opposite axis is the inverse of a joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot.joint_tree import JointTree, join_trees, serial
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.endless import stack_curves
from knotwork.tool_paths.moving_frame import KnownJoints


def tree_from(carriers: Sequence[KnownJoints], arm: JointTree, root: Any) -> JointTree:
    """The joints of an arm relative to a moving frame at its placement with joints at 0.

    Args:
        carriers: Joints that carry the frame, the outermost first.
        arm: The arm's joints.
        root: Placement of the root of the arm's URDF in the base frame, `pin.SE3`.

    Returns:
        The joints; positions are those of the arm, followed by those of the carriers in order.
    """
    steps: list[tuple[Any, Any, bool, int]] = []
    placement = pin.SE3.Identity()
    for carrier in carriers:
        placement = placement * carrier.placement
    firsts = np.cumsum([0, *(len(carrier.turns) for carrier in carriers)]).tolist()
    for carrier, first in reversed(list(zip(carriers, firsts, strict=False))):
        for k in reversed(range(len(carrier.turns))):
            steps.append((placement, -carrier.axis[k], carrier.turns[k], first + k))
            placement = pin.SE3.Identity()
        placement = placement * carrier.placement.inverse()
    placements, axes, turns, columns = zip(*steps, strict=True)
    tree = join_trees(serial(placements, np.array(axes), turns), arm, placement * root, len(steps))
    count = len(arm.parent) - 1
    arm_columns = [column - len(steps) for column in tree.column[len(steps) + 1 :]]
    columns = -1, *(count + column for column in columns), *arm_columns
    return replace(tree, column=columns)


def append_known(
    curve: PiecewisePolynomial, carriers: Sequence[KnownJoints]
) -> PiecewisePolynomial:
    """Positions of an arm's joints followed by those of carriers, over the time of the first."""
    span = curve.x[[0, -1]].tolist()
    return stack_curves(curve, *(carrier.curve.between(*span) for carrier in carriers))
