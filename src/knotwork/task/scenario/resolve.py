"""Resolve a scenario file to a `Scenario` in SI in the robot's base frame."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knotwork.files import documents
from knotwork.files.documents import Location, Places
from knotwork.task import Limits, PlainTask, Task
from knotwork.task.scenario.event_reader import EventReader, with_waits
from knotwork.task.scenario.repetitions import expand_repeats
from knotwork.task.scenario.scenario import SMALLEST_PATH_TOLERANCE, Scenario
from knotwork.task.scenario.scene_reader import read_scene
from knotwork.task.scenario.unknowns import read_unknowns
from knotwork.task.scenario.waypoint_reader import WaypointReader
from knotwork.task.si_units import in_si, si_factors
from knotwork.task.task_source import read_document
from knotwork.units import Units


def load_scenario(reference: str | Path | Mapping[str, Any] | Task) -> Scenario:
    """Read a scenario: a shipped one by name, a file by path, a mapping like a file, or a task.

    Args:
        reference: Name, path, mapping or task.

    Returns:
        The task in SI units, poses in the base frame.

    Raises:
        DocumentError: The file can't be read or has wrong content; the message lists every problem
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
    return resolve_task(documents.validate(Task, document), document.places)


def resolve_task(
    task: Task, places: Places | None = None, expected: Mapping[int, float] | None = None
) -> Scenario:
    """Resolve a task: see `load_scenario`.

    Args:
        task: The task, in its own units.
        places: Locations of its parts in its file, for messages.
        expected: Expected times of waypoints with a chosen time [s], by their index
            in the task.

    >>> ends = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
    >>> resolve_task(kw.Task(waypoints=ends)).times
    array([0., 2.])
    """
    return _Resolver(*expand_repeats(task, places or Places()), expected or {}).scenario()


NEEDING_ROBOT = {
    *("tool", "gravity", "near", "branch", "prefer", "pull_to_middle", "ways"),
    *("scene", "collisions"),
}
"""Keys of a file that need a robot."""


class _Resolver:
    """Resolver of a task. The steps share its units, frames and locations."""

    def __init__(self, task: PlainTask, places: Places, expected: Mapping[int, float]) -> None:
        self.task, self.places = task, places
        self.length, self.angle = si_factors(self.task.units)
        self.file = with_waits(in_si(self.task, self.length, self.angle))
        self.reader = WaypointReader(self.file, places, self.length, self.angle, expected)

    def scenario(self) -> Scenario:
        file, source = self.file, self.places.file
        if file.robot is None:
            self._check_joints_alone()
        elif file.joint_units:
            raise self.places.error(
                ("joint_units",), "is for scenarios without a robot, which defines its joints"
            )
        if isinstance(file.robot, dict):
            self._check_description_in_si(file.robot)
        if file.frame is not None or file.frames:
            self.reader.frames.find(file.frame or "base", ("frame",))
        self._check_tolerances()
        waypoints, paths = self.reader.waypoints()
        unknowns = read_unknowns(file, self.places, self.reader.indices)
        if file.frames:
            unknowns = self.reader.carriers.mark_arrivals(unknowns, self.reader.indices)
        units = Units(file.units.length, file.units.angle)
        events = EventReader(file, self.places, units, waypoints, paths, self.reader.indices)
        return Scenario(
            name=file.name or (source.stem if source is not None else "scenario"),
            waypoints=waypoints,
            task=file,
            given=self.task,
            index=self.reader.indices,
            paths=paths,
            units=units,
            frames={name: self.reader.frames[name].copy() for name in file.frames},
            events=events.events(timed=unknowns is None),
            unknowns=unknowns,
            pose_frame_link=self.reader.carriers.link if file.frames else "",
            motion_limits=self._motion_limits(),
            scene=read_scene(self.reader, waypoints),
            places=self.places,
        )

    def _check_description_in_si(self, robot: Mapping[str, Any]) -> None:
        """Refuse a robot description, which is in SI, in a file with other units."""
        if self.length == self.angle == 1.0:
            return
        for key in ("locked", "configurations", "limits", "external_axes"):
            if robot.get(key):
                raise self.places.error(
                    ("robot", key),
                    "is in SI like every robot description, but the file has other units",
                    "a robot file of its own, units m and rad, or the scenario's own limits",
                )

    def _check_joints_alone(self) -> None:
        """Refuse keys that need a robot in a file without one."""
        file, places = self.file, list[Location]()
        for i, waypoint in enumerate(file.waypoints):
            keys = [key for key in ("pose", "way") if getattr(waypoint, key, None) is not None]
            if isinstance(getattr(waypoint, "joints", None), str):
                keys.append("joints")
            places += [("waypoints", i, key) for key in keys]
        if isinstance(file.start, str):
            places.append(("start",))
        given = file.model_fields_set & NEEDING_ROBOT
        places += [(key,) for key in sorted(given) if getattr(file, key) not in ("free", "travel")]
        limits = ("tool_speed", "tool_acceleration", "frame_speed", "singular_value")
        places += [("limits", key) for key in limits if getattr(file.limits, key) is not None]
        if places:
            raise self.places.error(
                places[0],
                "needs a robot, and the file names none",
                "robot: the name of one (`knotwork robots` lists them) or a path",
            )

    def _motion_limits(self) -> Limits:
        limits = self.file.limits
        frames = [
            limit.model_copy(update={"speed": limits.margin * limit.speed})
            for limit in limits.frame_speeds
        ]
        tool = {
            key: limits.margin * value
            for key in ("tool_speed", "tool_acceleration")
            if (value := getattr(limits, key)) is not None
        }
        return limits.model_copy(update={**tool, "frame_speed": tuple(frames)})

    def _check_tolerances(self) -> None:
        tolerances = self.file.tolerances
        for name in ("path", "path_orientation", "path_speed"):
            value = getattr(tolerances, name)
            if value < SMALLEST_PATH_TOLERANCE:
                given_value = getattr(self.task.tolerances, name)
                raise self.places.error(
                    ("tolerances", name),
                    f"is {given_value:g}, below the resolution of floating point",
                    f"at least {SMALLEST_PATH_TOLERANCE * given_value / value:.4g}",
                )
