"""The paper's interpolant: a C2 cubic through positions and velocities, on rebuilt knots."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knotwork.arrays import (
    FloatArray,
    check_known_rows,
    checked_rows,
    checked_times,
    known_rows,
)
from knotwork.curves.interpolation.accelerations import SplineData, solve_knot_accelerations
from knotwork.curves.interpolation.knots import BalancedKnots, place_knots
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError, OptionError, WaypointDataError

EndAccelerationLike = str | tuple[ArrayLike, ArrayLike] | None
"""`None`, `"zero"`, or the accelerations at start and end."""


class ModifiedHermiteSpline(PiecewisePolynomial):
    """Modified piecewise cubic Hermite interpolator of values and first derivatives (C2 smooth).

    A cubic Hermite spline through the waypoints is C1 only. This spline has rebuilt knots, one
    before and one after each inner waypoint. Thus it meets every value and every derivative with a
    continuous second derivative, and its degree is still three: Eqs. (30), (31), (34) of the paper,
    on the knots of Eq. (39). Time and memory are linear in n, for any times.

    The interface is that of `scipy.interpolate.CubicHermiteSpline`, without extrapolation.

    >>> spline = kw.ModifiedHermiteSpline([0, 5, 15, 25], [0, 30, 90, 180], [0, 6, 9, 0])
    >>> spline([5, 15]), spline([5, 15], nu=1)  # positions and velocities are met
    (array([30., 90.]), array([6., 9.]))

    Args:
        x: Waypoint times [s], shape (n,), n >= 2, strictly increasing.
        y: Values, n along `axis`, any shape, finite.
        dydx: Derivatives, of the shape of `y`, finite.
        axis: Axis of `y` along which time runs.
        knots: `"paper"` for Eq. (39); `"balanced"` or a `BalancedKnots` for knots at equal
            distances next to each waypoint; or the m knot times [s] themselves.
        end_acceleration: `None` for the paper's curve, m = 2n - 2 knots, where the accelerations at
            start and end are unknown; or the second derivatives there, a pair of scalars or arrays
            of the trailing shape of `y`, or `"zero"` for both: one more knot in the first and in
            the last interval, m = 2n.
        acceleration: Known second derivatives, of the shape of `y`, NaN at waypoints where they are
            unknown. An inner waypoint with known ones ends one section of the curve and begins the
            next one. It is itself a knot, and neither side depends on the other.

    Attributes:
        x: Knot times, the breaks of the curve, shape (m,), not the argument `x`. For n = 2 without
            end accelerations the curve is the plain cubic Hermite polynomial.
        c: Coefficients, shape (4, m-1, ...), highest power first.
        axis: Time axis, counted from 0.
        waypoint_times: Times of the waypoints, shape (n,).
        waypoint_acceleration: Second derivative at the waypoints, of the shape of `y`.

    Raises:
        WaypointDataError: The data are complex or not finite, their shapes do not match, there
            are fewer than two waypoints or their times do not increase.
        KnotError: A knot leaves a waypoint outside its span, or there are too few or too many.
        OptionError: The end accelerations are not numbers, or of another shape.
        InputError: The curve exceeds the range of floats.
        UnknownNameError: No knot rule has that name.
    """

    # the checks report overflow with its reason
    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def __init__(
        self,
        x: ArrayLike,
        y: ArrayLike,
        dydx: ArrayLike,
        *,
        axis: int = 0,
        knots: str | BalancedKnots | ArrayLike = "paper",
        end_acceleration: EndAccelerationLike = None,
        acceleration: ArrayLike | None = None,
    ) -> None:
        times = checked_times(_require_real(x, "x"))
        values, own_axis = _move_time_axis(y, times.size, axis, "y")
        derivatives, _ = _move_time_axis(dydx, times.size, axis, "dydx")
        if values.shape != derivatives.shape:
            raise WaypointDataError(
                f"y and dydx must have the same shape; with the time axis first they have "
                f"{values.shape} and {derivatives.shape}"
            )
        trailing = values.shape[1:]
        flat = times.size, math.prod(trailing)
        required = np.full(flat, np.nan)
        if acceleration is not None:
            array, _ = _move_time_axis(acceleration, times.size, axis, "acceleration", unknown=True)
            if array.shape != values.shape:
                raise WaypointDataError(
                    f"acceleration must have the shape of y; with the time axis first they have "
                    f"{array.shape} and {values.shape}"
                )
            required[:] = array.reshape(flat)
        check_known_rows(required)
        known = known_rows(required) & (flat[1] > 0)
        ends = end_accelerations(end_acceleration, trailing)
        if ends is not None:
            for row, end_value in zip((0, -1), ends, strict=True):
                if not known[row]:
                    required[row], known[row] = end_value, True
        # contiguous rows, because NumPy would keep the order of a transposed view
        y_rows, v_rows = (
            np.ascontiguousarray(rows.reshape(flat).T) for rows in (values, derivatives)
        )
        data = SplineData(times, y_rows, v_rows, *place_knots(times, knots, known), known)
        a, left, right = solve_knot_accelerations(data, required[known].T)
        breaks, c = assemble_pieces(data, a, left, right)
        _check_range(a, c)
        self._assign(c.reshape(*c.shape[:2], *trailing), breaks, own_axis)
        self._waypoint_times = times
        accelerations = a.T.reshape(values.shape)
        if own_axis:
            accelerations = np.moveaxis(accelerations, 0, own_axis)
        accelerations.setflags(write=False)
        self._waypoint_acceleration = accelerations

    @property
    def waypoint_times(self) -> FloatArray:
        """Times of the waypoints [s], shape (n,)."""
        return self._waypoint_times

    @property
    def waypoint_acceleration(self) -> FloatArray:
        """Second derivative at the waypoints, of the shape of the data."""
        return self._waypoint_acceleration


def _check_range(a: FloatArray, c: FloatArray) -> None:
    """Raise an InputError if accelerations or jerks are beyond the range of floats."""
    wrong = np.flatnonzero(~np.isfinite(a).all(axis=0))
    if wrong.size or not np.isfinite(c[0]).all():
        where = f"the acceleration at waypoint {wrong[0] + 1}" if wrong.size else "the jerk"
        raise InputError(
            f"{where} is beyond the range of floating-point numbers: the times are too close "
            "together for the values given"
        )


def _require_real(values: ArrayLike, name: str) -> NDArray[Any]:
    """Check that values are real numbers, and return them as an array.

    Raises:
        WaypointDataError: Values are complex or not numbers.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "buif":
        raise WaypointDataError(f"{name} must be real numbers, not {array.dtype}", value=values)
    return array


