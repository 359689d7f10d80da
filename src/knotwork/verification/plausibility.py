"""Warnings of plausible slips in a scenario; they never fail."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from knotwork.documents import Location
from knotwork.joint_space import JointSpace, JointState
from knotwork.scenario import Scenario, ScenarioWaypoint
from knotwork.verification.finding import Finding
from knotwork.verification.lines import line_not_held
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint

SAME_PLACE = 1e-9
"""Poses nearer than this [m, rad] are one place."""
WHOLE_TURN = 2.0 * np.pi * 1.001
"""Angles above this [rad], a whole turn with what files round, are probably degrees."""
HEAVY = 100.0
"""Gravity above this [m/s²] is probably in mm/s²."""
ROUNDED = 0.1
"""A right angle may be off by this much [degrees]."""
UNEVEN = 20.0
"""Balanced knots beside an interval so many times its neighbour make a large jerk."""

# Keys of a scenario file that hold angles of an orientation.
_ANGLES = ("rpy", "angles", "rotation_vector")


def plausibility(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Name what was plausibly not meant as it is written."""
    yield from _angles_in_degrees(scenario, space)
    gravity = 0.0 if scenario.gravity is None else float(np.linalg.norm(scenario.gravity))
    if gravity > HEAVY:
        yield _warning(
            "gravity_unit",
            f"gravity is {gravity:g} m/s², whatever the file's unit of length; on Earth it is 9.81",
        )
    on_path = {i for path in scenario.paths for i in range(path.first, path.last)}
    for i, (first, second) in enumerate(pairwise(scenario.waypoints)):
        if i in on_path:
            continue
        if isinstance(first, CartesianWaypoint) and isinstance(second, CartesianWaypoint):
            yield from _one_place(first, second)
            yield from _pointing_away(first, second)
            if space.robot is not None:
                message = line_not_held(motion, scenario, space.robot, first, second)
                if message:
                    yield _warning("no_path", message, first)
        here, there = space.targets[i : i + 2]
        if here is not None and there is not None:
            yield from _joints_away(first, second, here, there, space)
    yield from _balanced_and_uneven(scenario, space.waits)


def _warning(quantity: str, message: str, waypoint: ScenarioWaypoint | None = None) -> Finding:
    return Finding(
        group="Warnings",
        subject="waypoint" if waypoint is not None else "motion",
        name=waypoint.name if waypoint is not None else "",
        quantity=quantity,
        verdict="warning",
        message=message,
        time=waypoint.time if waypoint is not None else None,
    )


def _angles_in_degrees(scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Angles above a whole turn in a file in radians are probably degrees."""
    document = scenario.document
    if document is None or (document.data.get("units") or {}).get("angle", "rad") != "rad":
        return
    units = dict(zip(space.joint_names, space.joint_units, strict=True))
    for location, key, value in _numbers(document.data, ()):
        angular = (
            units.get(key) == "rad"
            if location[0] == "start" or location[2:3] == ("joints",)
            else key in _ANGLES
        )
        if angular and abs(value) > WHOLE_TURN:
            yield _warning(
                "angle_unit",
                f"{document.where(location)} is {value:g} rad, more than a whole turn; if it is in "
                "degrees, say `units: {angle: deg}`",
            )


def _numbers(data: Any, location: Location, key: str = "") -> Iterator[tuple[Location, str, float]]:
    """All numbers of a file: where they are, the last name on the way there, and the value."""
    if isinstance(data, bool):
        return
    if isinstance(data, int | float):
        yield location, key, float(data)
    elif isinstance(data, Mapping):
        for name, value in data.items():
            yield from _numbers(value, (*location, name), str(name))
    elif isinstance(data, list):
        for i, value in enumerate(data):
            yield from _numbers(value, (*location, i), key)


def _one_place(first: CartesianWaypoint, second: CartesianWaypoint) -> Iterator[Finding]:
    """Two waypoints at one place of which one moves: the tool must leave and come back."""
    import pinocchio as pin

    apart = pin.log6(first.pose.actInv(second.pose)).vector
    moving = [one for one in (first, second) if np.linalg.norm(one.twist.vector) > 0]
    if np.linalg.norm(apart) < SAME_PLACE and moving:
        yield _warning(
            "one_place",
            f"waypoints {first.name!r} and {second.name!r} are at one place, but the tool moves at "
            f"{moving[0].name!r}: between them it must leave the place and come back",
            moving[0],
        )


def _pointing_away(first: CartesianWaypoint, second: CartesianWaypoint) -> Iterator[Finding]:
    """A velocity that points away from the next waypoint: the tool must turn round."""
    way = second.position - first.position
    length, speed = float(np.linalg.norm(way)), float(np.linalg.norm(first.linear))
    if length < SAME_PLACE or speed == 0.0:
        return
    angle = np.degrees(np.arccos(np.clip(way @ first.linear / (length * speed), -1.0, 1.0)))
    if angle > 90.0 + ROUNDED:
        yield _warning(
            "pointing_away",
            f"waypoint {first.name!r}: the velocity points away from the next waypoint "
            f"{second.name!r}, {angle:.0f} degrees from the straight way to it; is its sign meant?",
            first,
        )


def _joints_away(
    first: ScenarioWaypoint,
    second: ScenarioWaypoint,
    here: JointState,
    there: JointState,
    space: JointSpace,
) -> Iterator[Finding]:
    """Joint velocities that all point away from the next waypoint, or one place that is left."""
    way = there.position - here.position
    moving = np.flatnonzero(here.velocity)
    if not moving.size:
        return
    named = f"waypoint {first.name!r}: the velocity of joint {space.joint_names[moving[0]]!r}"
    if not way.any():
        message = f"{named} is not zero, but the next waypoint {second.name!r} is at the same place"
        yield _warning("one_place", message, first)
    elif (way[moving] * here.velocity[moving] <= 0.0).all():
        message = (
            f"{named} points away from the next waypoint {second.name!r}, and so do those of all "
            "joints that move; is its sign meant?"
        )
        yield _warning("pointing_away", message, first)


def _balanced_and_uneven(scenario: Scenario, waits: Sequence[int]) -> Iterator[Finding]:
    """Balanced knots close to a short interval leave the long one beside it to one cubic."""
    planner, _, rule = scenario.planner.partition(":")
    given = scenario.knots
    balanced = isinstance(given, int | float) or (isinstance(given, str) and given == "balanced")
    if planner != "modified-hermite" or not (balanced or rule == "balanced"):
        return
    lengths = np.diff(scenario.times)
    known = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    known.update(end for i in waits for end in (i, i + 1))
    for i, (before, after) in enumerate(pairwise(lengths), start=1):
        if i in known:  # a path's sections don't depend on what is beside them
            continue
        ratio = max(before, after) / min(before, after)
        if ratio > UNEVEN:
            name = scenario.waypoints[i].name
            yield _warning(
                "uneven_times",
                f"waypoint {name!r}: of the intervals beside it, {before:.4g} s and {after:.4g} s, "
                f"one is {ratio:.0f} times as long as the other; above {UNEVEN:g} times balanced "
                "knots make a large jerk there: even out the times or try `knots: paper`",
            )
