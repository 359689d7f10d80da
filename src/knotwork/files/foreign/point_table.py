"""Points of a motion of another tool, and their interpolation by a controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError
from knotwork.joint_quantities import MOTION_QUANTITIES

ErrorAt = Callable[[int, str, str, str], DocumentError]
"""Makes the error for a row and quantity of a file, from a message and the accepted input."""

QUANTITIES = MOTION_QUANTITIES[:3]
"""Quantities by which a controller interpolates points."""

_CURVES = ("straight lines", "cubics", "quintics")


class Joints(NamedTuple):
    """The joints required in a file, in any order.

    Attributes:
        names: Names, length d.
        units: `"rad"` or `"m"` for each.
        owner: Owner of the joints, for errors.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    owner: str


@dataclass(frozen=True, eq=False)
class PointTable:
    """Points of named joints, in SI.

    Attributes:
        joints: The joints.
        time: Times [s], shape (n,).
        values: Values of each of `QUANTITIES` [rad or m, and per s], shape (n, d); NaN in rows
            without the quantity.
        has: Whether each row has each of `QUANTITIES`, shape (n,).
        error: Function that makes an error with the location of a value in the file.
    """

    joints: Joints
    time: FloatArray
    values: Mapping[str, FloatArray]
    has: Mapping[str, BoolArray]
    error: ErrorAt


def check_points(table: PointTable) -> None:
    """Refuse points that a controller can't interpolate.

    Raises:
        DocumentError: There are fewer than two points, times do not increase, or a point has
            accelerations but no velocities.
    """
    if table.time.size < 2:
        raise table.error(0, "", f"has {table.time.size} points", "at least two points")
    late = np.flatnonzero(np.diff(table.time) <= 0.0)
    if late.size:
        row = int(late[0]) + 1
        before, after = (repr(float(table.time[i])).removesuffix(".0") for i in (row - 1, row))
        message = f"the time {after} s is not after {before} s, the previous one"
        raise table.error(row, "time", message, "increasing times")
    without_velocity = np.flatnonzero(table.has["acceleration"] & ~table.has["velocity"])
    if without_velocity.size:
        fault = "is given without a velocity"
        row = int(without_velocity[0])
        raise table.error(row, "acceleration", fault, "both, or velocities alone")


def to_trajectory(table: PointTable, description: str) -> JointTrajectory:
    """Interpolate points as ROS 2's joint_trajectory_controller does (C0, C1 or C2, by content).

    Two points are joined by a quintic if both have velocities and accelerations, by a cubic if both
    have velocities, and otherwise by a straight line.

    Args:
        table: The points.
        description: Name and kind of their file, for the report.

    Raises:
        DocumentError: As for `check_points`; or the curve exceeds the range of floats.
    """
    check_points(table)
    cubic = table.has["velocity"][:-1] & table.has["velocity"][1:]
    quintic = cubic & table.has["acceleration"][:-1] & table.has["acceleration"][1:]
    kinds = cubic.astype(int) + quintic
    derivatives = tuple(
        np.where(table.has[name][:, None], table.values[name], 0.0) for name in QUANTITIES
    )
    size = 2 * (int(kinds.max()) + 1)
    c = np.zeros((size, table.time.size - 1, len(table.joints.names)))
    for kind in sorted(set(kinds.tolist())):
        pieces = two_point_coefficients(table.time, derivatives[: kind + 1])
        of_kind = kinds == kind
        c[size - len(pieces) :, of_kind] = pieces[:, of_kind]
    if not np.isfinite(c).all():
        row = int(np.argwhere(~np.isfinite(c))[0][1]) + 1
        fault = "the motion from the previous point exceeds the range of floating-point numbers"
        raise table.error(row, "time", fault, "points farther apart in time")
    joined = " and ".join(_CURVES[kind] for kind in sorted(set(kinds.tolist())))
    return JointTrajectory(
        table.joints.names,
        PiecewisePolynomial(c, table.time),
        joint_units=table.joints.units,
        origin=f"{description}, {table.time.size} points joined by {joined}",
    )
