"""Inverse kinematics of velocities, and self-motion: least squares, limits, singularities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork import Robot, load_robot, robot_names
from knotwork.errors import ArrayError, BranchError, SingularityError
from knotwork.robot.kinematics import pull_to_middle, smallest_singular_value, solve_velocity_ik
from knotwork.robot.kinematics.sequence import travel_weights
from plans import pose_of

ROBOTS = {name: load_robot(name) for name in robot_names()}
PLANAR, UR5, PANDA = (ROBOTS[name] for name in ("planar2", "ur5", "panda"))
WRIST_STRAIGHT = np.array([0.3, -1.2, 1.1, -0.7, 0.0, 0.4])


def attainable(robot: Robot, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Joint positions beside home and a twist that the arm can do there."""
    generator = np.random.default_rng(seed)
    q = robot.configuration("home") + generator.uniform(-0.15, 0.15, robot.dof)
    return q, robot.jacobian(q) @ generator.uniform(-1, 1, robot.dof)


@pytest.mark.parametrize("name", robot_names())
def test_equals_least_squares(name: str) -> None:
    robot = ROBOTS[name]
    for seed in range(20):
        q, twist = attainable(robot, seed)
        v = solve_velocity_ik(robot, q, twist)
        J = robot.jacobian(q)
        # Of a redundant arm each joint's velocity is measured by its limit.
        weights = robot.limits.velocity if robot.dof > 6 else np.ones(robot.dof)
        expected = weights * np.linalg.lstsq(J * weights, twist, rcond=1e-10)[0]
        np.testing.assert_allclose(v, expected, atol=1e-11)
        np.testing.assert_allclose(J @ v, twist, atol=1e-12)


def test_pull_to_middle_uses_null_space() -> None:
    q, twist = attainable(PANDA, 52)
    pull = pull_to_middle(PANDA, q, rate=0.5)
    middle = 0.5 * (PANDA.limits.lower + PANDA.limits.upper)
    np.testing.assert_allclose(q + 2 * pull, middle)
    v = solve_velocity_ik(PANDA, q, twist, preferred=pull)
    np.testing.assert_allclose(PANDA.jacobian(q) @ v, twist, atol=1e-12)
    # Of all that give the twist it is the nearest to the pull, measured by the limits.
    free = np.linalg.svd(PANDA.jacobian(q))[2][-1]
    limits = PANDA.limits.velocity
    assert abs((free / limits) @ ((v - pull) / limits)) < 1e-12
    still = solve_velocity_ik(PANDA, q, np.zeros(6), preferred=pull)
    np.testing.assert_allclose(PANDA.jacobian(q) @ still, 0, atol=1e-12)
    assert still @ (pull / limits**2) > 0
    assert (pull_to_middle(ROBOTS["kinova"], np.ones(6))[[0, 3, 5]] == 0).all()


def test_accepts_motion_and_array() -> None:
    q, twist = attainable(UR5, 53)
    expected = solve_velocity_ik(UR5, q, twist)
    np.testing.assert_array_equal(solve_velocity_ik(UR5, q, pin.Motion(twist)), expected)


@pytest.mark.parametrize("q", [WRIST_STRAIGHT, np.zeros(6)])
def test_zero_twist_at_singularity(q: np.ndarray) -> None:
    assert smallest_singular_value(UR5, q) < 1e-12
    v = solve_velocity_ik(UR5, q, np.zeros(6))
    np.testing.assert_array_equal(v, np.zeros(6))


def test_singular_arm_gives_attainable_twists() -> None:
    v = np.array([0.3, -0.1, 0.2, 0.4, 0.5, -0.3])
    twist = UR5.twist(WRIST_STRAIGHT, v)
    found = solve_velocity_ik(UR5, WRIST_STRAIGHT, twist)
    np.testing.assert_allclose(UR5.twist(WRIST_STRAIGHT, found).vector, twist.vector, atol=1e-12)
    assert np.linalg.norm(found) <= np.linalg.norm(v)


def test_reports_lost_direction() -> None:
    lost = np.linalg.svd(UR5.jacobian(WRIST_STRAIGHT))[0][:, -1]
    lost *= np.sign(lost[0])
    possible = UR5.twist(WRIST_STRAIGHT, np.full(6, 0.2)).vector
    with pytest.raises(SingularityError, match="is unattainable here") as caught:
        solve_velocity_ik(
            UR5, WRIST_STRAIGHT, possible + 0.1 * lost, waypoint="w", where="task.yaml:9"
        )
    error = caught.value
    assert str(error).startswith("task.yaml:9: waypoint 'w': ")
    assert error.smallest_singular_value < 1e-12
    expected = 0.1 * np.linalg.norm(lost[:3]), 0.1 * np.linalg.norm(lost[3:])
    assert error.residual == pytest.approx(expected, abs=1e-9)
    assert tuple(error.joint_velocity) == UR5.joint_names
    lines = "along (0.30, -0.96, 0.00) and about (0.67, 0.21, 0.72) of the base frame"
    assert f"0.0761 m/s and 0.0649 rad/s {lines} is unattainable" in str(error)


@pytest.mark.parametrize(
    ("twist", "lost"),
    [
        ([0, 0, 0.2, 0, 0, 0], "along z of the base frame"),
        ([0, 0, 0, 0.3, 0, 0], "about x of the base frame"),
    ],
)
def test_refuses_twists_of_arm_with_few_joints(twist: list[float], lost: str) -> None:
    with pytest.raises(SingularityError, match="the arm can't") as caught:
        solve_velocity_ik(PLANAR, [0.5, 1.2], twist)
    assert lost in str(caught.value)
    assert sum(caught.value.residual) == pytest.approx(sum(twist))


