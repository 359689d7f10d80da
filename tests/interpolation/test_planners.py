from __future__ import annotations

import numpy as np
import pytest

from knotwork.curves.interpolation import (
    BalancedKnots,
    ModifiedHermiteSpline,
    PlannerOptions,
    get_planner,
)
from knotwork.errors import KnotError
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
    assert trajectory.joint_names == waypoints.joint_names
    assert trajectory.joint_units == waypoints.joint_units
    np.testing.assert_allclose(trajectory.acceleration(0.0), 0.1, atol=1e-15)
    np.testing.assert_allclose(trajectory.acceleration(25.0), [0.2, -0.3], atol=1e-14)
    knots = np.array([0, 3, 8, 13, 19, 25.0])
    np.testing.assert_array_equal(plan(waypoints, PlannerOptions(knots=knots)).breaks, knots)
    with pytest.raises(KnotError, match="5 are given"):
        plan(waypoints, PlannerOptions(knots=[0, 3, 8, 19, 25]))
