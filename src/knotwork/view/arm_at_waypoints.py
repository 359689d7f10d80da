"""The arm at the waypoints, for its translucent copies and for the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.trajectory import JointTrajectory
from knotwork.view.links import LinkShapes
from knotwork.view.mesh import coarse
from knotwork.waypoints import FloatArray

MOST_STOPS = 200
# Copies of the arm that differ by less than this, relative to the scene's size, hide each other.
DISTANCE = 0.12
MOST_COPIES = 4
# Samples of the arm along the motion.
PASSED = 40
# Detail of the arm where only its outline counts, relative to the scene's size.
DETAIL = 0.03


@dataclass(frozen=True, eq=False)
class Stops:
    """The arm at the waypoints, in the axes of the URDF's root.

    Attributes:
        position: Joint positions at each [rad or m], shape (s, d).
        outlines: Corners of boxes about the links at each [m], shape (s, n, 3).
        passed: The same all along the motion, which must be in view, too, shape (k, n, 3).
    """

    position: FloatArray
    outlines: FloatArray
    passed: FloatArray

    def distinct(self, size: float) -> list[int]:
        """Find those that differ from each other, so that copies of the arm can be distinguished.

        Args:
            size: Extent of the scene [m].
        """
        kept = [0] if len(self.outlines) else []
        apart = np.full(len(self.outlines), np.inf)
        while len(kept) < MOST_COPIES:
            moved = np.linalg.norm(self.outlines - self.outlines[kept[-1]], axis=2).max(axis=1)
            apart = np.minimum(apart, moved)
            if apart.max() <= DISTANCE * size:
                break
            kept.append(int(apart.argmax()))
        return kept


def find_stops(
    robot: Robot,
    shapes: LinkShapes,
    curve: PiecewisePolynomial,
    scenario: Scenario | None,
    trajectory: JointTrajectory,
) -> Stops:
    """Put the arm at the waypoints, or where none are known at both ends of the motion.

    Args:
        robot: The arm.
        shapes: Its meshes.
        curve: Its motion, joints in the robot's order.
        scenario: The task.
        trajectory: The motion, for the times of waypoints that it knows.
    """
    times = scenario.times if scenario is not None else trajectory.waypoint_times
    times = curve.x[[0, -1]] if times is None else times
    times = times[(times >= curve.x[0]) & (times <= curve.x[-1])]
    if not len(times):
        times = curve.x[[0, -1]]
    position = np.asarray(curve(times[:: len(times) // MOST_STOPS + 1]))
    boxes: list[FloatArray | None] = []
    for shape in shapes.shapes:
        corners = None
        if shape is not None:
            low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        boxes.append(corners)
    outlines, passed = (
        np.array([_placed(robot, boxes, q) for q in some])
        for some in (position, curve(np.linspace(curve.x[0], curve.x[-1], PASSED)))
    )
    return Stops(position, outlines, passed)


def arm_triangles(
    robot: Robot, shapes: LinkShapes, positions: FloatArray, size: float
) -> list[FloatArray]:
    """Give the arm's surface, coarsely, at each of some joint positions.

    Args:
        robot: The arm.
        shapes: Its meshes.
        positions: Joint positions [rad or m], shape (s, d).
        size: Extent of the scene [m].

    Returns:
        For each its triangles' corners in the axes of the URDF's root [m], shape (m, 3, 3).
    """
    corners: list[FloatArray | None] = []
    for shape in shapes.shapes:
        rough = coarse(shape, DETAIL * size) if shape is not None else None
        corners.append(rough.vertices[rough.faces].reshape(-1, 3) if rough is not None else None)
    return [_placed(robot, corners, q).reshape(-1, 3, 3) for q in positions]


def _placed(robot: Robot, points: list[FloatArray | None], q: FloatArray) -> FloatArray:
    """Put points that joints carry, `None` where one carries nothing, at joint positions q."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    placed = [
        own @ at.rotation.T + at.translation
        for own, at in zip(points, data.oMi, strict=True)
        if own is not None
    ]
    return np.concatenate(placed)
