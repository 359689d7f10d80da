"""Configuration flags of a six-joint arm: shoulder, elbow and wrist, found from its joint axes.

An arm has three kinds of singularity if axes 2 and 3 are parallel, and perpendicular to axis 1, and
the last axes intersect in a point (spherical wrist) or axis 4 is parallel to 3 and axes 5 and 6
intersect. Each kind is a flag, with a sign:

* shoulder: the side of axis 1 on which the wrist is. Seen from behind the arm, in the direction in
  which it reaches, the upper arm is to the left or to the right of axis 1. If it is on neither
  side, left is where the arm reaches along axis 2 × axis 1.
* elbow: up or down, for an arm that reaches away from its base; up is along axis 1.
* wrist: no flip where axis 6 is rotated from axis 4 in the positive sense of joint 5, else flip.

Axis 1 has the direction that points along z of the base frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import JointAxes, joint_axes
from knotwork.robot.joint_tree import cache_per_robot
from knotwork.robot.kinematics.chain.joint_ranges import low_discrepancy_points

FLAGS = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("no flip", "flip")}
FLAG_ROUNDING = 1e-6
"""Lengths below this [m] and sines below this are rounding."""


class ArmGeometry(NamedTuple):
    """Geometry of an arm with flags.

    Attributes:
        parallel: Axis 4 is parallel to axis 3; otherwise the wrist is spherical.
        up: Direction of axis 1 that is up, +1 or -1.
        side: Sign of the shoulder that is left for an arm along axis 2 × axis 1, +1 or -1.
        centre: Intersection of the last two or three axes, relative to the TCP in tool axes [m],
            shape (3,).
    """

    parallel: bool
    up: float
    side: float
    centre: FloatArray


@cache_per_robot
def find_axis_geometry(robot: Robot) -> ArmGeometry | None:
    """Find the geometry of an arm with flags; `None` for an arm without flags."""
    if robot.dof != 6:
        return None
    chain = joint_axes(robot)
    a, o = chain.axes, chain.origins
    if (
        not chain.is_revolute.all()
        or abs(a[0] @ a[1]) > FLAG_ROUNDING
        or not _are_parallel(a[1], a[2])
    ):
        return None
    centre = _intersect_lines(o[4], a[4], o[5], a[5])
    if centre is None:
        return None
    on_axis_4 = np.linalg.norm(np.cross(centre - o[3], a[3])) < FLAG_ROUNDING
    if not on_axis_4 and not _are_parallel(a[2], a[3]):
        return None
    across = float((centre - o[0]) @ a[1]) if on_axis_4 else float((o[3] - o[0]) @ a[1])
    up = -1.0 if a[0, 2] < -FLAG_ROUNDING else 1.0
    tip, rotation, *_ = chain.forward(np.zeros((1, 6)))
    in_tool = rotation[:, :, 0] @ (centre - tip[:, 0])
    geometry = ArmGeometry(not on_axis_4, up, -1.0 if across < -FLAG_ROUNDING else 1.0, in_tool)
    # The flags are valid if the Jacobian loses rank exactly where one of the three vanishes: its
    # determinant is a constant times their product.
    q = 2 * np.pi * low_discrepancy_points(6, 24) - np.pi
    product = np.prod(_evaluate_flag_functions(chain, geometry, q), axis=0)
    determinant = np.linalg.det(chain.jacobians(q))
    factor = (determinant @ product) / max(product @ product, 1e-300)
    if np.abs(determinant - factor * product).max() > 1e-9 * np.abs(determinant).max():
        return None
    return geometry


def _are_parallel(a: FloatArray, b: FloatArray) -> bool:
    return bool(np.linalg.norm(np.cross(a, b)) < FLAG_ROUNDING)


def _intersect_lines(
    p: FloatArray, a: FloatArray, q: FloatArray, b: FloatArray
) -> FloatArray | None:
    """Intersect two lines; `None` if they have no common point."""
    normal = np.cross(a, b)
    square = normal @ normal
    if square < FLAG_ROUNDING or abs((q - p) @ normal) > FLAG_ROUNDING:
        return None
    point: FloatArray = p + a * float(np.cross(q - p, b) @ normal / square)
    return point


def _evaluate_flag_functions(chain: JointAxes, geometry: ArmGeometry, q: FloatArray) -> FloatArray:
    """Evaluate the three functions whose signs are the flags at q (n, 6), shape (3, n)."""
    tip, rotation, p, z = chain.forward(q)
    centre = tip + np.einsum("crn,c->rn", rotation, geometry.centre)
    wrist = p[:, 3] if geometry.parallel else centre
    shoulder = geometry.up * geometry.side * _triple_products(z[:, 1], z[:, 0], centre - p[:, 0])
    elbow = _triple_products(p[:, 2] - p[:, 1], wrist - p[:, 2], z[:, 1])
    return np.array([shoulder, elbow, _triple_products(z[:, 3], z[:, 5], z[:, 4])])


def _triple_products(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Triple products (a × b) · c of vectors (3, n), shape (n,)."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return np.asarray(x * c[0] + y * c[1] + z * c[2])


def configuration_flags(robot: Robot, q: FloatArray) -> FloatArray:
    """Configuration flags: the signs that distinguish branches, for `q` of shape (n, d).

    Returns:
        Shoulder, elbow and wrist, shape (n, 3), +1 for the first of `FLAGS`, -1 for the second and
        0 on a singularity. For another arm of six joints it is the sign of the determinant of the
        Jacobian, shape (n, 1). Branches of all other arms have no signs, shape (n, 0).
    """
    geometry, chain = find_axis_geometry(robot), joint_axes(robot)
    if geometry is None:
        if robot.dof != 6:
            return np.empty((len(q), 0))
        determinant = np.linalg.det(chain.jacobians(q))
        return np.where(
            np.abs(determinant) < FLAG_ROUNDING * FLAG_ROUNDING, 0.0, np.sign(determinant)
        )[:, None]
    values = _evaluate_flag_functions(chain, geometry, q)
    signs = np.where(np.abs(values) < FLAG_ROUNDING, 0.0, np.sign(values))
    # The same elbow is up on one side of axis 1 and down on the other.
    signs[1] *= np.where(signs[0] == 0.0, 1.0, signs[0] * geometry.side)
    return signs.T


def are_all_branches(robot: Robot, q: FloatArray) -> bool | None:
    """Whether configurations (n, d) are all solutions of a pose, as far as the flags show.

    Only for arms with flags. There can be one solution for each combination of flags, though not
    at every pose; and each with the elbow up has one with the elbow down.

    Returns:
        `True` or `False`, and `None` if unknown.
    """
    if find_axis_geometry(robot) is None:
        return None
    signs = configuration_flags(robot, q)
    flags = {tuple(row) for row in signs.tolist()}
    if not signs.all() or len(flags) < len(q):
        return None
    if len(q) == 2 ** len(FLAGS):
        return True
    paired = all((shoulder, -elbow, wrist) in flags for shoulder, elbow, wrist in flags)
    return None if paired else False


def describe_flags(robot: Robot, flags: FloatArray) -> str:
    """Write the flags (k,) of one configuration: `shoulder left, elbow up, no flip`."""
    if find_axis_geometry(robot) is None:
        return (
            {1.0: "det J > 0", -1.0: "det J < 0", 0.0: "singular"}[flags[0]] if len(flags) else ""
        )
    parts = []
    for (joint, words), sign in zip(FLAGS.items(), flags, strict=True):
        word = "singular" if sign == 0 else words[0] if sign > 0 else words[1]
        parts.append(word if joint == "wrist" and sign != 0 else f"{joint} {word}")
    return ", ".join(parts)
