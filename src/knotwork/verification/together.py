"""How near two motions come to one another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pinocchio as pin

from knotwork.documents import resources
from knotwork.errors import InputError
from knotwork.scenario import OtherRobot, Scenario, load_scenario
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.trajectory import JointTrajectory
from knotwork.verification.collisions import nearest_to
from knotwork.verification.finding import Finding


def clearance_between(
    trajectory: JointTrajectory,
    scenario: Scenario,
    other: str | Path,
    *,
    motion: str | Path | None = None,
    frame: str | None = None,
    delay: float = 0.0,
    space: JointSpace | None = None,
) -> Finding:
    """Prove that a motion is clear of another robot's, or find where and when it comes too near.

    Args:
        trajectory: The motion.
        scenario: Its task, whose margin and rules of collisions hold.
        other: The other robot's scenario: a shipped one's name, or a path.
        motion: File of its recorded motion; by default its scenario is planned.
        frame: Frame of the first scenario, or `"base"`, that its base frame stands in; by default
            both are arms of one cell, parts of one URDF.
        delay: How much later than the first motion its own begins [s].
        space: The first scenario's joints and robot, if they have been loaded already.

    Returns:
        The pair that comes nearest: `ok`, `value` [m], `time` [s] and `message` say how.

    Raises:
        InputError: A scenario or a motion is wrong, the other's fails its own check, or it is not
            known where it stands.

    >>> plan = kw.plan("ur5_deburring")
    >>> clearance_between(plan.trajectory, plan.scenario, "ur5_deburring", frame="block").ok
    False
    """
    space = space if space is not None else joint_space(scenario)
    robot = space.robot
    if robot is None:
        raise InputError(f"{scenario.name} names no robot, which the other could come near to")
    source = resources.find("scenarios", other)
    second = joint_space(load_scenario(source)).robot
    if second is None:
        raise InputError(f"{other} names no robot, which {scenario.name} could come near to")
    name = source.stem
    placement = pin.SE3.Identity()
    cell = frame is None
    if cell:
        if robot.urdf != second.urdf or set(robot.joint_names) & set(second.joint_names):
            raise InputError(
                f"it is not known where robot {second.name!r} of {other} stands from "
                f"{robot.name!r}; accepted: a frame of {scenario.name} that its base frame stands "
                f"in, with --in ({', '.join(('base', *scenario.frames))}), or arms of one URDF"
            )
        placement = robot.base_placement.inverse() * second.base_placement
    elif frame != "base":
        placement = _frame(scenario, frame or "")
    given = OtherRobot(name, placement, source, Path(motion) if motion else None, delay, cell)
    scene = replace(scenario.scene, robots=(*scenario.scene.robots, given))
    both = replace(scenario, scene=scene)
    found = nearest_to(trajectory, both, space, name)
    if found is None:
        raise InputError(f"{scenario.name} and {other} have no shapes that could come near")
    return found


def _frame(scenario: Scenario, frame: str) -> Any:
    if frame in scenario.frames and frame not in scenario.scene.moving:
        return scenario.frames[frame]
    standing = [name for name in scenario.frames if name not in scenario.scene.moving]
    fault = "moves" if frame in scenario.frames else "is unknown"
    raise InputError(
        f"{scenario.name}: frame {frame!r} {fault}; accepted: {', '.join(('base', *standing))}"
    )
