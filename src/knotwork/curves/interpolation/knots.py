"""Positions of the rebuilt knots: one before and one after each inner waypoint.

Each inner waypoint x[i] is strictly between its *left* and its *right* knot. The first and the last
knot are the first and the last waypoint. Thus an inner interval has two knots, and the first and
the last interval have one each: m = 2n - 2. If the acceleration at an end is given, the interval
there has two knots as well: m = 2n with both. An inner waypoint with a given acceleration ends one
section of the curve and begins the next one. It is itself a knot, between its left and its right
knot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import BoolArray, FloatArray
from knotwork.errors import InputError, KnotError, UnknownNameError

PAPER_INNER = (0.25, 0.75)
"""Fractions of an interval at which its two knots are: Eqs. (35), (36)."""

PAPER_END = 0.618
"""Distance of the only knot of the first or last interval from the end of the curve, as a fraction
of the interval: Eqs. (37), (38)."""

KNOT_RULES = ("paper", "balanced")
"""Names of the rules that place knots."""


@dataclass(frozen=True)
class BalancedKnots:
    """Knots at equal distances before and after each waypoint.

    The knots of waypoint i are at x[i] ± c·min(x[i] - x[i-1], x[i+1] - x[i]). The first and the
    last waypoint have only one neighbour. If interval lengths differ much and velocities do not
    suit the path, the peak velocity is lower than with Eq. (39). The peak acceleration may be lower
    or higher. With a smaller `c` the peak velocity is lower, and the jerk increases as 1/c.

    >>> x, y, v = [0, 5, 15, 25], [0, 30, 90, 180], [0, 6, 9, 0]
    >>> kw.ModifiedHermiteSpline(x, y, v, knots=kw.interpolation.BalancedKnots(0.1)).x
    array([ 0. ,  4.5,  5.5, 14. , 16. , 25. ])

    Attributes:
        c: The fraction, 0 < c <= 1/2. At 1/2 the knots of two waypoints coincide if no neighbour of
            their interval is shorter. This is a `KnotError` when they are placed.

    Raises:
        InputError: `c` is out of bounds.
    """

    c: float = 0.2

    def __post_init__(self) -> None:
        try:
            c = float(self.c)
        except (TypeError, ValueError):
            c = np.nan
        if not 0.0 < c <= 0.5:
            raise InputError(
                f"the fraction c of balanced knots is {self.c!r}; it must be in (0, 0.5]"
            )
        object.__setattr__(self, "c", c)


KnotPlacement: TypeAlias = str | BalancedKnots | ArrayLike
"""A rule of `KNOT_RULES`, one with its own fraction, or the knot times [s]."""


def place_knots(
    x: FloatArray, rule: KnotPlacement, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Place knots around waypoints.

    Args:
        x: Waypoint times [s], shape (n,), n >= 2, strictly increasing.
        rule: `"paper"` for Eq. (39), at 1/4 and 3/4 of an interval with two knots and at 0.618
            from the end in an interval with one; `"balanced"` or a `BalancedKnots`; or the knot
            times [s] themselves, the first and the last waypoint included, inner ones left out.
        known: Whether the acceleration at each waypoint is given, shape (n,). The first or last
            interval then has two knots, otherwise one, and an inner waypoint is itself a knot.

    Returns:
        The left and the right knot of every waypoint [s], shape (n,) each. The left knot of the
        first waypoint and the right knot of the last one are these waypoints themselves. If the
        acceleration there is not given, so are the right knot of the first and the left knot of the
        last one.

    Raises:
        KnotError: A knot is not on its side of its waypoint or not before the next knot, or
            there are too few or too many.
        UnknownNameError: No rule has that name.
    """
    if isinstance(rule, str):
        if rule not in KNOT_RULES:
            raise UnknownNameError("knot rule", rule, KNOT_RULES)
        rule = BalancedKnots() if rule == "balanced" else rule
    if isinstance(rule, BalancedKnots):
        left, right = _place_balanced_knots(x, rule.c, known)
    elif isinstance(rule, str):
        left, right = _place_paper_knots(x, known)
    else:
        left, right = _check_knots(x, rule, known)
    left[0], right[-1] = x[0], x[-1]
    if not known[0]:
        right[0] = x[0]
    if not known[-1]:
        left[-1] = x[-1]
    _check_order(x, left, right, known)
    return left, right


