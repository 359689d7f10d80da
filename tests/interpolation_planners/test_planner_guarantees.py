"""What is promised of each planner, measured on its motions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planner_cases import random_waypoints

from judged import judged_joints
from knotwork.curves.interpolation import PLANNER_SPECS, PLANNERS, PlannerOptions, get_planner
from knotwork.errors import InputError
from knotwork.waypoints import JointWaypoints
from sweeps import examples

ALL_VELOCITIES = {
    *("modified-hermite", "cubic", "quintic", "septic", "nonic", "bspline-velocity", "3-5-3"),
}
END_VELOCITIES = ALL_VELOCITIES | {"parabolic-blend", "bspline", "4-3-4"}
ALL_POSITIONS = set(PLANNERS) - {"parabolic-blend"}


JUDGED = {"tolerances": {"joint_velocity": 1e-5}}
"""Since 1970 a rounding of the time moves a fast joint by this much [rad/s]."""


def unpromised(name):
    """Kinds of wrongs that the judge may find, since the planner says so."""
    kept = {"pose": name in ALL_POSITIONS, "velocity": name in ALL_VELOCITIES}
    kept["jump"] = PLANNER_SPECS[name].continuity >= 2
    return [kind for kind, keeps in kept.items() if not keeps]


def plan(name, waypoints, **options):
    return get_planner(name)(waypoints, PlannerOptions(**options))


def can(name, n):
    return not (name == "3-5-3" and n == 3)


def check_promises(name, waypoints, **options):
    trajectory = plan(name, waypoints, **options)
    record = PLANNER_SPECS[name]
    t, y, v = waypoints.time, waypoints.position, waypoints.velocity
    assert trajectory.planner == name
    np.testing.assert_array_equal(trajectory.waypoint_times, t)
    assert (trajectory.start_time, trajectory.end_time) == (t[0], t[-1])
    assert trajectory.polynomial.degree <= record.degree
    assert trajectory.continuity.order >= record.continuity
    at = slice(None) if name in ALL_POSITIONS else [0, -1]
    scale = np.abs(y).max()
    np.testing.assert_allclose(trajectory(t, 0)[at], y[at], rtol=0, atol=1e-10 * scale)
    speed = trajectory.extrema("velocity").peak.max()
    if name in END_VELOCITIES:
        at = slice(None) if name in ALL_VELOCITIES else [0, -1]
        np.testing.assert_allclose(trajectory(t, 1)[at], v[at], rtol=0, atol=1e-9 * speed)
    else:
        np.testing.assert_allclose(trajectory(t, 1), 0.0, rtol=0, atol=1e-9 * speed)
    assert not judged_joints(trajectory, waypoints, unpromised(name), **JUDGED)
    return trajectory


@examples(in_all=360)
@given(
    st.sampled_from(list(PLANNERS)),
    st.integers(2, 12),
    st.floats(1.0, 100.0),
    st.integers(0, 10**6),
)
def test_promises_hold_for_uneven_times(name, n, ratio, seed):
    if can(name, n):
        check_promises(name, random_waypoints(n, seed, joints=2, ratio=ratio))


@pytest.mark.parametrize("name", PLANNERS)
def test_it_is_no_smoother_than_it_says(name):
    trajectory = plan(name, random_waypoints(9))
    assert trajectory.continuity.order == PLANNER_SPECS[name].continuity
    assert trajectory.polynomial.degree == {"4-3-4": 4}.get(name, PLANNER_SPECS[name].degree)


@pytest.mark.parametrize("name", PLANNERS)
def test_promises_hold_at_the_time_of_day(name):
    """Times in seconds since 1970 are resolved to a quarter of a microsecond."""
    case = random_waypoints(9)
    later = JointWaypoints(
        case.joint_names, np.round(case.time, 3) + 1.7e9, case.position, case.velocity
    )
    check_promises(name, later)


@pytest.mark.parametrize("name", sorted(set(PLANNERS) - ALL_VELOCITIES))
def test_what_can_not_be_met_is_missed(name):
    waypoints = random_waypoints(6)
    trajectory = plan(name, waypoints)
    assert np.abs(trajectory.velocity(waypoints.time) - waypoints.velocity)[1:-1].min() > 1e-5
    miss = np.abs(trajectory.position(waypoints.time) - waypoints.position)[1:-1]
    assert miss.min() > 1e-4 if name == "parabolic-blend" else miss.max() < 1e-12


@pytest.mark.parametrize("name", PLANNERS)
def test_values_out_of_range_are_an_error_and_no_nan(name):
    waypoints = JointWaypoints(
        ("a",), [0.0, 1e-200, 2e-200, 3e-200], [[0.0], [1e200], [-1e200], [0.0]], np.ones((4, 1))
    )
    with pytest.raises(InputError, match=r"floating-point|finite|short|resol"):
        plan(name, waypoints)
