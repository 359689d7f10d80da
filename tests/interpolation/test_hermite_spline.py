"""The spline against independent formulations, for thousands of random cases, too.

Each grid of waypoints carries four joints whose positions and velocities are of independent sizes
from 1e-3 to 1e3: 860 grids with three knot rules are 10,320 cases, of which `make test` tries a
tenth. No other C² cubic on the same knots has these positions, velocities and end accelerations.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from spline_reference import exact_pieces

from knotwork.curves.interpolation import BalancedKnots, ModifiedHermiteSpline
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError, OptionError, WaypointDataError
from sweeps import first_of, mostly_exhaustive


def waypoints(n, d=3, seed=0, ratio=10.0):
    rng = np.random.default_rng([seed, n])
    x = rng.uniform(-5, 5) + np.concatenate(([0.0], np.cumsum(ratio ** rng.uniform(0, 1, n - 1))))
    return x, rng.normal(size=(n, d)), rng.normal(size=(n, d))


def knots_between(x, before, after, doubled_ends):
    """Knots at fractions `after` and 1 - `before` of each interval, but for single ones."""
    h = np.diff(x)
    right, left = x[:-1] + after * h, x[1:] - before * h
    inner = np.stack((right, left), axis=1).ravel()
    if not doubled_ends:
        inner = inner[1:-1]
    return np.concatenate((x[:1], inner, x[-1:]))


@pytest.mark.parametrize("ends", [None, (0.3, -2.0)], ids=["free", "given"])
@pytest.mark.parametrize("n", [3, 4])
@pytest.mark.parametrize("margin", mostly_exhaustive([1e-3, 1e-6, 1e-9], 1e-9))
def test_equals_rational_arithmetic_for_extreme_knots(margin, n, ends):
    """Knots by hand, as little as a billionth of an interval from the edge of what is allowed."""
    rng = np.random.default_rng(n)
    x = np.concatenate(([0.0], np.cumsum([3.0, 0.01, 2.0][: n - 1])))
    y, v = rng.normal(size=n), rng.normal(size=n)
    corners = [
        (margin, margin),
        (margin, 1 - 2 * margin),
        (1 - 2 * margin, margin),
        (0.3, 0.7 - margin),
        (0.3, margin),
    ]
    for _ in range(6):
        before, after = np.array(corners)[rng.integers(len(corners), size=n - 1)].T
        t = knots_between(x, before, after, ends is not None)
        spline = ModifiedHermiteSpline(x, y, v, knots=t, end_acceleration=ends)
        exact = exact_pieces(x, y, v, t, ends)
        # how far each coefficient moves its own piece, against how far they move any
        powers = np.diff(t) ** np.arange(3, -1, -1)[:, None]
        assert np.abs((spline.c - exact) * powers).max() <= 1e-14 * np.abs(exact * powers).max()
        assert np.abs(spline.c[1] - exact[1]).max() <= 1e-14 * np.abs(exact[1]).max()


@pytest.mark.parametrize(
    ("shape", "axis"),
    [((), 0), ((2,), 0), ((2,), 1), ((2,), -1), ((2, 3), 0), ((2, 3), 1), ((2, 3), 2), ((0,), 0)],
)
@pytest.mark.parametrize("ends", [None, "zero"])
def test_shapes_and_axis_are_those_of_scipy(shape, axis, ends):
    rng = np.random.default_rng(0)
    full = list(shape)
    full.insert(axis if axis >= 0 else len(shape) + 1 + axis, 5)
    x, y, v = np.arange(5.0), rng.normal(size=full), rng.normal(size=full)
    ours = ModifiedHermiteSpline(x, y, v, axis=axis, end_acceleration=ends)
    theirs = CubicHermiteSpline(
        ours.x, ours(ours.x), ours(ours.x, 1), axis=axis if axis >= 0 else y.ndim + axis
    )
    assert ours.axis == theirs.axis
    assert ours.c.shape == theirs.c.shape
    c = np.moveaxis(ours.c, (0, 1), (ours.axis, ours.axis + 1))
    np.testing.assert_array_equal(PiecewisePolynomial(c, ours.x, axis=ours.axis)(x), ours(x))
    assert ours.waypoint_acceleration.shape == y.shape
    for t in (2.3, [0.0, 4.0], np.linspace(0, 4, 6).reshape(2, 3), np.empty(0)):
        for nu in range(5):
            assert ours(t, nu).shape == theirs(t, nu).shape
            np.testing.assert_allclose(ours(t, nu), theirs(t, nu), atol=1e-10)
    np.testing.assert_allclose(ours(x), y, atol=1e-13)
    np.testing.assert_allclose(ours.derivative()(x), v, atol=1e-13)
    np.testing.assert_allclose(ours(x, 2), ours.waypoint_acceleration, atol=1e-12)
    np.testing.assert_allclose(ours.antiderivative()(x), theirs.antiderivative()(x), atol=1e-12)


def test_data_may_be_of_any_memory_layout_and_number_type():
    x, y, v = waypoints(9)
    expected = ModifiedHermiteSpline(x, y, v)
    for other in (np.asfortranarray(y), y.tolist(), np.repeat(y, 2, axis=0)[::2]):
        np.testing.assert_array_equal(ModifiedHermiteSpline(x, other, v).c, expected.c)
    whole = ModifiedHermiteSpline([0, 1, 3], [1, 2, 3], [0, 0, 0], end_acceleration=(0, 1))
    assert whole.c.dtype == float


def test_inputs_are_copied_and_arrays_read_only():
    x, y, v = waypoints(6)
    spline = ModifiedHermiteSpline(x, y, v)
    before = spline(x[2])
    x += 1.0
    y += 1.0
    np.testing.assert_array_equal(spline(x[2] - 1.0), before)
    for array in (spline.x, spline.c, spline.waypoint_times, spline.waypoint_acceleration):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


GOOD = ([0.0, 1.0, 2.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("data", "options", "error", "says"),
    [
        (([0.0], [0.0], [0.0]), {}, WaypointDataError, r"at least two.*\(1,\)"),
        (([0, 1, 1], *GOOD[1:]), {}, WaypointDataError, "waypoint 3 is 1 s.*later than 1 s"),
        (([0, 1, np.nan], *GOOD[1:]), {}, WaypointDataError, "nan"),
        (([0, 1, 2j], *GOOD[1:]), {}, WaypointDataError, "x must be real.*complex"),
        (([[0, 1, 2]], *GOOD[1:]), {}, WaypointDataError, "one dimension"),
        ((GOOD[0], [0, np.inf, 0], GOOD[2]), {}, WaypointDataError, r"y\[1\] is inf"),
        ((GOOD[0], GOOD[1], [0, 0, np.nan]), {}, WaypointDataError, r"dydx\[2\] is nan"),
        ((GOOD[0], [0, 1j, 0], GOOD[2]), {}, WaypointDataError, "y must be real.*complex"),
        ((GOOD[0], ["a", "b", "c"], GOOD[2]), {}, WaypointDataError, "y must be real"),
        ((GOOD[0], [0, 1], GOOD[2]), {}, WaypointDataError, "length 2.*3 times"),
        ((GOOD[0], GOOD[1], [0, 0, 0, 0]), {}, WaypointDataError, "length 4.*3 times"),
        (
            (GOOD[0], np.zeros((3, 2)), np.zeros((3, 1))),
            {},
            WaypointDataError,
            r"\(3, 2\) and \(3, 1\)",
        ),
        (GOOD, {"axis": 1}, WaypointDataError, "no axis 1"),
        (GOOD, {"end_acceleration": "one"}, OptionError, "'one'.*zero"),
        (GOOD, {"end_acceleration": 1.0}, InputError, r"pair \(start, end\)"),
        (GOOD, {"end_acceleration": (1.0, [1.0, 2.0])}, OptionError, r"has the end \[1.0, 2.0\]"),
        (GOOD, {"end_acceleration": (np.nan, 0.0)}, InputError, "start.*finite"),
        (([0, 1e-200, 1], *GOOD[1:]), {}, InputError, "waypoint.*range of floating-point"),
    ],
)
def test_bad_data_are_refused(data, options, error, says):
    with pytest.raises(error, match=says):
        ModifiedHermiteSpline(*data, **options)


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6])
@pytest.mark.parametrize(("rule", "growth"), [("paper", 1.0), ("balanced", 0.0)])
def test_rounding_grows_with_uneven_times_by_the_stated_bound(rule, growth, ratio):
    """Smooth data at times of which neighbours are closer by the ratio."""
    rng = np.random.default_rng(8)
    for _ in range(40):
        n = int(rng.integers(3, 10))
        h = np.where(rng.random(n - 1) < 0.5, 1.0, 1.0 / ratio)
        h[rng.integers(n - 1)] = 1.0 / ratio
        x = np.concatenate(([0.0], np.cumsum(h)))
        y, v = np.sin(x), np.cos(x) + 1e-3 * rng.normal(size=n)
        spline = ModifiedHermiteSpline(x, y, v, knots=rule)
        for nu in range(2):
            allowed = 1e-14 + growth * 1e-15 * ratio
            assert np.abs(spline.jumps(nu)).max() <= allowed * spline.extrema(nu).peak


GRIDS = 860  # in all, over four seeds
JOINTS = 4
EPS = np.finfo(float).eps


def random_grid(rng):
    """Times with interval ratios up to 1000:1, anywhere; positions and velocities of any size."""
    n = int(rng.integers(2, 51))
    ratio = 10 ** rng.uniform(0, 3)
    h = 10 ** rng.uniform(-2, 1) * ratio ** rng.uniform(0, 1, n - 1)
    x = rng.choice([0.0, 100.0]) * rng.uniform() + np.concatenate(([0.0], np.cumsum(h)))
    y, v = (10 ** rng.uniform(-3, 3, JOINTS) * rng.normal(size=(n, JOINTS)) for _ in range(2))
    return x, y, v


def largest(values):
    return np.abs(values).max(axis=0)


def cases(seed, grids):
    rng = np.random.default_rng(seed)
    for _ in range(grids):
        x, y, v = random_grid(rng)
        for rule in ("paper", "balanced", "by hand"):
            ends = [None, "zero", rng.normal(size=(2, JOINTS))][int(rng.integers(3))]
            knots = rule
            if rule == "by hand":
                low, high = np.sort(rng.uniform(0.05, 0.95, (2, len(x) - 1)), axis=0)
                before = 1 - np.maximum(high, low + 0.02)
                knots = knots_between(x, before, low, ends is not None)
            elif rule == "balanced":
                knots = BalancedKnots(rng.choice([0.05, 0.2, 0.45]))
            yield x, y, v, knots, ends


@pytest.mark.parametrize("grids", first_of(GRIDS // 40, GRIDS // 4))
@pytest.mark.parametrize("seed", range(4))
def test_ten_thousand_random_cases(seed, grids):
    for x, y, v, knots, ends in cases(seed, grids):
        spline = ModifiedHermiteSpline(x, y, v, knots=knots, end_acceleration=ends)
        h = np.diff(x)[:, None]
        assert len(spline.x) == (2 * len(x) if ends is not None else 2 * len(x) - 2)
        assert (np.diff(spline.x) > 0).all()

        position_scale = np.maximum(largest(y), largest(np.maximum(abs(v[1:]), abs(v[:-1])) * h))
        velocity_scale = np.maximum(largest(v), largest(np.diff(y, axis=0) / h))
        # beside a much shorter neighbour a curve on arbitrary knots can swing out to more than
        # 1e5 times its data; no polynomial with such values holds the data to better than this
        swing = largest(spline(spline.x)), largest(spline(spline.x, 1))
        bound = np.maximum(1e-10 * position_scale, 8 * EPS * swing[0])
        assert (largest(spline(x) - y) <= bound).all()
        bound = np.maximum(1e-9 * velocity_scale, 8 * EPS * swing[1])
        assert (largest(spline(x, 1) - v) <= bound).all()
        if not isinstance(knots, np.ndarray):
            assert (largest(spline(x) - y) <= 1e-10 * position_scale).all()
            assert (largest(spline(x, 1) - v) <= 1e-9 * velocity_scale).all()

        if len(spline.x) > 2:
            for nu, tolerance in ((0, 1e-11), (1, 1e-12), (2, 1e-13)):
                jumps = largest(spline.jumps(nu))
                assert (jumps <= tolerance * largest(spline(spline.x, nu))).all()
        exact = None if ends is None else np.zeros((2, JOINTS)) if isinstance(ends, str) else ends
        if exact is not None:
            reached = spline(x[[0, -1]], 2)
            peak = largest(spline(spline.x, 2))
            assert (largest(reached - exact) <= 1e-13 * peak).all()
