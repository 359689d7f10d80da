"""Hold a robot task true in a test suite of your own.

    pytest examples/test_my_task.py

The check knows nothing of the planner: it recomputes pose and speed at each waypoint by forward
kinematics, and compares the exact extrema of each joint with its limits.
"""

import numpy as np
import pytest

import knotwork as kw


@pytest.fixture(scope="module")
def plan() -> kw.Plan:
    """The task under test; a path to a file of yours would do as well."""
    return kw.plan("ur5_deburring")


def test_every_pose_speed_and_limit_is_kept(plan: kw.Plan) -> None:
    plan.report.raise_if_failed()


def test_no_joint_comes_near_its_speed_limit(plan: kw.Plan) -> None:
    for found in plan.report.select(subject="joint", quantity="velocity"):
        assert found.utilisation is not None
        assert found.utilisation < 0.5, found


def test_the_tool_stays_on_the_edge(plan: kw.Plan) -> None:
    robot = plan.joints.robot
    assert robot is not None
    on_edge = np.linspace(5.0, 11.0, 200)  # s
    points = np.array([robot.forward(q).translation for q in plan.trajectory(on_edge)])
    along = (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])
    off = np.linalg.norm(np.cross(points - points[0], along), axis=1)
    assert off.max() < 0.05e-3  # metres


def test_a_stop_at_each_waypoint_is_noticed() -> None:
    stopping = kw.plan("ur5_deburring", planner="trapezoidal")
    with pytest.raises(kw.CheckFailedError, match="velocity"):
        stopping.report.raise_if_failed()
