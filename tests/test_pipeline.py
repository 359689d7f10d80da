"""`plan` and `Plan` through the public interface, also in other processes and copied."""

from __future__ import annotations

import copy
import importlib
import json
import multiprocessing
import pickle
import re
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from operator import attrgetter
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import knotwork as kw
from knotwork import Plan
from knotwork.errors import KnotError, KnotworkError, UnknownNameError, UnreachablePoseError
from plans import assert_same_bits, passing_plan

TASK: dict[str, Any] = {
    "waypoints": [
        {"name": "A", "joints": {"a": 0, "b": 0}},
        {"name": "B", "joints": {"a": 1, "b": -1}, "velocity": {"a": 0.5}, "after": 1},
        {"name": "C", "joints": {"a": 1, "b": 0}, "after": 2},
    ]
}


def test_everything_public_can_be_had_from_the_package() -> None:
    for name in kw.__all__:
        assert getattr(kw, name) is not None
    assert set(kw.__all__) <= set(dir(kw))
    with pytest.raises(AttributeError, match="plann"):
        kw.plann  # noqa: B018


def test_the_package_offers_26_names_at_most() -> None:
    assert len(kw.__all__) <= 26
    assert not [name for name in kw.__all__ if isinstance(getattr(kw, name), ModuleType)]
    # All else that can be had from it is one of its packages.
    for name in set(dir(kw)) - set(kw.__all__):
        assert isinstance(getattr(kw, name), ModuleType), name


RENAMED = kw._RENAMED | {
    "robot.kinematics.Branch": "knotwork.robot.kinematics.PoseSolution",
    "verification.torque_bound": "knotwork.verification.effort_bound",
}


@pytest.mark.parametrize("old", RENAMED)
def test_an_old_name_works_and_warns_of_the_new_one(old: str) -> None:
    new_name = RENAMED[old]
    match = f"^knotwork.{old} is now {re.escape(new_name)};"
    with pytest.warns(DeprecationWarning, match=match) as seen:
        value = attrgetter(old)(kw)
    assert [warning.filename for warning in seen] == [__file__]
    module, _, attribute = new_name.rpartition(".")
    assert value is getattr(importlib.import_module(module), attribute)


@pytest.mark.parametrize(
    ("owner", "old", "new"),
    [
        ("joints.robot", "jerk_limit", "limits.jerk"),
        ("joints.robot", "held", "held_payloads"),
        ("joints.robot", "torque", "effort"),
        ("joints.robot", "frame_names", "link_names"),
        ("trajectory", "planner", "origin"),
        ("report", "planner", "origin"),
    ],
)
def test_an_old_attribute_works_and_warns(deburring: Plan, owner: str, old: str, new: str) -> None:
    with pytest.warns(DeprecationWarning, match=rf"\w+\.{old} is now {new};") as seen:
        value = attrgetter(f"{owner}.{old}")(deburring)
    assert [warning.filename for warning in seen] == [__file__]
    assert np.array_equal(value, attrgetter(f"{owner}.{new}")(deburring))


