from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from knotwork.errors import InputError, KnotError, UnknownNameError
from knotwork.interpolation import (
    PLANNERS,
    BalancedKnots,
    ModifiedHermiteSpline,
    PlannerOptions,
    get_planner,
)
from knotwork.waypoints import JointWaypoints


@pytest.fixture
def waypoints():
    return JointWaypoints(
        ("shoulder", "rail"),
        [0.0, 5.0, 15.0, 25.0],
        [[0.0, 0.1], [0.5, 0.3], [1.5, 0.2], [3.0, 0.4]],
        [[0.0, 0.0], [0.14, -0.1], [0.14, 0.05], [0.0, 0.0]],
        joint_units=("rad", "m"),
    )


def test_planners_are_found_by_name():
    assert set(PLANNERS) >= {"modified-hermite", "cubic"}
    for name, planner in PLANNERS.items():
        assert get_planner(name) is planner
    with pytest.raises(UnknownNameError, match="did you mean 'modified-hermite'") as caught:
        get_planner("modified-hermit")
    assert caught.value.available == tuple(PLANNERS)


@pytest.mark.parametrize("name", ["modified-hermite", "cubic"])
def test_planners_through_positions_and_velocities_meet_both(name, waypoints):
    trajectory = get_planner(name)(waypoints, PlannerOptions())
    assert trajectory.planner == name
    assert trajectory.joint_names == waypoints.joint_names
    assert trajectory.joint_units == waypoints.joint_units
    np.testing.assert_array_equal(trajectory.waypoint_times, waypoints.time)
    np.testing.assert_allclose(trajectory.position(waypoints.time), waypoints.position, atol=1e-14)
    np.testing.assert_allclose(trajectory.velocity(waypoints.time), waypoints.velocity, atol=1e-14)


def test_modified_hermite_supports_all_options(waypoints):
    plan = get_planner("modified-hermite")
    assert plan(waypoints, PlannerOptions()).continuity.order == 2
    options = PlannerOptions(knots=BalancedKnots(0.3), end_acceleration=(0.1, [0.2, -0.3]))
    trajectory = plan(waypoints, options)
    expected = ModifiedHermiteSpline(
        waypoints.time,
        waypoints.position,
        waypoints.velocity,
        knots=BalancedKnots(0.3),
        end_acceleration=(0.1, [0.2, -0.3]),
    )
    np.testing.assert_array_equal(trajectory.polynomial.c, expected.c)
    np.testing.assert_allclose(trajectory.acceleration(0.0), 0.1, atol=1e-15)
    np.testing.assert_allclose(trajectory.acceleration(25.0), [0.2, -0.3], atol=1e-14)
    knots = np.array([0, 3, 8, 13, 19, 25.0])
    np.testing.assert_array_equal(plan(waypoints, PlannerOptions(knots=knots)).breaks, knots)
    with pytest.raises(KnotError, match="5 are given"):
        plan(waypoints, PlannerOptions(knots=[0, 3, 8, 19, 25]))


def test_cubic_is_the_hermite_cubic_of_each_interval_and_jumps_in_acceleration(waypoints):
    trajectory = get_planner("cubic")(waypoints, PlannerOptions())
    expected = CubicHermiteSpline(waypoints.time, waypoints.position, waypoints.velocity)
    np.testing.assert_allclose(trajectory.polynomial.c, expected.c, atol=1e-15)
    assert trajectory.continuity.order == 1
    assert trajectory.continuity.acceleration.relative > 0.1


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"knots": "balanced"}, "a choice of knots"),
        ({"knots": [0, 3, 8, 13, 19, 25]}, "a choice of knots"),
        ({"end_acceleration": "zero"}, "end accelerations"),
        ({"end_acceleration": (0.0, np.zeros(2))}, "end accelerations"),
    ],
)
def test_cubic_refuses_what_it_does_not_support(waypoints, options, says):
    said = rf"'cubic': option \w+ asks for {says}.*does not support"
    with pytest.raises(InputError, match=said):
        get_planner("cubic")(waypoints, PlannerOptions(**options))
