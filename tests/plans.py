"""Plans: of shipped scenarios, each made once in a process, and of tasks that pass."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import knotwork as kw


@cache
def planned(scenario: str | Path, planner: str | None = None) -> kw.Plan:
    return kw.plan(scenario, planner=planner)


def passing_plan(scenario: Any, **options: Any) -> kw.Plan:
    """The plan of a task, held to pass its check."""
    plan = kw.plan(scenario, **options)
    plan.report.raise_if_failed()
    return plan


def assert_same_bits(one: kw.JointTrajectory, other: kw.JointTrajectory) -> None:
    """Hold two motions equal to the last bit."""
    assert one.polynomial.c.tobytes() == other.polynomial.c.tobytes()
    assert one.breaks.tobytes() == other.breaks.tobytes()
    assert np.asarray(one.waypoint_times).tobytes() == np.asarray(other.waypoint_times).tobytes()
    for name in ("joint_names", "joint_units", "origin", "continuity"):
        assert getattr(one, name) == getattr(other, name), name


def pose_of(robot: kw.Robot, q: Any) -> dict[str, Any]:
    """The pose of the tool at joint values, as a task gives it."""
    pose = robot.forward(q)
    return {"position": pose.translation.tolist(), "rotation_matrix": pose.rotation.tolist()}


def arm(plan: kw.Plan) -> kw.Robot:
    """The robot of a plan that has one."""
    return plan.joints.robot