def test_a_scenario_comes_as_mapping_file_path_or_loaded(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(json.dumps(TASK))
    plans = [kw.plan(TASK), kw.plan(path), kw.plan(str(path)), kw.plan(kw.load_scenario(TASK))]
    for plan in plans:
        assert plan.report.ok
        np.testing.assert_array_equal(
            plan.trajectory.polynomial.c, plans[0].trajectory.polynomial.c
        )
    assert plans[0].joint_waypoints.names == ("A", "B", "C")
    np.testing.assert_array_equal(plans[0].joint_waypoints.velocity[1], [0.5, 0])


def test_the_planner_can_be_overridden() -> None:
    plain = kw.plan(TASK, planner="cubic")
    assert plain.trajectory.origin == "cubic"
    assert not plain.report.ok  # its acceleration jumps
    assert kw.plan({**TASK, "continuity": 1}, planner="cubic").report.ok
    np.testing.assert_allclose(kw.plan(TASK).trajectory.breaks, [0, 0.618, 1 + 0.382 * 2, 3])
    balanced = kw.plan({**TASK, "knots": {"balanced": 0.25}})
    np.testing.assert_allclose(balanced.trajectory.breaks, [0, 0.75, 1.25, 3])
    balanced = kw.plan(TASK, planner="modified-hermite:balanced")
    np.testing.assert_allclose(balanced.trajectory.breaks, [0, 0.8, 1.2, 3])
    plan = passing_plan({**TASK, "knots": [0, 0.5, 2, 3]})
    np.testing.assert_array_equal(plan.trajectory.breaks, [0, 0.5, 2, 3])


def test_wrong_knots_name_the_waypoint_and_the_interval() -> None:
    with pytest.raises(
        KnotError,
        match=r"^knots: between waypoint 'B' and waypoint 'C': .*strictly between",
    ) as caught:
        kw.plan({**TASK, "knots": [0, 0.5, 0.9, 3]})
    assert caught.value.waypoint_index == 1
    assert caught.value.interval == (1.0, 3.0)


def test_turns_follow_the_motion_also_with_near() -> None:
    pose = {"position": [0.45, 0.1, 0.35], "rpy": [3.141592653589793, 0, 0]}
    task: dict[str, Any] = {"robot": "ur5", "waypoints": [{"pose": pose, "after": 9}]}
    home = kw.plan({**task, "start": "home"})
    names, q = home.trajectory.joint_names, home.joint_waypoints.position[1]
    turned = q - 2 * np.pi * np.sign(q) * (np.arange(6) == 5)
    start = dict(zip(names, turned.tolist(), strict=True))
    before = kw.plan({**task, "start": start}).joint_waypoints.position
    np.testing.assert_allclose(before, [turned, turned], atol=1e-6)
    # near chooses the branch, but does not wind joints back in mid-motion
    near = kw.plan({**task, "start": start, "near": "home"}).joint_waypoints.position
    np.testing.assert_allclose(near, [turned, turned], atol=1e-6)


def test_limits_of_the_scenario_take_the_place_of_the_robot_s() -> None:
    base = {"robot": "ur5", "waypoints": [{"joints": "home"}, {"joints": "home", "after": 1}]}
    own = kw.plan(base).joints
    given = {"velocity": {"elbow_joint": 90}, "acceleration": 180, "effort": 100}
    limits = kw.plan({**base, "units": {"angle": "deg"}, "limits": given}).joints.limits
    index = own.joint_names.index("elbow_joint")
    assert limits["velocity"][index] == pytest.approx(np.pi / 2)
    others = np.arange(6) != index
    np.testing.assert_array_equal(limits["velocity"][others], own.limits["velocity"][others])
    np.testing.assert_allclose(limits["acceleration"], np.pi)
    np.testing.assert_array_equal(limits["effort"], 100)  # N m in any unit of angle


def test_without_a_robot_joints_may_slide() -> None:
    task: dict[str, Any] = {
        "units": {"length": "mm", "angle": "deg"},
        "joint_units": {"slide": "m"},
        "limits": {"velocity": {"slide": 200, "turn": 90}},
        "waypoints": [
            {"joints": {"slide": 0, "turn": 0}},
            {"joints": {"slide": 100, "turn": 45}, "time": 1},
        ],
    }
    plan = kw.plan(task)
    assert plan.trajectory.joint_units == ("m", "rad")
    np.testing.assert_allclose(plan.trajectory.position(1.0), [0.1, np.pi / 4])
    peak = {(finding.name, finding.quantity): finding for finding in plan.report.findings}
    assert peak["slide", "velocity"].limit == pytest.approx(0.2)
    assert peak["slide", "velocity"].unit == "m/s"


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


def assert_same_robot(one: kw.Robot, other: kw.Robot) -> None:
    assert one.joint_names == other.joint_names
    q = np.linspace(0.2, 0.9, one.dof)
    assert np.array_equal(one.forward(q).homogeneous, other.forward(q).homogeneous)
    assert np.array_equal(one.jacobian(q), other.jacobian(q))
    assert np.array_equal(one.effort(q, q, q), other.effort(q, q, q))
    for name in ("lower", "upper", "velocity"):
        assert np.array_equal(getattr(one.limits, name), getattr(other.limits, name))
    assert dict(one.locked) == dict(other.locked)
    assert one.configurations.keys() == other.configurations.keys()


def test_a_plan_made_in_another_process(pool: ProcessPoolExecutor, deburring: Plan) -> None:
    other = pool.submit(kw.plan, "ur5_deburring").result()
    assert_same_bits(other.trajectory, deburring.trajectory)
    assert other.report == deburring.report
    assert other.report_to_dict() == deburring.report_to_dict()
    assert other.scenario.waypoints[0].name == deburring.scenario.waypoints[0].name
    assert np.array_equal(other.joint_waypoints.position, deburring.joint_waypoints.position)
    robot, ours = other.joints.robot, deburring.joints.robot
    assert_same_robot(robot, ours)
    pose = ours.forward(deburring.joint_waypoints.position[0])
    solutions = [branch.q for branch in robot.solve_pose_ik_all(pose)]
    assert np.array_equal(solutions, [branch.q for branch in ours.solve_pose_ik_all(pose)])
    again = kw.plan(other.scenario)  # and once more in this process
    assert_same_bits(again.trajectory, deburring.trajectory)
    assert again.report == deburring.report


def test_what_is_made_here_is_checked_there(pool: ProcessPoolExecutor, deburring: Plan) -> None:
    sent = pool.submit(kw.check, deburring.trajectory, deburring.scenario, joints=deburring.joints)
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
    assert np.array_equal(other.limits.acceleration, robot.limits.acceleration)
    # Its working memory is its own.
    q = np.linspace(0.2, 0.9, robot.dof)
    pose = robot.forward(q)
    other.forward(q[::-1])
    assert robot.data is not other.data
    assert np.array_equal(robot.forward(q).homogeneous, pose.homogeneous)