def _move_time_axis(
    values: ArrayLike, n: int, axis: int, name: str, *, unknown: bool = False
) -> tuple[FloatArray, int]:
    """Check data and move their time axis to the front; return the axis counted from 0."""
    array = _require_real(values, name)
    if not -array.ndim <= axis < array.ndim:
        raise WaypointDataError(f"{name} has shape {array.shape}; there is no axis {axis} in it")
    axis %= array.ndim
    array = np.moveaxis(array, axis, 0)
    if len(array) != n:
        raise WaypointDataError(
            f"{name} has length {len(array)} along axis {axis}; there are {n} times"
        )
    return checked_rows(array, array.shape, name, unknown=unknown), axis


def end_accelerations(
    option: EndAccelerationLike | Any, trailing: tuple[int, ...]
) -> tuple[FloatArray, FloatArray] | None:
    """First and last acceleration of all components, flat, shape (d,) each; `None` if not given.

    Raises:
        OptionError: The value is neither `"zero"` nor a pair of finite numbers of the right shape.
    """
    if option is None:
        return None
    pair = (0.0, 0.0) if isinstance(option, str) and option == "zero" else option
    if isinstance(pair, str) or not hasattr(pair, "__len__") or len(pair) != 2:
        message = f"is {option!r}; it must be None, 'zero' or a pair (start, end)"
        raise OptionError("end_acceleration", message)
    try:
        arrays = [np.array(value, dtype=float) for value in pair]
    except (TypeError, ValueError) as error:
        raise OptionError("end_acceleration", f"is {option!r}; it must be numbers") from error
    for name, array in zip(("start", "end"), arrays, strict=True):
        if array.shape not in ((), trailing) or not np.isfinite(array).all():
            raise OptionError(
                "end_acceleration",
                f"has the {name} {array.tolist()}; it must be a finite number, or finite numbers "
                f"of the shape of one waypoint, {trailing}",
            )
    start, end = (np.broadcast_to(array, trailing).reshape(-1) for array in arrays)
    return start, end


def assemble_pieces(
    data: SplineData, a: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Assemble the polynomials between the knots.

    The acceleration is linear between the knots, so its values there determine it. Position and
    velocity at each knot come from the waypoint next to it. Both pieces at a knot use the same
    state, so they agree to rounding. A waypoint with a given acceleration is itself a knot,
    where the jerk may jump.

    Args:
        data: Times, positions, velocities and knots.
        a: Accelerations at the waypoints as rows, shape (d, n).
        left: Accelerations at their left knots, shape (d, n).
        right: Accelerations at their right knots, shape (d, n).

    Returns:
        The knots [s], shape (m,), and the coefficients, shape (4, m-1, d), highest power first.
    """
    knots = _interleave(data.left, data.right)
    u, bend = knots - data.waypoint_times.repeat(2), _interleave(left, right)
    own_acceleration, v = a.repeat(2, axis=1), data.dydx.repeat(2, axis=1)
    position = data.y.repeat(2, axis=1) + u * (v + u * (2.0 * own_acceleration + bend) / 6.0)
    states = [knots, bend, v + 0.5 * u * (own_acceleration + bend), position]
    cuts = np.flatnonzero(data.known[1:-1]) + 1
    if cuts.size:
        values = data.waypoint_times, a, data.dydx, data.y
        states = [
            np.insert(state, 2 * cuts + 1, own_acceleration[..., cuts], axis=-1)
            for state, own_acceleration in zip(states, values, strict=True)
        ]
    # an end without a given acceleration has only one knot
    inside = slice(0 if data.known[0] else 1, None if data.known[-1] else -1)
    knots, bend, v, position = (state[..., inside] for state in states)
    c = np.empty((4, knots.size - 1, a.shape[0]))
    c[0] = (np.diff(bend) / (6.0 * np.diff(knots))).T
    c[1], c[2], c[3] = 0.5 * bend[:, :-1].T, v[:, :-1].T, position[:, :-1].T
    return np.array(knots), c


def _interleave(left: FloatArray, right: FloatArray) -> FloatArray:
    """Interleave values at the left and the right knots of the waypoints, shape (..., 2n)."""
    return np.stack((left, right), axis=-1).reshape(*left.shape[:-1], 2 * left.shape[-1])
