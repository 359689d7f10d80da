"""Plans of shipped scenarios, each made once in a process."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import knotwork as kw


@cache
def planned(scenario: str | Path, planner: str | None = None) -> kw.Plan:
    return kw.plan(scenario, planner=planner)


def arm(plan: kw.Plan) -> kw.Robot:
    """The robot of a plan that has one."""
    assert plan.space.robot is not None
    return plan.space.robot
