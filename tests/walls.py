"""A wall that a UR5 has to get past: the task that tests of ways and of what they show share."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import knotwork as kw

DOWN = [180, 0, 0]


def box(size: list[float], position: list[float]) -> dict[str, Any]:
    return {"box": size, "position": position}


WALL = {"wall": box([500, 30, 400], [450, 0, 190]), "beam": box([500, 30, 300], [450, 0, 850])}


def at(name: str, y: float, z: float = 100, **more: Any) -> dict[str, Any]:
    """A stop beside the wall, the tool pointing down."""
    return {"name": name, "pose": {"position": [450, y, z], "rpy": DOWN}, "stop": True, **more}


@cache
def through_wall() -> kw.Plan:
    """From one side of the wall straight through it to the other."""
    stops = [at("here", -250), at("there", 250, after=2)]
    return kw.plan(past({"wall": WALL["wall"]}, limits={}, waypoints=stops))


def past(objects: dict[str, Any] | None = None, *others: Any, **keys: Any) -> dict[str, Any]:
    """From one side of the wall to the other, or through other objects."""
    task = {
        "robot": "ur5",
        "units": {"length": "mm", "angle": "deg"},
        "tool": {
            "offset": {"position": [0, 0, 120]},
            "shape": {"cylinder": {"radius": 20, "length": 120}, "position": [0, 0, 60]},
        },
        "limits": {"acceleration": 460, "jerk": 11500},
        "scene": {"margin": 5, "objects": WALL if objects is None else objects},
        "waypoints": [at("here", -250), at("there", 250, way="clear"), *others],
        **keys,
    }
    return copy.deepcopy(task)