def test_refuses_excessive_speeds_only_near_singularity() -> None:
    near, clear = WRIST_STRAIGHT.copy(), WRIST_STRAIGHT.copy()
    near[4], clear[4] = 5e-4, 1.0
    lost = np.linalg.svd(UR5.jacobian(near))[0][:, -1]
    assert 0 < smallest_singular_value(UR5, near) < 1e-3
    with pytest.raises(SingularityError, match="close to a singularity") as caught:
        solve_velocity_ik(UR5, near, 0.1 * lost)
    velocity = np.array(list(caught.value.joint_velocity.values()))
    np.testing.assert_allclose(UR5.jacobian(near) @ velocity, 0.1 * lost, atol=1e-9)
    assert (np.abs(velocity) > UR5.limits.velocity).any()
    assert "wrist_1_joint" in str(caught.value)
    assert "(limit 3.2)" in str(caught.value)
    slow = solve_velocity_ik(UR5, near, 1e-4 * lost)
    np.testing.assert_allclose(slow, 1e-3 * velocity, rtol=1e-6, atol=1e-9)
    fast = solve_velocity_ik(UR5, clear, UR5.jacobian(clear) @ np.full(6, 10.0))
    np.testing.assert_allclose(fast, 10.0, rtol=1e-9)


def test_tolerance_grows_with_speed() -> None:
    q, twist = attainable(UR5, 54)
    v = solve_velocity_ik(UR5, q, 1e6 * twist)
    np.testing.assert_allclose(v, 1e6 * solve_velocity_ik(UR5, q, twist), rtol=1e-9)
    with pytest.raises(SingularityError):
        solve_velocity_ik(PLANAR, [0.5, 1.2], [0, 0, 2e-9, 0, 0, 0])


@pytest.mark.parametrize("twist", [[0] * 5, [0, 0, 0, 0, 0, np.nan], "fast", np.zeros((6, 1))])
def test_refuses_wrong_input(twist: object) -> None:
    with pytest.raises(ArrayError):
        solve_velocity_ik(PLANAR, [0.5, 1.2], twist)


def test_missing_limit_does_not_allow_any_speed():
    free = load_robot("ur5").with_limits(velocity=1e9)  # as good as none
    q = np.array(free.configuration("home"))
    q[4] = 1e-4  # the wrist all but straight
    lost = np.linalg.svd(free.jacobian(q))[0][:, -1]
    with pytest.raises(SingularityError, match="rad/s") as caught:
        solve_velocity_ik(free, q, 5e-3 * lost)
    assert max(map(abs, caught.value.joint_velocity.values())) > 10
    for name, speed in caught.value.joint_velocity.items():  # only those that matter are named
        assert (name in str(caught.value)) == (abs(speed) > 0.1)
    v = solve_velocity_ik(free, q, 1e-5 * lost)  # slowly enough it goes
    assert np.abs(v).max() < 10


def test_weights_grow_near_limits_and_singularities() -> None:
    lower, upper = PANDA.limits.lower, PANDA.limits.upper
    within = np.random.default_rng(6).uniform(0.025, 0.975, (20, PANDA.dof))
    for q in lower + (upper - lower) * within:
        smallest = np.linalg.svd(PANDA.jacobian(q), compute_uv=False)[-1]
        room = min((q - lower).min(), (upper - q).min())
        expected = 1 + max(0, 1 - smallest / 0.05) ** 2 + max(0, 1 - room / 0.2) ** 2
        assert travel_weights(PANDA, q[None])[0] == pytest.approx(expected, rel=1e-6)


PASSING: dict[str, Any] = {
    "robot": "panda",
    "start": "home",
    "waypoints": [
        {
            "pose": {"position": [0.5, 0.1, 0.4], "rpy": [3.0, 0.1, 0.2]},
            "velocity": {"linear": [0.0, 0.1, 0.0]},
            "after": 2.0,
        },
        {"pose": {"position": [0.5, 0.3, 0.4], "rpy": [3.0, 0.1, 0.2]}, "after": 2.0, "stop": True},
    ],
}


def test_pull_to_middle_at_passing_speed() -> None:
    plain, pulled = (kw.plan({**PASSING, "pull_to_middle": rate}) for rate in (0, 0.2))
    assert plain.report.ok
    assert pulled.report.ok
    q, v = plain.joint_waypoints.position, plain.joint_waypoints.velocity
    np.testing.assert_array_equal(pulled.joint_waypoints.position, q)
    extra = pulled.joint_waypoints.velocity - v
    np.testing.assert_array_equal(extra[[0, 2]], 0)  # at rest all joints rest
    np.testing.assert_allclose(PANDA.jacobian(q[1]) @ extra[1], 0, atol=1e-12)
    middle = 0.5 * (PANDA.limits.lower + PANDA.limits.upper)
    scale = PANDA.limits.velocity
    assert (extra[1] / scale) @ ((middle - q[1]) / scale) > 0
    wild = kw.plan({**PASSING, "pull_to_middle": 1000}).joint_waypoints.velocity[1]
    use = np.abs(wild) / PANDA.limits.velocity
    assert use.max() == pytest.approx(1.0)  # as far as the velocity limits let it


@pytest.mark.parametrize("branch", ["keep", "fixed"])
@pytest.mark.parametrize("robot", ["panda", "xarm7", "planar2"])
def test_refuses_branch_of_arm_without_branches(robot: str, branch: str) -> None:
    arm = kw.load_robot(robot)
    home = pose_of(arm, arm.configuration("home"))
    waypoints = [{"pose": home, "after": 4.0, "stop": True}]
    task = {"robot": robot, "branch": branch, "start": "home", "waypoints": waypoints}
    with pytest.raises(BranchError, match=f"branch: {branch} needs .* {robot} has .* near: "):
        kw.plan(task)
    kw.plan({**task, "branch": "free", "near": "home"})
