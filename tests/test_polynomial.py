"""Piecewise polynomials against SciPy: values, calculus, roots, jumps and extrema."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import PPoly

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.extended_curve import ExtendedCurve
from knotwork.errors import InputError, TimeRangeError, WaypointDataError
from sweeps import examples, mostly_exhaustive

EPS = np.finfo(float).eps


def random_pair(degree, pieces, trailing=(), seed=0):
    """A curve, and the same as SciPy has it."""
    rng = np.random.default_rng([seed, degree, pieces])
    x = rng.uniform(-1, 1) + np.concatenate(([0.0], np.cumsum(rng.uniform(0.1, 2, pieces))))
    c = rng.normal(size=(degree + 1, pieces, *trailing))
    return PiecewisePolynomial(c, x), PPoly(c, x)


def size(curve, nu=0):
    """Sum of the absolute terms of the nu-th derivative: what rounding is relative to."""
    curve = curve.derivative(nu)
    span = np.diff(curve.x).reshape(-1, *[1] * (curve.c.ndim - 2))
    powers = np.arange(curve.degree, -1, -1).reshape(-1, *[1] * (curve.c.ndim - 1))
    return (np.abs(curve.c) * span**powers).sum(axis=0).max(axis=0)


@pytest.mark.parametrize("trailing", [(), (1,), (3,), (2, 3), (0,)])
@pytest.mark.parametrize("pieces", [1, 5, 300])
@pytest.mark.parametrize("degree", mostly_exhaustive([0, 1, 3, 5], 0, 3))
def test_values_are_those_of_scipy_for_any_arguments(degree, pieces, trailing):
    ours, theirs = random_pair(degree, pieces, trailing)
    rng = np.random.default_rng(0)
    start, end = ours.x[[0, -1]]
    dense = np.linspace(start, end, 70_001)  # more than one block; many times in a piece
    dense[-1] = end
    scattered = rng.uniform(start, end, (50, 7))
    for t in (dense, dense[::-1], scattered, np.sort(scattered, axis=None), ours.x, start, end):
        for nu in range(degree + 3):
            expected = theirs(t, nu)
            atol = 8 * EPS * size(ours, nu)
            assert ours(t, nu).shape == expected.shape
            assert (np.abs(ours(t, nu) - expected) <= atol).all()


@pytest.mark.parametrize("nu", [0, 1, 2, 3, 7])
@pytest.mark.parametrize("degree", [0, 3, 9])
def test_derivatives_and_antiderivatives_are_those_of_scipy(degree, nu):
    ours, theirs = random_pair(degree, 6, (2,))
    np.testing.assert_allclose(ours.derivative(nu).c, theirs.derivative(nu).c, rtol=1e-14)
    up, expected = ours.antiderivative(nu), theirs.antiderivative(nu)
    np.testing.assert_allclose(up.c, expected.c, rtol=1e-12, atol=1e-13 * np.abs(expected.c).max())
    np.testing.assert_allclose(up.derivative(nu).c, ours.c, rtol=1e-14)
    np.testing.assert_array_equal(ours.derivative(-nu).c, up.c)
    np.testing.assert_array_equal(ours.antiderivative(-nu).c, ours.derivative(nu).c)


def test_roots_are_those_of_scipy_without_extrapolation():
    ours, theirs = random_pair(3, 5, (3,))
    for mine, other in zip(ours.roots(), theirs.roots(extrapolate=False), strict=True):
        np.testing.assert_array_equal(mine, other)
    scalar, _ = random_pair(3, 5)
    level = float(scalar(scalar.x[2]))
    assert np.abs(scalar.solve(level) - scalar.x[2]).min() < 1e-12


@pytest.mark.parametrize("t", [-1e-300, np.nextafter(2.0, 3.0), np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["alone", "first", "last", "middle", "among many"])
def test_outside_its_times_there_is_no_curve(t, where):
    curve = PiecewisePolynomial([[1.0, 2.0]], [0.0, 1.0, 2.0])
    others = np.linspace(0, 2, 100_000 if where == "among many" else 9)
    at = {"alone": None, "first": 0, "last": -1, "middle": 4, "among many": 70_000}[where]
    times = others if at is not None else t
    if at is not None:
        times[at] = t
    with pytest.raises(TimeRangeError) as caught:
        curve(times)
    np.testing.assert_equal(caught.value.time, t)
    assert (caught.value.start_time, caught.value.end_time) == (0.0, 2.0)


def test_at_a_break_the_right_hand_piece_counts_and_at_the_end_the_last():
    curve = PiecewisePolynomial([[1.0, 5.0], [0.0, 3.0]], [0.0, 1.0, 2.0])
    assert curve([0.0, 1.0, np.nextafter(1.0, 0.0), 2.0]).tolist() == pytest.approx([0, 3, 1, 8])
    assert curve.jumps(0).tolist() == [2.0]
    assert curve.jumps(1).tolist() == [4.0]
    assert curve.jumps(2).tolist() == [0.0]


def test_jumps_are_right_hand_less_left_hand_limits():
    ours, theirs = random_pair(4, 6, (2,))
    for nu in range(6):
        c = theirs.derivative(nu).c
        expected = [
            [
                np.polyval(c[:, i, j], 0.0) - np.polyval(c[:, i - 1, j], ours.x[i] - ours.x[i - 1])
                for j in range(2)
            ]
            for i in range(1, 6)
        ]
        np.testing.assert_allclose(ours.jumps(nu), expected, atol=1e-11)
    single, _ = random_pair(3, 1, (2,))
    assert single.jumps(1).shape == (0, 2)


def test_arrays_are_copied_and_read_only():
    c, x = np.ones((2, 1)), np.array([0.0, 1.0])
    curve = PiecewisePolynomial(c, x)
    c[:] = 7.0
    x[:] = 7.0
    assert curve(1.0) == 2.0
    for array in (curve.c, curve.x, curve.derivative().c, curve.antiderivative().c):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize(
    ("c", "x", "options", "error", "says"),
    [
        ([[1j]], [0, 1], {}, InputError, "real numbers, not complex"),
        ([["a"]], [0, 1], {}, InputError, "real numbers"),
        ([1.0], [0, 1], {}, InputError, r"shape \(1,\)"),
        ([[1.0]], [0, 1], {"axis": 1}, InputError, "axis is 1"),
        ([[1.0]], [0, 1], {"axis": -1}, InputError, "axis is -1"),
        ([[1.0, 2.0]], [0, 1], {}, InputError, "2 breaks bound 1 pieces.* 2 pieces"),
        (np.empty((0, 1)), [0, 1], {}, InputError, "0 powers"),
        ([[1.0], [np.nan]], [0, 1], {}, InputError, r"coefficient \[1, 0\] is nan"),
        ([[1.0]], [0, 0], {}, WaypointDataError, "break 2 is 0 s; .* the previous break"),
        ([[1.0]], [0, np.inf], {}, WaypointDataError, "inf"),
        ([[1.0]], [0], {}, WaypointDataError, "at least two break times"),
        ([[1.0]], ["a", "b"], {}, WaypointDataError, "time must be numbers"),
    ],
)
def test_what_is_no_piecewise_polynomial_is_refused(c, x, options, error, says):
    with pytest.raises(error, match=says):
        PiecewisePolynomial(c, x, **options)


@pytest.mark.parametrize("nu", [-1, 0.5, "1", None, True, np.float64(1.0)])
def test_orders_are_whole_numbers(nu):
    curve, _ = random_pair(3, 2)
    for function in (
        lambda: curve(curve.x, nu),
        lambda: curve.jumps(nu),
        lambda: curve.extrema(nu),
    ):
        with pytest.raises(InputError, match="must be an integer"):
            function()
    if nu != -1:
        for function in (lambda: curve.derivative(nu), lambda: curve.antiderivative(nu)):
            with pytest.raises(InputError, match="must be an integer"):
                function()
    assert curve(curve.x, np.int64(1)).shape == (3,)


@pytest.mark.parametrize("t", ["0.5", 0.5j, [None]])
def test_times_are_real_numbers(t):
    curve, _ = random_pair(3, 2)
    with pytest.raises(InputError, match="times must be real"):
        curve(t)


# ---- extrema ------------------------------------------------------------------------------------


@pytest.mark.parametrize("leading_zeros", range(7))
@pytest.mark.parametrize("tiny", [0.0, 1e-300, 1e-30, 1e-17])
def test_extrema_with_vanishing_leading_coefficients(leading_zeros, tiny):
    c = np.concatenate((np.full(leading_zeros, tiny), [-1.0, 1.0, 0.25]))[:, None]
    found = PiecewisePolynomial(c, [0.0, 1.0]).extrema()
    assert found.maximum == pytest.approx(0.5, rel=1e-12)
    assert found.maximum_time == pytest.approx(0.5, rel=1e-7)
    assert found.minimum == pytest.approx(0.25, rel=1e-12)


@pytest.mark.parametrize("roots", [(0.3, 0.3), (0.3, 0.3, 0.3), (0.25, 0.25, 0.75), (0.5,) * 4])
@pytest.mark.parametrize("other", [(), (0.6,), (0.6, 0.6), (0.1, 0.9), (-1.0, 2.0)])
def test_extrema_where_the_slope_has_multiple_roots(roots, other):
    slope = Polynomial.fromroots([*roots, *other])
    polynomial = slope.integ()
    curve = PiecewisePolynomial(polynomial.coef[::-1][:, None], [0.0, 1.0])
    at = np.array([0.0, 1.0, *(r for r in (*roots, *other) if 0 <= r <= 1)])
    found = curve.extrema()
    rounding = 4 * EPS * np.abs(polynomial.coef).sum()
    assert found.maximum == pytest.approx(polynomial(at).max(), abs=rounding)
    assert found.minimum == pytest.approx(polynomial(at).min(), abs=rounding)
    assert curve(found.maximum_time) == pytest.approx(found.maximum, abs=2 * rounding)
    assert curve(found.minimum_time) == pytest.approx(found.minimum, abs=2 * rounding)


def test_both_sides_of_a_jump_count():
    curve = PiecewisePolynomial([[1.0, -1.0], [0.0, 5.0]], [0.0, 1.0, 2.0])
    found = curve.extrema()
    assert (found.minimum, found.minimum_time) == (0.0, 0.0)
    assert (found.maximum, found.maximum_time) == (5.0, 1.0)
    falling = PiecewisePolynomial([[7.0, 0.0], [0.0, 1.0]], [0.0, 1.0, 2.0]).extrema()
    assert (falling.maximum, falling.maximum_time) == (7.0, 1.0)


@examples(in_all=360)
@given(
    c=st.lists(
        st.floats(-1e3, 1e3).map(lambda v: v if abs(v) > 1e-6 else 0.0), min_size=1, max_size=9
    ),
    end=st.floats(1e-3, 1e2),
)
def test_extrema_of_any_polynomial_bound_its_samples(c, end):
    curve = PiecewisePolynomial(np.array(c)[:, None], [0.0, end])
    found = curve.extrema()
    values = curve(np.linspace(0.0, end, 2000))
    rounding = 8 * EPS * size(curve)
    assert found.maximum >= values.max() - rounding
    assert found.minimum <= values.min() + rounding
    # between samples the curve can exceed them by no more than its second derivative allows
    curvature = size(curve, 2) * (end / 1999) ** 2 / 8
    assert found.maximum <= values.max() + curvature + rounding
    assert found.minimum >= values.min() - curvature - rounding


def test_extrema_of_very_many_pieces_are_found_in_parts(monkeypatch):
    curve, _ = random_pair(3, 500, (3,))
    whole = curve.extrema()
    monkeypatch.setattr("knotwork.curves.polynomial.extrema.BLOCK_PIECES", 7)
    parts = curve.extrema()
    for name in ("minimum", "minimum_time", "maximum", "maximum_time"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


@pytest.mark.parametrize(("holds_ends", "outside"), [(True, [1, 0, 0]), (False, [5, 2, 0])])
def test_extended_curve_keeps_its_end_position_or_velocity(holds_ends, outside):
    parabola = ExtendedCurve(
        PiecewisePolynomial([[[1.0]], [[0.0]], [[0.0]]], [0, 1]), holds_ends=holds_ends
    )
    assert [parabola([3.0], nu).item() for nu in range(3)] == outside
    assert [parabola([0.5], nu).item() for nu in range(3)] == [0.25, 1, 2]
    assert parabola.between(2, 4)(3.0).item() == outside[0]
