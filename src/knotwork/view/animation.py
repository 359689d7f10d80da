"""A trajectory as an animation: times of its frames, and the joints that move."""

from __future__ import annotations

from typing import Any

import pinocchio as pin

from knotwork.errors import InputError
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.robot.joint_tree import joint_tree
from knotwork.sampling import sample_times
from knotwork.waypoints import FloatArray

LEAST_RATE = 60.0
"""Frames a second that an animation has at least."""

RATE = 120.0
MOST_FRAMES = 240_000


def frame_times(curve: PiecewisePolynomial) -> FloatArray:
    """Times of an animation's frames [s], `RATE` a second or, if it is long, `LEAST_RATE`.

    Between two frames the first is shown, and none is made up. The last is the end of the motion.

    Raises:
        InputError: It lasts so long that no page could hold it.
    """
    start, end = float(curve.x[0]), float(curve.x[-1])
    duration = end - start
    rate = RATE if duration * RATE < MOST_FRAMES else LEAST_RATE
    if duration * rate >= MOST_FRAMES:
        raise InputError(
            f"the motion lasts {duration:g} s; an animation of {LEAST_RATE:g} frames a second can "
            f"last {MOST_FRAMES / LEAST_RATE:g} s at most: view a part of it"
        )
    return sample_times(start, end, rate)


def drawn_joints(robot: Robot) -> list[dict[str, Any]]:
    """Describe the joints of a chain: what carries each, where, and how it moves.

    The n-th entry is of the n-th joint; `parent` counts from 1, and 0 is what does not move.
    Joint position q turns it about `axis` by q, or shifts it by q along it, after `quaternion`
    (x, y, z, w) and `origin` [m] have placed it in its parent's axes.
    """
    model, joints = robot.model, joint_tree(robot.model)
    return [
        {
            "name": str(model.names[i]),
            "parent": joints.parent[i],
            "origin": joints.translation[i].tolist(),
            "quaternion": pin.Quaternion(joints.rotation[i]).coeffs().tolist(),
            "axis": joints.axis[i].tolist(),
            "slides": not joints.turns[i],
        }
        for i in range(1, model.njoints)
    ]
