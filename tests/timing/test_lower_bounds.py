"""The least durations in closed form: no motion is below them, and bang-bang motions reach them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from knotwork.planning.timing import TimingLimits, TimingProblem, lower_bound
from sweeps import examples

PARTS = st.lists(st.tuples(st.floats(0.01, 2.0), st.floats(-1.0, 1.0)), min_size=1, max_size=6)


@examples(200)
@given(parts=PARTS, start=st.floats(-1.0, 1.0), scale=st.floats(0.01, 100.0))
@example(parts=[(1.0, -1.0), (1.0, -0.9999999999999999)], start=1.0, scale=1.0)  # back by 1e-16
@example(parts=[(1.0, -0.9999999999999999)] * 2, start=1.0, scale=1.0)
def test_no_motion_is_below_the_bound(
    parts: list[tuple[float, float]], start: float, scale: float
) -> None:
    """Any motion of accelerations between -1 and 1, its own peak velocity being the limit."""
    v, q, peak, duration = start, 0.0, abs(start), 0.0
    for h, a in parts:
        q += v * h + 0.5 * a * h * h
        v += a * h
        peak, duration = max(peak, abs(v)), duration + h
    limits = TimingLimits([scale * peak + 1e-9], [scale])
    for known in (slice(0, 2), slice(0, 1), slice(1, 2), slice(0, 0)):
        velocity = np.full((2, 1), np.nan)
        velocity[known] = scale * np.array([[start], [v]])[known]
        problem = TimingProblem(("a",), [[0.0], [scale * q]], velocity, limits)
        assert lower_bound(problem) <= duration * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize(
    ("move", "ends", "least"),
    [
        (1.0, (0.0, 0.0), 2.0),  # up and down
        (8.0, (0.0, 0.0), 6.0),  # with a stretch at the limit of 2
        (1.0, (1.0, 1.0), 2.0 * (np.sqrt(2.0) - 1.0)),
        (-1.0, (0.0, 0.0), 2.0),
        (-0.25, (0.5, 0.5), 1.0 + 2.0 * np.sqrt(0.5)),  # there and back
    ],
)
def test_lower_bounds_by_hand(move: float, ends: tuple[float, float], least: float) -> None:
    limits = TimingLimits([2.0], [1.0])
    problem = TimingProblem(("a",), [[0.0], [move]], [[ends[0]], [ends[1]]], limits)
    assert lower_bound(problem) == pytest.approx(least)
