"""Accelerations and higher derivatives at waypoints: given, zero, or estimated."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.errors import OptionError
from knotwork.spline.interpolation.modified_hermite_spline import end_accelerations
from knotwork.spline.interpolation.options import PlannerOptions
from knotwork.waypoints import FloatArray, JointWaypoints


def estimated_accelerations(waypoints: JointWaypoints) -> FloatArray:
    """Estimate accelerations from the cubic Hermite pieces that adjoin each waypoint.

    Where pieces of lengths h₋ and h₊ meet with the accelerations a₋ and a₊, the estimate is

        a = (h₋ a₋ + h₊ a₊) / (h₋ + h₊),

    and at the ends the acceleration of the one piece. Among all curves with its end positions and
    velocities the cubic has the minimum integral of squared acceleration. A quintic whose
    acceleration at one end differs from the cubic's by e exceeds it by a multiple of h e². So the
    estimate minimises the sum over both neighbouring quintics, if their accelerations at the far
    ends are those of the cubics. It is exact for quadratic and cubic motions, local, and for equal
    intervals the mean of both.

    Returns:
        Accelerations, shape (n, d) [rad/s² or m/s²].
    """
    h = np.diff(waypoints.time)[:, None]
    start, end = cubic_accelerations(waypoints)
    inner = (h[:-1] * end[:-1] + h[1:] * start[1:]) / (h[:-1] + h[1:])
    return np.concatenate((start[:1], inner, end[-1:]))


def cubic_accelerations(waypoints: JointWaypoints) -> tuple[FloatArray, FloatArray]:
    """Accelerations of the cubic Hermite pieces at their starts and ends, shape (n-1, d) each."""
    h = np.diff(waypoints.time)[:, None]
    v, slope = waypoints.velocity, np.diff(waypoints.position, axis=0) / h
    start = (6.0 * slope - 4.0 * v[:-1] - 2.0 * v[1:]) / h
    return start, (4.0 * v[1:] + 2.0 * v[:-1] - 6.0 * slope) / h


def preset_accelerations(waypoints: JointWaypoints, options: PlannerOptions) -> FloatArray:
    """Accelerations at the waypoints given by the options, zeros by default, shape (n, d).

    Accelerations of the waypoints have priority over the options.

    Raises:
        OptionError: An array has another shape, or end accelerations are given together with one.
    """
    asked = "zero" if options.accelerations is None else options.accelerations
    ends = end_accelerations(options.end_acceleration, (len(waypoints.joint_names),))
    if not isinstance(asked, str):
        if ends is not None:
            raise OptionError(
                "end_acceleration",
                "gives the accelerations at the ends, and so do the first and last row of option "
                "accelerations; give one of the two",
            )
        return with_known(preset_rows(asked, waypoints), waypoints)
    if asked == "zero":
        accelerations = np.zeros(waypoints.position.shape)
    else:
        accelerations = estimated_accelerations(waypoints)
    if ends is not None:
        accelerations[0], accelerations[-1] = ends
    return with_known(accelerations, waypoints)


def with_known(accelerations: FloatArray, waypoints: JointWaypoints) -> FloatArray:
    """Replace the accelerations of an option by those that the waypoints have."""
    known = waypoints.acceleration
    return accelerations if known is None else np.where(np.isnan(known), accelerations, known)


def preset_rows(rows: Any, waypoints: JointWaypoints, *, skipped: int = 0) -> FloatArray:
    """Accelerations given at the waypoints, shape (n, d).

    Args:
        rows: Value of the option `accelerations`.
        waypoints: The waypoints.
        skipped: Number of waypoints at either end without a row.

    Raises:
        OptionError: The shape is wrong.
    """
    n, joints = waypoints.position.shape
    shape = max(n - 2 * skipped, 0), joints
    where = "each waypoint, the start included"
    if skipped:
        where += f", but the first {skipped} and the last {skipped}, where nothing is free"
    accepted = f"{n} waypoints of {joints} joints take {shape[0]} (shape {shape}), one for "
    array = np.asarray(rows, dtype=float)
    if array.size == shape[0] == 0:
        return np.zeros(shape)
    if array.shape != shape:
        count = len(array) if array.ndim else "no"
        raise OptionError(
            "accelerations", f"has {count} rows (shape {array.shape}); {accepted}{where}"
        )
    return array
