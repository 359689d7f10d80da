from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_banded

from knotwork.interpolation.accelerations import Waypoints, interval_weights
from knotwork.interpolation.knots import place_knots
from knotwork.interpolation.tridiagonal import solve_tridiagonal
from sweeps import examples

EPS = np.finfo(float).eps


def dense(lower, diagonal, upper):
    return np.diag(diagonal) + np.diag(lower, -1) + np.diag(upper, 1)


@pytest.mark.parametrize("n", [*range(1, 20), 63, 64, 65, 1000])
def test_equals_lapack(n):
    rng = np.random.default_rng(n)
    lower, upper = -rng.uniform(0, 1, (2, n - 1))
    diagonal, rhs = rng.uniform(2, 3, n), rng.normal(size=(3, n))
    expected = solve_banded((1, 1), [np.append(0, upper), diagonal, np.append(lower, 0)], rhs.T).T
    solution = solve_tridiagonal(lower, diagonal, upper, rhs.copy())
    np.testing.assert_allclose(solution, expected, rtol=1e-12, atol=1e-13)


def test_without_right_hand_sides():
    assert solve_tridiagonal(-np.ones(4), 3 * np.ones(5), -np.ones(4), np.empty((0, 5))).shape == (
        0,
        5,
    )


def system_of_spline(x, fractions):
    """The matrix for two knots in every interval, end rows and columns left out."""
    h = np.diff(x)
    inner = np.stack((x[:-1] + fractions[0] * h, x[:-1] + fractions[1] * h), axis=1).ravel()
    knots = place_knots(x, np.concatenate((x[:1], inner, x[-1:])), doubled_ends=True)
    none = np.empty((0, x.size))
    weights = interval_weights(Waypoints(x, none, none, knots), 0, x.size - 1)
    after, before = weights.after_time, weights.before_time
    lower = -weights.before[0][1:-1] / before[1:-1]
    upper = -weights.after[1][1:-1] / after[1:-1]
    diagonal = (1 - weights.before[1][:-1]) / before[:-1] + (1 - weights.after[0][1:]) / after[1:]
    return lower, diagonal, upper


fractions = st.lists(st.floats(1e-6, 1 - 1e-6), min_size=2, max_size=2, unique=True).map(sorted)


@examples(150)
@given(
    intervals=st.lists(st.tuples(st.floats(1e-2, 1e2), fractions), min_size=3, max_size=9),
    seed=st.integers(0, 100),
)
def test_any_admissible_knots_give_an_m_matrix_solved_row_by_row(intervals, seed):
    x = np.concatenate(([0.0], np.cumsum([h for h, _ in intervals])))
    # the least gap that still leaves two different knots
    low = np.array([f[0] for _, f in intervals])
    high = np.maximum([f[1] for _, f in intervals], low + 1e-7)
    lower, diagonal, upper = system_of_spline(x, (low, high))
    assert (lower <= 0).all()
    assert (upper <= 0).all()
    assert (diagonal > 0).all()
    matrix = dense(lower, diagonal, upper)
    by_row = matrix / np.abs(matrix).max(axis=1, keepdims=True)
    # totally nonnegative with alternating signs; all leading minors positive
    signs = (-1.0) ** np.add.outer(np.arange(len(matrix)), np.arange(len(matrix)))
    assert (signs * by_row >= 0).all()
    ratio = lower * upper / (diagonal[:-1] * diagonal[1:])
    pivot = 1.0
    for product in ratio:
        pivot = 1.0 - product / pivot
        assert pivot > 0
    # and elimination without pivoting leaves a residual of a few roundings in every row
    rhs = np.random.default_rng(seed).normal(size=(2, len(matrix))) * np.abs(diagonal)
    solution = solve_tridiagonal(lower, diagonal, upper, rhs.copy())
    residual = np.abs(solution @ matrix.T - rhs)
    assert (residual <= 40 * EPS * (np.abs(solution) @ np.abs(matrix).T + np.abs(rhs))).all()


@pytest.mark.parametrize("sum_of_fractions", [0.51, 1.0, 1.49])
def test_rows_are_diagonally_dominant_between_half_and_three_halves(sum_of_fractions):
    rng = np.random.default_rng(0)
    x = np.concatenate(([0.0], np.cumsum(10 ** rng.uniform(-2, 2, 30))))
    low = np.full(30, 0.9 * sum_of_fractions / 2)
    high = sum_of_fractions - low
    lower, diagonal, upper = system_of_spline(x, (low, np.minimum(high, 0.999)))
    assert (diagonal[1:-1] > np.abs(lower[:-1]) + np.abs(upper[1:])).all()
