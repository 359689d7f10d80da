"""What a robot alone gives to a collision model: its links, and which of them touch at home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from knotwork.robot import Robot
from knotwork.scene.bodies import Body, LinkBodies, LinkSources, link_bodies, link_sources
from knotwork.scene.distances import DistanceMeter, nearest_of_bodies
from knotwork.scene.placements import JointTree, joint_tree, place_joints
from knotwork.waypoints import FloatArray


class RobotAlone(NamedTuple):
    """What a collision model takes from the robot alone.

    Attributes:
        joints: Its joints.
        links: Its links.
        touching: Pairs of links that touch at home, by their places.
    """

    joints: JointTree
    links: LinkBodies
    touching: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class _Key:
    """What decides how a robot's links lie to one another."""

    sources: LinkSources
    home: tuple[float, ...]
    robot: Robot = field(compare=False)


def robot_alone(robot: Robot) -> RobotAlone:
    """What is the same for all scenarios of a robot; it is kept for the next time."""
    return _made(_Key(link_sources(robot), tuple(home_of(robot).tolist()), robot))


@lru_cache(maxsize=32)
def _made(key: _Key) -> RobotAlone:
    joints, links = joint_tree(key.robot.model), link_bodies(key.sources)
    n = len(links.bodies)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    touching = touching_pairs(joints, links.bodies, pairs, np.array(key.home))
    return RobotAlone(joints, links, tuple(touching))


def home_of(robot: Robot) -> FloatArray:
    """Home, or where there is none as near to zero as limits let it."""
    low, high = robot.lower_position_limit, robot.upper_position_limit
    return robot.configurations.get("home", np.clip(np.zeros(robot.dof), low, high))


def touching_pairs(
    joints: JointTree,
    bodies: Sequence[Body],
    pairs: Sequence[tuple[int, int]],
    q: FloatArray,
) -> list[tuple[int, int]]:
    """Those pairs of bodies that touch at a configuration, of those that move to one another."""
    rotation, origin = (array[0] for array in place_joints(joints, np.array([q])))
    meter = DistanceMeter()
    return [
        (i, j)
        for i, j in pairs
        if bodies[i].joint != bodies[j].joint
        and nearest_of_bodies(meter, bodies[i], bodies[j], rotation, origin).distance <= 0.0
    ]
