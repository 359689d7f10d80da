"""Tasks that begin during the execution of a motion, with the scene from that time on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from knotwork.curves.retiming import find_first_rest
from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE, signals_on_at
from knotwork.errors import InputError
from knotwork.errors.plain_text import default_waypoint_name
from knotwork.files.documents.values import marked
from knotwork.task import Action, EndAcceleration, ExpandedTask, Placement, SceneObject, Task
from knotwork.task.scenario import PlacedHeldObject, Scenario, resolve_task
from knotwork.task.scenario.event_reader import action_of
from knotwork.task.scenario.repetitions import expand_repeats
from knotwork.task.scenario.scenario_joints import robot_with_tool, to_file_units
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.task_part import plain
from knotwork.task.task_waypoints import JointWaypoint, Waypoint
from knotwork.verification.report import CheckedMotion


def continued_scenario(
    motion: JointTrajectory,
    at: float,
    task: str | Path | Mapping[str, Any] | Task,
    current: Scenario | None = None,
) -> Scenario:
    """The scenario of a task that continues a motion at a given time: see `Plan.replan`.

    Args:
        motion: The motion in execution.
        at: Its time that is time 0 of the task [s].
        task: The new task.
        current: The scenario of the motion, if known.

    Raises:
        InputError: The time is outside the motion, a held object is missing in the task, the task
            is for another robot, or it is wrong.
    """
    expanded, _ = expand_repeats(task if isinstance(task, Task) else Task.load(task))
    resolved = resolve_task(_continued_task(motion, at, expanded, current))
    if resolved.task.robot is not None:
        with resolved.locations.errors_at("robot"):
            names = robot_with_tool(resolved).joint_names
            if set(names) != set(motion.joint_names):
                raise InputError(
                    f"has the joints {', '.join(names)}; the motion that it continues has "
                    f"{', '.join(motion.joint_names)}"
                )
    return replace(resolved, continued_motion=(motion, at))


def _continued_task(
    motion: JointTrajectory, at: float, task: ExpandedTask, current: Scenario | None
) -> Task:
    """A task with the state of a motion at a time [s] as its first waypoint, at time 0."""
    goals = [
        waypoint if waypoint.name else waypoint.replace(name=default_waypoint_name(i))
        for i, waypoint in enumerate(task.waypoints)
    ]
    replaced = goals.pop(0) if task.start is None and len(goals) > 1 else None
    name = START if replaced is None else replaced.name
    for held in held_at(current, at) if current is not None else ():
        if task.tool is None or held not in task.tool.holds:
            raise InputError(
                f"{task.name or 'the new task'}: the tool holds {held!r} at {at:g} s, which "
                f"the task omits; accepted: `tool: {{holds: {{{held}: {{from: {name}, to: …}}}}"
                "}` with its shape"
            )
    actions = [] if replaced is None else list(replaced.actions)
    before_waits = takewhile(lambda action: action.wait is None, actions)
    immediate = [x for x in before_waits if not (x.at or x.after or x.before)]
    switched: set[str | int | None] = {action.output for action in immediate}
    switched |= {task.outputs.get(key, key) for action in immediate for key in action.signals}
    kept_on = [
        Action(**action_of(event, task.outputs))
        for event in signals_on_at(motion.events, at)
        if task.outputs.get(event.name, event.signal) not in switched
    ]
    state = waypoint_at_state(motion, at, task, name, replaced) | {"time": 0.0}
    if replaced is not None and replaced.wait_time:
        if find_first_rest(motion.polynomial, at) != at:
            raise InputError(
                f"{task.name or 'the new task'}: {name!r} waits, but the motion is not at rest at "
                f"{at:g} s; accepted: no wait there, or a time at which the motion is at rest"
            )
        del state["velocity"]
        state["wait"] = replaced.wait
    if kept_on or actions:
        state["do"] = [*kept_on, *actions]
    ends = {"start": to_file_units(motion, motion(at, 2), task.units)}
    if isinstance(task.end_acceleration, EndAcceleration):
        ends["end"] = task.end_acceleration.end
    return task.replace(start=None, waypoints=[state, *goals], end_acceleration=ends)


def waypoint_at_state(
    motion: JointTrajectory,
    time: float,
    task: Task,
    name: str | None,
    reached: Waypoint | None = None,
) -> dict[str, Any]:
    """The state of a motion as a waypoint of a task.

    Args:
        motion: The motion.
        time: Its time [s].
        task: The task, in whose units the values are.
        name: Name of the waypoint.
        reached: The waypoint that the motion reaches there, if any. The new waypoint has those of
            its values that neither define the motion nor belong to a pose.
    """
    q, v = (to_file_units(motion, motion(time, nu), task.units) for nu in range(2))
    kept = JointWaypoint.model_fields.keys() - marked(JointWaypoint, "defines_motion")
    values = {} if reached is None else reached.to_dict()
    values = {key: value for key, value in values.items() if key in kept}
    return values | {"name": name, "time": time, "joints": q, "velocity": v}


def held_at(scenario: Scenario, at: float) -> list[str]:
    """Names of the objects held at a time [s]."""
    held, times = scenario.scene.held, scenario.times
    return [item.name for item in held if times[item.taken_at] <= at < times[item.released_at]]


def in_moving_frames(task: ExpandedTask) -> list[int]:
    """Indices in a task of the poses that are in moving frames."""
    return [
        i
        for i, waypoint in enumerate(task.waypoints)
        if not isinstance(waypoint, JointWaypoint) and task.is_moving_frame(task.frame_of(waypoint))
    ]


def task_with_scene_from(
    plan: CheckedMotion, span: tuple[float, float], ends: tuple[str, str]
) -> Task:
    """The task of a plan with its scene from a time on, which becomes time 0.

    Objects that are held at that time are held from the first waypoint on. Objects released before
    or taken later belong to the scene. Moving frames and robots continue.

    Args:
        plan: The planned motion.
        span: Time interval of the planned motion that is executed [s].
        ends: Names of the waypoints at these times.
    """
    scenario, task, (first, last) = plan.scenario, plan.scenario.task, span
    times = [waypoint.time for waypoint in scenario.waypoints]
    holds: dict[str, Any] = {}
    objects: dict[str, Any] = {}

    def shift_appearance(item: Any, i: int | None) -> Any:
        """An object that appears at waypoint i, or `None` if the execution ends before."""
        since, appears = first, None
        if i is not None and first < times[i]:
            since, appears = times[i], scenario.waypoints[i].name
        return None if last < since else item.replace(appears=appears)

    for item in scenario.scene.objects:
        objects[item.name] = shift_appearance(task.scene.objects[item.name], item.appears)
    for held in scenario.scene.held:
        taken, released = times[held.taken_at], times[held.released_at]
        if taken < last - TIME_TOLERANCE and first < released:
            task_object = task.tool.holds[held.name]  # type: ignore[union-attr]  # it holds something
            holds[held.name] = shift_appearance(task_object, held.appears).replace(
                taken_at=task_object.taken_at if first < taken else ends[0],
                released_at=task_object.released_at if released <= last else ends[1],
            )
        else:
            i = held.taken_at if last - TIME_TOLERANCE <= taken else held.released_at
            put_down = _put_down(plan, held, i, span)
            objects[held.name] = shift_appearance(put_down, held.appears)
    tool = None if task.tool is None else task.tool.replace(holds=holds or None)
    present = {name: item for name, item in objects.items() if item}
    frames = {
        name: frame.replace(moves=frame.moves and frame.moves.replace(at=frame.moves.at - first))
        for name, frame in task.frames.items()
    }
    robots = {
        name: other.replace(delay=other.delay - first) for name, other in task.scene.robots.items()
    }
    scene = task.scene.replace(objects=present or None, robots=robots or None)
    return task.replace(
        tool=tool,
        frames=frames or None,
        frame=_frame_of_joints(scenario),
        # without a robot there is no scene, not even an empty one
        scene=scene if present or robots else None,
    )


def _frame_of_joints(scenario: Scenario) -> str | None:
    """The frame of a task with joint values only, on the link that carries the poses, if any."""
    task, link = scenario.task, scenario.pose_frame_link
    return next((name for name, frame in task.frames.items() if frame.on == link), task.frame)


def _put_down(
    plan: CheckedMotion, held: PlacedHeldObject, i: int, span: tuple[float, float]
) -> SceneObject:
    """A held object that lies where the tool takes or releases it.

    The tool may touch it if the execution includes the motion from or to it.

    Args:
        plan: The planned motion.
        held: The object.
        i: Index in the scenario of the waypoint where it is taken or released.
        span: Time interval of the planned motion that is executed [s].
    """
    scenario, task = plan.scenario, plan.scenario.task
    waypoint, frame = scenario.waypoints[i], held.end_frames[i == held.released_at]
    near = [neighbour.time for neighbour in scenario.waypoints[max(i - 1, 0) : i + 2]]
    robot, q = plan.joints.robot, plan.trajectory(waypoint.time)
    tool = robot.tool_pose(q, in_world_frame=waypoint.in_world_frame)  # type: ignore[union-attr]
    placed, parent = tool * held.shape.placement, "base"
    if frame.is_moving:
        parent = task.frame_of(task.waypoints[scenario.task_index[i]])
        placed = frame.placement_at(waypoint.time).actInv(placed)
    elif scenario.pose_frame_link and not waypoint.in_world_frame:
        parent = _frame_of_joints(scenario) or "base"
        placed = scenario.frame_placements[parent].actInv(placed)
    task_object = task.tool.holds[held.name]  # type: ignore[union-attr]
    described = SceneObject.model_fields.keys() - Placement.model_fields.keys()
    shape = {key: getattr(task_object, key) for key in described & task_object.model_fields_set}
    place = plain(placed)
    place["position"] = (placed.translation / task.units.in_si[0]).tolist()
    is_near = near[0] <= span[1] and span[0] <= near[-1]
    allow = [*held.allow, *(["tool"] if is_near else [])]
    return SceneObject(**{**shape, **place, "parent": parent, "allow": allow})
