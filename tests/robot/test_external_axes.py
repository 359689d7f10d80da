"""Joints beside those of a URDF, and weights of joints, against plain Pinocchio and SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import scipy

import knotwork as kw
from knotwork.errors import InputError

URDF = "example-robot-data:ur_description/urdf/ur5_robot.urdf"
RAIL = {"carries": "robot", "slides": [0, 3, 4], "range": [-1, 1], "velocity": 1.5}


def arm(**axes: Any) -> kw.Robot:
    return kw.load_robot({"urdf": URDF, "tool_frame": "tool0", "external_axes": axes})


def test_rail_carries_robot() -> None:
    robot = arm(rail={**RAIL, "position": [0.1, 0.2, 0.3], "rpy": [0.3, -0.2, 0.1]})
    assert robot.joint_names[0] == "rail"
    assert robot.joint_units[0] == "m"
    assert (robot.limits.lower[0], robot.limits.velocity[0]) == (-1.0, 1.5)
    model = pin.buildModelFromUrdf(str(robot.urdf))
    data, q = model.createData(), np.linspace(-0.7, 0.9, 7)
    pin.framesForwardKinematics(model, data, q[1:])
    below = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.2, 0.1), np.array([0.1, 0.2, 0.3]))
    along = pin.SE3(np.eye(3), q[0] * np.array([0, 0.6, 0.8]))
    expected = below * along * data.oMf[model.getFrameId("tool0")]
    assert robot.forward(q).isApprox(expected, 1e-12)


def test_axes_carry_each_other() -> None:
    tilt = {"carries": "cradle", "turns": [1, 0, 0], "range": [-1, 1], "position": [0.5, 0, 0.2]}
    turn = {"in": "cradle", "turns": [0, 0, 1], "position": [0, 0, 0.1]}
    robot = arm(tilt=tilt, plate=turn).with_tool("plate")
    assert robot.joint_names == ("tilt", "plate")
    assert np.isinf(robot.limits.upper[1])
    a, b = 0.4, 2.0
    placed = pin.SE3(pin.rpy.rpyToMatrix(a, 0, 0), np.array([0.5, 0, 0.2]))
    placed = placed * pin.SE3(pin.rpy.rpyToMatrix(0, 0, b), np.array([0, 0, 0.1]))
    assert robot.forward([a, b]).isApprox(placed, 1e-12)


def test_weights_decide_which_joints_move() -> None:
    """The velocities of least weighted norm, by SciPy from the definition."""
    robot = kw.load_robot("ur5_rail").with_weights({"rail": 0.2, "elbow_joint": 3.0})
    q, twist = robot.configuration("home"), np.array([0.1, 0.2, -0.05, 0.1, 0, 0.2])
    share = np.array([0.2, 1, 1, 3, 1, 1, 1]) / robot.limits.velocity
    J = robot.jacobian(q)
    expected = np.linalg.pinv(J / share) @ twist / share
    assert kw.solve_velocity_ik(robot, q, twist) == pytest.approx(expected, abs=1e-9)
    null = scipy.linalg.null_space(J)[:, 0]
    assert (share**2 * expected) @ null == pytest.approx(0.0, abs=1e-9)


def test_light_rail_moves_and_arm_keeps_posture() -> None:
    task = kw.Task.load("ur5_rail_bead")
    plain, follows = (kw.plan(task.replace(prefer=p)) for p in ("travel", {"rail": 0.02}))
    motion = plain.scenario.paths[0].timed_path
    moved = {}
    for plan in (plain, follows):
        assert plan.report.ok, plan.report
        times = np.linspace(motion.start_time, motion.end_time, 60)
        q = np.array([plan.trajectory.position(t) for t in times])
        moved[plan] = np.ptp(q, axis=0)
    assert moved[plain][1:].max() > 0.3
    assert moved[follows][1:].max() < 0.02
    assert moved[follows][0] == pytest.approx(motion.tool_path.length, abs=0.01)
    (row,) = follows.report.select(group="Freedom")
    assert row.value == pytest.approx(moved[follows][0], abs=1e-3)
    assert "bead start to bead end: rail 1" in row.highlight


def test_refuses_weights_of_unknown_joints() -> None:
    with pytest.raises(InputError, match=r"prefer: robot 'ur5_rail': unknown joint 'rial'.*rail"):
        kw.plan(kw.Task.load("ur5_rail_bead").replace(prefer={"rial": 0.2}))


def test_refuses_weights_of_locked_joints() -> None:
    pose = {"position": [0.4, 0.1, 0.3], "rpy": [np.pi, 0, 0]}
    task = {"robot": "ur5_turntable", "prefer": {"table": 0.1}, "start": "home"}
    with pytest.raises(InputError, match=r"prefer: .*'table' does not move: .*joints that move"):
        kw.plan({**task, "waypoints": [{"pose": pose, "after": 2}]})


@pytest.mark.parametrize(
    ("place", "prefer"),
    [
        ([0.45, -0.1, 0.3], None),
        ([0.3, -0.3, 0.5], {"rail": 0.02}),
        ([-0.4, 0.3, 0.4], {"rail": 1e4}),
    ],
)
def test_fastest_motion_moves_slow_rail_little(place: list[float], prefer: Any) -> None:
    """No place of the rail, with any of the arm's solutions there, is reached a fifth sooner."""
    pose = {"position": place, "rpy": [np.pi, 0.0, -np.pi / 2]}
    limits = {"acceleration": {"rail": 0.5}}
    goal = {"name": "goal", "after": "fastest", "pose": pose}
    task = {"robot": "ur5_rail", "start": "home", "limits": limits, "waypoints": [goal]}
    plan = kw.plan({**task, "prefer": prefer} if prefer else task)
    assert plan.report.ok
    robot, ur5 = plan.joints.robot, kw.load_robot("ur5")
    speed, acceleration = robot.limits.velocity, robot.limits["acceleration"]
    best, home = np.inf, robot.configuration("home")
    target = pin.SE3(pin.rpy.rpyToMatrix(*pose["rpy"]), np.array(place))
    for rail in np.linspace(-0.2, 0.2, 21):
        there = pin.SE3(np.eye(3), np.array([0.0, -rail, 0.0])) * target
        for one in kw.solve_pose_ik_all(ur5, there):
            move = np.abs(np.array([rail, *one.q]) - home)
            peak = np.minimum(speed, np.sqrt(acceleration * move))
            best = min(best, float((move / np.maximum(peak, 1e-9) + peak / acceleration).max()))
    assert plan.trajectory.duration < 1.2 * best
