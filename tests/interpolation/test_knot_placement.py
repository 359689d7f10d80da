"""Where knots lie, and sections between waypoints whose acceleration is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.curves.interpolation import BalancedKnots, ModifiedHermiteSpline
from knotwork.errors import InputError, KnotError, WaypointDataError
from sweeps import examples

X = np.array([0.0, 5.0, 15.0, 25.0])


def placed(x, rule="paper", doubled_ends=False):
    """Knot times of a spline through waypoints at x."""
    still = np.zeros(len(x))
    ends = "zero" if doubled_ends else None
    return ModifiedHermiteSpline(x, still, still, knots=rule, end_acceleration=ends).x


def test_balanced_reaches_as_far_as_the_nearer_neighbour_allows():
    t = placed(X, BalancedKnots(0.2))
    np.testing.assert_allclose(t, [0, 4, 6, 13, 17, 25])
    t = placed(X, "balanced", doubled_ends=True)
    np.testing.assert_allclose(t, [0, 1, 4, 6, 13, 17, 23, 25])
    np.testing.assert_allclose(placed([0, 4], "balanced", True), [0, 0.8, 3.2, 4])


@pytest.mark.parametrize("c", [0.0, -0.1, 0.5000001, np.nan, np.inf, "a", None])
def test_balanced_constant_out_of_bounds(c):
    with pytest.raises(InputError, match=r"must be in \(0, 0.5\]"):
        BalancedKnots(c)


def test_balanced_knots_must_not_coincide():
    # the interval in the middle is no longer than both its neighbours: 0.5 reaches its middle
    with pytest.raises(KnotError, match="coincide between waypoints 2 and 3") as caught:
        placed([0, 2, 3, 5], BalancedKnots(0.5))
    assert caught.value.waypoint_index == 1
    # beside a shorter neighbour it does not, and an end interval has one knot only
    assert (np.diff(placed(X, BalancedKnots(0.5))) > 0).all()
    assert (np.diff(placed([0, 1, 2], BalancedKnots(0.5))) > 0).all()
    for x in ([0, 1], [0, 1, 2]):
        with pytest.raises(KnotError, match="coincide between waypoints 1 and 2"):
            placed(x, BalancedKnots(0.5), doubled_ends=True)


@pytest.mark.parametrize("doubled_ends", [False, True])
@pytest.mark.parametrize("rule", ["paper", BalancedKnots(0.49), BalancedKnots(1e-6)], ids=str)
@examples(in_all=360)
@given(h=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=12))
def test_each_waypoint_lies_between_its_knots(rule, doubled_ends, h):
    x = np.concatenate(([0.0], np.cumsum(h)))
    knots = placed(x, rule, doubled_ends)
    n = len(x)
    assert len(knots) == (2 * n if doubled_ends else 2 * n - 2)
    assert (np.diff(knots) > 0).all()
    assert knots[0] == x[0]
    assert knots[-1] == x[-1]
    inner = knots[2:-2] if doubled_ends else knots[1:-1]
    assert (inner[0::2] < x[1:-1]).all()
    assert (x[1:-1] < inner[1::2]).all()


@pytest.mark.parametrize(
    ("knots", "waypoint", "interval"),
    [
        ([0, 5.5, 8, 13, 19, 25], 0, (0, 5)),
        ([0, 5, 8, 13, 19, 25], 0, (0, 5)),
        ([0, -1, 8, 13, 19, 25], 0, (0, 5)),
        ([0, 3, 5, 13, 19, 25], 1, (5, 15)),
        ([0, 3, 15, 13, 19, 25], 1, (5, 15)),
        ([0, 3, 8, 8, 19, 25], 1, (5, 15)),
        ([0, 3, 13, 8, 19, 25], 1, (5, 15)),
        ([0, 3, 8, 13, 15, 25], 2, (15, 25)),
        ([0, 3, 8, 13, 25, 25], 2, (15, 25)),
    ],
)
def test_misplaced_knots_name_their_interval(knots, waypoint, interval):
    with pytest.raises(KnotError, match="strictly between") as caught:
        placed(X, knots)
    assert (caught.value.waypoint_index, caught.value.interval) == (waypoint, interval)


@pytest.mark.parametrize(
    ("knots", "doubled_ends"),
    [([0, 3, 8, 19, 25], False), ([0, 3, 8, 13, 17, 19, 25], False), ([0, 3, 8, 13, 19, 25], True)],
)
def test_wrong_count_of_knots(knots, doubled_ends):
    needed = "8 knots .2n, because end acc" if doubled_ends else r"6 knots .2n - 2\)"
    with pytest.raises(KnotError, match=f"4 waypoints need {needed}.*{len(knots)} are"):
        placed(X, knots, doubled_ends)


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        ([0.1, 3, 8, 13, 19, 25], "first knot is 0.1.*waypoint 1, 0 s"),
        ([0, 3, 8, 13, 19, 24], "last knot is 24 s.*waypoint 4, 25 s"),
        ([0, 3, np.nan, 13, 19, 25], "knot 3 is nan"),
        ([[0, 3]], r"one dimension, not shape \(1, 2\)"),
        (3.0, "one dimension"),
        ([], "0 are given"),
        ([0, "a", 25], "must be a rule or times"),
    ],
)
def test_knots_that_are_no_knots(knots, says):
    with pytest.raises(KnotError, match=says):
        placed(X, knots)


def test_a_spline_takes_knots_a_rounding_away_from_its_waypoints():
    near = [0, np.nextafter(5, 0), np.nextafter(5, 9), np.nextafter(15, 0), 19, 25]
    spline = ModifiedHermiteSpline(X, [0, 30, 90, 180], [0, 8, 8, 0], knots=near)
    np.testing.assert_allclose(spline(X), [0, 30, 90, 180], rtol=1e-13)
    np.testing.assert_allclose(spline(X, 1), [0, 8, 8, 0], atol=1e-12)
    assert np.abs(spline.jumps(2)).max() <= 1e-13 * np.abs(spline(spline.x, 2)).max()


def data(n, seed=0, ratio=10.0, d=2):
    rng = np.random.default_rng([seed, n])
    x = np.cumsum(ratio ** rng.uniform(0, 1, n))
    return x, *rng.normal(size=(3, n, d))


def with_cuts(a, cuts):
    known = np.full_like(a, np.nan)
    known[cuts] = a[cuts]
    return known


def scale(spline, nu):
    return np.abs(spline(spline.x, nu)).max() + 1e-300


def assert_meets_and_is_c2(spline, x, y, v, a):
    known = ~np.isnan(a).any(axis=1)
    for nu, wanted in ((0, y), (1, v)):
        np.testing.assert_allclose(spline(x, nu), wanted, atol=1e-11 * scale(spline, nu))
    np.testing.assert_allclose(spline(x[known], 2), a[known], atol=1e-11 * scale(spline, 2))
    for nu in range(3):
        assert np.abs(spline.jumps(nu)).max(initial=0.0) <= 1e-11 * scale(spline, nu)
    assert spline.c.shape[0] == 4


@examples()
@given(
    n=st.integers(2, 9),
    seed=st.integers(0, 1000),
    ratio=st.sampled_from([1.0, 10.0, 1e3]),
    chosen=st.lists(st.booleans(), min_size=9, max_size=9),
    rule=st.sampled_from(["paper", "balanced"]),
)
def test_any_choice_of_known_accelerations_is_met(n, seed, ratio, chosen, rule):
    x, y, v, a = data(n, seed, ratio)
    cuts = np.flatnonzero(chosen[:n])
    known = with_cuts(a, cuts)
    spline = ModifiedHermiteSpline(x, y, v, acceleration=known, knots=rule)
    assert_meets_and_is_c2(spline, x, y, v, known)
    assert len(spline.x) == 2 * n - 2 + len(cuts)
    assert set(x[cuts]) <= set(spline.x)


@pytest.mark.parametrize("rule", ["paper", "balanced"])
def test_each_section_is_the_spline_of_its_own_waypoints(rule):
    x, y, v, a = data(9)
    whole = ModifiedHermiteSpline(x, y, v, acceleration=with_cuts(a, [0, 3, 8]), knots=rule)
    for low, high in ((0, 3), (3, 8)):
        part = slice(low, high + 1)
        ends = a[low], a[high]
        alone = ModifiedHermiteSpline(x[part], y[part], v[part], knots=rule, end_acceleration=ends)
        t = np.linspace(x[low], x[high], 301)
        for nu in range(3):
            np.testing.assert_allclose(whole(t, nu), alone(t, nu), atol=1e-10 * scale(whole, nu))


@pytest.mark.parametrize("planner", ["modified-hermite", "quintic", "septic", "nonic", "3-5-3"])
def test_planners_meet_known_accelerations(planner):
    x, y, v, a = data(8)
    waypoints = kw.JointWaypoints(("a", "b"), x, y, v, acceleration=with_cuts(a, [3, 4]))
    motion = kw.interpolation.get_planner(planner)(waypoints)
    np.testing.assert_allclose(motion.acceleration(x[3:5]), a[3:5], atol=1e-9)
    other = kw.interpolation.get_planner(planner)(kw.JointWaypoints(("a", "b"), x, y, v))
    assert np.abs(other.acceleration(x[3:5]) - a[3:5]).max() > 1e-3


def test_an_acceleration_known_for_some_joints_only_is_refused():
    x, y, v, a = data(3)
    a[1, 0] = np.nan
    with pytest.raises(WaypointDataError, match="acceleration at waypoint 2 is known for some"):
        ModifiedHermiteSpline(x, y, v, acceleration=a)
    with pytest.raises(WaypointDataError, match="acceleration at waypoint 'on' is known for"):
        kw.JointWaypoints(("a", "b"), x, y, v, names=("from", "on", "to"), acceleration=a)
    with pytest.raises(WaypointDataError, match="acceleration must have the shape of y"):
        ModifiedHermiteSpline(x, y, v, acceleration=a[:, :1])
    a[1] = np.inf
    with pytest.raises(WaypointDataError, match=r"acceleration\[1, 0\] is inf"):
        ModifiedHermiteSpline(x, y, v, acceleration=a)
