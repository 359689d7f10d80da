"""Proved errors of a motion along a path relative to its tolerances, between its waypoints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import PathError
from knotwork.robot import Robot
from knotwork.verification.bounds.path_criteria import PathLimits
from knotwork.verification.bounds.stretch_bounds import path_bounds, path_rounding
from knotwork.waypoints import FloatArray

# Fraction by which the tolerances of the proof are narrower. The check rounds differently, and must
# reach the same verdict.
TOLERANCE_NARROWING = 1e-6
# Minimum ratio of a tolerance to the rounding error of the bounds.
ROUNDING_FACTOR = 4.0


class PathTolerance(NamedTuple):
    """Tolerances of a motion along its path.

    Attributes:
        position: Distance from the path [m].
        orientation: Angle from the orientation of the path [rad].
        speed: Relative error of the path speed.
    """

    position: float
    orientation: float
    speed: float


def check_tolerance(
    robot: Robot, curve: PiecewisePolynomial, path: TimedPath, tolerance: PathTolerance
) -> None:
    """Refuse tolerances that are too fine to be proved.

    Raises:
        PathError: A tolerance is too fine.
    """
    least = ROUNDING_FACTOR * path_rounding(robot, curve, path)
    slowest = float(path.timing.speeds.min())
    for quantity, value, needed, unit in (
        ("of the distance from the path", tolerance.position, least, " m"),
        ("of the orientation", tolerance.orientation, least, " rad"),
        (f"of the speed, a part of {slowest:g} m/s,", tolerance.speed, least / slowest, ""),
    ):
        if value < needed:
            raise PathError(
                f"the tolerance {quantity} is {value:g}{unit}: rounding leaves no margin to prove "
                f"it; at least {needed:.2g}{unit} is accepted"
            )


def proved_tolerance_use(
    robot: Robot,
    curve: PiecewisePolynomial,
    path: TimedPath,
    tolerance: PathTolerance,
    times: FloatArray,
) -> FloatArray:
    """Upper bound on the error between waypoints, relative to the tolerances.

    The same proof as in the check: see `verification.bounds.stretch_bounds`.

    Args:
        robot: The arm.
        curve: Joint positions along the whole path, trailing shape (d,).
        path: Poses of the tool over time.
        tolerance: Tolerances of the motion.
        times: Times of the waypoints, including ends of stretches [s], shape (k,).

    Returns:
        Bounds, above 1 where nothing is proved, shape (k - 1,).
    """
    use = np.zeros(len(times) - 1)
    part = 1.0 - TOLERANCE_NARROWING
    timing, start = path.timing, path.start_time
    for i, speed in enumerate(timing.speeds.tolist()):
        begin, end = start + timing.times[i : i + 2]
        low, high = start + timing.full_speed[i]
        limits = PathLimits(
            position=part * tolerance.position,
            orientation=part * tolerance.orientation,
            speed=part * tolerance.speed * speed,
            full_speed=speed,
            full_interval=(low, high),
        )
        bounds = path_bounds(robot, curve, path, (begin, end), limits)
        middle = 0.5 * (bounds.times[1:] + bounds.times[:-1])
        interval = np.clip(np.searchsorted(times, middle) - 1, 0, len(use) - 1)
        np.maximum.at(use, interval, bounds.use)
    return use
