"""Self-motion of seven joints: away from limits and singularities, towards the middle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork.errors import BranchError, DocumentError, RobotError
from knotwork.robot.kinematics.sequence import travel_weights

PANDA = kw.load_robot("panda")


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


def test_weights_grow_near_limits_and_singularities() -> None:
    for q in anywhere(PANDA, 6, 20):
        smallest = np.linalg.svd(PANDA.jacobian(q), compute_uv=False)[-1]
        room = min((q - PANDA.lower_position_limit).min(), (PANDA.upper_position_limit - q).min())
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
    wild = kw.plan({**PASSING, "pull_to_middle": 1000}).joint_waypoints.velocity[1]
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
