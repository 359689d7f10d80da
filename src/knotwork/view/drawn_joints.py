"""The joints of a chain as the page turns them."""

from __future__ import annotations

from typing import Any

import pinocchio as pin

from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, joint_tree


def drawn_joints(robot: Robot) -> list[dict[str, Any]]:
    """Describe the joints of a chain: what carries each, where, and how it moves.

    The n-th entry is of the n-th joint; `parent` counts from 1, and 0 is what does not move.
    Joint position q turns it about `axis` by q, or shifts it by q along it, after `quaternion`
    (x, y, z, w) and `origin` [m] have placed it in its parent's axes.
    """
    model, joints = robot.model, joint_tree(robot.model)
    return [drawn_joint(joints, i, str(model.names[i])) for i in range(1, model.njoints)]


def drawn_joint(joints: JointTree, i: int, name: str) -> dict[str, Any]:
    """Describe one joint of a tree."""
    return {
        "name": name,
        "parent": joints.parent[i],
        "origin": joints.translation[i].tolist(),
        "quaternion": pin.Quaternion(joints.rotation[i]).coeffs().tolist(),
        "axis": joints.axis[i].tolist(),
        "slides": not joints.turns[i],
    }
