"""The robot in a collision model: its links, and the pairs that touch at home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from knotwork.robot import Robot
from knotwork.robot.joint_tree import JointTree, joint_tree, place_joints
from knotwork.scene.bodies import Body, LinkBodies, LinkSources, link_bodies, link_sources
from knotwork.scene.distances import DistanceMeter, nearest_of_bodies
from knotwork.task.scene_shapes import Collisions
from knotwork.waypoints import FloatArray

TOUCHING_DISTANCE = Collisions.model_construct().resolution
"""Distance of bodies [m] below which they touch, because no check finds them clear."""

Touching = dict[tuple[int, int], float]
"""Pairs of bodies that touch at home, by index, with their penetration depth [m]."""


class RobotGeometry(NamedTuple):
    """The part of a collision model that depends on the robot only.

    Attributes:
        joints: Its joints.
        links: Its links.
        touching: Pairs of links that touch at home.
    """

    joints: JointTree
    links: LinkBodies
    touching: Touching


@dataclass(frozen=True)
class _Key:
    """All inputs of the relative placement of a robot's links."""

    sources: LinkSources
    home: tuple[float, ...]
    robot: Robot = field(compare=False)


def robot_geometry(robot: Robot) -> RobotGeometry:
    """The geometry of a robot, common to all its scenarios; cached."""
    return _build_geometry(_Key(link_sources(robot), tuple(home_of(robot).tolist()), robot))


@lru_cache(maxsize=32)
def _build_geometry(key: _Key) -> RobotGeometry:
    joints, links = joint_tree(key.robot.model), link_bodies(key.sources)
    n = len(links.bodies)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    return RobotGeometry(joints, links, touching_pairs(joints, links.bodies, pairs, key.robot))


def home_of(robot: Robot) -> FloatArray:
    """The home configuration, or the one nearest to zero within the limits."""
    low, high = robot.lower_position_limit, robot.upper_position_limit
    return robot.configurations.get("home", np.clip(np.zeros(robot.dof), low, high))


def touching_pairs(
    joints: JointTree,
    bodies: Sequence[Body],
    pairs: Sequence[tuple[int, int]],
    robot: Robot,
) -> Touching:
    """Pairs of bodies that move relative to each other and touch at home."""
    rotation, origin = (poses[0] for poses in place_joints(joints, home_of(robot)[None]))
    meter = DistanceMeter()
    touching = {}
    for i, j in pairs:
        if bodies[i].joint == bodies[j].joint:
            continue
        distance = nearest_of_bodies(meter, bodies[i], bodies[j], rotation, origin).distance
        if distance < TOUCHING_DISTANCE:
            touching[i, j] = -distance
    return touching
