"""Waypoints: what a user may build, and what is refused."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pinocchio as pin
import pytest

from knotwork.errors import WaypointDataError
from knotwork.waypoints import CartesianWaypoint

POSE = pin.SE3(pin.rpy.rpyToMatrix(0.1, -0.4, 2.0), np.array([0.4, 0.1, 0.3]))
TWIST = pin.Motion(np.array([0.1, 0.0, -0.2]), np.array([0.0, 0.5, 0.0]))


def test_a_waypoint_holds_its_pose_and_twist() -> None:
    waypoint = CartesianWaypoint("on", 1.5, POSE, TWIST)
    for same in (waypoint, copy.deepcopy(waypoint), pickle.loads(pickle.dumps(waypoint))):
        assert same.pose.isApprox(POSE, 0.0)
        assert same.twist.isApprox(TWIST, 0.0)
        np.testing.assert_array_equal(same.position, [0.4, 0.1, 0.3])
        np.testing.assert_array_equal(same.rotation, POSE.rotation)
        np.testing.assert_array_equal(same.linear, [0.1, 0, -0.2])
        np.testing.assert_array_equal(same.angular, [0, 0.5, 0])


def test_a_waypoint_does_not_change_with_what_it_was_made_of() -> None:
    pose, twist = POSE.copy(), TWIST.copy()
    waypoint = CartesianWaypoint("on", 1.5, pose, twist)
    pose.translation[0] = 9
    twist.linear[0] = 9
    waypoint.position[0] = 9
    assert waypoint.pose.isApprox(POSE, 0.0)
    assert waypoint.twist.isApprox(TWIST, 0.0)
    with pytest.raises(AttributeError):
        setattr(waypoint, "pose", pose)  # noqa: B010


SHEARED = pin.SE3(np.array([[1.0, 0.1, 0], [0, 1, 0], [0, 0, 1]]), np.zeros(3))
LEFT_HANDED = pin.SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3))
FAR = pin.SE3(np.eye(3), np.array([0, np.inf, 0]))
NOT_KNOWN = pin.Motion(np.array([np.nan, 0, 0]), np.zeros(3))


@pytest.mark.parametrize(
    ("pose", "twist", "says"),
    [
        (np.eye(4), TWIST, "on: pose must be a pin.SE3"),
        (POSE, np.zeros(6), "on: twist must be a pin.Motion"),
        (POSE, None, "on: twist must be a pin.Motion, not None"),
        (FAR, TWIST, "on: pose.* is inf; every value must be finite"),
        (POSE, NOT_KNOWN, "on: twist.* is nan; every value must be finite"),
        (SHEARED, TWIST, "R'R differs from I by 0.1"),
        (LEFT_HANDED, TWIST, "det R = -1"),
    ],
)
def test_what_is_no_waypoint_is_refused(pose, twist, says: str) -> None:
    with pytest.raises(WaypointDataError, match=says):
        CartesianWaypoint("on", 1.5, pose, twist)
