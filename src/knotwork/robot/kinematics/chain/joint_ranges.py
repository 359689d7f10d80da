"""Ranges of joints: limits and their middles, whole turns, and evenly spread starts.

A pair of limits is a tuple of two arrays of shape (d,) [rad or m], infinite where there is none.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes

Limits: TypeAlias = tuple[FloatArray, FloatArray]

FULL_TURN = 2 * np.pi
LIMIT_TOLERANCE = 1e-9
"""Rounding tolerance of position limits [rad or m]."""
MAX_TURNS = 1024
"""Maximum number of turns of one configuration. Six joints with two turns each have 64."""


def position_limits(robot: Robot) -> Limits:
    """Position limits of a robot, as a pair."""
    return robot.limits.lower, robot.limits.upper


def arm_limits(robot: Robot) -> Limits:
    """Position limits of a robot, infinite for its virtual joints."""
    lower, upper = position_limits(robot)
    return np.where(robot.is_virtual, -np.inf, lower), np.where(robot.is_virtual, np.inf, upper)


def infinite_limits(robot: Robot) -> Limits:
    """Infinite limits, for a search that ignores the robot's."""
    return np.full(robot.dof, -np.inf), np.full(robot.dof, np.inf)


def turning_limits(robot: Robot) -> Limits:
    """Limits for a search, infinite for joints that can make a full turn.

    `turn_into_limits` then turns such a joint by whole turns into its limits.
    """
    lower, upper = position_limits(robot)
    can_turn = joint_axes(robot).is_revolute & (upper - lower >= FULL_TURN)
    return np.where(can_turn, -np.inf, lower), np.where(can_turn, np.inf, upper)


def range_middles(limits: Limits) -> FloatArray:
    """Middles of the joints' ranges, zero where they are unlimited, shape (d,)."""
    lower, upper = limits
    bounded = np.isfinite(lower) & np.isfinite(upper)
    return np.where(bounded, 0.5 * (np.where(bounded, lower, 0.0) + upper), 0.0)


def unbounded_joints(robot: Robot) -> BoolArray:
    """Whether each joint turns without limit, shape (d,)."""
    lower, upper = position_limits(robot)
    return joint_axes(robot).is_revolute & ~(np.isfinite(lower) & np.isfinite(upper))


def clip_to_limits(q: FloatArray, limits: Limits) -> FloatArray:
    """Clip joint positions to limits."""
    return np.minimum(np.maximum(q, limits[0]), limits[1])


def find_blocked_joints(q: FloatArray, slope: FloatArray, limits: Limits) -> BoolArray:
    """Find the joints at a limit that a step along a slope would violate.

    All arrays have shapes that can be broadcast together.
    """
    lower, upper = limits
    blocked: BoolArray = ((q <= lower) & (slope < 0.0)) | ((q >= upper) & (slope > 0.0))
    return blocked


def whole_turns(difference: FloatArray) -> FloatArray:
    """Angles rounded to whole turns [rad]."""
    return np.asarray(FULL_TURN * np.rint(difference / FULL_TURN))


def joint_difference(a: FloatArray, b: FloatArray, revolute: BoolArray) -> FloatArray:
    """Difference a − b of joint positions; for revolute joints the shortest rotation [rad or m]."""
    difference = a - b
    return np.where(revolute, difference - whole_turns(difference), difference)


def joint_distances(a: FloatArray, b: FloatArray, revolute: BoolArray) -> FloatArray:
    """Largest difference of a joint between configurations, whole turns aside, shape (n,)."""
    return np.asarray(np.abs(joint_difference(a, b, revolute)).max(axis=-1))


def nearest_turns(robot: Robot, q: FloatArray, near: FloatArray) -> FloatArray:
    """Turn joints by whole turns to be nearest a configuration, inside the limits.

    Args:
        robot: The robot.
        q: Joint positions [rad or m], shape (..., d). A joint that no turn brings inside its limits
            gets the turn with the smallest excess.
        near: Preferred configuration, shape (d,).
    """
    lower, upper = position_limits(robot)
    first, last = np.ceil((lower - q) / FULL_TURN), np.floor((upper - q) / FULL_TURN)
    nearest = np.minimum(np.maximum(np.rint((near - q) / FULL_TURN), first), last)
    highest, lowest = q + FULL_TURN * last, q + FULL_TURN * first
    # Rounding may leave a joint just outside its limit.
    inside = np.minimum(np.maximum(q + FULL_TURN * nearest, lower), upper)
    outside = np.where(lower - highest <= lowest - upper, highest, lowest)
    turned = np.where(first <= last, inside, outside)
    return np.where(joint_axes(robot).is_revolute, turned, q)


