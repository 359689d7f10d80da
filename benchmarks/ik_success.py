"""How often inverse kinematics succeeds, from anywhere, from close by, and at the edge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

import knotwork as kw
from ik_arms import ARMS, TOLERANCE, arm, box, misses
from knotwork.arrays import FloatArray
from knotwork.errors import KnotworkError, UnreachablePoseError
from knotwork.robot import Robot
from knotwork.robot.joint_axes import JointAxes


def success(poses: int) -> dict[str, Any]:
    """Solved poses of each arm, from anywhere and from 0.1 rad away."""
    arms: list[dict[str, Any]] = []
    edge = max(1, poses // 10)
    for name in ARMS:
        robot, generator = arm(name), np.random.default_rng(42)
        lower, upper = box(robot)
        counts = [0, 0, 0, 0]
        for i in range(poses):
            q = generator.uniform(lower, upper)
            pose = robot.forward(q)
            start = generator.uniform(lower, upper)
            counts[0] += _solved(robot, pose, start) is not None
            near = np.clip(q + generator.uniform(-0.1, 0.1, robot.dof), lower, upper)
            found = _solved(robot, pose, near)
            counts[1] += found is not None
            if found is not None:
                away = np.linalg.norm(found - near)
                counts[2] += bool(away <= np.linalg.norm(q - near) + 1e-6)
            if i < edge:
                side = generator.integers(0, 3, robot.dof)
                q = np.select([side == 0, side == 1], [lower, upper], q)
                counts[3] += _solved(robot, robot.forward(q), start) is not None
        keys = ("from_anywhere", "from_near", "kept_near", "at_limits")
        row = {"arm": name, "poses": poses, **dict(zip(keys, counts, strict=True))}
        arms.append({**row, "poses_at_limits": edge})
    return {"poses": poses, "beyond": _beyond(edge), "arms": arms, "singular": singular(edge)}


def _solved(robot: Robot, pose: Any, start: FloatArray) -> FloatArray | None:
    try:
        q = kw.solve_pose_ik(robot, pose, start).q
    except KnotworkError:
        return None
    return q if misses(robot, pose, q) <= TOLERANCE else None


SINGULAR: dict[str, dict[str, dict[int, float]]] = {
    "ur5": {
        "wrist": {4: 0.0},
        "elbow": {2: 0.0},
        "wrist and elbow": {2: 0.0, 4: 0.0},
        "full stretch": {1: -np.pi / 2, 2: 0.0, 3: 0.0, 4: 0.0},
    },
    "panda": {"shoulder and wrist": {1: 0.0, 5: 0.0}, "straight": {1: 0.0, 2: 0.0, 5: 0.0}},
    "kinova": {"elbow": {2: np.pi}, "wrist": {4: np.pi}},
}


def singular(poses: int) -> list[dict[str, Any]]:
    """Solved poses at singularities, from anywhere."""
    rows: list[dict[str, Any]] = []
    for name, places in SINGULAR.items():
        robot, generator = arm(name), np.random.default_rng(43)
        lower, upper = box(robot)
        for where, fixed in places.items():
            solved = 0
            for _ in range(poses):
                q = generator.uniform(lower, upper)
                q[list(fixed)] = list(fixed.values())
                pose = robot.forward(q)
                solved += _solved(robot, pose, generator.uniform(lower, upper)) is not None
            rows.append({"arm": name, "where": where, "solved": solved, "poses": poses})
    solved = 0
    robot, generator = arm("ur5"), np.random.default_rng(44)
    lower, upper = box(robot)
    for _ in range(poses):
        q = _shoulder_singular(robot, generator.uniform(lower, upper))
        pose = robot.forward(q)
        solved += _solved(robot, pose, generator.uniform(lower, upper)) is not None
    return [*rows, {"arm": "ur5", "where": "shoulder", "solved": solved, "poses": poses}]


def _beyond(poses: int) -> dict[str, Any]:
    """How many poses a micrometre beyond the full stretch of a UR5 are refused."""
    robot, generator = arm("ur5"), np.random.default_rng(48)
    lower, upper = box(robot)
    refused = 0
    for _ in range(poses):
        q = generator.uniform(lower, upper)
        q[1:5] = -np.pi / 2, 0.0, 0.0, generator.choice([-1.0, 1.0]) * np.pi / 2
        pose = robot.forward(q)
        # The direction that no joint moves the tool in, as a screw: metres and radians alike.
        lost = np.linalg.svd(robot.jacobian(q))[0][:, -1]
        for away in (1e-6, -1e-6):
            there = pin.SE3(
                pin.exp3(away * lost[3:]) @ pose.rotation, pose.translation + away * lost[:3]
            )
            try:
                kw.solve_pose_ik(robot, there, generator.uniform(lower, upper))
            except UnreachablePoseError:
                refused += 1
    return {"arm": "ur5", "refused": refused, "poses": poses}


def _shoulder_singular(robot: Robot, q: FloatArray) -> FloatArray:
    """Turn joint 2 of a UR arm until the wrist is above its shoulder axis."""
    from knotwork.robot.kinematics.geometry.configuration_flags import (
        _evaluate_flag_functions,
        find_axis_geometry,
    )

    found, chain = find_axis_geometry(robot), JointAxes(robot)
    if found is None:
        raise RuntimeError("the arm has no shoulder")
    grid = np.linspace(-np.pi, np.pi, 721)

    def side(angle: float) -> float:
        turned = q.copy()
        turned[1] = angle
        return float(_evaluate_flag_functions(chain, found, turned[None])[0, 0])

    values = [side(angle) for angle in grid]
    for a, b, low, high in zip(grid, grid[1:], values, values[1:], strict=False):
        if low * high < 0:
            for _ in range(60):
                middle = 0.5 * (a + b)
                if side(middle) * low > 0:
                    a = middle
                else:
                    b = middle
            turned = q.copy()
            turned[1] = a
            return turned
    return _shoulder_singular(robot, np.roll(q, 1))
