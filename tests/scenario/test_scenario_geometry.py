"""Orientations, units and frames of scenario files, against SciPy's rotations."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import knotwork as kw
from knotwork.task.scenario import Scenario, load_scenario
from knotwork.task.scenario.scenario_joints import read_scenario_joints
from knotwork.waypoints import CartesianWaypoint

Array = NDArray[np.float64]
ZERO = {"position": [0, 0, 0], "rpy": [0, 0, 0]}
ORDERS = [
    "".join(order)
    for order in itertools.product("XYZ", repeat=3)
    if order[0] != order[1] and order[1] != order[2]
]


def task(pose: dict[str, Any], **rest: Any) -> Scenario:
    waypoint = {"pose": pose, **rest.pop("waypoint", {})}
    return load_scenario(
        {"robot": "ur5", "waypoints": [waypoint, {"pose": ZERO, "after": 1}], **rest}
    )


def first(pose: dict[str, Any], **rest: Any) -> CartesianWaypoint:
    return task(pose, **rest).waypoints[0]


def turned(**orientation: Any) -> Array:
    return first({"position": [0, 0, 0], **orientation}).rotation


def in_degrees(orientation: dict[str, Any]) -> dict[str, Any]:
    """An orientation with its angles in degrees."""
    (key, value), *_ = orientation.items()
    if key == "euler":
        return {key: {**value, "angles": np.degrees(value["angles"]).tolist()}}
    return {key: np.degrees(value).tolist()}


# Orientations


def forms(rotation: Rotation) -> dict[str, dict[str, Any]]:
    """A rotation in each form of a file, in radians."""
    x, y, z, w = rotation.as_quat().tolist()
    return {
        "rpy": {"rpy": rotation.as_euler("xyz").tolist()},
        "rotation_vector": {"rotation_vector": rotation.as_rotvec().tolist()},
        "rotation_matrix": {"rotation_matrix": rotation.as_matrix().tolist()},
        "quaternion_xyzw": {"quaternion_xyzw": [x, y, z, w]},
        "quaternion_wxyz": {"quaternion_wxyz": [w, x, y, z]},
        "negative quaternion": {"quaternion_wxyz": [-w, -x, -y, -z]},
    } | {
        order: {"euler": {"order": order, "angles": rotation.as_euler(order).tolist()}}
        for order in ORDERS
    }


@pytest.mark.parametrize("form", forms(Rotation.from_rotvec([0.3, 0.4, 0.5])))
def test_orientation_equals_that_of_scipy(form: str) -> None:
    for rotation in Rotation.random(20, random_state=1):
        result = turned(**forms(rotation)[form])
        np.testing.assert_allclose(result, rotation.as_matrix(), atol=1e-13)


def test_a_matrix_and_a_quaternion_rounded_to_four_digits_become_exact_rotations() -> None:
    rotation = Rotation.from_euler("xyz", [0.4, -1.0, 2.5])
    rounded = np.round(rotation.as_matrix(), 4)
    for result in (
        turned(rotation_matrix=rounded.tolist()),
        turned(quaternion_xyzw=np.round(rotation.as_quat(), 4).tolist()),
    ):
        np.testing.assert_allclose(result.T @ result, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(result, rotation.as_matrix(), atol=2e-4)


# Units


def test_angles_in_degrees_and_lengths_in_millimetres() -> None:
    rotation = Rotation.from_euler("xyz", [20, -50, 130], degrees=True)
    for name, orientation in forms(rotation).items():
        has_angles = name in ("rpy", "rotation_vector", *ORDERS)
        pose = {
            "position": [100, -200, 300.5],
            **(in_degrees(orientation) if has_angles else orientation),
        }
        waypoint = first(pose, units={"length": "mm", "angle": "deg"})
        np.testing.assert_allclose(waypoint.position, [0.1, -0.2, 0.3005], rtol=1e-15)
        np.testing.assert_allclose(waypoint.rotation, rotation.as_matrix(), atol=1e-14)


def test_units_hold_for_velocities_tools_frames_and_tolerances_alike() -> None:
    pose = {"position": [1000, 0, 0], "rpy": [0, 0, 90]}
    scenario = task(
        pose,
        units={"length": "mm", "angle": "deg"},
        waypoint={"velocity": {"linear": [50, 0, 0], "angular": [0, 0, 180]}},
        tool={"frame": "tool0", "offset": {"position": [0, 0, 250], "rotation_vector": [90, 0, 0]}},
        frames={"table": {"position": [0, 500, 0], "rpy": [0, 0, 90]}},
        frame="table",
        tolerances={
            "position": 0.5,
            "orientation": 1.8,
            "linear_velocity": 2,
            "angular_velocity": 3.6,
            "joint_position": 0.18,
            "joint_velocity": 18,
        },
    )
    waypoint = scenario.waypoints[0]
    np.testing.assert_allclose(waypoint.position, [0, 1.5, 0], atol=1e-15)
    np.testing.assert_allclose(waypoint.linear, [0, 0.05, 0], atol=1e-16)
    np.testing.assert_allclose(waypoint.angular, [0, 0, np.pi], atol=1e-15)
    robot = read_scenario_joints(scenario).robot
    offset = robot.tool_offset
    np.testing.assert_allclose(offset.translation, [0, 0, 0.25])
    np.testing.assert_allclose(
        offset.rotation, Rotation.from_euler("x", 90, degrees=True).as_matrix(), atol=1e-15
    )
    tolerances = scenario.tolerances
    assert tolerances.position == pytest.approx(0.5e-3)
    assert tolerances.orientation == pytest.approx(np.pi / 100)
    assert tolerances.linear_velocity == pytest.approx(2e-3)
    assert tolerances.angular_velocity == pytest.approx(np.pi / 50)
    assert tolerances.path == 1e-4
    joints = read_scenario_joints(scenario)
    np.testing.assert_allclose(joints.tolerances["joint_position"], np.pi / 1000)
    np.testing.assert_allclose(joints.tolerances["joint_velocity"], np.pi / 10)
    np.testing.assert_array_equal(joints.tolerances["joint_acceleration"], 1e-6)


# Frames


def test_nested_frames_chain_from_the_base() -> None:
    frames = {
        # out of order on purpose
        "hole": {"in": "plate", "position": [0.01, 0.02, 0.0], "rotation_vector": [0, 0.5, 0]},
        "table": {"position": [0.4, 0.1, -0.2], "rpy": [0, 0, 0.7]},
        "plate": {
            "in": "table",
            "position": [0, 0, 0.05],
            "euler": {"order": "XYZ", "angles": [0.1, 0.2, 0.3]},
        },
    }
    transform = np.eye(4)
    for rotation, position in (
        (Rotation.from_euler("xyz", [0, 0, 0.7]), [0.4, 0.1, -0.2]),
        (Rotation.from_euler("XYZ", [0.1, 0.2, 0.3]), [0, 0, 0.05]),
        (Rotation.from_rotvec([0, 0.5, 0]), [0.01, 0.02, 0]),
        (Rotation.from_euler("xyz", [1, 2, 3]), [0.1, 0.2, 0.3]),
    ):
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation.as_matrix(), position
        transform = transform @ step
    pose = {"position": [0.1, 0.2, 0.3], "rpy": [1, 2, 3]}
    for choice in ({"frame": "hole"}, {"waypoint": {"frame": "hole"}}):
        waypoint = first(pose, frames=frames, **choice)
        np.testing.assert_allclose(waypoint.position, transform[:3, 3], atol=1e-15)
        np.testing.assert_allclose(waypoint.rotation, transform[:3, :3], atol=1e-14)


def test_a_waypoint_s_own_frame_goes_before_the_file_s() -> None:
    frames = {"a": {"position": [1, 0, 0]}, "b": {"position": [0, 1, 0]}}
    waypoint = first(ZERO, frames=frames, frame="a", waypoint={"frame": "b"})
    np.testing.assert_array_equal(waypoint.position, [0, 1, 0])
    waypoint = first(ZERO, frames=frames, frame="a", waypoint={"frame": "base"})
    np.testing.assert_array_equal(waypoint.position, [0, 0, 0])


# Axes of velocities


VELOCITY = {"linear": [0.1, 0.2, 0.3], "angular": [0.4, 0.5, 0.6]}


@pytest.mark.parametrize("axes", [None, "base", "tool", "table", "plate"])
def test_a_velocity_is_turned_from_the_axes_it_names(axes: str | None) -> None:
    table = Rotation.from_euler("xyz", [0.1, 0.2, 0.3])
    plate = table * Rotation.from_rotvec([0.3, -0.4, 0.5])
    frames = {
        "table": {"position": [1, 2, 3], "rpy": [0.1, 0.2, 0.3]},
        "plate": {"in": "table", "position": [1, 0, 0], "rotation_vector": [0.3, -0.4, 0.5]},
    }
    own = Rotation.from_euler("ZYX", [1.0, -0.7, 0.2])
    pose = {"position": [0.1, 0, 0], "quaternion_xyzw": own.as_quat().tolist()}
    expected = {
        None: plate,
        "base": Rotation.identity(),
        "tool": plate * own,
        "table": table,
        "plate": plate,
    }[axes]
    velocity = VELOCITY if axes is None else {**VELOCITY, "in": axes}
    waypoint = first(pose, frames=frames, frame="plate", waypoint={"velocity": velocity})
    np.testing.assert_allclose(waypoint.linear, expected.apply(VELOCITY["linear"]), atol=1e-15)
    np.testing.assert_allclose(waypoint.angular, expected.apply(VELOCITY["angular"]), atol=1e-15)


AHEAD = [0, 0, 0.1]


def test_a_tool_has_a_frame_an_offset_or_both() -> None:
    own = kw.load_robot("ur5")
    bare, flange, only = (
        read_scenario_joints(task(ZERO, **more)).robot
        for more in ({}, {"tool": {"frame": "ee_link"}}, {"tool": {"offset": {"position": AHEAD}}})
    )
    assert (bare.tool_frame, only.tool_frame) == (own.tool_frame, own.tool_frame)
    assert flange.tool_frame == "ee_link"
    np.testing.assert_array_equal(bare.tool_offset.homogeneous, own.tool_offset.homogeneous)
    np.testing.assert_array_equal(only.tool_offset.translation, AHEAD)
    np.testing.assert_array_equal(only.tool_offset.rotation, np.eye(3))
