"""Each planner against the linear system of its definition, solved densely."""

from __future__ import annotations

import numpy as np
import pytest
from planner_cases import COUNTS, DenseSpline, inside, random_waypoints
from scipy.interpolate import BPoly, CubicSpline

from knotwork.curves.interpolation import PlannerOptions, get_planner

COUNTS_DENSE = [n for n in COUNTS if n < 20]


def estimated_accelerations(waypoints):
    """The accelerations that `estimated` gives the waypoints."""
    return get_planner("quintic:estimated")(waypoints).acceleration(waypoints.time)


def assert_same(trajectory, dense, order=2, tolerance=1e-9):
    t = inside(trajectory.breaks)
    for nu in range(order + 1):
        expected = dense(t, nu)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(trajectory(t, nu), expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("n", COUNTS_DENSE)
@pytest.mark.parametrize(("name", "orders"), [("quintic", 3), ("septic", 4), ("nonic", 5)])
def test_high_degrees_meet_all_that_is_given_at_both_ends(name, orders, n):
    waypoints = random_waypoints(n)
    random = np.random.default_rng(n)
    a = random.normal(size=waypoints.position.shape)
    given = (waypoints.position, waypoints.velocity, a, 0 * a, 0 * a)[:orders]
    expected = BPoly.from_derivatives(waypoints.time, np.stack(given, axis=1))
    trajectory = get_planner(name)(waypoints, PlannerOptions(accelerations=a))
    assert trajectory.polynomial.degree == 2 * orders - 1
    assert_same(trajectory, expected, orders - 1)


@pytest.mark.parametrize("n", COUNTS)
def test_bspline_is_the_complete_cubic_spline(n):
    waypoints = random_waypoints(n)
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    expected = CubicSpline(t, y, bc_type=((1, v[0]), (1, v[-1])))
    trajectory = get_planner("bspline")(waypoints, PlannerOptions())
    assert_same(trajectory, expected, 3)


@pytest.mark.parametrize("n", COUNTS)
def test_bspline_velocity_is_the_cubic(n):
    waypoints = random_waypoints(n)
    trajectory = get_planner("bspline-velocity")(waypoints, PlannerOptions())
    cubic = get_planner("cubic")(waypoints, PlannerOptions())
    np.testing.assert_array_equal(trajectory.polynomial.c, cubic.polynomial.c)


@pytest.mark.parametrize("rule", ["estimated", "zero"])
@pytest.mark.parametrize("n", [2, 4, 5, 6, 9])
def test_353_is_cubic_quintics_cubic(n, rule):
    waypoints = random_waypoints(n)
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    middle = estimated_accelerations(waypoints) if rule == "estimated" else 0.0 * y
    dense = DenseSpline(t, [3] if n == 2 else [3, *[5] * (n - 3), 3])
    for i in range(n - 1):
        for end in (i, i + 1):
            dense.meet(i, t[end], 0, y[end])
            dense.meet(i, t[end], 1, v[end])
    for i in range(2, n - 2):
        for piece in (i - 1, i):
            dense.meet(piece, t[i], 2, middle[i])
    for i in (1, n - 2) if n > 2 else ():
        dense.rows.append(dense.row(i, t[i], 2) - dense.row(i - 1, t[i], 2))
        dense.values.append(np.zeros(3))
    dense.solve()
    trajectory = get_planner("3-5-3")(waypoints, PlannerOptions(accelerations=rule))
    assert_same(trajectory, dense)
    assert not trajectory.polynomial.c[:-4, [0, -1]].any()
    if rule == "estimated":
        default = get_planner("3-5-3")(waypoints, PlannerOptions())
        np.testing.assert_array_equal(default.polynomial.c, trajectory.polynomial.c)


@pytest.mark.parametrize("n", COUNTS_DENSE)
@pytest.mark.parametrize("ends", [None, (0.5, [-1.0, 2.0, 0.0])])
def test_434_is_quartic_cubics_quartic(n, ends):
    waypoints = random_waypoints(n)
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    dense = DenseSpline(t, [5] if n == 2 else [4, *[3] * (n - 3), 4])
    for i, row, acceleration in ((0, 0, ends and ends[0]), (n - 2, -1, ends and ends[1])):
        dense.meet(i, t[row], 0, y[row])
        dense.meet(i, t[row], 1, v[row])
        dense.meet(i, t[row], 2, np.broadcast_to(acceleration or 0.0, 3))
    for i in range(1, n - 1):
        dense.meet(i, t[i], 0, y[i])
    dense.join(2)
    dense.solve()
    trajectory = get_planner("4-3-4")(waypoints, PlannerOptions(end_acceleration=ends))
    assert_same(trajectory, dense)
    assert not trajectory.polynomial.c[:-4, 1:-1].any()


@pytest.mark.parametrize("n", COUNTS_DENSE)
def test_parabolic_blends_are_lines_joined_by_parabolas_centred_on_waypoints(n):
    waypoints = random_waypoints(n)
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    h = np.diff(t)
    times = np.minimum(np.append(h[0], h), np.append(h, h[-1])) / 3
    edges = [(a - T / 2, a + T / 2) for a, T in zip(t, times, strict=True)]
    edges[0], edges[-1] = (t[0], t[0] + times[0]), (t[-1] - times[-1], t[-1])
    breaks = np.ravel(edges)
    dense = DenseSpline(breaks, [*[2, 1] * (n - 1), 2])
    for piece, row in ((0, 0), (2 * n - 2, -1)):
        dense.meet(piece, t[row], 0, y[row])
        dense.meet(piece, t[row], 1, v[row])
    for i in range(1, n - 1):
        dense.meet(2 * i - 1, t[i], 0, y[i])
    dense.join(1)
    dense.solve()
    trajectory = get_planner("parabolic-blend")(waypoints, PlannerOptions())
    np.testing.assert_allclose(trajectory.breaks, breaks, atol=1e-12)
    assert_same(trajectory, dense)
    turn = trajectory.acceleration(t)[1:-1] * times[1:-1, None]
    miss = trajectory.position(t)[1:-1] - y[1:-1]
    np.testing.assert_allclose(miss, turn * times[1:-1, None] / 8, atol=1e-12)


@pytest.mark.parametrize("n", COUNTS_DENSE)
def test_trapezoids_start_and_stop_at_each_waypoint(n):
    waypoints = random_waypoints(n)
    t, y = waypoints.time, waypoints.position
    h = np.diff(t)
    breaks = np.append(np.ravel([t[:-1], t[:-1] + h / 3, t[:-1] + h * 2 / 3], order="F"), t[-1])
    trajectory = get_planner("trapezoidal")(waypoints, PlannerOptions())
    np.testing.assert_allclose(trajectory.breaks, breaks, atol=1e-12)
    for i in range(n - 1):
        part = DenseSpline(breaks[3 * i : 3 * i + 4], [2, 1, 2])
        for piece, row in ((0, i), (2, i + 1)):
            part.meet(piece, t[row], 0, y[row])
            part.meet(piece, t[row], 1, np.zeros(3))
        part.join(1)
        part.solve()
        times = inside(part.breaks)
        for nu in range(3):
            np.testing.assert_allclose(trajectory(times, nu), part(times, nu), atol=1e-9)


@pytest.mark.parametrize("n", [3, 5])
def test_estimated_accelerations_cost_the_neighbouring_quintics_least(n):
    """Against a search: no other acceleration at one waypoint has a smaller integral of a²."""
    waypoints = random_waypoints(n)
    estimate = estimated_accelerations(waypoints)
    cubic = get_planner("cubic")(waypoints, PlannerOptions()).polynomial
    nodes, weights = np.polynomial.legendre.leggauss(6)
    for i in range(n):
        costs = []
        steps = (-0.1, 0.0, 0.1)
        for step in steps:
            total = np.zeros(3)
            for k in range(max(i - 1, 0), min(i + 1, n - 1)):
                pair = waypoints.time[k : k + 2]
                h = pair[1] - pair[0]
                far = np.stack((2 * cubic.c[1, k], 6 * cubic.c[0, k] * h + 2 * cubic.c[1, k]))
                far[i - k] = estimate[i] + step
                given = waypoints.position[k : k + 2], waypoints.velocity[k : k + 2], far
                quintic = BPoly.from_derivatives(pair, np.stack(given, axis=1))
                a = quintic(pair[0] + h * (nodes + 1) / 2, 2)
                total += (weights[:, None] * a**2).sum(axis=0) * h / 2
            costs.append(total)
        assert (costs[1] < costs[0]).all()
        np.testing.assert_allclose(costs[0], costs[2], rtol=1e-8)
