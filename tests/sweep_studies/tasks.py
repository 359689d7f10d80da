"""Small tasks to sweep over."""

from __future__ import annotations

from typing import Any

LIFT: dict[str, Any] = {
    "name": "lift",
    "limits": {"velocity": 1.2},
    "waypoints": [
        {"name": "down", "joints": {"lift": 0}},
        {"name": "up", "joints": {"lift": 1}, "after": 1},
    ],
}
"""A motion of one joint, which one second is too short for."""

PLACED: dict[str, Any] = {
    "name": "placed",
    "robot": "planar2",
    "frames": {"part": {"position": [0, 0, 0], "rpy": [0, 0, 0]}},
    "frame": "part",
    "waypoints": [],
}
