"""Waypoints that are repeated at several locations."""

from __future__ import annotations

from typing import Annotated

from pydantic import Tag

from knotwork.files.documents import Text
from knotwork.files.documents.values import Forms, Several, optional, required
from knotwork.task.poses import Frame
from knotwork.task.scene_shapes import HeldObject
from knotwork.task.task_part import TaskPart
from knotwork.task.task_waypoints import (
    KINDS,
    JointWaypoint,
    PathWaypoint,
    PoseWaypoint,
    Waypoint,
    by_key,
)


class PlacesFile(TaskPart):
    """Locations in a CSV file."""

    file: Text = required(
        "Path of a CSV file, relative to this file, with the columns x, y, z, and "
        "qx, qy, qz, qw for orientations; its numbers are in this file's unit of "
        "length"
    )
    parent: Text = optional("base or the name of a frame", "base", key="in")


class Repeat(TaskPart):
    """Waypoints that are repeated, once at each location."""

    over: Annotated[
        Text
        | PlacesFile
        | Several[
            Annotated[
                Text | Frame,
                Forms("the name of a frame, or a mapping with a position"),
            ]
        ],
        Forms("the name of a frame with a grid, a list of frames and places, or a file"),
    ] = required(
        "Places: a frame with a grid, a list of frame names and of places, or a CSV "
        "file; inside the block, the frame place is the current place"
    )
    holds: dict[Text, HeldObject] = optional(
        "Objects held by the tool in each repetition, as holds of the tool", {}
    )
    repeat: Several[Waypoint] = required(
        "Waypoints of one repetition; its number is added to all names in it"
    )


Step = Annotated[
    Annotated[PoseWaypoint, Tag("PoseWaypoint")]
    | Annotated[PathWaypoint, Tag("PathWaypoint")]
    | Annotated[JointWaypoint, Tag("JointWaypoint")]
    | Annotated[Repeat, Tag("Repeat")],
    by_key({"repeat": "Repeat"} | KINDS, "either pose or joints, or with repeat"),
]
