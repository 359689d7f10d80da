"""Self-motion of seven joints: less travel, away from limits and singularities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import BranchError, DocumentError, RobotError
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence import (
    JointRules,
    RefinementTask,
    StepRules,
    refine_sequence,
    weights,
)
from knotwork.robot.joint_axes import joint_axes
from knotwork.waypoints import CartesianWaypoint

PANDA = kw.load_robot("panda")
XARM = kw.load_robot("xarm7")


def stops_at(robot: kw.Robot, configurations: Any, seconds: float = 4.0) -> list[dict]:
    waypoints = []
    for q in configurations:
        pose = robot.forward(q)
        placed = {
            "position": pose.translation.tolist(),
            "rotation_matrix": pose.rotation.tolist(),
        }
        waypoints.append({"pose": placed, "after": seconds, "stop": True})
    return waypoints


def anywhere(robot: kw.Robot, seed: int, count: int) -> np.ndarray:
    """Configurations within 95 % of the limits, or of a turn where there is none."""
    generator = np.random.default_rng(seed)
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    lower, upper = np.maximum(lower, -2 * np.pi), np.minimum(upper, 2 * np.pi)
    within = generator.uniform(-0.95, 0.95, (count, robot.dof))
    return 0.5 * (lower + upper) + 0.5 * (upper - lower) * within


def rules_of(robot: kw.Robot) -> JointRules:
    limit, endless, one = robot.velocity_limit, np.full(7, np.inf), np.ones(7)
    return JointRules(limit, limit, -endless, endless, np.zeros(7, dtype=bool), one, 0 * one)


@pytest.mark.parametrize(("robot", "seed"), [(PANDA, 3), (XARM, 4)])
def test_refinement_keeps_poses_and_reduces_cost(robot: kw.Robot, seed: int) -> None:
    q = anywhere(robot, seed, 5)
    generator = np.random.default_rng(seed)
    twists = 0.05 * generator.uniform(-1, 1, (5, 6))
    waypoints = []
    for i, (x, twist) in enumerate(zip(q, twists, strict=True)):
        arguments = robot.forward(x), pin.Motion(twist)
        waypoints.append(CartesianWaypoint(str(i), 15.0 * i, *arguments))
    times = np.array([w.time for w in waypoints])
    v = solve_velocities(robot, joint_axes(robot).jacobians(q), twists)[0]
    free: list[CartesianWaypoint | None] = list(waypoints)
    free[2] = None
    steps = [StepRules(duration) for duration in np.diff(times)]
    refined = refine_sequence(robot, RefinementTask(rules_of(robot), steps, free), q, v)
    np.testing.assert_array_equal(refined[2], q[2])
    for before, after in zip(q, refined, strict=True):
        error = robot.forward(before).actInv(robot.forward(after))
        assert np.abs(error.homogeneous - np.eye(4)).max() < 1e-8
    assert (refined >= robot.lower_position_limit).all()
    assert (refined <= robot.upper_position_limit).all()

    def cost(positions: np.ndarray) -> float:
        travel = np.linalg.norm(np.diff(positions, axis=0) / robot.velocity_limit, axis=1)
        near = weights(robot, positions)
        return float((travel * (near[:-1] + near[1:]) / 2).sum())

    assert cost(refined) < cost(q)


def test_near_ignores_whole_turns() -> None:
    q, near = anywhere(XARM, 6, 2)
    pose = CartesianWaypoint("a", 0.0, XARM.forward(q), pin.Motion.Zero())
    task = RefinementTask(rules_of(XARM), (), [pose], near)
    turn = np.zeros(7)
    turn[6] = -2 * np.pi * np.sign(q[6])
    still = np.zeros((1, 7))
    here, turned = (refine_sequence(XARM, task, one[None], still)[0] for one in (q, q + turn))
    assert np.abs(here - q).max() > 0.05
    np.testing.assert_allclose(turned, here + turn, atol=1e-6)


def test_weights_grow_near_limits_and_singularities() -> None:
    for q in anywhere(PANDA, 6, 20):
        smallest = np.linalg.svd(PANDA.jacobian(q), compute_uv=False)[-1]
        room = min((q - PANDA.lower_position_limit).min(), (PANDA.upper_position_limit - q).min())
        expected = 1 + max(0, 1 - smallest / 0.05) ** 2 + max(0, 1 - room / 0.2) ** 2
        assert weights(PANDA, q[None])[0] == pytest.approx(expected, rel=1e-6)


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
    plain, pulled = kw.plan(PASSING), kw.plan({**PASSING, "pull_to_middle": 0.2})
    assert plain.report.ok
    assert pulled.report.ok
    q, v = plain.joint_waypoints.position, plain.joint_waypoints.velocity
    np.testing.assert_array_equal(pulled.joint_waypoints.position, q)
    extra = pulled.joint_waypoints.velocity - v
    np.testing.assert_array_equal(extra[[0, 2]], 0)  # at rest all joints rest
    np.testing.assert_allclose(PANDA.jacobian(q[1]) @ extra[1], 0, atol=1e-12)
    middle = 0.5 * (PANDA.lower_position_limit + PANDA.upper_position_limit)
    scale = PANDA.velocity_limit
    assert (extra[1] / scale) @ ((middle - q[1]) / scale) > 0
    wild = kw.plan({**PASSING, "pull_to_middle": 100}).joint_waypoints.velocity[1]
    use = np.abs(wild) / PANDA.velocity_limit
    assert use.max() == pytest.approx(1.0)  # as far as the velocity limits let it


def test_pull_to_middle_needs_redundant_arm() -> None:
    task = {"robot": "ur5", "pull_to_middle": 1, "waypoints": PASSING["waypoints"]}
    with pytest.raises(RobotError, match="pull_to_middle: robot 'ur5': is not redundant: it has 6"):
        kw.plan(task)
    with pytest.raises(DocumentError, match="pull_to_middle"):
        kw.plan({**PASSING, "pull_to_middle": -1})


@pytest.mark.parametrize("branch", ["keep", "fixed"])
@pytest.mark.parametrize("robot", ["panda", "xarm7", "planar2"])
def test_refuses_branch_of_arm_without_branches(robot: str, branch: str) -> None:
    arm = kw.load_robot(robot)
    waypoints = stops_at(arm, [arm.configuration("home")])
    task = {"robot": robot, "branch": branch, "start": "home", "waypoints": waypoints}
    with pytest.raises(BranchError, match=f"branch: {branch} has no meaning for {robot}.* near: "):
        kw.plan(task)
    kw.plan({**task, "branch": "free", "near": "home"})
