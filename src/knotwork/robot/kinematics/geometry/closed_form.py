"""All configurations of a six-joint arm for a pose in closed form, where its geometry has one.

These arms have configuration flags: axes 2 and 3 are parallel to each other and perpendicular to
axis 1, and the wrist is spherical (Pieper, 1968), or axis 4 is parallel to 3 and axes 5 and 6
intersect (a Universal Robots arm). Each joint follows from one equation a cos x + b sin x = c. Its
two solutions belong to one flag: they coincide at the singularity of that flag, and beyond it there
are none.

Positions and directions are in the base frame with all joints at zero, as in `JointAxes`. Arrays
have shape (n, 8, ...): poses and the eight combinations of shoulder, wrist and elbow.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes, pose_errors
from knotwork.robot.joint_tree import cache_per_robot
from knotwork.robot.kinematics.chain.batch import Targets
from knotwork.robot.kinematics.geometry.configuration_flags import find_axis_geometry

CLEAR_MARGIN = 3e-3
"""Margin within which rounding and pose tolerances decide whether an equation has solutions.

There a search is needed. It is a sine, for the shoulder a length [m].
"""
SOLUTION_ERROR = 1e-11
"""Largest pose error of solutions [m, rad]."""
_SIGNS = np.array([(a, b, c) for a in (1.0, -1.0) for b in (1.0, -1.0) for c in (1.0, -1.0)]).T
"""Signs of the shoulder, the wrist and the elbow."""


class ClosedForm(NamedTuple):
    """Solutions of one pose.

    Attributes:
        q: Configurations, shape (b, 6).
        certain: Whether these are all. Otherwise, near a singularity, they are approximate and may
            not be solutions; and there are none if the arm has no closed form.
    """

    q: FloatArray
    certain: bool


def solve_closed_form(robot: Robot, targets: Targets) -> list[ClosedForm]:
    """Find all configurations for each pose in closed form, regardless of position limits.

    Args:
        robot: The arm.
        targets: n poses in the base frame.
    """
    equations = _make_equations(robot)
    if equations is None:
        return [ClosedForm(np.empty((0, robot.dof)), certain=False)] * len(targets)
    with np.errstate(over="ignore", invalid="ignore"):  # results that are not finite are not clear
        q, exists, clear = equations.solve(targets)
    n = len(q)
    finite = np.asarray(np.isfinite(q).all(axis=2))
    chain, flat = joint_axes(robot), np.where(finite[..., None], q, 0.0).reshape(8 * n, 6)
    tip, rotation, *_ = chain.forward(flat)
    wanted = targets.take(np.repeat(np.arange(n), 8))
    _, distance, angle = pose_errors(tip, rotation, wanted.position, wanted.rotation)
    met = (np.maximum(distance, angle) <= SOLUTION_ERROR).reshape(n, 8)
    certain = np.asarray(clear & (met | ~exists).all(axis=1))
    return [
        ClosedForm(solutions[mask if sure else usable], certain=bool(sure))
        for solutions, mask, usable, sure in zip(q, exists, finite, certain, strict=True)
    ]


class _Equations:
    """The closed-form equations of one arm."""

    def __init__(self, robot: Robot, parallel: bool, centre: FloatArray) -> None:
        chain = joint_axes(robot)
        tip, rotation, *_ = chain.forward(np.zeros((1, 6)))
        self.tip, self.turned = tip[:, 0], rotation[:, :, 0].T
        self.axes, self.parallel = chain.axes, parallel
        # The wrist centre, and the end of the lower arm, which the elbow moves.
        self.centre = self.tip + self.turned @ centre
        self.end = chain.origins[3] if parallel else self.centre
        self.origins = chain.origins
        # Axes 2, 3 and 4 share one direction; a joint about its opposite has a negative sense.
        self.senses = np.sign(self.axes @ self.axes[1])
        # The direction that is fixed relative to the last two joints of the wrist.
        self.fixed = self.axes[1] if parallel else self.axes[3]

    def solve(self, targets: Targets) -> tuple[FloatArray, BoolArray, BoolArray]:
        """Find joint positions (n, 8, 6), their existence (n, 8), and its certainty (n,)."""
        shoulder, wrist, elbow = _SIGNS
        a, o = self.axes, self.origins
        # R and p map points at the zero configuration to those at the pose.
        R = targets.rotation.transpose(2, 1, 0) @ self.turned.T
        R = np.repeat(R[:, None], 8, axis=1)
        p = targets.position.T[:, None] - R @ self.tip
        q = np.empty((len(R), 8, 6))
        # Joints 2 and following do not move the wrist centre along axis 2.
        w = R @ self.centre + p - o[0]
        along = (self.centre - o[0]) @ a[1]
        q[..., 0], margin = _solve_angle(w @ a[1], w @ np.cross(a[0], a[1]), along, shoulder)
        margins = [margin]
        first = _rotations_about(a[0], -q[..., 0])
        R, p = first @ R, _rotate(first, p - o[0]) + o[0]
        if self.parallel:
            margins.append(self._wrist(q, R, wrist))
            last = _rotations_about(a[4], q[..., 4]) @ _rotations_about(a[5], q[..., 5])
            # The end of the lower arm after joints 1 to 3, with joints 5 and 6 undone.
            undone = R @ last.swapaxes(2, 3)
            end = _rotate(R, self.centre) + p + _rotate(undone, self.end - self.centre)
            margins.append(self._elbow(q, end, elbow))
            angle = _angles_between(a[1], _perpendicular(a[1]), undone @ _perpendicular(a[1]))
            together = angle - self.senses[1] * q[..., 1] - self.senses[2] * q[..., 2]
            q[..., 3] = self.senses[3] * together
        else:
            margins.append(self._elbow(q, _rotate(R, self.centre) + p, elbow))
            arm = _rotations_about(a[1], q[..., 1]) @ _rotations_about(a[2], q[..., 2])
            R = arm.swapaxes(2, 3) @ R
            margins.append(self._wrist(q, R, wrist))
            fifth = _rotations_about(a[4], q[..., 4])
            q[..., 3] = _angles_between(a[3], fifth @ a[5], R @ a[5])
        exists, clear = np.ones((2, *q.shape[:2]), dtype=bool)
        for margin in reversed(margins):  # an angle that depends on an uncertain one is uncertain
            exists &= margin > 0.0
            clear = (margin < -(CLEAR_MARGIN**2)) | ((margin > CLEAR_MARGIN**2) & clear)
        return q - 2.0 * np.pi * np.rint(q / (2.0 * np.pi)), exists, np.asarray(clear.all(axis=1))

    def _wrist(self, q: FloatArray, R: FloatArray, sign: FloatArray) -> FloatArray:
        """Find joints 5 and 6, from the rotation of the joints after the fixed direction.

        Returns:
            The margin of `_solve_angle`.
        """
        fifth, sixth, fixed = self.axes[4], self.axes[5], self.fixed
        # Relative to the fixed direction, axis 6 is moved by joint 5 alone.
        level = (fixed @ fifth) * (fifth @ sixth)
        across = sixth - (fifth @ sixth) * fifth
        seen = R @ sixth @ fixed
        x, y = fixed @ across, fixed @ np.cross(fifth, sixth)
        q[..., 4], margin = _solve_angle(x, y, seen - level, sign)
        before = _rotations_about(fifth, -q[..., 4]) @ fixed
        q[..., 5] = _angles_between(sixth, R.swapaxes(2, 3) @ fixed, before)
        return margin

    def _elbow(self, q: FloatArray, end: FloatArray, sign: FloatArray) -> FloatArray:
        """Find joints 2 and 3, which bring the end of the lower arm to a point (n, 8, 3).

        Returns:
            The margin of `_solve_angle`.
        """
        axis, o = self.axes[1], self.origins
        upper, lower = o[2] - o[1], self.end - o[2]
        upper = upper - (upper @ axis) * axis
        lower = lower - (lower @ axis) * axis
        reach = end - o[1]
        reach = reach - (reach @ axis)[..., None] * axis
        square = (reach * reach).sum(axis=2) - upper @ upper - lower @ lower
        turned = np.cross(axis, lower)
        product = 2.0 * float(np.sqrt((upper @ upper) * (lower @ lower)))
        x, y = 2.0 * (upper @ lower) / product, 2.0 * (upper @ turned) / product
        elbow, margin = _solve_angle(x, y, square / product, sign)
        bent = upper + np.cos(elbow)[..., None] * lower + np.sin(elbow)[..., None] * turned
        q[..., 1] = _angles_between(axis, bent, reach)
        q[..., 2] = self.senses[2] * elbow
        return margin


@cache_per_robot
def _make_equations(robot: Robot) -> _Equations | None:
    geometry = find_axis_geometry(robot)
    return None if geometry is None else _Equations(robot, geometry.parallel, geometry.centre)


def _solve_angle(x: Any, y: Any, z: Any, sign: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The solution of x cos + y sin = z with the given sign, shape (n, 8).

    It comes with a margin, x² + y² - z²: above zero there are two solutions, below zero none.
    """
    size = np.hypot(x, y)
    cosine = np.clip(z / np.maximum(size, 1e-300), -1.0, 1.0)
    return np.arctan2(y, x) + sign * np.arccos(cosine), size * size - z * z


def _rotations_about(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Rotations about an axis by angles of shape (n, 8), shape (n, 8, 3, 3)."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(angle)[..., None, None], 1.0 - np.cos(angle)[..., None, None]
    return np.asarray(np.eye(3) + sine * K + versine * (K @ K))


def _rotate(R: FloatArray, points: FloatArray) -> FloatArray:
    """Rotate points, shape (3,) or (n, 8, 3)."""
    return np.asarray((R @ points[..., None])[..., 0])


def _perpendicular(axis: FloatArray) -> FloatArray:
    """Make a unit vector perpendicular to another."""
    normal = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    return np.asarray(normal / np.linalg.norm(normal))


def _angles_between(axis: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Angles about an axis from one vector to another, shape (n, 8) from (n, 8, 3) or (3,)."""
    sine = np.cross(start, end) @ axis
    cosine = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(sine, cosine))
