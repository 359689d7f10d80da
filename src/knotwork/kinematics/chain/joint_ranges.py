"""Where pose IK searches from, and which turn of a joint is the nearest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

BoolArray = NDArray[np.bool_]

FULL_TURN = 2 * np.pi


def low_discrepancy(dimension: int) -> Iterator[FloatArray]:
    """Points that fill the unit cube evenly, the same ones every time: Roberts's R_d sequence.

    The i-th point is (i α_k mod 1)_k, k = 1…d, with α_k = g^-k and g the root above 1 of
    g^(d+1) = g + 1, which is the golden ratio for d = 1.

    Yields:
        Points, shape (dimension,).
    """
    alpha = _steps(dimension)
    point = np.full(dimension, 0.5)
    while True:
        point = (point + alpha) % 1.0
        yield point


@lru_cache
def _steps(dimension: int) -> FloatArray:
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (dimension + 1))
    return np.asarray(g ** -np.arange(1.0, dimension + 1.0))


def search_box(robot: Robot, near: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Box around a configuration, no wider than the limits, that starts are taken from.

    Args:
        robot: The robot.
        near: Centre [rad or m], shape (d,).
        radius: How far a joint may be from the centre [rad or m].

    Returns:
        Lower and upper corner, shape (d,) each. A revolute joint gets one full turn at most,
        because the other turns repeat it; a slide with limits its range.
    """
    everywhere, radius = radius > np.pi, min(radius, np.pi)
    lower = np.maximum(robot.lower_position_limit, near - radius)
    upper = np.minimum(robot.upper_position_limit, near + radius)
    # A centre outside the limits may leave nothing of the box.
    empty = ~(lower < upper)
    lower[empty] = np.maximum(robot.lower_position_limit, near - np.pi)[empty]
    upper[empty] = np.minimum(robot.upper_position_limit, near + np.pi)[empty]
    empty = ~(lower < upper)
    lower[empty] = robot.lower_position_limit[empty]
    upper[empty] = np.minimum(robot.upper_position_limit, lower + FULL_TURN)[empty]
    if everywhere and "m" in robot.joint_units:
        low, high = robot.lower_position_limit, robot.upper_position_limit
        slides = np.array([unit == "m" for unit in robot.joint_units])
        whole = slides & np.isfinite(low) & np.isfinite(high)
        lower[whole], upper[whole] = low[whole], high[whole]
    return lower, upper


def difference(a: FloatArray, b: FloatArray, revolute: BoolArray) -> FloatArray:
    """A − b, for joints that turn the shortest way round [rad or m]."""
    gap = a - b
    return np.where(revolute, gap - FULL_TURN * np.round(gap / FULL_TURN), gap)


def nearest_turns(
    q: FloatArray, near: FloatArray, lower: FloatArray, upper: FloatArray, revolute: BoolArray
) -> FloatArray:
    """Turn revolute joints by whole turns to where they are nearest a configuration.

    Args:
        q: Joint positions [rad or m], shape (d,).
        near: Configuration to be near to, shape (d,).
        lower: Lower limits, shape (d,).
        upper: Upper limits, shape (d,). A joint that no turn brings inside the limits is left at
            the turn that is least outside.
        revolute: Which joints are revolute, shape (d,).
    """
    # Joint by joint: for so few numbers that is several times faster than arrays.
    result = q.copy()
    joints = zip(q.tolist(), near.tolist(), lower.tolist(), upper.tolist(), revolute, strict=True)
    for i, (angle, goal, low, high, turning) in enumerate(joints):
        turns: float = round((goal - angle) / FULL_TURN)
        inside = low <= angle <= high
        if not turning or (turns == 0 and inside):
            continue
        least, most = (low - angle) / FULL_TURN, (high - angle) / FULL_TURN
        least = math.ceil(least) if math.isfinite(least) else least
        most = math.floor(most) if math.isfinite(most) else most
        if least <= most:
            turns = min(max(turns, least), most)
        else:
            below, above = low - (angle + most * FULL_TURN), angle + least * FULL_TURN - high
            turns = most if below <= above else least
        moved = angle + turns * FULL_TURN
        # Rounding may leave a joint beside the limit that it should have met.
        if low <= moved <= high or not inside:
            result[i] = moved
    return result
