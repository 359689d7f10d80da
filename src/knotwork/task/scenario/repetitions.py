"""A task without repeats, in which each repetition has its own waypoints, frames and objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from knotwork.curves.tool_paths.points_file import read_points
from knotwork.errors import suggest_name
from knotwork.files.documents import Location, Places
from knotwork.task import Frame, HeldObject, PlacesFile, PlainTask, Repeat, Task, Tool
from knotwork.task.scenario.scenario import Scenario
from knotwork.task.scenario.unknowns import ends_wait

PLACE_FRAME = "place"
"""Name of the frame of the current location, in a repeated block."""

MAX_REPEATED_WAYPOINTS = 10_000
"""Largest number of waypoints in all repetitions."""


def expand_repeats(task: Task, places: Places | None = None) -> tuple[PlainTask, Places]:
    """Write out every repetition of every block.

    Names of waypoints and objects of a block get the number of the repetition. In `allow`, the name
    of an object of a block means the objects of all repetitions.

    Args:
        task: The task, in its own units.
        places: Locations of its parts in the file, for errors.

    Returns:
        The task without repeats, and the locations of its parts: for a repetition, that of the
        block.

    Raises:
        DocumentError: The locations of a block are wrong, or a name is not unique.
    """
    places = places or Places()
    if isinstance(task, PlainTask):
        return task, places
    if any(isinstance(step, Repeat) for step in task.waypoints):
        return _Expansion(task, places).result()
    return PlainTask.model_construct(task.model_fields_set, **dict(task)), places


def repetition_starts(scenario: Scenario) -> list[list[int]]:
    """The first waypoint of each repetition of each block of a scenario, by index."""
    starts: dict[Location, list[int]] = {}
    for i, k in enumerate(scenario.index):
        location = scenario.places.given(("waypoints", k))
        if location[2:] == ("repeat", 0) and not ends_wait(scenario.index, i):
            starts.setdefault(location[:2], []).append(i)
    return list(starts.values())


class _Expansion:
    """The parts of a task, with those of all repetitions."""

    def __init__(self, task: Task, places: Places) -> None:
        self.task, self.places = task, places
        self.frames = dict(task.frames)
        self.holds = dict(task.tool.holds) if task.tool is not None else {}
        self.waypoints: list[Any] = []
        self.origins: dict[Location, Location] = {}
        self.objects: dict[str, list[str]] = {}

    def result(self) -> tuple[PlainTask, Places]:
        task = self.task
        if PLACE_FRAME in task.frames:
            raise self.places.error(
                ("frames", PLACE_FRAME),
                "is the frame of the current place in repeat",
                "any other name",
            )
        for i, step in enumerate(task.waypoints):
            if isinstance(step, Repeat):
                self._add_block(step, ("waypoints", i))
            else:
                self._add(step, ("waypoints", i))
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
        expanded_task = PlainTask.model_construct(
            task.model_fields_set | parts.keys(), **dict(task) | parts
        )
        return expanded_task, replace(self.places, origins=self.origins)

    def _add_block(self, block: Repeat, place: Location) -> None:
        frames = list(self._places(block, (*place, "over")))
        if len(self.waypoints) + len(frames) * len(block.repeat) > MAX_REPEATED_WAYPOINTS:
            raise self.places.error(
                (*place, "over"),
                f"makes {len(frames)} repetitions of {len(block.repeat)} waypoints",
                f"at most {MAX_REPEATED_WAYPOINTS} waypoints in all",
            )
        names = {step.name for step in block.repeat}
        known = [PLACE_FRAME, "base", *self.task.frames]
        for j, template in enumerate(block.repeat):
            frame_name = getattr(template, "frame", None)
            if frame_name is not None and frame_name not in (*known, *self.frames):
                raise self._unknown_frame(frame_name, (*place, "repeat", j, "frame"), known)
        for turn, frame in enumerate(frames, start=1):
            for j, template in enumerate(block.repeat):
                changes: dict[str, Any] = {}
                if template.name is not None:
                    changes["name"] = f"{template.name} {turn}"
                for key in ("frame", "orientation_in"):
                    if getattr(template, key, None) == PLACE_FRAME:
                        changes[key] = frame
                velocity: Any = getattr(template, "velocity", None)
                if getattr(velocity, "axes", None) == PLACE_FRAME:
                    changes["velocity"] = velocity.model_copy(update={"axes": frame})
                self._add(template.model_copy(update=changes), (*place, "repeat", j))
            for name, held in block.holds.items():
                ends = {key: getattr(held, key) for key in ("take", "leave", "appears")}
                changes = {
                    key: f"{waypoint} {turn}" for key, waypoint in ends.items() if waypoint in names
                }
                self._add_held(name, turn, held.model_copy(update=changes), (*place, "holds", name))

    def _add(self, waypoint: Any, place: Location) -> None:
        self.origins["waypoints", len(self.waypoints)] = place
        self.waypoints.append(waypoint)

    def _add_held(self, name: str, turn: int, held: HeldObject, place: Location) -> None:
        numbered = f"{name} {turn}"
        if numbered in self.holds:
            raise self.places.error(
                place, f"{numbered!r} of repetition {turn} is held twice", "a unique name"
            )
        self.holds[numbered] = held
        self.objects.setdefault(name, []).append(numbered)
        self.origins["tool", "holds", numbered] = place

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

    def _places(self, block: Repeat, where: Location) -> Iterator[str]:
        """The names of the frames of all repetitions; missing frames are made."""
        over = block.over
        if isinstance(over, str):
            yield from self._grid_frames(over, where)
        elif isinstance(over, PlacesFile):
            path = self.places.named_file(over.file, (*where, "file"))
            points, rotations, normals = read_points(path, 1.0)
            if normals is not None:
                raise self.places.error(
                    (*where, "file"),
                    f"{path} has normals, which leave the turn at a place open",
                    "columns qx, qy, qz, qw, or positions alone",
                )
            for k, point in enumerate(points):
                turn = {} if rotations is None else {"rotation_matrix": rotations[k].tolist()}
                frame = Frame(position=point.tolist(), parent=over.parent, **turn)
                yield self._add_place(frame, (*where, "file"))
        else:
            for k, spot in enumerate(over):
                if isinstance(spot, str) and spot not in self.task.frames:
                    raise self._unknown_frame(spot, (*where, k), list(self.task.frames))
                if not isinstance(spot, str):
                    yield self._add_place(spot, (*where, k))
                elif self.task.frames[spot].grid is not None:
                    yield from self._grid_frames(spot, (*where, k))
                else:
                    yield spot

    def _grid_frames(self, name: str, where: Location) -> Iterator[str]:
        grids = {
            key: frame.grid for key, frame in self.task.frames.items() if frame.grid is not None
        }
        grid = grids.get(name)
        if grid is None:
            raise self._unknown_frame(name, where, list(grids))
        counts = (*grid.counts, 1, 1)[:3]
        pitches = (*grid.pitches, 0.0, 0.0)[:3]
        steps = (step[::-1] for step in product(*map(range, counts[::-1])))
        for k, step in enumerate(steps, start=1):
            position = (np.multiply(step, pitches) + 0.0).tolist()
            numbered = f"{name} {k}"
            if numbered in self.task.frames:
                raise self.places.error(
                    ("frames", numbered),
                    f"is the name of a place of the grid in {name!r}",
                    "another",
                )
            self.frames[numbered] = Frame(position=position, parent=name)
            self.origins["frames", numbered] = ("frames", name)
            yield numbered

    def _add_place(self, frame: Frame, origin: Location) -> str:
        k = 1
        while (name := f"{PLACE_FRAME} {k}") in self.frames:
            k += 1
        self.frames[name] = frame
        self.origins["frames", name] = origin
        return name

    def _unknown_frame(self, name: str, where: Location, names: Sequence[str]) -> Exception:
        if name in self.task.frames:
            return self.places.error(
                where,
                f"frame {name!r} has no grid",
                "grid: {counts, pitches} in that frame, or a list of frames",
            )
        fault = f"there is no frame {name!r}" + ("" if names else ", and none has a grid")
        return self.places.error(where, fault, suggest_name(name, names) if names else "")
