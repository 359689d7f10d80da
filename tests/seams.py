"""A seam that a UR5 follows from home: the task that tests of tool paths have in common."""

from __future__ import annotations

from typing import Any

ON: dict[str, Any] = {
    "name": "on",
    "after": 2,
    "pose": {"position": [450, -100, 60], "rpy": [180, 0, 0]},
}
"""Where a seam begins, the tool pointing down."""


def task(*waypoints: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A scenario of waypoints in mm and degrees."""
    return {
        "units": {"length": "mm", "angle": "deg"},
        "robot": "ur5",
        "start": "home",
        "waypoints": list(waypoints),
        **more,
    }
