"""Self-motion of seven joints: away from limits and singularities between waypoints, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.errors import BranchError, DocumentError, RobotError
from knotwork.kinematics.chain.velocity import solve_velocities
from knotwork.kinematics.sequence import Given, Rules, interval_nearness, refine_sequence, weights
from knotwork.kinematics.sequence.nearness import SINGULAR_MARGIN, limit_nearness
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


def margins(plan: kw.Plan) -> tuple[float, float]:
    """Least room to a limit [rad] and least singular value, sampled densely."""
    robot = plan.space.robot
    assert robot is not None
    trajectory = plan.trajectory
    q = trajectory(np.linspace(trajectory.start_time, trajectory.end_time, 800))
    room = np.minimum(q - robot.lower_position_limit, robot.upper_position_limit - q).min()
    singular = [np.linalg.svd(robot.jacobian(x), compute_uv=False)[-1] for x in q]
    return float(room), float(min(singular))


def passing_task(seed: int) -> dict[str, Any]:
    """Three poses that a Panda passes at speed, the last one at rest."""
    generator = np.random.default_rng(seed)
    lower, upper = PANDA.lower_position_limit + 0.05, PANDA.upper_position_limit - 0.05
    q = PANDA.configuration("home") + generator.uniform(-0.9, 0.9, (3, 7))
    q = np.clip(q, lower, upper)
    waypoints = stops_at(PANDA, q, 1.5)
    for waypoint, x in zip(waypoints[:-1], q, strict=False):
        del waypoint["stop"]
        twist = PANDA.twist(x, generator.uniform(-0.6, 0.6, 7))
        waypoint["velocity"] = {"linear": twist.linear.tolist(), "angular": twist.angular.tolist()}
    # of limits alone: what collides is left out
    free = {"self": False}
    return {"robot": "panda", "start": "home", "waypoints": waypoints, "collisions": free}


WAYPOINTS_ALONE = np.array([[-0.031, 0.120], [0.083, 0.145], [0.045, 0.187]])
"""Margins of three motions that are chosen with an eye on their waypoints alone: one of them breaks
a limit between them."""


def test_margins_are_larger_with_an_eye_on_the_way_between() -> None:
    with_it = np.array([margins(kw.plan(passing_task(seed))) for seed in (12, 19, 27)])
    assert (with_it[:, 0] > WAYPOINTS_ALONE[:, 0] + 0.03).all()
    assert with_it[:, 0].min() > 0.03
    assert (with_it[:, 1] > 0.9 * WAYPOINTS_ALONE[:, 1]).all()


@pytest.mark.parametrize(("robot", "seed"), [(PANDA, 3), (XARM, 4)])
def test_refinement_keeps_the_poses_and_never_costs_more(robot: kw.Robot, seed: int) -> None:
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
    rules = Rules(robot.velocity_limit, robot.velocity_limit, np.zeros(7, dtype=bool))
    refined = refine_sequence(robot, Given(times, rules, free), q, v)
    np.testing.assert_array_equal(refined[2], q[2])
    for before, after in zip(q, refined, strict=True):
        error = robot.forward(before).actInv(robot.forward(after))
        assert np.abs(error.homogeneous - np.eye(4)).max() < 1e-8
    assert (refined >= robot.lower_position_limit).all()
    assert (refined <= robot.upper_position_limit).all()

    def cost(positions: np.ndarray) -> tuple[float, float]:
        speeds = solve_velocities(robot, joint_axes(robot).jacobians(positions), twists)[0]
        ends = (positions[:-1], speeds[:-1]), (positions[1:], speeds[1:])
        travel = np.linalg.norm(np.diff(positions, axis=0) / robot.velocity_limit, axis=1)
        near = weights(robot, positions)
        at_ends = near[:-1], near[1:]
        mean, most, beyond = interval_nearness(robot, *ends, np.diff(times), ends=at_ends)
        weighted = travel * (1 + mean) + np.diff(times) * most
        return round(float(beyond.sum()), 9), float(weighted.sum())

    assert cost(refined) < cost(q)


def test_whole_turns_do_not_matter_for_what_is_near() -> None:
    q, near = anywhere(XARM, 6, 2)
    pose = CartesianWaypoint("a", 0.0, XARM.forward(q), pin.Motion.Zero())
    rules = Rules(XARM.velocity_limit, XARM.velocity_limit, np.zeros(7, dtype=bool))
    given = Given(np.zeros(1), rules, [pose], near)
    turn = np.zeros(7)
    turn[6] = -2 * np.pi * np.sign(q[6])
    still = np.zeros((1, 7))
    here, turned = (refine_sequence(XARM, given, one[None], still)[0] for one in (q, q + turn))
    assert np.abs(here - q).max() > 0.05
    np.testing.assert_allclose(turned, here + turn, atol=1e-6)


def test_the_nearness_of_a_way_is_that_along_it() -> None:
    q = anywhere(PANDA, 5, 2)
    v = np.random.default_rng(5).uniform(-1, 1, (2, 7))
    # The cubic by its Bézier points, looked at far more often than is done.
    points = np.array([q[0], q[0] + 2 / 3 * v[0], q[1] - 2 / 3 * v[1], q[1]])
    s = np.linspace(0, 1, 2001)[:, None]
    basis = np.hstack([(1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3])
    near = weights(PANDA, basis @ points) - 1
    interval = (q[:1], v[:1]), (q[1:], v[1:]), np.array([2.0])
    at_ends = weights(PANDA, q[:1]), weights(PANDA, q[1:])
    mean, most, beyond = interval_nearness(PANDA, *interval, samples=1999, ends=at_ends)
    assert near.max() > 0
    assert mean[0] == pytest.approx(((near[1:] + near[:-1]) / 2).mean(), rel=1e-9)
    assert most[0] == pytest.approx(near.max(), rel=1e-9)
    for x in (basis @ points)[::400], basis @ points:
        smallest = np.linalg.svd(joint_axes(PANDA).jacobians(x), compute_uv=False)[:, -1]
        singular = np.maximum(0.0, 1.0 - smallest / SINGULAR_MARGIN) ** 2
        expected = 1 + limit_nearness(PANDA, x) + singular
        np.testing.assert_allclose(weights(PANDA, x), expected, rtol=0, atol=1e-12)
    assert singular.max() > 0
    low, high = PANDA.lower_position_limit, PANDA.upper_position_limit
    q_on_way = basis @ points
    assert beyond[0] == pytest.approx(max(0.0, (low - q_on_way).max(), (q_on_way - high).max()))
    ends, worse, _ = interval_nearness(PANDA, *interval, samples=0, ends=at_ends)
    assert ends[0] == pytest.approx((near[0] + near[-1]) / 2)
    assert worse[0] == pytest.approx(max(near[0], near[-1]))


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


def test_joints_are_pulled_to_the_middle_where_the_tool_passes_at_speed() -> None:
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


def test_a_pull_to_the_middle_needs_a_redundant_arm() -> None:
    task = {"robot": "ur5", "pull_to_middle": 1, "waypoints": PASSING["waypoints"]}
    with pytest.raises(RobotError, match="pull_to_middle: robot 'ur5': is not redundant: it has 6"):
        kw.plan(task)
    with pytest.raises(DocumentError, match="pull_to_middle"):
        kw.plan({**PASSING, "pull_to_middle": -1})


@pytest.mark.parametrize("branch", ["keep", "fixed"])
@pytest.mark.parametrize("robot", ["panda", "xarm7", "planar2"])
def test_branches_are_refused_where_there_are_none(robot: str, branch: str) -> None:
    arm = kw.load_robot(robot)
    waypoints = stops_at(arm, [arm.configuration("home")])
    task = {"robot": robot, "branch": branch, "start": "home", "waypoints": waypoints}
    with pytest.raises(BranchError, match=f"branch: {branch} has no meaning for {robot}.* near: "):
        kw.plan(task)
    kw.plan({**task, "branch": "free", "near": "home"})
