"""Clearance between two motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.task import OtherRobot
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace, joint_space
from knotwork.task.scenario.resolve import resolve_task
from knotwork.verification.collisions import nearest_to
from knotwork.verification.finding import Finding


def clearance_between(
    trajectory: JointTrajectory,
    scenario: Scenario,
    other: Mapping[str, Any],
    *,
    space: JointSpace | None = None,
) -> Finding:
    """Prove that the motions of two robots are clear of each other, or find their contact.

    A contact has a location and a time.

    Args:
        trajectory: The motion.
        scenario: Its task, with the margin and rules of collisions.
        other: The other robot, with the keys of `scene: {robots: …}`, such as `scenario`, `motion`,
            `in`, `position` and `delay`.
        space: The scenario's joints and robot, if loaded already.

    Returns:
        The pair with the minimum clearance: `ok`, `value` [m], `time` [s] and `message`.

    Raises:
        InputError: A scenario or a motion is wrong, or the other motion fails its own check.

    >>> plan, other = kw.plan("ur5_deburring"), {"scenario": "ur5_deburring", "in": "block"}
    >>> clearance_between(plan.trajectory, plan.scenario, other).ok
    False
    """
    robot = OtherRobot(**other)
    name = Path(robot.scenario).stem
    scene = scenario.given.scene
    with_other = scene.model_copy(update={"robots": {**scene.robots, name: robot}})
    resolved_scene = resolve_task(scenario.given.replace(scene=with_other), scenario.places).scene
    space = space if space is not None else joint_space(scenario)
    nearest = nearest_to(trajectory, replace(scenario, scene=resolved_scene), space, name)
    if nearest is None:
        raise InputError(f"{scenario.name} and {robot.scenario} have no shapes that can collide")
    return nearest
