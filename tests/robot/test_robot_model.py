"""Kinematics, dynamics and limits of robots against formulations of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import knotwork as kw
from knotwork import Robot, load_robot, robot_names
from knotwork.errors import (
    ArrayError,
    DocumentError,
    InputError,
    RobotError,
    UnknownNameError,
)
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.joint_tree import joint_tree, place_joints
from plain import full_configuration
from sweeps import examples

L1, L2 = 0.5, 0.4
ANGLE = st.floats(-2.6, 2.6)


def samples(robot: Robot, count: int, seed: int = 0) -> np.ndarray:
    lower = np.maximum(robot.limits.lower, -2 * np.pi)
    upper = np.minimum(robot.limits.upper, 2 * np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, robot.dof))


@examples()
@given(ANGLE, st.tuples(*[st.floats(-3, 3)] * 4))
def test_planar_dynamics_equal_closed_form(b: float, rates: tuple[float, ...]) -> None:
    """Two bars turning in a horizontal plane (Craig, Introduction to Robotics, section 6.7)."""
    m1, m2, i1, i2, c1, c2 = 3.0, 2.0, 0.0634, 0.027083333, 0.25, 0.2
    v, a = np.array(rates[:2]), np.array(rates[2:])
    coupling = m2 * L1 * c2 * np.cos(b)
    m22 = i2 + m2 * c2**2
    m12 = m22 + coupling
    m11 = i1 + m1 * c1**2 + m2 * L1**2 + m22 + 2 * coupling
    h = m2 * L1 * c2 * np.sin(b)
    expected = np.array([[m11, m12], [m12, m22]]) @ a
    expected += [-h * (2 * v[0] * v[1] + v[1] ** 2), h * v[0] ** 2]
    np.testing.assert_allclose(PLANAR.effort([0.3, b], v, a), expected, atol=1e-12)


PLANAR = load_robot("planar2")


@pytest.mark.parametrize("name", sorted({*robot_names()} - {"ur5_rail", "ur5_turntable"}))
def test_agrees_with_full_model(name: str) -> None:
    """The same URDF as Pinocchio reads it by itself, fingers, (cos, sin) joints and all."""
    robot = load_robot(name)
    model = pin.buildModelFromUrdf(str(robot.urdf))
    data = model.createData()
    links = robot.base_frame, robot.tool_frame
    base, tool = (model.getFrameId(link, pin.BODY) for link in links)
    columns = [model.joints[model.getJointId(joint)].idx_v for joint in robot.joint_names]
    for q in samples(robot, 10):
        full = full_configuration(model, robot, q)
        pin.computeJointJacobians(model, data, full)
        pin.updateFramePlacements(model, data)
        expected = data.oMf[base].inverse() * data.oMf[tool]
        assert robot.forward(q).isApprox(expected, 1e-12)
        rotation = data.oMf[base].rotation.T
        J = pin.getFrameJacobian(model, data, tool, pin.LOCAL_WORLD_ALIGNED)[:, columns]
        J = np.vstack([rotation @ J[:3], rotation @ J[3:]])
        np.testing.assert_allclose(robot.jacobian(q), J, atol=1e-12)


def test_turned_base_frame_turns_pose_and_twist() -> None:
    ur5 = load_robot("ur5")
    description = {
        "urdf": "example-robot-data:ur_description/urdf/ur5_robot.urdf",
        "base_frame": "base",
        "tool_frame": "tool0",
    }
    robot = load_robot(description)
    half_turn = pin.utils.rotate("z", np.pi)
    q, v = samples(ur5, 2)
    np.testing.assert_allclose(
        robot.forward(q).translation, half_turn @ ur5.forward(q).translation, atol=1e-9
    )
    np.testing.assert_allclose(
        robot.twist(q, v).angular, half_turn @ ur5.twist(q, v).angular, atol=1e-9
    )
    np.testing.assert_allclose(robot.twist(q, v).linear, robot.jacobian(q)[:3] @ v)
    assert (robot.base_placement * robot.forward(q)).isApprox(ur5.forward(q), 1e-9)


@pytest.mark.parametrize(
    "q", [[0.0], [0.0, 0.0, 0.0], [[0.0, 0.0]], [0.0, np.nan], [np.inf, 0.0], ["a", "b"], None]
)
def test_refuses_wrong_joint_positions(q: object) -> None:
    for method in (PLANAR.forward, PLANAR.jacobian, PLANAR.forward_and_jacobian):
        with pytest.raises(ArrayError) as caught:
            method(q)
        assert not hasattr(caught.value, "waypoint_index")


def test_limits_from_urdf_and_file() -> None:
    robot = load_robot("panda")
    np.testing.assert_array_equal(robot.limits.velocity, [2.175] * 4 + [2.61] * 3)
    np.testing.assert_array_equal(robot.limits.acceleration, [15, 7.5, 10, 12.5, 15, 20, 20])
    np.testing.assert_array_equal(robot.limits.effort, [87] * 4 + [12] * 3)
    np.testing.assert_array_equal(robot.limits.jerk[[0, 5]], [7500, 10000])
    assert (robot.limits.lower[3], robot.limits.upper[3]) == (-3.0718, -0.0698)
    with pytest.raises(ValueError, match="read-only"):
        robot.limits.velocity[0] = 1


def test_unbounded_joints_have_limits_of_their_element_only() -> None:
    bravo, kinova = load_robot("bravo7"), load_robot("kinova")
    unbounded = [0, 3, 5]
    assert np.isinf(bravo.limits.lower[unbounded]).all()
    assert np.isinf(bravo.limits.upper[unbounded]).all()
    assert np.isinf(bravo.limits.velocity[unbounded]).all()
    assert np.isinf(bravo.limits.effort[unbounded]).all()
    assert np.isfinite(bravo.limits.velocity[[1, 2, 4]]).all()
    assert np.isinf(kinova.limits.upper[unbounded]).all()
    np.testing.assert_allclose(kinova.limits.velocity, [0.628319] * 3 + [0.837758] * 3, rtol=1e-5)


def test_replaces_limits() -> None:
    robot = load_robot("planar2")
    changed = robot.with_limits(
        position={"elbow": (-1.0, 0.5)}, velocity={"elbow": 0.7}, jerk=9.0, effort={"shoulder": 2}
    )
    np.testing.assert_array_equal(changed.limits.lower, [-2.9, -1.0])
    np.testing.assert_array_equal(changed.limits.upper, [2.9, 0.5])
    np.testing.assert_array_equal(changed.limits.velocity, [3.0, 0.7])
    np.testing.assert_array_equal(changed.limits.acceleration, [15.0, 15.0])
    np.testing.assert_array_equal(changed.limits.jerk, [9.0, 9.0])
    np.testing.assert_array_equal(changed.limits.effort, [2.0, 30.0])
    again = changed.with_limits(jerk={"elbow": 4.0}).with_limits(velocity=1.0)
    np.testing.assert_array_equal(again.limits.jerk, [9.0, 4.0])
    np.testing.assert_array_equal(again.limits.velocity, [1.0, 1.0])
    np.testing.assert_array_equal(robot.limits.velocity, [3.0, 3.0])


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ({"velocity": {"elbow": 0.0}}, "velocity.elbow: 0.0: must be greater than 0"),
        ({"jerk": {"elbow": "fast"}}, "'fast': must be a number"),
        ({"jerk": float("nan")}, "must be a finite number"),
        ({"position": {"elbow": (1.0, 1.0)}}, "lower limit 1 must be less than upper limit 1"),
        ({"position": {"elbow": (1.0,)}}, "has 1 value, fewer than 2"),
        ({"velocty": 1.0}, "did you mean 'velocity'"),
        ({"velocity": np.ones(2)}, "must be a positive number for every joint or a mapping"),
    ],
)
def test_refuses_invalid_limits(limits: dict, says: str) -> None:
    with pytest.raises(DocumentError, match=says):
        PLANAR.with_limits(**limits)


def test_takes_limits_from_numpy() -> None:
    changed = PLANAR.with_limits(velocity=np.int64(2), jerk={"elbow": np.float32(3.0)})
    assert changed.limits.velocity.tolist() == [2.0, 2.0]
    assert changed.limits.jerk[1] == 3.0


def test_refuses_limit_of_unknown_joint() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'elbow'") as caught:
        PLANAR.with_limits(velocity={"elbo": 1.0})
    assert caught.value.available == ("shoulder", "elbow")


@pytest.mark.parametrize("weight", [0, -1, float("nan"), float("inf"), "1", True, None])
def test_refuses_weights_that_are_not_positive(weight: Any) -> None:
    with pytest.raises(InputError, match=r"weight of joint 'elbow' is .*; it must be a positive"):
        PLANAR.with_weights({"elbow": weight})


@pytest.mark.parametrize(
    ("method", "arguments", "says"),
    [
        ("with_tool", {"payload": 3}, "payload is 3; accepted: a knotwork.robot.payload.Payload"),
        ("with_held", 3, "payload is 3; accepted: a knotwork.robot.payload.Payload"),
        ("with_virtual_joints", 3, "virtual joint is 3; accepted: a VirtualJoint"),
        ("with_weights", 3, "weights is 3; accepted: a mapping of joints to weights"),
    ],
)
def test_refuses_arguments_of_other_types(method: str, arguments: Any, says: str) -> None:
    change = getattr(PLANAR, method)
    with pytest.raises(InputError, match=says):
        change(**arguments) if isinstance(arguments, dict) else change(arguments)


def test_used_fraction_replaces_an_earlier_one() -> None:
    half = PLANAR.with_used_fraction(0.5)
    assert half.with_used_fraction(0.5).limits.used_fraction == 0.5
    for wrong in ("x", -1, np.ones(2)):
        with pytest.raises(InputError, match=r"used_fraction is .*; it must be a positive"):
            half.with_used_fraction(wrong)


def test_finds_configuration_by_name() -> None:
    home = PLANAR.configuration("home")
    np.testing.assert_array_equal(home, [0.5, 1.2])
    assert not home.flags.writeable
    for find in (PLANAR.configuration, PLANAR.with_unplanned_at):
        with pytest.raises(UnknownNameError, match="did you mean 'home'"):
            find("hom")


def test_tool_offset_moves_tcp() -> None:
    offset = pin.SE3(pin.utils.rotate("y", 0.4), np.array([0.1, 0.02, 0.3]))
    robot = PLANAR.with_tool(offset=offset)
    q = [0.4, -0.9]
    assert robot.forward(q).isApprox(PLANAR.forward(q) * offset, 1e-14)
    assert robot.tool_offset.isApprox(offset, 0.0)
    assert PLANAR.tool_offset.isIdentity(0.0)
    lever = robot.forward(q).translation - PLANAR.forward(q).translation
    v = np.array([0.3, 0.8])
    moved = PLANAR.twist(q, v)
    expected = moved.linear + np.cross(moved.angular, lever)
    np.testing.assert_allclose(robot.twist(q, v).linear, expected, atol=1e-14)


def test_new_tool_frame_selects_its_joints() -> None:
    robot = PLANAR.with_tool("upper_arm", pin.SE3(np.eye(3), np.array([0.5, 0, 0])))
    assert robot.joint_names == ("shoulder",)
    np.testing.assert_allclose(
        robot.forward([0.3]).translation, [0.5 * np.cos(0.3), 0.5 * np.sin(0.3), 0]
    )
    assert robot.with_tool("tip").joint_names == ("shoulder", "elbow")
    assert robot.with_tool("tip").tool_offset.isIdentity(0.0)
    np.testing.assert_array_equal(robot.configuration("home"), [0.5])
    with pytest.raises(UnknownNameError, match="did you mean 'tip'"):
        PLANAR.with_tool("tipp")
    with pytest.raises(RobotError, match=r"pin\.SE3"):
        PLANAR.with_tool(offset=np.eye(4))


@pytest.mark.parametrize("arm", ["planar2", "ur5", "panda", "kinova", "xarm7"])
def test_joints_and_tool_move_as_in_pinocchio(arm: str) -> None:
    robot, generator = kw.load_robot(arm), np.random.default_rng(1)
    model, data = robot.model, robot.model.createData()
    q = generator.uniform(-3, 3, (20, model.nv))
    rotations, origins = place_joints(joint_tree(model), q)
    tip, columns, J = joint_axes(robot).compute_poses_and_jacobians(q)
    for k, one in enumerate(q):
        pin.forwardKinematics(model, data, one)
        for i in range(1, model.njoints):
            np.testing.assert_allclose(rotations[k, i], data.oMi[i].rotation, atol=1e-12)
            np.testing.assert_allclose(origins[k, i], data.oMi[i].translation, atol=1e-12)
        pose, jacobian = robot.forward_and_jacobian(one)
        np.testing.assert_allclose(tip[:, k], pose.translation, atol=1e-12)
        np.testing.assert_allclose(columns[:, :, k].T, pose.rotation, atol=1e-12)
        np.testing.assert_allclose(J[:, :, k], jacobian, atol=1e-12)
