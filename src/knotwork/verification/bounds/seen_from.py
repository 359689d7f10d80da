"""An arm relative to a moving frame: the inverse of the frame's joints, followed by the arm's.

If the frame is at P₁J₁(q₁) P₂J₂(q₂) …, a point x of the base is at … J₂(−q₂) P₂⁻¹ J₁(−q₁) P₁⁻¹ x in
the frame. A joint with the opposite axis is the inverse of a joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot.joint_tree import JointTree, join_trees, serial
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.endless import stack_curves
from knotwork.tool_paths.moving_frame import KnownJoints


def seen_from(carriers: Sequence[KnownJoints], arm: JointTree, root: Any) -> JointTree:
    """The joints of an arm relative to a moving frame at its placement with joints at 0.

    Args:
        carriers: Joints that carry the frame, the outermost first.
        arm: The arm's joints.
        root: Placement of the root of the arm's URDF in the base frame, `pin.SE3`.

    Returns:
        The joints; positions are those of the arm, followed by those of the carriers in order.
    """
    steps: list[tuple[Any, Any, bool, int]] = []
    before, column = pin.SE3.Identity(), 0
    for one in carriers:
        before = before * one.placement
    counts = np.cumsum([0, *(len(one.turns) for one in carriers)])
    for one, column in reversed(list(zip(carriers, counts.tolist(), strict=False))):
        for k in reversed(range(len(one.turns))):
            steps.append((before, -one.axis[k], one.turns[k], column + k))
            before = pin.SE3.Identity()
        before = before * one.placement.inverse()
    placements, axes, turns, columns = zip(*steps, strict=True)
    chain = serial(placements, np.array(axes), turns)
    whole = join_trees(chain, arm, before * root, len(steps))
    n = len(arm.parent) - 1
    own = [column - len(steps) for column in whole.column[len(steps) + 1 :]]
    return JointTree(
        whole.parent,
        (-1, *(n + column for column in columns), *own),
        whole.rotation,
        whole.translation,
        whole.axis,
        whole.turns,
        whole.slides,
    )


def with_known(curve: PiecewisePolynomial, carriers: Sequence[KnownJoints]) -> PiecewisePolynomial:
    """Positions of an arm's joints followed by those of carriers, over the time of the first."""
    span = curve.x[[0, -1]].tolist()
    return stack_curves(curve, *(one.curve.between(*span) for one in carriers))
