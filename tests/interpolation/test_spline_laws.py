"""Laws that the interpolant must obey, whatever the waypoints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from knotwork.interpolation import BalancedKnots, ModifiedHermiteSpline
from sweeps import examples

RULES = [
    ("paper", None),
    ("paper", "zero"),
    ("balanced", None),
    (BalancedKnots(0.45), (1.5, -2.0)),
]
rules = pytest.mark.parametrize(("rule", "ends"), RULES, ids=str)

values = st.floats(-10, 10).map(lambda v: round(v, 3))


@st.composite
def waypoints(draw, minimum=2):
    h = draw(st.lists(st.floats(0.05, 5.0), min_size=minimum - 1, max_size=8))
    x = np.concatenate(([0.0], np.cumsum(h)))
    size = st.lists(values, min_size=len(x), max_size=len(x))
    return x, np.array(draw(size)), np.array(draw(size))


def scaled(ends, factor):
    if ends is None or isinstance(ends, str):
        return ends
    return tuple(factor * a for a in ends)


def size(spline, nu=0):
    """How large the nu-th derivative's terms are: what its rounding errors are relative to."""
    span = np.diff(spline.x)
    terms = np.abs(spline.c) * span ** np.arange(3, -1, -1)[:, None]
    return max(terms.max(), 1e-9) / span.min() ** nu


def same(a, b, scale, tolerance=1e-11):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * scale)


@rules
@examples(40)
@given(data=waypoints(), seed=st.integers(0, 1000))
def test_is_linear_in_the_data(rule, ends, data, seed):
    x, y, v = data
    rng = np.random.default_rng(seed)
    y2, v2, factor = rng.normal(size=x.size), rng.normal(size=x.size), rng.normal()
    options = {"knots": rule}
    first = ModifiedHermiteSpline(x, y, v, **options, end_acceleration=ends)
    second = ModifiedHermiteSpline(x, y2, v2, **options, end_acceleration=scaled(ends, 0.3))
    both = ModifiedHermiteSpline(
        x,
        y + factor * y2,
        v + factor * v2,
        **options,
        end_acceleration=scaled(ends, 1 + 0.3 * factor),
    )
    t = np.linspace(x[0], x[-1], 60)
    same(both(t), first(t) + factor * second(t), size(first) + abs(factor) * size(second))


@rules
@examples(40)
@given(data=waypoints(), shift=st.floats(-100, 100))
def test_shifting_time_shifts_the_curve(rule, ends, data, shift):
    x, y, v = data
    one = ModifiedHermiteSpline(x, y, v, knots=rule, end_acceleration=ends)
    other = ModifiedHermiteSpline(x + shift, y, v, knots=rule, end_acceleration=ends)
    # times of about 100 s are rounded to 1e-14 s, which changes the shortest intervals by 1e-12
    same(one.c[3], other.c[3], size(one))
    same(one.c[2], other.c[2], size(one, 1))


@rules
@examples(40)
@given(data=waypoints(), factor=st.sampled_from([0.125, 0.5, 4.0, 1024.0]))
def test_scaling_time_scales_velocities_and_accelerations(rule, ends, data, factor):
    x, y, v = data
    one = ModifiedHermiteSpline(x, y, v, knots=rule, end_acceleration=ends)
    other = ModifiedHermiteSpline(
        factor * x, y, v / factor, knots=rule, end_acceleration=scaled(ends, factor**-2)
    )
    for nu in range(3):
        same(one(one.x, nu), other(other.x, nu) * factor**nu, size(one, nu), 1e-13)


@rules
@examples(40)
@given(data=waypoints())
def test_time_reversed_data_give_the_time_reversed_curve(rule, ends, data):
    x, y, v = data
    one = ModifiedHermiteSpline(x, y, v, knots=rule, end_acceleration=ends)
    mirrored = ends if ends is None or isinstance(ends, str) else ends[::-1]
    other = ModifiedHermiteSpline(
        -x[::-1], y[::-1], -v[::-1], knots=rule, end_acceleration=mirrored
    )
    np.testing.assert_allclose(other.x, -one.x[::-1], atol=1e-14 * x[-1])
    for nu in range(3):
        same(one(one.x, nu), (-1) ** nu * other(other.x, nu)[::-1], size(one, nu))


@rules
@examples(40)
@given(data=waypoints(), cubic=st.lists(values, min_size=4, max_size=4))
def test_reproduces_any_single_cubic(rule, ends, data, cubic):
    x = data[0]
    polynomial = np.polynomial.Polynomial(cubic)
    velocity, acceleration = polynomial.deriv(), polynomial.deriv(2)
    asked = None if ends is None else (acceleration(x[0]), acceleration(x[-1]))
    spline = ModifiedHermiteSpline(
        x, polynomial(x), velocity(x), knots=rule, end_acceleration=asked
    )
    t = np.linspace(x[0], x[-1], 40)
    # the data themselves are rounded, and their size is that of the cubic's terms
    scale = max(1e-9, np.abs(np.array(cubic) * x[-1] ** np.arange(4)).max())
    shortest = np.diff(spline.x).min()
    for nu, exact in enumerate((polynomial, velocity, acceleration)):
        same(spline(t, nu), exact(t), scale / shortest**nu)


@pytest.mark.parametrize("rule", ["paper", "balanced"])
@examples(20)
@given(where=st.integers(25, 35), seed=st.integers(0, 1000))
def test_a_change_of_one_waypoint_is_felt_nearby_only(rule, where, seed):
    rng = np.random.default_rng(seed)
    x, y, v = np.arange(60.0), rng.normal(size=60), rng.normal(size=60)
    before = ModifiedHermiteSpline(x, y, v, knots=rule)
    y[where] += 1.0
    v[where] -= 1.0
    change = np.abs(ModifiedHermiteSpline(x, y, v, knots=rule)(x, 2) - before(x, 2))
    assert change[where] > 0.1
    assert change[: where - 15].max() <= 1e-14 * change.max()
    assert change[where + 16 :].max() <= 1e-14 * change.max()


def test_errors_shrink_by_12_587_a_waypoint_for_even_times():
    v = np.zeros(41)
    v[20] = 1.0
    change = np.abs(ModifiedHermiteSpline(np.arange(41.0), 0 * v, v)(np.arange(41.0), 2))
    ratios = change[23:29] / change[24:30]
    np.testing.assert_allclose(ratios, 12.587, atol=0.01)


@rules
def test_joints_do_not_influence_each_other(rule, ends):
    rng = np.random.default_rng(0)
    x, y, v = np.cumsum(rng.uniform(0.1, 2, 30)), *rng.normal(size=(2, 30, 4))
    together = ModifiedHermiteSpline(x, y, v, knots=rule, end_acceleration=ends)
    for joint in range(4):
        alone = ModifiedHermiteSpline(
            x, y[:, joint], v[:, joint], knots=rule, end_acceleration=ends
        )
        np.testing.assert_array_equal(alone.c, together.c[..., joint])
