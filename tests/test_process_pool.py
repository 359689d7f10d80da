"""What is made in one process can be used in another, and copied."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork import Plan
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import KnotworkError, UnknownNameError, UnreachablePoseError

FAILING = Path(__file__).parent / "failing"
COPIES: list[Callable[[Any], Any]] = [
    copy.copy,
    copy.deepcopy,
    lambda thing: pickle.loads(pickle.dumps(thing)),
]


@pytest.fixture(scope="module")
def pool() -> Iterator[ProcessPoolExecutor]:
    """One other process, which shares no memory with this one."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as executor:
        yield executor


def assert_same_bits(one: JointTrajectory, other: JointTrajectory) -> None:
    assert one.polynomial.c.tobytes() == other.polynomial.c.tobytes()
    assert one.breaks.tobytes() == other.breaks.tobytes()
    assert np.asarray(one.waypoint_times).tobytes() == np.asarray(other.waypoint_times).tobytes()
    assert (one.joint_names, one.joint_units, one.planner) == (
        other.joint_names,
        other.joint_units,
        other.planner,
    )
    assert one.continuity == other.continuity


def assert_same_robot(one: kw.Robot, other: kw.Robot) -> None:
    assert one.joint_names == other.joint_names
    q = np.linspace(0.2, 0.9, one.dof)
    assert np.array_equal(one.forward(q).homogeneous, other.forward(q).homogeneous)
    assert np.array_equal(one.jacobian(q), other.jacobian(q))
    assert np.array_equal(one.torque(q, q, q), other.torque(q, q, q))
    for name in ("lower_position_limit", "upper_position_limit", "velocity_limit"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert dict(one.locked) == dict(other.locked)
    assert one.configurations.keys() == other.configurations.keys()


def test_a_plan_made_in_another_process(pool: ProcessPoolExecutor, deburring: Plan) -> None:
    other = pool.submit(kw.plan, "ur5_deburring").result()
    assert_same_bits(other.trajectory, deburring.trajectory)
    assert other.report == deburring.report
    assert other.report_to_dict() == deburring.report_to_dict()
    assert other.scenario.waypoints[0].name == deburring.scenario.waypoints[0].name
    assert np.array_equal(other.joint_waypoints.position, deburring.joint_waypoints.position)
    robot, ours = other.space.robot, deburring.space.robot
    assert_same_robot(robot, ours)
    pose = ours.forward(deburring.joint_waypoints.position[0])
    solutions = [branch.q for branch in robot.solve_pose_ik_all(pose)]
    assert np.array_equal(solutions, [branch.q for branch in ours.solve_pose_ik_all(pose)])
    assert kw.plan(other.scenario).report == deburring.report


def test_what_is_made_here_is_checked_there(pool: ProcessPoolExecutor, deburring: Plan) -> None:
    sent = pool.submit(kw.check, deburring.trajectory, deburring.scenario, space=deburring.space)
    assert sent.result() == deburring.report


def test_an_error_of_another_process_is_raised_here(pool: ProcessPoolExecutor) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'ur5_deburring'") as unknown:
        pool.submit(kw.plan, "ur5_deburing").result()
    assert "ur5_deburring" in unknown.value.available
    with pytest.raises(UnreachablePoseError) as unreachable:
        pool.submit(kw.plan, FAILING / "unreachable_far.yaml").result()
    assert unreachable.value.closest_distance > 0.1
    with pytest.raises(KnotworkError, match="waypoints"):
        pool.submit(kw.plan, FAILING / "several_problems.yaml").result()
    assert pool.submit(kw.robot_names).result() == kw.robot_names()  # the pool still works


@pytest.mark.parametrize("copied", COPIES, ids=["copy", "deepcopy", "pickle"])
def test_read_only_copies(copied: Callable[[Any], Any], deburring: Plan, paper_case: Plan) -> None:
    for plan in (deburring, paper_case):
        other = copied(plan)
        assert_same_bits(other.trajectory, plan.trajectory)
        assert other.report == plan.report
        for array in (
            other.trajectory.breaks,
            other.trajectory.polynomial.c,
            other.trajectory.waypoint_times,
            other.joint_waypoints.position,
            other.joint_waypoints.velocity,
        ):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0.0
    spline = kw.ModifiedHermiteSpline([0, 1, 3], [0, 1, 0], [0, 0.5, 0])
    assert np.array_equal(copied(spline).c, spline.c)
    assert copied(spline)(0.7) == spline(0.7)


@pytest.mark.parametrize("copied", COPIES, ids=["copy", "deepcopy", "pickle"])
def test_a_copy_of_a_robot_has_its_own_memory(copied: Callable[[Any], Any]) -> None:
    robot = kw.load_robot("kinova").with_limits(acceleration=3.0)
    other = copied(robot)
    assert_same_robot(other, robot)
    assert np.array_equal(other.acceleration_limit, robot.acceleration_limit)
    # Its working memory is its own.
    q = np.linspace(0.2, 0.9, robot.dof)
    pose = robot.forward(q)
    other.forward(q[::-1])
    assert robot.data is not other.data
    assert np.array_equal(robot.forward(q).homogeneous, pose.homogeneous)
