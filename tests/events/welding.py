"""A task with events: a seam of two lines with a corner, for an arm of Universal Robots."""

from __future__ import annotations

from typing import Any

from seams import task

DOWN = {"rpy": [180, 0, 0]}


def weld(**changes: Any) -> dict[str, Any]:
    """A seam of two lines with a corner; lengths in mm. Keys of waypoints by their names."""
    given: dict[str, dict[str, Any]] = {
        "approach": {"pose": {"position": [450, -100, 250], **DOWN}, "after": 2, "stop": True},
        "seam": {"pose": {"position": [450, -100, 200], **DOWN}, "after": 1, "stop": True},
        "corner": {"along": "line", "speed": 50, "pose": {"position": [450, 0, 200]}, "blend": 10},
        "end": {"along": "line", "speed": 80, "pose": {"position": [550, 0, 200]}, "stop": True},
        "retract": {"pose": {"position": [550, 0, 250], **DOWN}, "after": 1},
    }
    waypoints = ({"name": key, **one, **changes.get(key, {})} for key, one in given.items())
    return task(*waypoints, outputs={"arc": 3})


def do(*actions: dict[str, Any]) -> dict[str, Any]:
    return {"do": list(actions)}
