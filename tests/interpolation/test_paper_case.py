"""The paper's case study, section 5: every printed digit, and the misprints among them.

Also its equations (30), (31) and (34) as the text has them from which this was written. That text
was extracted from the published PDF and may have lost what the print has.
"""

from __future__ import annotations

import numpy as np
import pytest
from spline_reference import knots_of_paper, paper_system

from knotwork.curves.interpolation import ModifiedHermiteSpline

X, Y, DYDX = [0.0, 5.0, 15.0, 25.0], [0.0, 30.0, 90.0, 180.0], [0.0, 8.0, 8.0, 0.0]
ROUNDED_KNOTS = [0.0, 3.0, 8.0, 13.0, 19.0, 25.0]

EQ_40 = np.array(
    [
        [-0.4, -0.225, 0, 0, 2, 0.375, 0, 0],
        [0.3, 0, -0.3, 0, 0.5, 2, 0.5, 0],
        [0, 0.327, -0.1, -0.227, 0, 0.546, 2, 0.455],
        [0, 0, 0.25, 0, 0, 0, 0.5, 2],
        [0.648, 0.352, 0, 0, 0.72, -0.48, 0, 0],
        [-0.288, 0.288, 0, 0, -0.12, -0.32, 0, 0],
        [0, 0, 0.741, 0.259, 0, 0, 0.889, -0.444],
        [0, 0, -0.222, 0.222, 0, 0, 0, -0.333],
    ]
)
EQ_40_RIGHT = np.array([0, 0, 0, 45, 30, 8, 90, 8])
EQS_41_TO_45 = [
    [0.0, 0.0, 2.221, -0.214],
    [-4.142, 4.142, 0.84, -0.061],
    [-76.069, 31.115, -2.531, 0.08],
    [125.677, -15.442, 1.05, -0.012],
    [1057.847, -162.627, 8.796, -0.148],
]


@pytest.fixture(scope="module")
def curve():
    return ModifiedHermiteSpline(X, Y, DYDX, knots=ROUNDED_KNOTS)


def in_global_time(curve, piece):
    """Coefficients of a piece in t itself, lowest power first, as the paper prints them."""
    local = np.poly1d(curve.c[:, piece])(np.poly1d([1.0, -curve.x[piece]]))
    return np.concatenate((np.zeros(4 - len(local.c)), local.c))[::-1]


def test_equation_39_gives_the_knots_before_rounding():
    spline = ModifiedHermiteSpline(X, Y, DYDX)
    np.testing.assert_allclose(spline.x, [0, 3.09, 7.5, 12.5, 18.82, 25], rtol=1e-15)
    np.testing.assert_allclose(spline.x, knots_of_paper(X), rtol=1e-15)


def test_equation_40_is_the_system_of_the_corrected_forms():
    matrix, right = paper_system(X, Y, DYDX, ROUNDED_KNOTS)
    others = np.ones_like(EQ_40, dtype=bool)
    others[2, 5] = False  # misprinted; see below
    np.testing.assert_array_equal(np.round(matrix, 3)[others], EQ_40[others])
    np.testing.assert_allclose(right, EQ_40_RIGHT, atol=1e-12)


def test_equation_40_misprints_6_over_11():
    matrix, _ = paper_system(X, Y, DYDX, ROUNDED_KNOTS)
    assert matrix[2, 5] == pytest.approx(6 / 11, rel=1e-15)
    assert round(6 / 11, 3) == 0.545
    assert EQ_40[2, 5] == 0.546


@pytest.mark.parametrize(
    ("knot", "position", "velocity"),
    [
        (0.0, 0.0, 0.0),
        (3.0, 14.21, None),
        (8.0, None, 5.952),
        (13.0, 76.147, 5.805),
        (19.0, 129.443, 11.53),
        (25.0, 180.0, 0.0),
    ],
)
def test_table_2(curve, knot, position, velocity):
    if position is not None:
        assert round(float(curve(knot)), 3) == position
    if velocity is not None:
        assert round(float(curve(knot, 1)), 3) == velocity


@pytest.mark.parametrize("piece", range(5))
def test_equations_41_to_45(curve, piece):
    assert np.round(in_global_time(curve, piece), 3).tolist() == pytest.approx(
        EQS_41_TO_45[piece], abs=1e-12
    )


@pytest.mark.parametrize(
    ("knot", "position", "velocity", "acceleration"),
    [
        (3.0, 14.21, 7.55, 0.59),
        (8.0, 51.75, None, -1.23),
        (13.0, 76.15, 5.81, 1.17),
        (19.0, 129.44, 11.53, 0.74),
    ],
)
def test_table_4_from_both_sides(curve, knot, position, velocity, acceleration):
    i = ROUNDED_KNOTS.index(knot)
    for piece, u in ((i - 1, knot - ROUNDED_KNOTS[i - 1]), (i, 0.0)):
        polynomial = np.poly1d(curve.c[:, piece])
        assert round(float(polynomial(u)), 2) == position
        if velocity is not None:
            assert round(float(polynomial.deriv()(u)), 2) == velocity
        assert round(float(polynomial.deriv(2)(u)), 2) == acceleration


def test_start_is_a_step_of_acceleration(curve):
    assert float(curve(0.0, 2)) == pytest.approx(4.4418, abs=5e-5)
