"""A task without repeats, in which each repetition has its own waypoints, frames and objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from knotwork.curves.tool_paths.points_file import read_points
from knotwork.files.documents import Location, Locations
from knotwork.files.documents.values import is_marked, marked
from knotwork.task import ExpandedTask, Frame, Grid, HeldObject, PlacesFile, Repeat, Task, Tool
from knotwork.task.scenario.scenario import Scenario
from knotwork.task.scenario.unknowns_reader import ends_wait
from knotwork.task.task_part import PartT, TaskPart

PLACE_FRAME = "place"
"""Name of the frame of the current place, in a repeated block."""

MAX_REPEATED_WAYPOINTS = 10_000
"""Maximum number of waypoints in all repetitions."""


def expand_repeats(
    task: Task, locations: Locations | None = None
) -> tuple[ExpandedTask, Locations]:
    """Write out every repetition of every block.

    Names of waypoints and objects of a block get the number of the repetition. In `allow`, the name
    of an object of a block means the objects of all repetitions.

    Args:
        task: The task, in its own units.
        locations: Locations of its parts in the file, for errors.

    Returns:
        The task without repeats, and the locations of its parts: for a repetition, that of the
        block.

    Raises:
        DocumentError: The places of a block are wrong, or a name is not unique.
    """
    locations = locations or Locations()
    if isinstance(task, ExpandedTask):
        return task, locations
    if any(isinstance(item, Repeat) for item in task.waypoints):
        return _Expansion(task, locations).result()
    return ExpandedTask.model_construct(task.model_fields_set, **dict(task)), locations


def repetition_starts(scenario: Scenario) -> list[list[int]]:
    """The first waypoint of each repetition of each block, by index in the scenario."""
    starts: dict[Location, list[int]] = {}
    for i, task_i in enumerate(scenario.task_index):
        location = scenario.locations.in_file(("waypoints", task_i))
        if location[2:] == ("repeat", 0) and not ends_wait(scenario.task_index, i):
            starts.setdefault(location[:2], []).append(i)
    return list(starts.values())


class _Expansion:
    """The parts of a task, with those of all repetitions."""

    def __init__(self, task: Task, locations: Locations) -> None:
        self.task, self.locations = task, locations
        self.frames = dict(task.frames)
        self.holds = dict(task.tool.holds) if task.tool is not None else {}
        self.waypoints: list[Any] = []
        self.origins: dict[Location, Location] = {}
        self.objects: dict[str, list[str]] = {}

    def result(self) -> tuple[ExpandedTask, Locations]:
        task = self.task
        if PLACE_FRAME in task.frames:
            raise self.locations.error(
                ("frames", PLACE_FRAME),
                "is the frame of the current place in repeat",
                "any other name",
            )
        for i, item in enumerate(task.waypoints):
            if isinstance(item, Repeat):
                self._add_block(item, ("waypoints", i))
            else:
                self._add(item, ("waypoints", i))
        parts: dict[str, Any] = {"waypoints": tuple(self.waypoints), "frames": self.frames}
        if self.holds:
            held = {name: self._expand_allow(held, name) for name, held in self.holds.items()}
            parts["tool"] = (task.tool or Tool()).model_copy(update={"holds": held})
        if task.scene.objects:
            objects = {name: self._expand_allow(item) for name, item in task.scene.objects.items()}
            parts["scene"] = task.scene.model_copy(update={"objects": objects})
        if task.collisions.ignore:
            pairs = (product(*map(self._bodies_named, pair)) for pair in task.collisions.ignore)
            ignore = tuple(pair for several in pairs for pair in several)
            parts["collisions"] = task.collisions.model_copy(update={"ignore": ignore})
        expanded_task = ExpandedTask.model_construct(
            task.model_fields_set | parts.keys(), **dict(task) | parts
        )
        return expanded_task, replace(self.locations, origins=self.origins)

    def _add_block(self, block: Repeat, location: Location) -> None:
        frames = [*self._frames_of(block, (*location, "over"))]
        if len(self.waypoints) + len(frames) * len(block.repeat) > MAX_REPEATED_WAYPOINTS:
            raise self.locations.error(
                (*location, "over"),
                f"makes {len(frames)} repetitions of {len(block.repeat)} waypoints",
                f"at most {MAX_REPEATED_WAYPOINTS} waypoints in all",
            )
        choices = [PLACE_FRAME, "base", *self.task.frames]
        for j, template in enumerate(block.repeat):
            name = getattr(template, "frame", None)
            if name is not None and name not in self.frames:
                self.locations.check_name((*location, "repeat", j, "frame"), "frame", name, choices)
        names = {template.name for template in block.repeat if template.name is not None}
        for number, frame in enumerate(frames, start=1):
            for j, template in enumerate(block.repeat):
                waypoint = _at_place(template, frame)
                if template.name is not None:
                    waypoint = waypoint.model_copy(update={"name": f"{template.name} {number}"})
                self._add(waypoint, (*location, "repeat", j))
            for name, held in block.holds.items():
                changes = {
                    key: f"{waypoint} {number}"
                    for key in marked(HeldObject, "names_waypoint")
                    if (waypoint := getattr(held, key)) in names
                }
                held = held.model_copy(update=changes)
                self._add_held(name, number, held, (*location, "holds", name))

    def _add(self, waypoint: Any, location: Location) -> None:
        self.origins["waypoints", len(self.waypoints)] = location
        self.waypoints.append(waypoint)

    def _add_held(self, name: str, number: int, held: HeldObject, location: Location) -> None:
        numbered = f"{name} {number}"
        if numbered in self.holds:
            raise self.locations.error(
                location, f"{numbered!r} of repetition {number} is held twice", "a unique name"
            )
        self.holds[numbered] = held
        self.objects.setdefault(name, []).append(numbered)
        self.origins["tool", "holds", numbered] = location

    def _bodies_named(self, name: str) -> Sequence[str]:
        """The objects of all repetitions with a name, or the name itself."""
        return self.objects.get(name, [name])

    def _expand_allow(self, item: Any, excluded: str = "") -> Any:
        """An object with the names in `allow` expanded to those of all repetitions."""
        if not any(name in self.objects for name in item.allow):
            return item
        names = (
            body for name in item.allow for body in self._bodies_named(name) if body != excluded
        )
        return item.model_copy(update={"allow": tuple(names)})

    def _frames_of(self, block: Repeat, location: Location) -> Iterator[str]:
        """The frame of each repetition; missing frames are made."""
        over = block.over
        frames = self.task.frames
        grids = {name: frame.grid for name, frame in frames.items() if frame.grid is not None}
        if isinstance(over, PlacesFile):
            yield from self._frames_in_file(over, (*location, "file"))
        elif isinstance(over, str):
            self.locations.check_name(location, "frame with a grid", over, grids)
            yield from self._grid_frames(over, grids[over])
        else:
            for k, frame in enumerate(over):
                if not isinstance(frame, str):
                    yield self._add_place(frame, (*location, k))
                    continue
                self.locations.check_name((*location, k), "frame", frame, frames)
                if frame in grids:
                    yield from self._grid_frames(frame, grids[frame])
                else:
                    yield frame

    def _frames_in_file(self, over: PlacesFile, location: Location) -> Iterator[str]:
        path = self.locations.named_file(over.file, location)
        points = read_points(path)
        if points.normals is not None:
            raise self.locations.error(
                location,
                f"{path} has normals, which leave the turn at a place open",
                "columns qx, qy, qz, qw, or positions alone",
            )
        for k, position in enumerate(points.points.tolist()):
            frame = Frame(position=position, parent=over.parent)
            if points.rotations is not None:
                frame = frame.replace(rotation_matrix=points.rotations[k])
            yield self._add_place(frame, location)

    def _grid_frames(self, name: str, grid: Grid) -> Iterator[str]:
        # counted along x first
        for number, steps in enumerate(np.ndindex(*grid.counts[::-1]), start=1):
            position = np.zeros(3)
            position[: len(steps)] += np.multiply(steps[::-1], grid.pitches)
            numbered = f"{name} {number}"
            if numbered in self.task.frames:
                raise self.locations.error(
                    ("frames", numbered),
                    f"is the name of a place of the grid in {name!r}",
                    "another",
                )
            self.frames[numbered] = Frame(position=position.tolist(), parent=name)
            self.origins["frames", numbered] = ("frames", name)
            yield numbered

    def _add_place(self, frame: Frame, origin: Location) -> str:
        k = 1
        while (name := f"{PLACE_FRAME} {k}") in self.frames:
            k += 1
        self.frames[name] = frame
        self.origins["frames", name] = origin
        return name


def _at_place(part: PartT, frame: str) -> PartT:
    """A part of a repeated waypoint where the place is a frame."""
    changes: dict[str, Any] = {}
    for name in part.model_fields_set:
        value = getattr(part, name)
        if isinstance(value, TaskPart):
            changes[name] = _at_place(value, frame)
        elif value == PLACE_FRAME and is_marked(type(part).model_fields.get(name), "names_frame"):
            changes[name] = frame
    return part.model_copy(update=changes)
