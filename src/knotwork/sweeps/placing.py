"""Rows that differ in where frames are: their poses, without reading each row anew.

Reading a scenario makes its paths and checks all that it says, which takes longer than finding out
that a pose is out of reach. Where all frames that waypoints stand in are moved alike, the waypoints
are moved as one body: paths, speeds and times stay as they are, and so does whatever could be wrong
with them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from knotwork.documents import Document, Edits, edited
from knotwork.errors import InputError
from knotwork.scenario import Scenario, scenario_of
from knotwork.scenario.geometry import Frames
from knotwork.task import Frame
from knotwork.task.units import in_si
from knotwork.waypoints import CartesianWaypoint

Pose = tuple[str, Any]
"""Name of a waypoint, and where the tool is to be there, a `pin.SE3` in the base frame."""

FRAMES = "frames"
ALIKE = 1e-9
"""Frames are moved alike if their rotations and places [m] agree to this."""
FARTHEST = 100.0
"""Frames farther away [m] are left to reading."""


class Placing:
    """A scenario, and its poses with frames placed otherwise.

    Args:
        document: The scenario.

    Attributes:
        document: As given.
        scenario: As it stands in the document.

    Raises:
        InputError: It is wrong as it stands.
    """

    def __init__(self, document: Document) -> None:
        self.document, self.scenario = document, scenario_of(document)
        data = document.data
        self._data: dict[str, Any] = data.get(FRAMES) or {}
        self._frames = {name: Frame.model_validate(one) for name, one in self._data.items()}
        self._used = sorted(set(_used(data)))
        placed = self._placed({})
        self._back = {name: placed[name].inverse() for name in self._used}
        self._poses = poses_of(self.scenario)

    def poses(self, edits: Edits) -> list[Pose] | None:
        """Poses of a row.

        Args:
            edits: Values by location that the row has in place of those of the document.

        Returns:
            `None` where the row has to be read to know them.
        """
        if not all(location[0] == FRAMES and len(location) > 1 for location in edits):
            return None
        try:
            placed = self._placed(edits)
        except (InputError, ValidationError):
            return None  # reading says what is wrong
        moves = [placed[name] * self._back[name] for name in self._used]
        if not moves or np.abs(moves[0].translation).max() > FARTHEST:
            return None
        if not all(one.isApprox(moves[0], ALIKE) for one in moves[1:]):
            return None
        return [(name, moves[0] * pose) for name, pose in self._poses]

    def _placed(self, edits: Edits) -> Frames:
        changed = edited(Document({FRAMES: self._data}), edits).data[FRAMES]
        varied = {str(location[1]) for location in edits}
        own = {name: Frame.model_validate(changed[name]) for name in varied}
        length, angle = (1.0 / self.scenario.units.shown(1.0, unit)[0] for unit in ("m", "rad"))
        given = {**self._frames, **own}.items()
        return Frames({name: in_si(one, length, angle) for name, one in given}, self.document)


def poses_of(scenario: Scenario) -> list[Pose]:
    """The poses that planning solves first, in order; those along a path follow from its start."""
    along = {i for path in scenario.paths for i in range(path.first + 1, path.last + 1)}
    return [
        (waypoint.name, waypoint.pose)
        for i, waypoint in enumerate(scenario.waypoints)
        if isinstance(waypoint, CartesianWaypoint) and i not in along
    ]


def _used(data: Mapping[str, Any]) -> Iterator[str]:
    """Frames that poses, orientations and velocities of waypoints are given in."""
    for waypoint in data["waypoints"]:
        if "joints" not in waypoint:
            yield waypoint.get("frame") or data.get("frame") or "base"
            if "orientation_in" in waypoint:
                yield waypoint["orientation_in"]
            velocity = waypoint.get("velocity")
            if isinstance(velocity, Mapping) and velocity.get("in", "tool") != "tool":
                yield velocity["in"]
