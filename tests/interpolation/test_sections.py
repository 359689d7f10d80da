"""Sections: waypoints whose acceleration is known divide the curve, which stays C2 and cubic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.errors import WaypointDataError
from sweeps import examples


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


def test_an_arm_that_waits_does_not_move_at_all():
    x = np.array([0.0, 1.0, 1.3, 3.0])
    y = np.array([[0.0], [0.7], [0.7], [2.0]])
    v, a = np.zeros((4, 1)), np.full((4, 1), np.nan)
    moves = ModifiedHermiteSpline(x, y, v, acceleration=a, knots="balanced")
    a[1:3] = 0.0
    waits = ModifiedHermiteSpline(x, y, v, acceleration=a, knots="balanced")
    t = np.linspace(1.0, 1.3, 1001)
    assert np.ptp(moves(t)) > 1e-3  # without the accelerations it does
    assert np.ptp(waits(t)) == 0.0


def test_no_known_acceleration_is_the_papers_curve_to_the_bit():
    x, y, v, a = data(6)
    plain = ModifiedHermiteSpline(x, y, v)
    same = ModifiedHermiteSpline(x, y, v, acceleration=np.full_like(a, np.nan))
    np.testing.assert_array_equal(plain.c, same.c)
    np.testing.assert_array_equal(plain.x, same.x)


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
    with pytest.raises(WaypointDataError, match="acceleration at waypoint 1 is known for some"):
        ModifiedHermiteSpline(x, y, v, acceleration=a)
    with pytest.raises(WaypointDataError, match="acceleration at 'on' is known for some joints"):
        kw.JointWaypoints(("a", "b"), x, y, v, names=("from", "on", "to"), acceleration=a)
    with pytest.raises(WaypointDataError, match="acceleration must have the shape of y"):
        ModifiedHermiteSpline(x, y, v, acceleration=a[:, :1])
    a[1] = np.inf
    with pytest.raises(WaypointDataError, match=r"acceleration\[1, 0\] is inf"):
        ModifiedHermiteSpline(x, y, v, acceleration=a)
