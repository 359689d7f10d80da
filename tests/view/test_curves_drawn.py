"""What is drawn of a curve, against the trajectory itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.view.curves import jump_breaks, strokes
from sweeps import examples

seeds = st.integers(0, 2**32 - 1)


def random_curve(
    seed: int, degree: int = 3, pieces: int = 5, joints: int = 2
) -> PiecewisePolynomial:
    """A curve that jumps at every break in every derivative."""
    rng = np.random.default_rng(seed)
    breaks = np.cumsum(rng.uniform(0.1, 2.0, pieces + 1))
    return PiecewisePolynomial(rng.normal(size=(degree + 1, pieces, joints)), breaks)


def left_value(curve: PiecewisePolynomial, piece: int, order: int, joint: int) -> float:
    """Value at the end of a piece, from the piece before the break, by NumPy."""
    polynomial = np.poly1d(curve.c[:, piece, joint]).deriv(order)
    return float(polynomial(curve.x[piece + 1] - curve.x[piece]))


@examples()
@given(seeds, st.integers(0, 3), st.integers(1, 9))
def test_points_lie_on_the_curve_with_both_sides_of_every_break(
    seed: int, order: int, degree: int
) -> None:
    curve = random_curve(seed, degree)
    drawn = strokes(curve, 1, order, 2.5)
    assert (np.diff(drawn.time, axis=1) >= 0).all()
    inner = drawn.time < curve.x[1:, None]
    np.testing.assert_allclose(
        drawn.value[inner], 2.5 * curve(drawn.time[inner], order)[:, 1], rtol=1e-9, atol=1e-9
    )
    np.testing.assert_array_equal(drawn.time[:, 0], curve.x[:-1])
    np.testing.assert_array_equal(drawn.time[:, -1], curve.x[1:])
    for piece in range(len(curve.x) - 1):
        expected = 2.5 * left_value(curve, piece, order, 1)
        assert drawn.value[piece, -1] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@examples()
@given(seeds, st.integers(0, 3), st.integers(1, 7))
def test_the_exact_extrema_are_among_the_points(seed: int, order: int, degree: int) -> None:
    curve = random_curve(seed, degree)
    drawn = strokes(curve, 0, order, 1.0)
    extrema = curve.extrema(order)
    scale = max(1.0, float(extrema.peak[0]))
    assert float(drawn.value.max()) == pytest.approx(float(extrema.maximum[0]), abs=1e-9 * scale)
    assert float(drawn.value.min()) == pytest.approx(float(extrema.minimum[0]), abs=1e-9 * scale)


def test_rounding_makes_no_jump() -> None:
    """One cubic, cut into pieces, continues at the cuts but for rounding."""
    cubic = np.poly1d([0.3, -1.0, 2.0, 1e3])
    breaks = np.linspace(0.0, 3.0, 8)
    c = [[cubic.deriv(k)(t) / [1, 1, 2, 6][k] for t in breaks[:-1]] for k in (3, 2, 1, 0)]
    curve = PiecewisePolynomial(np.array(c)[:, :, None], breaks)
    assert [jump_breaks(curve, 0, order).size for order in range(4)] == [0, 0, 0, 0]


@examples()
@given(seeds, st.integers(0, 2), st.floats(0.05, 0.95))
def test_what_is_beyond_a_limit_is_where_the_curve_is_beyond_it(
    seed: int, order: int, part: float
) -> None:
    curve = random_curve(seed, 4)
    extrema = curve.extrema(order)
    low, high = float(extrema.minimum[0]), float(extrema.maximum[0])
    upper = low + part * (high - low)
    drawn = strokes(curve, 0, order, 1.0)
    time, value = drawn.beyond(-np.inf, upper)
    shown = np.isfinite(value)
    assert shown.any()
    inner = ~np.isclose(time[:, None], curve.x, rtol=0, atol=1e-9).any(axis=1)
    own = curve(time[inner], order)[:, 0]
    clear = np.abs(own - upper) > 1e-6 * max(abs(low), abs(high), 1.0)
    np.testing.assert_array_equal(shown[inner][clear], (own > upper)[clear])
