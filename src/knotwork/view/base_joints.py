"""Joints between the world and the base frame, in scenes whose base frame is moved by joints.

Such a scene is in base axes. Its first joints are the inverses of those that move the base, and
they carry the world.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, invert_chain, joint_tree, place_joints


def drawn_joints(tree: JointTree, names: Iterable[str], first: int = 1) -> list[dict[str, Any]]:
    """Describe the joints of a tree from `first` on, as plain data with one entry per joint.

    `parent` counts joints from 1, and 0 is fixed. `quaternion` (x, y, z, w) and `origin` [m] place
    the joint in the axes of its parent. The joint position q then rotates it about `axis` by q, or
    shifts it along `axis` by q if it `slides`.
    """
    return [
        {
            "name": name,
            "parent": tree.parent[i],
            "origin": tree.translation[i].tolist(),
            "quaternion": pin.Quaternion(tree.rotation[i]).coeffs().tolist(),
            "axis": tree.axis[i].tolist(),
            "slides": not tree.angle_per_unit[i],
        }
        for i, name in enumerate(names, first)
    ]


@dataclass(frozen=True, eq=False)
class BaseJoints:
    """The m joints between the world and the base frame of a robot; none if the base is fixed.

    Attributes:
        robot: The robot.
        joints: Descriptions of these joints, from `drawn_joints`.
        columns: Index of the robot's joint whose position each one has, except the last one, which
            is always at 0.
    """

    robot: Robot
    joints: list[dict[str, Any]]
    columns: Sequence[int]

    @property
    def count(self) -> int:
        """Number of these joints."""
        return len(self.joints)

    def below(self, joints: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
        """These joints, followed by others that they carry."""
        return [
            *self.joints,
            *({**joint, "parent": joint["parent"] + self.count} for joint in joints),
        ]

    def carry(self, parts: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
        """Meshes or labels, whose carriers are renumbered to follow these joints."""
        if not self.joints:
            return [dict(part) for part in parts]
        return [{**part, "carrier": part.get("carrier", 0) + self.count} for part in parts]

    def positions(self, q: FloatArray) -> FloatArray:
        """Positions of these joints, then those of the robot and others, shape (k, m + d)."""
        if not self.joints:
            return q
        return np.hstack((q[:, list(self.columns)], np.zeros((len(q), 1)), q))

    def to_world(self, q: FloatArray, points: FloatArray) -> FloatArray:
        """Transform points from base to world axes.

        Args:
            q: Joint positions [rad or m], shape (k, d).
            points: Points in base axes [m], shape (k, n, 3).
        """
        if not self.joints:
            return points
        frame = self.robot.model.frames[self.robot.link_index(self.robot.world_frame)]
        placed = place_joints(joint_tree(self.robot.model), q)
        rotation, origin = (x[:, frame.parentJoint] for x in placed)
        in_joint = frame.placement
        shift = origin + rotation @ in_joint.translation
        return np.asarray((points - shift[:, None]) @ (rotation @ in_joint.rotation))


def base_joints(robot: Robot) -> BaseJoints:
    """Joints from the world to the base frame of a robot."""
    if not robot.base_moves:
        return BaseJoints(robot, [], [])
    tree = joint_tree(robot.model)
    frame = robot.model.frames[robot.link_index(robot.world_frame)]
    chain, columns = invert_chain(tree, int(frame.parentJoint), frame.placement)
    names = (f"base joint {i}" for i in range(1, len(chain.parent)))
    return BaseJoints(robot, drawn_joints(chain, names), columns)
