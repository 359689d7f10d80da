"""ROS 2: messages have the fields of its definitions, and its controller makes our motion."""

from __future__ import annotations

import sys
from fractions import Fraction
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from motions import NANOSECONDS, controller, hermite_data, motion, nanoseconds
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from knotwork import Plan
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import ExportError, InputError
from sweeps import examples

ROUNDING = 2e-14


def replayed_error(trajectory: JointTrajectory, message: dict, rate: int = 1000) -> float:
    """Largest difference from our curve at 1 kHz until the controller holds the last point."""
    step = NANOSECONDS // rate
    last = nanoseconds(message["points"][-1]["time_from_start"])
    ticks = np.append(np.arange(0, last + 2 * step, step), last)
    start = Fraction(trajectory.start_time)
    own = [float(start + Fraction(int(tick), NANOSECONDS)) for tick in ticks]
    own = np.clip(own, trajectory.start_time, trajectory.end_time)
    return float(np.abs(controller(message, ticks) - trajectory(own)).max())


def nanosecond_bound(trajectory: JointTrajectory, order: int) -> float:
    """Of the position, where a quantity jumps at a knot and a piece takes 1/2 ns of the next one.

    What an end velocity does to a cubic is at most 4/27 of its length; an end acceleration does to
    a quintic at most 0.01728 of its square.
    """
    h = np.diff(trajectory.breaks)[:, None]
    jumps = np.zeros((trajectory.breaks.size, len(trajectory.joint_names)))
    jumps[1:-1] = np.abs(trajectory.polynomial.jumps(order))
    most = float(((jumps[:-1] + jumps[1:]) * h ** (order - 1)).max())
    end_speed = float(np.abs(trajectory.velocity(trajectory.end_time)).max())
    return (4 / 27 if order == 2 else 0.01728) * most * 0.5e-9 + 1e-9 * end_speed


@pytest.mark.parametrize(
    ("planner", "accelerations"),
    [("cubic", False), ("parabolic-blend", False), ("quintic", True), ("3-5-3", True)],
)
def test_replay_keeps_to_the_bound(planner: str, accelerations: bool) -> None:
    trajectory = motion(planner)
    bound = nanosecond_bound(trajectory, 3 if accelerations else 2)
    message = yaml.safe_load(trajectory.to_ros2(accelerations=accelerations))
    error = replayed_error(trajectory, message)
    assert bound / 100 < error <= bound + ROUNDING


@given(hermite_data())
@examples()
def test_any_cubics_are_replayed_within_the_bound(trajectory: JointTrajectory) -> None:
    message = yaml.safe_load(trajectory.to_ros2())
    # times are rounded relative to the largest, and positions by some 200 roundings
    longest = trajectory.duration + abs(trajectory.start_time)
    scale = 1.0 + float(np.abs(trajectory.knots.position).max())
    scale += float(np.abs(trajectory.knots.velocity).max()) * longest
    error = replayed_error(trajectory, message, rate=50)
    assert error <= nanosecond_bound(trajectory, 2) + 5e-14 * scale


def test_times_do_not_drift() -> None:
    """A thousand steps of a third of a second end within a nanosecond of their sum."""
    time = np.arange(1001) / 3.0
    flat = np.zeros((1001, 1))
    trajectory = JointTrajectory.from_knots(["a"], time, flat, flat)
    message = yaml.safe_load(trajectory.to_ros2())
    for i, point in enumerate(message["points"]):
        off = nanoseconds(point["time_from_start"]) - Fraction(time[i]) * NANOSECONDS
        assert abs(off) <= Fraction(1, 2) or (i == 1000 and -1 < off <= 0)


