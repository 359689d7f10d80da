"""The way out of a collision: where the tool would have to be for the arm to be clear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from knotwork.robot import Robot
from knotwork.scene.model import CollisionModel
from knotwork.scene.solid_pairs import SolidPairs
from knotwork.waypoints import FloatArray

DIRECTIONS = 8
"""Directions square to the motion that are tried."""

NEAREST, FARTHEST = 4e-3, 2.0
"""Ways out are looked for between these distances [m], each time twice as far."""

PRECISION = 2e-3
"""The way out is found to this [m]."""

BEND = 0.04
"""A waypoint is proposed this much farther [m], because the motion to it and on from it bends."""

STEPS = 15
"""Steps that the joints are taken towards a pose in at most."""

CLOSE = 1e-5
"""A pose is reached where no more is left than this [m and rad]."""

LARGEST_STEP = 0.4
"""No joint goes farther in one step [rad or m]."""

DAMPING = 1e-6
"""Of the steps next to singularities [m^2]."""


@dataclass(frozen=True, eq=False)
class WayOut:
    """A shift of the tool that takes the arm out of its collisions.

    Attributes:
        tool: Where the TCP is then, in the base frame [m], shape (3,).
        direction: Unit vector towards there, shape (3,).
        distance: How far at least [m].
        beyond: How much farther it is clear still [m]: `BEND`, or 0 where it is not.
    """

    tool: FloatArray
    direction: FloatArray
    distance: float
    beyond: float


def way_out(
    model: CollisionModel, robot: Robot, q: FloatArray, time: float, along: FloatArray
) -> WayOut | None:
    """Find the shortest shift of the tool, square to a motion, after which nothing collides.

    The tool keeps its orientation, if the arm has joints enough, and the arm its branch. All pairs
    are looked at, not only one that collides.

    Args:
        model: Bodies and pairs.
        robot: The robot, with its tool.
        q: Joint positions of the collision [rad or m], shape (d,).
        time: Of the collision [s].
        along: Direction in which the tool moves, shape (3,); zero if it stands still.
    """
    search = _Search(model, robot, q, time)
    best: WayOut | None = None
    for direction in _directions(along):
        most = best.distance if best is not None else FARTHEST
        best = search.towards(direction, most) or best
    return best


class _Search:
    """Shifts of the tool from one configuration."""

    def __init__(self, model: CollisionModel, robot: Robot, q: FloatArray, time: float) -> None:
        self.pairs, self.robot, self.q, self.time = SolidPairs(model), robot, q, time
        self.start = robot.forward(q)

    def towards(self, direction: FloatArray, most: float) -> WayOut | None:
        """The shortest shift in a direction, if it is shorter than a distance [m]."""
        near, far, q = 0.0, NEAREST, self.q
        while True:
            if far >= most:
                return None
            reached = self._moved(q, far * direction)
            if reached is None:
                return None
            q = reached
            if self._clear(q):
                break
            near, far = far, 2 * far
        while far - near > PRECISION:
            middle = (near + far) / 2
            reached = self._moved(q, middle * direction)
            if reached is not None and self._clear(reached):
                far, q = middle, reached
            else:
                near = middle
        there = self._moved(q, (far + BEND) * direction)
        beyond = BEND if there is not None and self._clear(there) else 0.0
        return WayOut(self.start.translation + far * direction, direction, far, beyond)

    def _clear(self, q: FloatArray) -> bool:
        return float(self.pairs.clearance(q[None], self.time)[0]) >= 0.0

    def _moved(self, q: FloatArray, shift: FloatArray) -> FloatArray | None:
        """The configuration with the tool shifted, `None` if there is none near."""
        goal, rows = self.start.translation + shift, 6 if self.robot.dof >= 6 else 3
        for _ in range(STEPS):
            pose, jacobian = self.robot.forward_and_jacobian(q)
            turn = np.array(pin.log3(self.start.rotation @ pose.rotation.T))
            left = np.concatenate([goal - pose.translation, turn])[:rows]
            if np.abs(left).max() < CLOSE:
                low, high = self.robot.lower_position_limit, self.robot.upper_position_limit
                return q if ((q >= low) & (q <= high)).all() else None
            J: Any = jacobian[:rows]
            step = J.T @ np.linalg.solve(J @ J.T + DAMPING * np.eye(rows), left)
            q = q + step * min(1.0, LARGEST_STEP / max(np.abs(step).max(), 1e-300))
        return None


def _directions(along: FloatArray) -> list[FloatArray]:
    """Directions square to another, upwards the first; if there is none, along the axes."""
    up = np.array([0.0, 0.0, 1.0])
    size = float(np.linalg.norm(along))
    if size < 1e-9:
        return [up, *(sign * axis for axis in np.eye(3)[:2] for sign in (1.0, -1.0)), -up]
    ahead = along / size
    first = up - (up @ ahead) * ahead
    if np.linalg.norm(first) < 1e-3:
        first = np.cross(ahead, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    other = np.cross(ahead, first)
    turns = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return [np.cos(turn) * first + np.sin(turn) * other for turn in turns]
