"""The scene from a given time on, which becomes time zero."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.scenario import GraspedObject, Scenario
from knotwork.task import SceneObject, Task
from knotwork.task.si_units import si_factors
from knotwork.task.surroundings import SHAPES
from knotwork.task.task_part import plain

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.scenario.joint_space import JointSpace
    from knotwork.trajectory import JointTrajectory
    from knotwork.waypoints import FloatArray

NEAR = 1e-9
"""Objects taken within this time before the end [s] are not yet held."""


def held_at(scenario: Scenario, at: float) -> list[str]:
    """Names of the objects held at a time [s]."""
    times = {one.name: one.time for one in scenario.waypoints}
    held = scenario.scene.held
    return [one.name for one in held if times[one.take] <= at < times[one.leave]]


def on_moving_frames(task: Task) -> list[int]:
    """Indices of the waypoints of a task in moving frames."""
    frames = task.frames

    def moves(name: str | None) -> bool:
        while name in frames:
            if frames[name].moves is not None:
                return True
            name = frames[name].parent
        return False

    given = enumerate(task.waypoints)
    return [i for i, one in given if moves(getattr(one, "frame", None) or task.frame)]


def scene_from(
    scenario: Scenario,
    robot: Robot | None,
    motion: JointTrajectory,
    span: tuple[float, float],
    ends: tuple[str, str],
) -> Task:
    """The task with its scene from a time on, which becomes time 0.

    Objects held at that time are held from the first waypoint on. Objects released before or
    taken later belong to the scene. Moving frames and robots continue.

    Args:
        scenario: The scenario of the motion.
        robot: Its robot.
        motion: The planned motion.
        span: Time interval of the planned motion that is executed [s].
        ends: Names of the waypoints at these times.
    """
    task, (first, last) = scenario.task, span
    times = [one.time for one in scenario.waypoints]
    place = {one.name: i for i, one in enumerate(scenario.waypoints)}
    holds: dict[str, Any] = {}
    objects: dict[str, Any] = {}

    def there(one: Any, name: str | None) -> Any:
        """The new task's object for one that appears at a waypoint; `None` if it appears later."""
        since = first if name is None else times[place[name]]
        return None if last < since else one.replace(appears=name if first < since else None)

    for name, one in task.scene.objects.items():
        objects[name] = there(one, one.appears)
    for held in scenario.scene.held:
        take, leave = place[held.take], place[held.leave]
        asked = task.tool.holds[held.name]  # type: ignore[union-attr]  # it holds something
        if times[take] < last - NEAR and first < times[leave]:
            holds[held.name] = there(asked, held.appears).replace(
                take=held.take if first < times[take] else ends[0],
                leave=held.leave if times[leave] <= last else ends[1],
            )
            continue
        i = take if last - NEAR <= times[take] else leave
        near = times[max(i - 1, 0)] <= last and first <= times[min(i + 1, len(times) - 1)]
        pose = robot.forward(motion(times[i]))  # type: ignore[union-attr]
        objects[held.name] = there(_lying(scenario, held, i, pose, near=near), held.appears)
    tool = None if task.tool is None else task.tool.replace(holds=holds or None)
    return _moved_on(
        task.replace(tool=tool), {name: one for name, one in objects.items() if one}, first
    )


def _moved_on(task: Task, objects: dict[str, Any], first: float) -> Task:
    """The task with other objects, and with moving frames and robots shifted to a time [s]."""
    frames = {
        name: one
        if one.moves is None
        else one.replace(moves=one.moves.replace(at=one.moves.at - first))
        for name, one in task.frames.items()
    }
    given = task.scene.robots.items()
    robots = {name: one.replace(delay=one.delay - first) for name, one in given}
    scene = task.scene.replace(objects=objects or None, robots=robots or None)
    # without a robot there is no scene, not even an empty one
    return task.replace(frames=frames or None, scene=scene if objects or robots else None)


def _lying(
    scenario: Scenario, held: GraspedObject, i: int, pose: Any, *, near: bool
) -> SceneObject:
    """A held object at the place where the tool takes or releases it, at waypoint i."""
    task, carrier = scenario.task, held.carriers[scenario.waypoints[i].name == held.leave]
    asked = task.tool.holds[held.name]  # type: ignore[union-attr]
    placed, parent = pose * held.shape.placement, "base"
    if carrier is not None:
        given = task.waypoints[scenario.index[i]]
        parent = getattr(given, "frame", None) or task.frame or "base"
        placed = carrier.at(scenario.waypoints[i].time).actInv(placed)
    shape = {key: getattr(asked, key) for key in (*SHAPES, "scale", "exact")}
    where = plain(placed)
    where["position"] = (placed.translation / si_factors(task.units)[0]).tolist()
    return SceneObject(
        **{key: value for key, value in shape.items() if value is not None},
        **where,
        parent=parent,
        allow=[*held.allow, *(["tool"] if near else [])],
    )


def by_joint(
    joints: JointSpace | JointTrajectory, values: FloatArray, length: float, angle: float
) -> dict[str, float]:
    """Values by joint in the units of a file."""
    units = np.where(np.array(joints.joint_units) == "m", length, angle)
    return dict(zip(joints.joint_names, (values / units).tolist(), strict=True))
