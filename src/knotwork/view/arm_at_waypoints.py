"""The arm at the waypoints and along its motion, for translucent copies and for the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.robot.joint_tree import joint_tree, place_joints
from knotwork.view.base_joints import base_joints
from knotwork.view.mesh import box_corners
from knotwork.view.shown_motion import ShownMotion
from knotwork.waypoints import FloatArray

MOST_STOPS = 200
# Copies of the arm closer to each other than this, relative to the scene's size, hide each other.
LEAST_DISTANCE = 0.12
MOST_COPIES = 4
# Number of samples of the arm along the motion.
PASSED_SAMPLES = 40


@dataclass(frozen=True, eq=False)
class Stops:
    """The arm at the waypoints, in world axes.

    Attributes:
        position: Joint positions at each waypoint [rad or m], shape (s, d).
        outlines: Corners of bounding boxes of the links at each waypoint [m], shape (s, n, 3).
        passed: Corners along the motion, which must also be in view, shape (k, n, 3).
    """

    position: FloatArray
    outlines: FloatArray
    passed: FloatArray

    def distinct(self, size: float) -> list[int]:
        """Indices of distinct ones, so that copies of the arm can be distinguished.

        Args:
            size: Extent of the scene [m].
        """
        chosen = [0]
        apart = np.full(len(self.outlines), np.inf)
        while len(chosen) < MOST_COPIES:
            moved = np.linalg.norm(self.outlines - self.outlines[chosen[-1]], axis=2).max(axis=1)
            apart = np.minimum(apart, moved)
            if apart.max() <= LEAST_DISTANCE * size:
                break
            chosen.append(int(apart.argmax()))
        return chosen


def find_stops(shown: ShownMotion) -> Stops:
    """The arm at the waypoints, or without any at both ends of the motion."""
    robot, curve, times = shown.robot, shown.curve, shown.times
    start, end = curve.x[[0, -1]]
    times = times[(times >= start) & (times <= end)]
    times = times[:: len(times) // MOST_STOPS + 1] if len(times) else curve.x[[0, -1]]
    position = np.asarray(curve(times))
    boxes = [mesh if mesh is None else box_corners(mesh.vertices) for mesh in shown.shapes.shapes]
    joints = joint_tree(robot.model)

    def outlines(q: FloatArray) -> FloatArray:
        rotation, origin = place_joints(joints, q)
        placed = [
            box @ rotation[:, i].swapaxes(1, 2) + origin[:, i, np.newaxis]
            for i, box in enumerate(boxes)
            if box is not None
        ]
        return base_joints(robot).to_world(q, np.concatenate(placed, axis=1))

    return Stops(
        position, outlines(position), outlines(curve(np.linspace(start, end, PASSED_SAMPLES)))
    )
