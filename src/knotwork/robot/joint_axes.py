"""Forward kinematics and Jacobian of many configurations at once, from the tree of joints."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import RobotError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import cache_per_robot, joint_tree


class JointAxes:
    """The joint axes of a serial arm in the base frame, with its forward kinematics and Jacobian.

    They serve many configurations at once. The index of the configuration is the last one, for
    contiguous memory access.

    Args:
        robot: A robot with a tool frame.

    Attributes:
        axes: Directions of the axes with all joints at zero, shape (d, 3).
        origins: Points on the axes at zero [m], shape (d, 3).
        is_revolute: Whether each joint is revolute, shape (d,).
        reach: Length from the base through all joints to the TCP, prismatic joints at 0 [m].

    Raises:
        RobotError: The robot has no tool frame, or a joint does not move it.
    """

    def __init__(self, robot: Robot) -> None:
        self._joints = joint_tree(robot.model)
        tool = robot.model.frames[robot.require_tool()]
        if len(self._joints.chain_to(int(tool.parentJoint))) < robot.dof:
            raise RobotError(robot.name, "is not a serial chain: a joint does not move the tool")
        self._base = robot.base_placement.inverse()
        # Rows are the weights of the columns of the last joint's frame.
        weights = self._joints.alignment[-1].T @ tool.placement.homogeneous[:3]
        self._tool = weights.T
        self.is_revolute = self._joints.is_angle
        tip, _, points, axes = (values[..., 0] for values in self.forward(np.zeros((1, robot.dof))))
        self.axes, self.origins = axes.T.copy(), points.T.copy()
        links = np.diff(np.vstack([np.zeros(3), self.origins, tip]), axis=0)
        self.reach = float(np.linalg.norm(links, axis=1).sum())

    def distance_beyond_reach(self, position: FloatArray) -> FloatArray:
        """Distance of points beyond the reach of the arm [m]; a positive one excludes solutions.

        It is 0 for an arm with a prismatic joint, whose reach changes.

        Args:
            position: Points in the base frame [m], shape (3,) or (3, n).
        """
        if not self.is_revolute.all():
            return np.zeros(position.shape[1:])
        with np.errstate(over="ignore"):  # an overflow is a miss as well
            away = np.linalg.norm(position, axis=0)
        return np.asarray(away - (1.0 + 1e-9) * self.reach)

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Compute the poses of the tool and the axes of all joints.

        Args:
            q: Joint positions [rad or m], shape (n, d).

        Returns:
            Four arrays in the base frame: TCP positions (3, n) [m]; orientations (3, 3, n), whose
            first index is the column and whose second index is the row of the matrix; points on the
            joint axes (3, d, n) [m]; directions of the axes (3, d, n).
        """
        frames = self._joints.frames(q, self._base)
        last, joints = frames[-1], frames[1:].transpose(1, 2, 0, 3)
        tool = np.matmul(self._tool, last[:3].reshape(3, -1)).reshape(4, 3, -1)
        return tool[3] + last[3], tool[:3], joints[3], joints[2]

    def jacobians(self, q: FloatArray) -> FloatArray:
        """Jacobians of the TCP in base axes, shape (n, 6, d), for `q` of shape (n, d)."""
        return self.compute_poses_and_jacobians(q)[2].transpose(2, 0, 1)

    def compute_poses_and_jacobians(
        self, q: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Compute positions and orientations of the tool, as `forward`, and its Jacobians.

        Jacobians are in base axes (`local_world_aligned`), shape (6, d, n).
        """
        tip, rotation, points, axes = self.forward(q)
        J = np.empty((6, *points.shape[1:]))
        (x, y, z), (u, v, w) = axes, tip[:, None] - points
        for row, (a, b, c, e) in enumerate(((y, w, z, v), (z, u, x, w), (x, v, y, u))):
            np.multiply(a, b, out=J[row])
            J[row] -= c * e
        J[3:] = axes
        if not self.is_revolute.all():
            slides = ~self.is_revolute
            J[:3, slides], J[3:, slides] = axes[:, slides], 0.0
        return tip, rotation, J


@cache_per_robot
def joint_axes(robot: Robot) -> JointAxes:
    """Compute the joint axes of a robot; cached."""
    return JointAxes(robot)


def pose_errors(
    tip: FloatArray, rotation: FloatArray, position: FloatArray, target: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute the errors of poses from their targets.

    Args:
        tip: TCP positions [m], shape (3, n).
        rotation: Orientations, column, row, configuration: shape (3, 3, n).
        position: Target positions [m], shape (3, n).
        target: Target orientations, shape (3, 3, n).

    Returns:
        Twists to the targets in base axes, shape (6, n); distances [m] and angles [rad], shape
        (n,) each. At an angle of π the axis of rotation is undefined, and the angular part of the
        twist may be zero.
    """
    error = np.empty((6, tip.shape[1]))
    np.subtract(position, tip, out=error[:3])
    # With R* = E R, the axis of E times the sine of its angle is half the sum over the columns of
    # R_k × R*_k, and the trace of E the sum of R_k · R*_k.
    (a, b, c), (x, y, z) = rotation.transpose(1, 0, 2), target.transpose(1, 0, 2)
    w = error[3:]
    for row, product in enumerate((b * z - c * y, c * x - a * z, a * y - b * x)):
        np.add(product[0], product[1], out=w[row])
        w[row] += product[2]
    w *= 0.5
    sine = np.sqrt(w[0] ** 2 + w[1] ** 2 + w[2] ** 2)
    trace = (rotation * target).reshape(9, -1).sum(axis=0)
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    w *= angle / np.maximum(sine, 1e-300)
    linear = error[:3]
    return error, np.sqrt(linear[0] ** 2 + linear[1] ** 2 + linear[2] ** 2), angle
