"""Points of a motion of another tool, and their interpolation by a controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import DocumentError
from knotwork.joint_quantities import DERIVATIVES
from knotwork.waypoints import FloatArray

Place = Callable[[int, str, "int | None"], Callable[[str, str], DocumentError]]
"""Function of row, quantity and joint (or `None`) that gives a maker of errors for that location,
from a message and the accepted input.
"""

QUANTITIES = DERIVATIVES[:3]
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
        values: By the name of each of `QUANTITIES` [rad or m, and per s], shape (n, d); NaN in the
            rows without it.
        has: Rows that have each of them, shape (n,).
        place: Maker of errors with the location of a value in the file.
    """

    joints: Joints
    time: FloatArray
    values: Mapping[str, FloatArray]
    has: Mapping[str, NDArray[np.bool_]]
    place: Place


def check_points(table: PointTable) -> None:
    """Refuse points that a controller can't interpolate.

    Raises:
        DocumentError: There are fewer than two points, a value is not finite, times do not
            increase, or a point has accelerations but no velocities.
    """
    if table.time.size < 2:
        raise table.place(0, "", None)(f"has {table.time.size} points", "at least two points")
    _refuse_not_finite(table)
    late = np.flatnonzero(np.diff(table.time) <= 0.0)
    if late.size:
        row = int(late[0]) + 1
        raise table.place(row, "time", None)(
            f"the time {_digits(table.time[row])} s is not after {_digits(table.time[row - 1])} s, "
            "the previous one",
            "increasing times",
        )
    alone = np.flatnonzero(table.has["acceleration"] & ~table.has["velocity"])
    if alone.size:
        raise table.place(int(alone[0]), "acceleration", None)(
            "is given without a velocity", "both, or velocities alone"
        )


def _digits(value: float) -> str:
    """All digits of a number, without trailing ones."""
    return repr(float(value)).removesuffix(".0")


def _refuse_not_finite(table: PointTable) -> None:
    bad = np.flatnonzero(~np.isfinite(table.time))
    if bad.size:
        row = int(bad[0])
        message = f"the time is {table.time[row]}"
        raise table.place(row, "time", None)(message, "a finite number of seconds")
    for quantity, values in table.values.items():
        wrong = np.argwhere(~np.isfinite(values) & table.has[quantity][:, None])
        if wrong.size:
            row, joint = (int(i) for i in wrong[0])
            name = table.joints.names[joint]
            message = f"the {quantity} of joint {name!r} is {values[row, joint]}"
            raise table.place(row, quantity, joint)(message, "a finite number")


def to_trajectory(table: PointTable, source: str) -> JointTrajectory:
    """Interpolate points as ROS 2's joint_trajectory_controller does (C0, C1 or C2, by content).

    Between two points it is a quintic if both have velocities and accelerations, a cubic if both
    have velocities, and a straight line otherwise.

    Args:
        table: The points.
        source: Their source, for the report.

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
        raise table.place(row, "time", None)(
            "the motion from the previous point exceeds the range of floating-point numbers",
            "points farther apart in time",
        )
    joined = " and ".join(_CURVES[kind] for kind in sorted(set(kinds.tolist())))
    return JointTrajectory(
        table.joints.names,
        PiecewisePolynomial(c, table.time),
        joint_units=table.joints.units,
        planner=f"{source}, {table.time.size} points joined by {joined}",
    )