def _place_paper_knots(x: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    h = np.diff(x)
    left, right = x.copy(), x.copy()
    right[:-1] += PAPER_INNER[0] * h
    left[1:] = x[:-1] + PAPER_INNER[1] * h
    if not known[0]:
        left[1] = x[0] + PAPER_END * h[0]
    if not known[-1]:
        right[-2] = x[-1] - PAPER_END * h[-1]
    return left, right


def _place_balanced_knots(
    x: FloatArray, c: float, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    h = np.diff(x)
    before, after = np.insert(h, 0, np.inf), np.append(h, np.inf)
    shorter = np.minimum(before, after)
    # at the end of a section, the interval beyond it is ignored
    before, after = (c * np.where(known, side, shorter) for side in (before, after))
    before[0] = after[-1] = 0.0
    meeting = after[:-1] + before[1:] >= h
    meeting[0] &= known[0]
    meeting[-1] &= known[-1]
    if meeting.any():
        i = int(np.flatnonzero(meeting)[0])
        raise KnotError(
            f"balanced knots with c = {c:g} coincide between waypoints {i + 1} and {i + 2}, where "
            "neither neighbouring interval is shorter; choose c below 0.5",
            waypoint_index=i,
        )
    return x - before, x + after


def _check_knots(
    x: FloatArray, knots: ArrayLike, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    n = x.size
    known_ends = int(known[0]) + int(known[-1])
    expected = 2 * n - 2 + known_ends
    try:
        t = np.array(knots, dtype=float)
    except (TypeError, ValueError) as error:
        raise KnotError(f"knots must be a rule or times in seconds, not {knots!r}") from error
    if t.ndim != 1:
        raise KnotError(f"knot times must have one dimension, not shape {t.shape}")
    if not np.isfinite(t).all():
        j = int(np.flatnonzero(~np.isfinite(t))[0])
        raise KnotError(f"knot {j + 1} is {t[j]}; every knot must be finite")
    for end, i in ((0, 0), (-1, n - 1)) if t.size else ():
        if t[end] != x[end]:
            raise KnotError(
                f"the {'last' if end else 'first'} knot is {t[end]:.15g} s; it must be the time of "
                f"waypoint {i + 1}, {x[end]:.15g} s",
                waypoint_index=i,
            )
    if t.size != expected:
        rule = (
            "2n - 2",
            "2n - 1, because one end acceleration is given",
            "2n, because end accelerations are given",
        )[known_ends]
        raise KnotError(f"{n} waypoints need {expected} knots ({rule}); {t.size} are given")
    t = np.concatenate((() if known[0] else t[:1], t, () if known[-1] else t[-1:]))
    return t[0::2].copy(), t[1::2].copy()


def _check_order(x: FloatArray, left: FloatArray, right: FloatArray, known: BoolArray) -> None:
    """Raise a KnotError for the first interval with misplaced knots."""
    # a knot and its waypoint coincide only at the ends
    right_fits = (right[:-1] > x[:-1]) & (right[:-1] < x[1:])
    left_fits = (left[1:] > x[:-1]) & (left[1:] < x[1:])
    right_fits[0] |= not known[0]
    left_fits[-1] |= not known[-1]
    fits = right_fits & left_fits & (right[:-1] < left[1:])
    if fits.all():
        return
    i = int(fits.argmin())
    low, high = float(x[i]), float(x[i + 1])
    inner = (time for time in (right[i], left[i + 1]) if time not in (x[0], x[-1]))
    raise KnotError(
        f"knots at {' and '.join(f'{time:.15g} s' for time in inner)} must lie strictly between "
        f"{low:.15g} s and {high:.15g} s, the times of two neighbouring waypoints, in order",
        waypoint_index=i,
        interval=(low, high),
    )