def test_a_quintic_says_why_it_can_not_go() -> None:
    with pytest.raises(ExportError, match="degree 5") as caught:
        motion("quintic").to_ros2()
    message = str(caught.value)
    for word in ("quintic", "off by up to", "--accelerations", "--tolerance"):
        assert word in message
    dense = np.linspace(1.0, motion("quintic").end_time, 20001)
    knots = motion("quintic").knots
    joined = JointTrajectory.from_knots("abc", knots.time, knots.position, knots.velocity)
    seen = np.abs(joined(dense) - motion("quintic")(dense)).max()
    assert caught.value.error == pytest.approx(seen, rel=1e-4)


def test_jumping_accelerations_can_not_go() -> None:
    with pytest.raises(ExportError, match=r"acceleration of joint .* jumps .* leave"):
        motion("cubic").to_ros2(accelerations=True)


def test_the_end_speed_is_reported() -> None:
    curve = JointTrajectory.from_knots(["a"], [0, 1], [[0], [1]], [[0], [1]])
    assert "allow_nonzero_velocity_at_trajectory_end" in curve.to_ros2()
    assert "allow_nonzero_velocity_at_trajectory_end" not in motion().to_ros2()


def test_the_first_speed_is_reported() -> None:
    names, ends, speeds = ["lift", "turn"], [[0, 0], [1, 1]], [[-0.4, 0], [0, 0]]
    lift = JointTrajectory.from_knots(names, [0, 1], ends, speeds)
    text = lift.to_ros2()
    assert "must be at rest" not in text
    assert "# The motion begins at a velocity and acceleration (lift -0.4 and " in text
    still = JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    assert "# The arm must be at rest at the first point when this is sent." in still.to_ros2()


def test_knots_within_a_nanosecond_are_refused() -> None:
    curve = JointTrajectory.from_knots(
        ["a"], [0, 1, 1 + 2e-10, 2], np.zeros((4, 1)), np.zeros((4, 1))
    )
    with pytest.raises(ExportError, match="same nanosecond"):
        curve.to_ros2()


def test_a_motion_longer_than_a_duration_is_refused() -> None:
    curve = JointTrajectory.from_knots(["a"], [0, 2.0**31], [[0], [1]], [[0], [0]])
    with pytest.raises(InputError, match="2147483647 s"):
        curve.to_ros2()


def test_message_objects_without_ros_2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "trajectory_msgs.msg", None)
    with pytest.raises(InputError, match="source a ROS 2 installation"):
        motion().to_ros2_message()


DISTRIBUTIONS = (Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY)
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
POINT = "trajectory_msgs/msg/JointTrajectoryPoint"
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
def test_message_follows_definition(store: Any, deburring: Plan, accelerations: bool) -> None:
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
    # no tolerances given: the controller's own tolerances hold
    assert back.path_tolerance == back.goal_tolerance == []
    assert back.goal_time_tolerance.sec == back.goal_time_tolerance.nanosec == 0


def test_message_objects_get_every_field(store: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of classes made of the definitions, where what is left out is empty, as in ROS 2."""
    tolerances = {"path_tolerance": [], "goal_tolerance": [], "goal_time_tolerance": None}
    goal = partial(store.types[GOAL], multi_dof_trajectory=None, **tolerances)
    messages = {
        "JointTrajectory": partial(store.types[TRAJECTORY], header=None, points=[]),
        "JointTrajectoryPoint": partial(store.types[POINT], accelerations=[], effort=[]),
    }
    duration = store.types["builtin_interfaces/msg/Duration"]
    for name, classes in (
        ("trajectory_msgs.msg", messages),
        ("control_msgs.action", {"FollowJointTrajectory": SimpleNamespace(Goal=goal)}),
        ("builtin_interfaces.msg", {"Duration": duration}),
    ):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(**classes))
    message = motion().to_ros2_message(goal=True).trajectory
    data = yaml.safe_load(motion().to_ros2())
    assert message.joint_names == data["joint_names"]
    for point, row in zip(message.points, data["points"], strict=True):
        assert (point.positions, point.velocities) == (row["positions"], row["velocities"])
        assert point.time_from_start == duration(**row["time_from_start"])
