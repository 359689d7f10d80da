"""A path of a UR5 whose times and speeds are chosen: the task that these tests share."""

from __future__ import annotations

from typing import Any


def reach(*waypoints: dict[str, Any], **keys: Any) -> dict[str, Any]:
    """From y = -200 mm on, the tool pointing down."""
    pose = {"position": [400, -200, 300], "rpy": [180, 0, 0]}
    return {
        "robot": "ur5",
        "units": {"length": "mm", "angle": "deg"},
        "limits": {"acceleration": 400},
        "waypoints": [{"name": "in", "pose": pose}, *waypoints],
        **keys,
    }
