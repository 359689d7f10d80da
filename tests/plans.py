"""Plans of shipped scenarios, each made once in a process."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import knotwork as kw


@cache
def planned(scenario: str | Path, planner: str | None = None) -> kw.Plan:
    return kw.plan(scenario, planner=planner)


def assert_same_bits(one: kw.JointTrajectory, other: kw.JointTrajectory) -> None:
    """Hold two motions equal to the last bit."""
    assert one.polynomial.c.tobytes() == other.polynomial.c.tobytes()
    assert one.breaks.tobytes() == other.breaks.tobytes()
    assert np.asarray(one.waypoint_times).tobytes() == np.asarray(other.waypoint_times).tobytes()
    for name in ("joint_names", "joint_units", "origin", "continuity"):
        assert getattr(one, name) == getattr(other, name), name


def arm(plan: kw.Plan) -> kw.Robot:
    """The robot of a plan that has one."""
    return plan.joints.robot
