"""ROS 2's own definitions of the messages: each field there is, of its type, and back from CDR."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from motions import motion
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from knotwork import Plan

DISTRIBUTIONS = (Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY)
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
GOAL = "control_msgs/msg/FollowJointTrajectory_Goal"
# control_msgs is not among the definitions that come with the reader.
TOLERANCE = "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
GOAL_DEFINITION = """trajectory_msgs/JointTrajectory trajectory
trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory
control_msgs/JointTolerance[] path_tolerance
control_msgs/JointTolerance[] goal_tolerance
builtin_interfaces/Duration goal_time_tolerance
"""


@pytest.fixture(scope="module", params=DISTRIBUTIONS, ids=lambda store: store.value)
def store(request: pytest.FixtureRequest) -> Any:
    """The types of a distribution of ROS 2."""
    types = get_typestore(request.param)
    types.register(get_types_from_msg(TOLERANCE, "control_msgs/msg/JointTolerance"))
    types.register(get_types_from_msg(GOAL_DEFINITION, GOAL))
    return types


def fill(store: Any, name: str, data: dict[str, Any]) -> Any:
    """Make a message of plain data; what is left out is empty, what it has not got an error."""
    _, fields = store.fielddefs[name]
    assert set(data) <= {field for field, _ in fields}, f"{name} has no such field"
    return store.types[name](**{f: value(store, kind, data.get(f)) for f, kind in fields})


def value(store: Any, kind: Any, given: Any) -> Any:
    """Make the value of a field."""
    node, detail = kind
    if node == Nodetype.NAME:
        return fill(store, detail, given or {})
    if node == Nodetype.BASE:
        base = detail[0]
        if base == "string":
            assert given is None or type(given) is str
            return given or ""
        assert given is None or type(given) in ((int, float) if base[0] == "f" else (int,))
        return given or 0
    assert node == Nodetype.SEQUENCE
    inner = detail[0]
    entries = [value(store, inner, entry) for entry in given or []]
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.array(entries, dtype=inner[1][0])
    return entries


@pytest.mark.parametrize("accelerations", [False, True])
def test_the_message_is_what_the_definition_says(
    store: Any, deburring: Plan, accelerations: bool
) -> None:
    data = yaml.safe_load(deburring.trajectory.to_ros2(accelerations=accelerations))
    message = fill(store, TRAJECTORY, data)
    back = store.deserialize_cdr(store.serialize_cdr(message, TRAJECTORY), TRAJECTORY)
    knots = deburring.trajectory.knots
    header = back.header
    assert (header.frame_id, header.stamp.sec, header.stamp.nanosec) == ("", 0, 0)
    assert back.joint_names == list(deburring.trajectory.joint_names)
    for i, point in enumerate(back.points):
        time = point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
        assert time == pytest.approx(knots.time[i], abs=1e-9)
        np.testing.assert_allclose(point.positions, knots.position[i], rtol=0, atol=1e-9)
        np.testing.assert_allclose(point.velocities, knots.velocity[i], rtol=0, atol=1e-9)
        assert point.accelerations.size == (6 if accelerations else 0)
        assert point.effort.size == 0


def test_the_goal_holds_the_message(store: Any) -> None:
    curve = motion()
    goal = fill(store, GOAL, yaml.safe_load(curve.to_ros2(goal=True)))
    back = store.deserialize_cdr(store.serialize_cdr(goal, GOAL), GOAL)
    assert len(back.trajectory.points) == curve.breaks.size
    assert back.trajectory.joint_names == list(curve.joint_names)
    # nothing asked for: the controller's own tolerances hold
    assert back.path_tolerance == back.goal_tolerance == []
    assert back.goal_time_tolerance.sec == back.goal_time_tolerance.nanosec == 0
