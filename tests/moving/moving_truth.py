"""Arms among things that move, by plain Pinocchio and Coal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

import knotwork as kw
from judge.arm import Arm
from judge.bodies import link_shapes

Array = NDArray[np.float64]
Placed = list[tuple[Any, pin.SE3]]
Bodies = Callable[[float], dict[str, Placed]]


def down(x: float, y: float, z: float) -> dict[str, Any]:
    """A pose with the tool downwards."""
    return {"position": [x, y, z], "rpy": [np.pi, 0, 0]}


def frame(position: Any, linear: Any, angular: Any, t: float) -> pin.SE3:
    """Where a frame with parallel axes is after a time at constant speeds in its own axes."""
    turn = pin.exp3(t * np.array(angular, dtype=float))
    return pin.SE3(turn, np.array(position, dtype=float) + t * np.array(linear, dtype=float))


def seen(pose: Callable[[float], pin.SE3], t: float) -> tuple[pin.SE3, Array]:
    """A pose that moves at a time, and its velocity [m/s], by differences."""
    h = 1e-5
    before, here, after = (pose(s) for s in (t - h, t, t + h))
    return here, (after.translation - before.translation) / (2 * h)


def links(motion: Any, base: pin.SE3, name: str = "ur5") -> Bodies:
    """Links of an arm over time, by name."""
    arm = Arm(name, Path(), {}, 1.0, 1.0, None)
    shapes = link_shapes(arm)
    found = pin.GeometryData(shapes)

    def at(t: float) -> dict[str, Placed]:
        inside = float(np.clip(t, motion.start_time, motion.end_time))
        q = arm.whole(motion.position(inside)[None])[0]
        pin.updateGeometryPlacements(arm.model, arm.data, shapes, found, q)
        placed: dict[str, Placed] = {}
        for one, place in zip(shapes.geometryObjects, found.oMg, strict=True):
            link = arm.model.frames[one.parentFrame].name
            placed.setdefault(link, []).append((one.geometry, base * place))
        return placed

    return at


class OfArm:
    """The part of a motion that an arm's own joints have."""

    def __init__(self, plan: kw.Plan, arm: str = "ur5") -> None:
        self.start_time, self.end_time = plan.trajectory.start_time, plan.trajectory.end_time
        names = plan.trajectory.joint_names
        self._motion = plan.trajectory
        self._columns = [names.index(name) for name in kw.load_robot(arm).joint_names]

    def position(self, t: float) -> Array:
        return np.asarray(self._motion.position(t)[self._columns])


def distance(first: Placed, second: Placed) -> float:
    """Of two bodies [m]; minus the depth where they overlap."""
    request, found = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    least = np.inf
    for one, here in first:
        for other, there in second:
            found.clear()
            places = (coal.Transform3s(p.rotation, p.translation) for p in (here, there))
            a, b = places
            coal.distance(one, a, other, b, request, found)
            least = min(least, found.min_distance)
    return float(least)


def sampled(own: Bodies, others: Bodies, times: Array) -> dict[tuple[str, str], Array]:
    """Distances of each pair at times [m], shape (k,) each."""
    rows: dict[tuple[str, str], list[float]] = {}
    for t in times.tolist():
        here, there = own(t), others(t)
        for one, first in here.items():
            for other, second in there.items():
                rows.setdefault((one, other), []).append(distance(first, second))
    return {pair: np.array(row) for pair, row in rows.items()}
