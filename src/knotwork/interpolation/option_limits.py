"""Limits that shape a motion, and how to refuse an interval that is too short for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knotwork.errors import InputError
from knotwork.interpolation.options import option_array
from knotwork.waypoints import FloatArray, JointWaypoints

DEFAULT_FRACTION = 1.0 / 3.0
"""Part of an interval, or of its shortest neighbour, for a change of speed that no limit bounds."""

ROUNDING = 1e-12
"""Relative tolerance: rounding can make a fully used limit or interval seem exceeded."""


def limit_rows(option: str, given: Any, joints: int) -> FloatArray:
    """Limits of the joints, infinite where none is given, shape (d,).

    Raises:
        OptionError: The shape is another.
    """
    accepted = f"{joints} joints need ({joints},), infinite where there is no limit"
    return option_array(option, given, (joints,), np.inf, accepted)


def interval_name(waypoints: JointWaypoints, interval: int) -> str:
    """Describe an interval between waypoints: names, times and length."""
    names, t = waypoints.names, waypoints.time
    return (
        f"the interval from waypoint {names[interval]!r} ({t[interval]:.6g} s) to "
        f"{names[interval + 1]!r} ({t[interval + 1]:.6g} s), "
        f"{t[interval + 1] - t[interval]:.6g} s long"
    )


def refuse_first(
    wrong: NDArray[np.bool_],
    waypoints: JointWaypoints,
    reason: Callable[[int, int], str],
) -> None:
    """Raise an error for the first interval and joint that are wrong, if any is.

    Args:
        wrong: Shape (n-1, d).
        waypoints: The waypoints.
        reason: Says what is wrong with an interval and a joint.

    Raises:
        InputError: One is wrong.
    """
    if wrong.any():
        interval, joint = (int(i) for i in np.argwhere(wrong)[0])
        raise InputError(
            f"joint {waypoints.joint_names[joint]!r} can't do "
            f"{interval_name(waypoints, interval)}: {reason(interval, joint)}"
        )


def refuse_unresolved(time: FloatArray, wrong: NDArray[np.bool_], what: str) -> None:
    """Raise an error for the first phase that is too short for the resolution of times.

    Args:
        time: Times of the phases [s], shape (k,).
        wrong: Which are too short, shape (k,).
        what: What a phase is called.

    Raises:
        InputError: One is wrong.
    """
    if wrong.any():
        at = float(time[np.flatnonzero(wrong)[0]])
        raise InputError(
            f"the {what} at {at:.17g} s is too short for the resolution of "
            f"times there, {np.spacing(abs(at)):.3g} s; ask for a longer one or a lower "
            "acceleration_limit"
        )


def snapped(time: FloatArray, span: FloatArray) -> FloatArray:
    """Round durations down to the resolution of the times that they start or end at.

    Then a break is at the same time for both polynomials that meet there, however large the times.
    """
    size = np.abs(time)
    rounded = (size + span) - size
    return np.where(rounded > span, rounded - np.spacing(size + span), rounded)
