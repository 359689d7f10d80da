"""Resolve a scenario file to a `Scenario` in SI in the robot's base frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from knotwork.files import documents
from knotwork.files.documents import Location, Locations
from knotwork.files.documents.values import is_marked, unit_of
from knotwork.task import ExpandedTask, Limits, MotionLimits, Task, ToolTolerances
from knotwork.task.scenario.event_reader import EventReader
from knotwork.task.scenario.repetitions import expand_repeats
from knotwork.task.scenario.scenario import MIN_PATH_TOLERANCE, Scenario
from knotwork.task.scenario.scene_reader import read_scene
from knotwork.task.scenario.task_reading import TaskReading
from knotwork.task.scenario.unknowns_reader import read_unknowns
from knotwork.task.scenario.waypoint_reader import read_waypoints
from knotwork.task.si_units import to_si
from knotwork.task.task_part import TaskPart
from knotwork.task.task_source import read_document
from knotwork.units import SI


def load_scenario(reference: str | Path | Mapping[str, Any] | Task) -> Scenario:
    """Read a scenario: a shipped one by name, a file by path, a mapping like a file, or a task.

    Args:
        reference: Name, path, mapping or task.

    Returns:
        The task in SI units, poses in the base frame.

    Raises:
        DocumentError: The file can't be read or has wrong content; `problems` has each problem
            with its line, field, value and the accepted values.
        InputError: The file is missing, or describes a robot.
        UnknownNameError: No scenario of this name is shipped.

    >>> load_scenario("ur5_deburring").waypoints[0].name
    'start'
    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    >>> load_scenario({"name": "swing", "waypoints": ends}).times
    array([0., 2.])
    """
    if isinstance(reference, Task):
        return resolve_task(reference)
    document = read_document(reference)
    return resolve_task(documents.validate(Task, document), document)


def resolve_task(
    task: Task, locations: Locations | None = None, expected: Mapping[int, float] | None = None
) -> Scenario:
    """Resolve a task: see `load_scenario`.

    Args:
        task: The task, in its own units.
        locations: Locations of its parts in its file, for messages.
        expected: Expected times of waypoints with a chosen time [s], by their index in the task.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    >>> resolve_task(kw.Task(waypoints=ends)).times
    array([0., 2.])
    """
    expanded, locations = expand_repeats(task, locations or Locations())
    reading = TaskReading(to_si(expanded, expanded.units), locations, expanded.units)
    _check_keys(reading, expanded)
    task_in_si = reading.task
    waypoints, paths, task_index = read_waypoints(reading, expected or {})
    unknowns = read_unknowns(task_in_si, reading.waypoint_unknowns, locations, task_index)
    if task_in_si.frames and unknowns is not None:
        unknowns = reading.pose_frames.with_time_dependent(unknowns, task_index)
    event_reader = EventReader(reading, waypoints, paths, task_index)
    file_name = "scenario" if locations.file is None else locations.file.stem
    return Scenario(
        name=expanded.name or file_name,
        waypoints=waypoints,
        task=expanded,
        planner=expanded.planner,
        tolerances=ToolTolerances.model_construct(
            **task_in_si.tolerances.model_dump(include={*ToolTolerances.model_fields})
        ),
        task_index=task_index,
        paths=paths,
        units=reading.units,
        events=event_reader.events(timed=unknowns is None),
        unknowns=unknowns,
        pose_frame_link=reading.pose_frames.link,
        motion_limits=_motion_limits(task_in_si.limits),
        scene=read_scene(reading, waypoints, task_index),
        locations=locations,
    )


def change_task(
    scenario: Scenario, task: ExpandedTask, expected: Mapping[int, float] | None = None
) -> Scenario:
    """A scenario with another task, from the same file and in continuation of the same motion.

    Args:
        scenario: The scenario.
        task: The changed task, repeats written out.
        expected: Expected times of waypoints with a chosen time [s], by index in the task.
    """
    resolved = resolve_task(task, scenario.locations, expected)
    return replace(resolved, continued_motion=scenario.continued_motion)


def _check_keys(reading: TaskReading, in_file_units: ExpandedTask) -> None:
    """Refuse keys that exclude each other, unknown frames and too small tolerances.

    Args:
        reading: The task in SI, with its frames.
        in_file_units: The task before its conversion to SI.
    """
    task, locations = reading.task, reading.locations
    if task.robot is None:
        _check_joints_alone(reading)
    elif task.joint_units:
        raise locations.error(
            ("joint_units",), "is for scenarios without a robot, which defines its joints"
        )
    if isinstance(task.robot, dict) and reading.units != SI:
        for key in ("locked", "configurations", "limits", "external_axes"):
            if task.robot.get(key):
                raise locations.error(
                    ("robot", key),
                    "is in SI like every robot description, but the file has other units",
                    "a robot file of its own, units m and rad, or the scenario's own limits",
                )
    if task.frame is not None or task.frames:
        reading.pose_frames.named.checked_name(task.frame or "base", ("frame",))
    for name in ("path", "path_orientation", "path_speed"):
        value, in_file = (getattr(x.tolerances, name) for x in (task, in_file_units))
        if value < MIN_PATH_TOLERANCE:
            raise locations.error(
                ("tolerances", name),
                f"is {in_file:g}, below the resolution of floating point",
                f"at least {MIN_PATH_TOLERANCE * in_file / value:.4g}",
            )


def _check_joints_alone(reading: TaskReading) -> None:
    """Refuse keys that need a robot, and configurations by name, in a task without one."""
    parts: dict[Location, TaskPart] = {
        ("waypoints", i): waypoint for i, waypoint in enumerate(reading.task.waypoints)
    }
    parts |= {(): reading.task, ("limits",): reading.task.limits}
    for location, part in parts.items():
        for key, field in type(part).model_fields.items():
            value = getattr(part, key)
            is_configuration = key in ("start", "joints") and isinstance(value, str)
            is_given = is_marked(field, "needs_robot") and value != field.get_default()
            if is_configuration or is_given:
                raise reading.locations.error(
                    (*location, key),
                    "needs a robot, and the file names none",
                    "robot: the name of one (`knotwork robots` lists them) or a path",
                )


def _motion_limits(limits: Limits) -> MotionLimits:
    """Limits on the motion of tool and links, scaled by their used fraction."""
    fraction = limits.used_fraction
    values = {name: getattr(limits, name) for name in MotionLimits.model_fields}
    for name, field in MotionLimits.model_fields.items():
        if unit_of(field) and values[name] is not None:  # a singular value has none
            values[name] *= fraction
    values["frame_speed"] = tuple(
        limit.model_copy(update={"speed": fraction * limit.speed}) for limit in limits.link_speeds
    )
    return MotionLimits.model_construct(**values)
