"""Whether joints keep their limits on the steps of a continuation, from many starts at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from knotwork.kinematics.chain.joint_ranges import limits_of
from knotwork.kinematics.chain.velocity import FASTEST_JOINT
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# A limit is broken beyond this part of it, so that rounding does not decide [rad or m, relative].
AT_LIMIT = 1e-9


def mean_velocities(time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Mean velocities from each step to the next, for q and v of shape (n, ...)."""
    h = np.diff(time).reshape(-1, *np.ones(q.ndim - 1, dtype=int))
    means = np.diff(q, axis=0) / np.where(h > 0.0, h, 1.0)
    return np.asarray(np.where(h > 0.0, means, 0.5 * (v[1:] + v[:-1])))


def fastest(time: FloatArray, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Greatest speeds of cubics from each step to the next, and how far on the way.

    Args:
        time: Of n steps [s], shape (n,).
        q: Joint positions then, shape (n, ...); NaN where they are not known.
        v: Joint velocities then, likewise.

    Returns:
        Shape (n - 1, ...) each; speeds are -1 where nothing is known.
    """
    v, w, means = v[:-1], v[1:], mean_velocities(time, q, v)
    bulge = 6.0 * (means - 0.5 * (v + w))
    with np.errstate(divide="ignore", invalid="ignore"):
        u = 0.5 + 0.5 * (w - v) / bulge
        u = np.where((u > 0.0) & (u < 1.0), u, 0.0)
    speeds, where = np.nan_to_num(np.abs(v), nan=-1.0), np.zeros(u.shape)
    for other, there in ((w, 1.0), (v + (w - v) * u + u * (1.0 - u) * bulge, u)):
        faster = np.abs(other) > speeds
        speeds = np.where(faster, np.abs(other), speeds)
        where = np.where(faster, there, where)
    return speeds, where


def inside_range(robot: Robot, q: FloatArray, turns: FloatArray) -> NDArray[np.bool_]:
    """Whether joints keep their limits all along, whole turns away from each of m starts.

    Args:
        robot: The arm.
        q: Joint positions at n steps from the starts [rad or m], shape (n, m, d).
        turns: How far each joint is turned from there, shape (m, d).
    """
    lower, upper = (bound - turns for bound in limits_of(robot))
    over = np.maximum(q.max(axis=0) - upper, lower - q.min(axis=0))
    return np.asarray((over <= AT_LIMIT).all(axis=1))


def slow_enough(robot: Robot, time: FloatArray, q: FloatArray, v: FloatArray) -> NDArray[np.bool_]:
    """Whether joints keep their velocity limits all along from each of m starts.

    Args:
        robot: The arm.
        time: Of n steps [s], shape (n,).
        q: Joint positions then [rad or m], shape (n, m, d).
        v: Joint velocities then [rad/s or m/s], shape (n, m, d).
    """
    use = fastest(time, q, v)[0].max(axis=0) / np.minimum(robot.velocity_limit, FASTEST_JOINT)
    return np.asarray((use <= 1.0 + AT_LIMIT).all(axis=1))