def turn_into_limits(robot: Robot, q: FloatArray, near: FloatArray) -> FloatArray:
    """Turn joints by whole turns nearest a configuration, and clip them to their limits."""
    return clip_to_limits(nearest_turns(robot, q, near), position_limits(robot))


def all_turns(robot: Robot, q: FloatArray) -> list[FloatArray]:
    """List copies of configurations inside the limits, offset by whole turns.

    Args:
        robot: The robot.
        q: Configurations [rad or m], shape (n, d).

    Returns:
        For each configuration its copies, shape (k, d): at most `MAX_TURNS`, the nearest to the
        middle of the limits. Joints without limits keep their turn.
    """
    limits = lower, upper = position_limits(robot)
    low, high, middle = lower - LIMIT_TOLERANCE, upper + LIMIT_TOLERANCE, range_middles(limits)
    nearest = np.rint((middle - q) / FULL_TURN)
    first = np.maximum(np.ceil((low - q) / FULL_TURN), nearest - MAX_TURNS)
    last = np.minimum(np.floor((high - q) / FULL_TURN), nearest + MAX_TURNS)
    turns = joint_axes(robot).is_revolute & np.isfinite(lower) & np.isfinite(upper)
    first, last = np.where(turns, first, 0.0), np.where(turns, last, (low <= q) * (q <= high) - 1.0)
    copies = list(clip_to_limits(q + FULL_TURN * first, limits)[:, None])
    for i in np.flatnonzero((first != last).any(axis=1)):
        begin, end = first[i], last[i]
        while (counts := end - begin + 1.0).prod() > MAX_TURNS:
            k = int(counts.argmax())
            if 2.0 * (middle[k] - q[i, k]) >= FULL_TURN * (begin[k] + end[k]):
                begin[k] += 1.0
            else:
                end[k] -= 1.0
        added = np.indices(counts.astype(int)).reshape(robot.dof, -1).T + begin
        copies[i] = clip_to_limits(q[i] + FULL_TURN * added, limits)
    return copies


def spread_starts(
    robot: Robot,
    limits: Limits,
    count: int,
    *,
    centre: FloatArray | None = None,
    radius: float = np.inf,
    skip: int = 0,
) -> FloatArray:
    """Configurations evenly spread over a box of joint space, the same ones every time.

    The box is one turn wide for a revolute joint, because other turns repeat it, and as wide as the
    arm is long for a prismatic one. It lies within the limits, as near as possible to a centre.

    Args:
        robot: The robot.
        limits: Joint limits.
        count: Number of configurations.
        centre: Centre of the box [rad or m], shape (d,); by default zero.
        radius: Maximum distance of a joint from the centre [rad or m].
        skip: Number of configurations to skip in the sequence.

    Returns:
        Shape (count, d).
    """
    lower, upper = limits
    chain = joint_axes(robot)
    half = np.minimum(np.where(chain.is_revolute, np.pi, max(chain.reach, np.pi)), radius)
    low = np.maximum((np.zeros(robot.dof) if centre is None else centre) - half, lower)
    low = np.minimum(low, np.maximum(upper - 2.0 * half, lower))
    high = np.minimum(low + 2.0 * half, upper)
    return np.asarray(low + low_discrepancy_points(robot.dof, count, skip) * (high - low))


def low_discrepancy_points(dimension: int, count: int, skip: int = 0) -> FloatArray:
    """Points evenly spread over the unit cube: Roberts's R_d sequence.

    The i-th point is (1/2 + i α_k mod 1)_k, k = 1…d, with α_k = g^-k and g the root above 1 of
    g^(d+1) = g + 1, which is the golden ratio for d = 1.

    Returns:
        Points `skip` + 1 to `skip` + `count` of the sequence, shape (count, dimension).
    """
    index = np.arange(skip + 1, skip + count + 1)[:, None]
    return np.asarray((0.5 + index * _ratios(dimension)) % 1.0)


@lru_cache
def _ratios(dimension: int) -> FloatArray:
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimension + 1))
    return np.asarray(g ** -np.arange(1.0, dimension + 1.0))
