"""Forward kinematics and Jacobian of many configurations at once, from the tree of joints."""

from __future__ import annotations

from weakref import WeakKeyDictionary, ref

import numpy as np
import pinocchio as pin

from knotwork.errors import RobotError
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree, place_joints
from knotwork.waypoints import FloatArray

# Up to this many configurations are placed by Pinocchio.
FEW = 16


class JointAxes:
    """The joint axes of a serial arm where all its joints are at zero: all its kinematics.

    Frame i sits on the axis a_i of joint i with its z axis along it. From joint to joint the
    frames turn as R_i = R_{i-1} C_i Rot_z(q_i), with C_i constant, and their origins move as
    p_i = p_{i-1} + R_{i-1} c_i (a slide adds a_i q_i instead of turning): a product of
    exponentials. Arrays over many configurations have them last, so that each operation runs
    over contiguous memory.

    Args:
        robot: A robot with a tool frame.

    Attributes:
        axes: Directions a_i at zero in the base frame, shape (d, 3).
        origins: Points on the axes at zero in the base frame [m], shape (d, 3).
        revolute: Which joints turn, shape (d,).
        reach: Length of the arm, from the base through all joints to the TCP [m].

    Raises:
        RobotError: The robot has no tool frame, or a joint does not move it.
    """

    def __init__(self, robot: Robot) -> None:
        joints, tool = joint_tree(robot.model), robot.model.frames[robot.require_tool()]
        rotation, origin = (one[0] for one in place_joints(joints, np.zeros((1, robot.dof))))
        path = joints.path(int(tool.parentJoint))
        if len(path) < robot.dof:
            raise RobotError(robot.name, "is no serial chain: a joint does not move the tool")
        base = robot.base_placement.inverse()
        pose = base * pin.SE3(rotation[path[-1]], origin[path[-1]]) * tool.placement
        self.revolute = joints.turns[path] > 0.0
        self.axes = (rotation[path] @ joints.axis[path][..., None])[..., 0] @ base.rotation.T
        self.origins = origin[path] @ base.rotation.T + base.translation
        frames = [np.eye(3), *(_frame_along(axis) for axis in self.axes), pose.rotation]
        points = np.vstack([np.zeros(3), self.origins, pose.translation])
        # Rows of each are what the columns of R_{i-1} are summed up with: C_i and then c_i.
        self._steps = [
            np.column_stack([before.T @ after, before.T @ (p - o)]).T.copy()
            for before, after, o, p in zip(frames, frames[1:], points, points[1:], strict=False)
        ]
        self.reach = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
        self._robot, self._base = ref(robot), base

    def certain_miss(self, position: FloatArray) -> FloatArray:
        """How much farther away points are than the arm is long [m], not above 0 where they aren't.

        Args:
            position: Points in the base frame [m], shape (3,) or (3, n).
        """
        if not self.revolute.all():
            return np.zeros(position.shape[1:])
        with np.errstate(over="ignore"):  # as far as that is a miss, too
            away = np.linalg.norm(position, axis=0)
        return np.asarray(away - (1.0 + 1e-9) * self.reach)

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Place the tool and all joints.

        Args:
            q: Joint positions [rad or m], shape (n, d).

        Returns:
            In the base frame TCP positions (3, n) [m]; orientations (3, 3, n), the first index
            for the column, the second for the row of the matrix; points on the joint axes
            (3, d, n) [m]; and directions of the axes (3, d, n).
        """
        n, d = q.shape
        q = np.ascontiguousarray(q.T)
        cosine, sines = np.cos(q), np.empty((d, 2, 1, n))
        np.sin(q, out=sines[:, 0, 0])
        np.negative(sines[:, 0, 0], out=sines[:, 1, 0])
        # Of each frame its three axes, and then its origin.
        frames, turned, across = (
            np.empty((d + 1, 4, 3, n)),
            np.empty((2, 3, n)),
            np.empty((2, 3, n)),
        )
        R: FloatArray = np.empty((3, 3, n))
        R[:] = np.eye(3)[:, :, None]
        for i, (step, frame) in enumerate(zip(self._steps, frames, strict=True)):
            np.matmul(step, R.reshape(3, 3 * n), out=frame.reshape(4, 3 * n))
            R = frame[:3]
            if i:
                frame[3] += frames[i - 1, 3]
            if i == d:
                break
            if self.revolute[i]:
                np.multiply(R[:2], cosine[i], out=turned)
                np.multiply(R[1::-1], sines[i], out=across)
                np.add(turned, across, out=R[:2])
            else:
                frame[3] += q[i] * R[2]
        joints = frames[:d].transpose(1, 2, 0, 3)
        return frames[d, 3], R, joints[3], joints[2]

    def jacobian(self, tip: FloatArray, points: FloatArray, axes: FloatArray) -> FloatArray:
        """Jacobians of the TCP in base axes (`local_world_aligned`), shape (6, d, n).

        Args:
            tip: TCP positions [m], shape (3, n).
            points: Points on the joint axes [m], shape (3, d, n).
            axes: Directions of the joint axes, shape (3, d, n).
        """
        J = np.empty((6, *points.shape[1:]))
        (x, y, z), (u, v, w) = axes, tip[:, None] - points
        for row, (a, b, c, e) in enumerate(((y, w, z, v), (z, u, x, w), (x, v, y, u))):
            np.multiply(a, b, out=J[row])
            J[row] -= c * e
        J[3:] = axes
        if not self.revolute.all():
            slides = ~self.revolute
            J[:3, slides], J[3:, slides] = axes[:, slides], 0.0
        return J

    def jacobians(self, q: FloatArray) -> FloatArray:
        """Jacobians of the TCP in base axes, shape (n, 6, d), for `q` of shape (n, d)."""
        return self.placed(q)[2].transpose(2, 0, 1)

    def placed(self, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Place the tool: positions and orientations as `forward`, Jacobians as `jacobian`.

        Of few configurations Pinocchio, one by one, is faster than arrays of all.
        """
        robot = self._robot()
        if len(q) > FEW or robot is None:
            tip, turned, points, axes = self.forward(q)
            return tip, turned, self.jacobian(tip, points, axes)
        model, data, frame = robot.model, robot.data, robot.require_tool()
        place, turn = np.empty((len(q), 3)), np.empty((len(q), 3, 3))
        J = np.empty((len(q), 6, q.shape[1]))
        each = J if q.shape[1] > 1 else J[:, :, 0]  # a single column comes as a vector
        tool, axes = data.oMf[frame], pin.LOCAL_WORLD_ALIGNED
        for i, one in enumerate(q):
            each[i] = pin.computeFrameJacobian(model, data, one, frame, axes)
            place[i], turn[i] = tool.translation, tool.rotation
        base = self._base.rotation
        J = (base @ J.reshape(-1, 2, 3, q.shape[1])).reshape(J.shape)
        tip = base @ place.T + self._base.translation[:, None]
        return tip, (base @ turn).transpose(2, 1, 0), np.ascontiguousarray(J.transpose(1, 2, 0))


_CHAINS: WeakKeyDictionary[Robot, JointAxes] = WeakKeyDictionary()


def joint_axes(robot: Robot) -> JointAxes:
    """The axes of a robot, kept for as long as the robot is."""
    if robot not in _CHAINS:
        _CHAINS[robot] = JointAxes(robot)
    return _CHAINS[robot]


def _frame_along(axis: FloatArray) -> FloatArray:
    """A rotation matrix whose third column is a unit vector, shape (3, 3)."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = other - other.dot(axis) * axis
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def pose_errors(
    tip: FloatArray, rotation: FloatArray, position: FloatArray, target: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors of poses against their targets.

    Args:
        tip: TCP positions [m], shape (3, n).
        rotation: Orientations, column, row, configuration: shape (3, 3, n).
        position: Positions wanted [m], shape (3, n).
        target: Orientations wanted, shape (3, 3, n).

    Returns:
        Twists that lead to the targets, in base axes, shape (6, n); distances [m] and angles
        [rad], shape (n,) each. At an angle of π the axis of the turn is not determined, and the
        angular part of the twist may be zero.
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
