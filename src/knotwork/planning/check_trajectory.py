"""Checks of a stored motion with or without its task, and of the clearance between two motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import InputError
from knotwork.files import documents
from knotwork.files.documents import Document, Location, validate
from knotwork.files.documents.values import marked
from knotwork.files.foreign import read_trajectory
from knotwork.planning.replanning import waypoint_at_state
from knotwork.task import OtherRobot, Task, Tool
from knotwork.task.scenario import Scenario, load_scenario, resolve_task
from knotwork.task.scenario.scenario_joints import (
    ScenarioJoints,
    read_scenario_joints,
    robot_with_tool,
)
from knotwork.task.task_source import read_document
from knotwork.verification import Finding, check
from knotwork.verification.checks import CHECKS, NeedsTask
from knotwork.verification.collisions import clearance_from_robot
from knotwork.verification.report import CheckedMotion


def check_with_task(path: str | Path, reference: str | Path) -> CheckedMotion:
    """Read a trajectory of any tool and check it against its scenario.

    Args:
        path: The trajectory.
        reference: Name or file of its scenario.

    Raises:
        InputError: A file can't be read, or the trajectory has other joints.
    """
    scenario = load_scenario(reference)
    joints = read_scenario_joints(scenario)
    span = float(scenario.times[0]), float(scenario.times[-1])
    motion, defects = read_trajectory(path, joints.joint_names, joints.joint_units, span=span)
    report = check(motion, scenario, joints=joints, defects=defects)
    return CheckedMotion(scenario, joints, None, motion, report)


def check_without_task(
    path: str | Path,
    robot: str | Path | None = None,
    scene: str | Path | None = None,
    limits: Mapping[str, Any] | str | Path | None = None,
) -> CheckedMotion:
    """Read a trajectory of any tool and check it for limits, collisions and continuity.

    Args:
        path: The trajectory.
        robot: Name or file of its robot; by default the one named in the scene.
        scene: Name or file of a scenario. All of it is used but what defines its motion, such as
            waypoints; so no object may be held or appear at one.
        limits: Limits in place of the robot's and the scene's, in its units: a mapping, the path
            of a file, or YAML.

    Raises:
        InputError: A file can't be read or is wrong, no robot is named, or an object of the scene
            refers to a waypoint.
    """
    surroundings = read_document(scene) if scene is not None else Document({})
    if not isinstance(surroundings.data, dict):
        accepted = "keys of a scenario, such as robot, tool, scene and limits"
        raise surroundings.error((), "is not a mapping", accepted)
    replaced = marked(Task, "defines_motion")
    data = {key: value for key, value in surroundings.data.items() if key not in replaced}
    own_limits = data.get("limits") or {}
    if limits is not None and isinstance(own_limits, dict):  # anything else is refused below
        data["limits"] = {**own_limits, **_limits(limits)}
    if robot is not None:
        data["robot"] = Path(robot).resolve().as_posix() if Path(robot).is_file() else str(robot)
    if not data.get("robot"):
        raise InputError(f"{path} needs its robot: give the robot, or a scene that names it")
    # placeholders: the ends of the motion can't be read before the robot is known
    data["waypoints"] = [{"joints": "home"}, {"joints": "home", "after": 1}]
    task = validate(Task, replace(surroundings, data=data)).replace(name=Path(path).name)
    _refuse_waypoint_names(task, surroundings)
    named = robot_with_tool(resolve_task(task, surroundings))
    motion, defects = read_trajectory(
        path, named.joint_names, named.joint_units, owner=f"robot {named.name!r}"
    )
    if set(motion.joint_names) != set(named.joint_names):
        raise InputError(
            f"{path} moves {', '.join(motion.joint_names)}; robot {named.name!r} has "
            f"{', '.join(named.joint_names)}"
        )
    scenario = resolve_task(task.replace(waypoints=_ends(motion, task)), surroundings)
    joints = read_scenario_joints(scenario)
    # the ends of the motion are its own waypoints
    without = [name for name, function in CHECKS.items() if isinstance(function, NeedsTask)]
    report = check(motion, scenario, joints=joints, defects=defects, without=without)
    return CheckedMotion(scenario, joints, None, motion, report)


def _refuse_waypoint_names(task: Task, surroundings: Document) -> None:
    """Refuse objects that are held or appear at waypoints, because a scene has none."""
    objects = task.scene.objects.items()
    held: list[Location] = [("tool", "holds", name) for name in (task.tool or Tool()).holds]
    appearing = [("scene", "objects", name, "appears") for name, item in objects if item.appears]
    if held + appearing:
        raise surroundings.error(
            (held + appearing)[0],
            "refers to waypoints, which are not read from a scene",
            "a scene without it, or the whole scenario with --scenario",
        )


def _ends(motion: JointTrajectory, task: Task) -> list[dict[str, Any]]:
    """The two ends of a motion as waypoints of a task."""
    return [
        waypoint_at_state(motion, time, task, name)
        for name, time in (("start", motion.start_time), ("end", motion.end_time))
    ]


def _limits(source: Mapping[str, Any] | str | Path) -> Mapping[str, Any]:
    """Limits from a mapping, a file or YAML."""
    if isinstance(source, Mapping):
        return source
    is_file = Path(source).is_file()
    data = (documents.read(Path(source)) if is_file else documents.parse(str(source), None)).data
    limits = data.get("limits", data) if isinstance(data, dict) else data
    if not isinstance(limits, dict):
        accepted = "a file with limits, or YAML such as '{acceleration: 8, jerk: 400}'"
        raise InputError(f"limits are {source!r}; accepted: {accepted}")
    return limits


def clearance_between(
    trajectory: JointTrajectory,
    scenario: Scenario,
    other: Mapping[str, Any],
    *,
    joints: ScenarioJoints | None = None,
) -> Finding:
    """Prove that the motions of two robots are clear of each other, or find their contact.

    A contact has a location and a time.

    Args:
        trajectory: The motion.
        scenario: Its scenario, with the margin and rules of collisions.
        other: The other robot, with the keys of `scene: {robots: …}`, such as `scenario`, `motion`,
            `in`, `position` and `delay`.
        joints: The scenario's joints and robot, if loaded already.

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
    scene = scenario.task.scene
    with_other = scene.model_copy(update={"robots": {**scene.robots, name: robot}})
    resolved_scene = resolve_task(scenario.task.replace(scene=with_other), scenario.locations).scene
    joints = joints if joints is not None else read_scenario_joints(scenario)
    nearest = clearance_from_robot(
        trajectory, replace(scenario, scene=resolved_scene), joints, name
    )
    if nearest is None:
        raise InputError(f"{scenario.name} and {robot.scenario} have no shapes that can collide")
    return nearest
