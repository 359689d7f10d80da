"""Arrays of numbers: their types, and checks that copy values into read-only arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knotwork.errors import ArrayError, WaypointDataError
from knotwork.errors.plain_text import default_waypoint_name, waypoint_text

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


def number_array(
    values: ArrayLike, shape: tuple[int, ...], subject: str, kind: type = float
) -> Any:
    """Copy values, infinite ones and NaN included, into a read-only array of a shape and type.

    Raises:
        ArrayError: The values are not numbers or have a wrong shape.
    """
    try:
        given = np.asarray(values)
        if given.dtype.kind not in ("biuf" if kind is bool else "iuf") + "O":
            raise TypeError  # NumPy would convert text and flags
        array: NDArray[Any] = np.array(given, dtype=kind)
    except (TypeError, ValueError) as error:
        message = f"{subject} must be numbers, not {values!r}"
        raise ArrayError(message, value=values) from error
    if array.shape != shape:
        message = f"{subject} must have shape {shape}, not {array.shape}"
        raise ArrayError(message, value=array)
    array.setflags(write=False)
    return array


def checked_array(
    values: ArrayLike, shape: tuple[int, ...], subject: str, *, unknown: bool = False
) -> FloatArray:
    """Copy values into a read-only array of finite floats of the given shape.

    Args:
        values: Numbers, as for NumPy.
        shape: Required shape.
        subject: Description of the values, for the error.
        unknown: Whether NaN is accepted, for unknown values.

    Raises:
        ArrayError: The values are not numbers, not finite or have a wrong shape.
    """
    array: FloatArray = number_array(values, shape, subject)
    wrong = np.isinf(array) if unknown else ~np.isfinite(array)
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        where = f"{subject}{list(index)}" if index else subject
        raise ArrayError(
            f"{where} is {array[index]}; every value must be finite",
            value=array[index],
            index=index,
        )
    return array


def checked_rows(
    values: ArrayLike, shape: tuple[int, ...], subject: str, *, unknown: bool = False
) -> FloatArray:
    """Copy values, a row for each waypoint, into a read-only array: see `checked_array`.

    Raises:
        WaypointDataError: The values are not numbers, not finite or have a wrong shape.
    """
    try:
        return checked_array(values, shape, subject, unknown=unknown)
    except ArrayError as error:
        i = error.index[0] if error.index else None
        raise WaypointDataError(str(error), waypoint_index=i, value=error.value) from error


def checked_times(
    times: ArrayLike, names: Sequence[str] | None = None, subject: str = "waypoint"
) -> FloatArray:
    """Copy times [s], strictly increasing, shape (n,), n >= 2, into a read-only array.

    Args:
        times: The times.
        names: Names of the points at these times.
        subject: Kind of the points, for the error.

    Raises:
        WaypointDataError: There are fewer than two times, or they are not finite or don't increase.
    """
    shape = np.shape(times if isinstance(times, np.ndarray) else np.asarray(times, dtype=object))
    if len(shape) != 1 or shape[0] < 2:
        message = f"at least two {subject} times are needed, in one dimension, not shape {shape}"
        raise WaypointDataError(message)
    array = checked_rows(times, shape, "time")
    late = np.flatnonzero(np.diff(array) <= 0)
    if late.size:
        i = int(late[0]) + 1
        name = f" ({names[i]!r})" if names is not None else ""
        raise WaypointDataError(
            f"time of {subject} {i + 1}{name} is {array[i]:.15g} s; it must be later than "
            f"{array[i - 1]:.15g} s, the time of the previous {subject}",
            waypoint_index=i,
            value=float(array[i]),
        )
    return array


def known_rows(values: FloatArray) -> BoolArray:
    """Find the waypoints at which values (n, d) are known, shape (n,); NaN is unknown."""
    return np.asarray(~np.isnan(values).any(axis=1))


def check_known_rows(
    values: FloatArray, names: Sequence[str] = (), subject: str = "acceleration"
) -> None:
    """Check that values (n, d) at each waypoint are known for all joints or none; NaN is unknown.

    Raises:
        WaypointDataError: Values are known for some joints only.
    """
    missing = np.isnan(values)
    partly = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
    if partly.size:
        i = int(partly[0])
        where = waypoint_text(names[i]) if names else default_waypoint_name(i)
        raise WaypointDataError(
            f"{subject} at {where} is known for some joints only; give all of them, or NaN for all",
            waypoint_index=i,
        )


def checked_joints(
    names: Sequence[str], units: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of joints as tuples; without units all are `"rad"`.

    Raises:
        WaypointDataError: There are no names, a name is repeated, or a unit is missing or unknown.
    """
    names = tuple(names)
    units = () if units is None else tuple(units)
    units = units or ("rad",) * len(names)
    if not names or len(set(names)) != len(names):
        raise WaypointDataError(f"joint names must be given, each once; got {list(names)}")
    if len(units) != len(names) or not set(units) <= {"rad", "m"}:
        raise WaypointDataError(
            f"joint units are {units}; give 'rad' or 'm' for each of {len(names)}"
        )
    return names, units


def rotation_error(matrix: FloatArray, tolerance: float) -> str:
    """Describe how a matrix (3, 3) differs from a rotation; empty within the tolerance."""
    error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    determinant = float(np.linalg.det(matrix))
    if error <= tolerance and determinant > 0.0:
        return ""
    return f"R'R differs from I by {error:.3g}, det R = {determinant:.3g}"


class ReadOnlyArrays:
    """Base class of objects with read-only arrays, which stay read-only in copies."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self.__dict__.update(state)
