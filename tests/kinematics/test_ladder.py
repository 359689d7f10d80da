"""Ways up a ladder of sampled configurations, looked at by plain Pinocchio."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import knotwork as kw
from knotwork.robot.description import VirtualJoint
from knotwork.robot.kinematics.following.ladder import Ladder
from plain import tool_frames

tp = kw.tool_paths


def line(robot: kw.Robot) -> tuple[Any, np.ndarray]:
    """A line of 300 mm at 50 mm/s, and starts of it."""
    home = robot.forward(robot.configurations["home"])
    start = home.translation - [0.0, 0.15, 0.0]
    path = tp.ToolPath(
        [tp.Line(start, start + np.array([0.0, 0.3, 0.0]))],
        tp.OrientationCurve.constant(home.rotation, 0.3),
    )
    motion = tp.TimedPath(path, tp.speed_profile([0.3], [0.05], acceleration=1.0))
    found = kw.solve_pose_ik_all(robot, motion.pose(0.0), spread=8)
    return motion, np.array([one.q for one in found])


def test_guides_are_on_the_path_within_limits_and_clear() -> None:
    robot = kw.load_robot("panda")
    motion, starts = line(robot)

    def clear(q: np.ndarray, time: float) -> np.ndarray:
        return np.asarray(np.abs(q[:, 2]) < 0.8)

    guides = list(Ladder(robot, [motion], starts, clear).guided_starts(12))
    assert guides
    for start, (guide,) in guides:
        np.testing.assert_allclose(guide.posture(0.0), starts[start], atol=1e-12)
        rungs = guide.postures.x
        for s, q in zip(rungs, guide.posture(rungs), strict=True):
            (pose,), asked = tool_frames(robot, [q]), motion.path.pose(s)
            assert np.linalg.norm(pose.translation - asked.translation) < 1e-8
            assert np.linalg.norm(pin.log3(pose.rotation.T @ asked.rotation)) < 1e-8
            assert np.abs(q[2]) < 0.8
        q = guide.posture(np.linspace(0.0, 0.3, 200))
        assert (robot.lower_position_limit <= q).all()
        assert (q <= robot.upper_position_limit).all()
        off = [
            np.linalg.norm(
                tool_frames(robot, [one])[0].translation[[0, 2]] - asked.translation[[0, 2]]
            )
            for one in q
        ]
        assert max(off) < 2e-3


def test_no_guide_where_all_collides() -> None:
    robot = kw.load_robot("panda")
    motion, starts = line(robot)
    ladder = Ladder(robot, [motion], starts, lambda q, time: np.full(len(q), time < 3.0))
    assert not list(ladder.guided_starts(12))


@pytest.mark.parametrize("turns", [0, 1])
def test_guide_depends_on_its_start_only(turns: int) -> None:
    robot = kw.load_robot("ur5").with_virtual_joints(VirtualJoint("turn", "z", -0.4, 0.4))
    motion, starts = line(robot)
    guides = dict(Ladder(robot, [motion], starts, None).guided_starts(12))
    start = next(iter(guides))
    turned = starts[start] - 2.0 * np.pi * turns * np.sign(starts[start]) * (np.arange(7) == 3)
    ((_, (guide,)),) = Ladder(robot, [motion], turned[None], None).guided_starts(12)
    s = np.linspace(0.0, 0.3, 50)
    gap = guide.posture(s) - guides[start][0].posture(s) - (turned - starts[start])
    assert np.abs(gap).max() < 1e-6
