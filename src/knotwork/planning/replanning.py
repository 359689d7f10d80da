"""Another task that begins during the execution of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from knotwork.curves.trajectory import JointTrajectory
from knotwork.curves.trajectory.motion_events import signals_on_at
from knotwork.errors import InputError
from knotwork.errors.plain_text import default_waypoint_name
from knotwork.planning.remaining_scene import held_at
from knotwork.task import Action, EndAcceleration, PlainTask, Task
from knotwork.task.scenario import Scenario, resolve_task
from knotwork.task.scenario.event_reader import action_of
from knotwork.task.scenario.joint_space import by_joint, moved_robot
from knotwork.task.scenario.repetitions import expand_repeats
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.si_units import si_factors


def scenario_from(
    motion: JointTrajectory,
    at: float,
    scenario: str | Path | Mapping[str, Any] | Task,
    current: Scenario | None = None,
) -> Scenario:
    """A task that starts from the state of a motion at a given time: see `Plan.replan`.

    Args:
        motion: The motion in execution.
        at: Its time that is time 0 of the task [s].
        scenario: The new task.
        current: The scenario of the motion, if known.

    Raises:
        InputError: The time is outside the motion, a held object is missing in the task, the task
            is for another robot, or it is wrong.
    """
    task, _ = expand_repeats(scenario if isinstance(scenario, Task) else Task.load(scenario))
    resolved = resolve_task(_task_from(motion, at, task, current))
    if resolved.task.robot is not None:
        with resolved.error_context("robot"):
            names = moved_robot(resolved).joint_names
            if set(names) != set(motion.joint_names):
                raise InputError(
                    f"has the joints {', '.join(names)}; the motion that it continues has "
                    f"{', '.join(motion.joint_names)}"
                )
    return replace(resolved, continued_motion=(motion, at))


def _task_from(
    motion: JointTrajectory, at: float, task: PlainTask, current: Scenario | None
) -> Task:
    """A task with the state of a motion at a time [s] as its first waypoint, at time 0."""
    q, v, a = (motion(at, nu) for nu in range(3))
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
    units = si_factors(task.units)
    actions = [] if replaced is None else list(replaced.actions)
    immediate = [x for x in actions if x.after is x.before is x.at is None]
    switched: set[str | int | None] = {action.output for action in immediate}
    switched |= {task.outputs.get(key, key) for action in immediate for key in action.signals}
    kept_on = [
        Action(**action_of(event, task.outputs))
        for event in signals_on_at(motion.events, at)
        if task.outputs.get(event.name, event.signal) not in switched
    ]
    state: dict[str, Any] = {
        "name": name,
        "time": 0.0,
        "joints": by_joint(motion, q, *units),
        "velocity": by_joint(motion, v, *units),
    }
    if kept_on or actions:
        state["do"] = [*kept_on, *actions]
    ends = {"start": by_joint(motion, a, *units)}
    if isinstance(task.end_acceleration, EndAcceleration):
        ends["end"] = task.end_acceleration.end
    return task.replace(start=None, waypoints=[state, *goals], end_acceleration=ends)
