"""What was plausibly not meant as it is written in a scenario; it never fails."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import numpy as np

from knotwork.errors.plain_text import called
from knotwork.scenario import Scenario, ScenarioWaypoint
from knotwork.scenario.angle_slips import angle_slips
from knotwork.scenario.joint_space import JointSpace, JointState
from knotwork.verification.finding import Finding
from knotwork.verification.lines import line_not_held
from knotwork.verification.motion import Motion
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from knotwork.tool_paths import ThroughPoints

SAME_PLACE = 1e-9
"""Poses nearer than this [m, rad] are one place."""
HEAVY = 100.0
"""Gravity above this [m/s²] is probably in mm/s²."""
ROUNDED = 0.1
"""A right angle may be off by this much [degrees]."""
BULGE = 0.2
"""A curve that leaves the chord between two points by more than this part of it, as one of a circle
through five points does not, is plausibly none that they mean."""
UNEVEN = 20.0
"""Largest ratio of neighbouring intervals with which balanced knots keep the jerk small."""


def plausibility(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Name what was plausibly not meant as it is written."""
    units = dict(zip(space.joint_names, space.joint_units, strict=True))
    for message in angle_slips(scenario, units):
        yield _warning("angle_unit", message)
    yield from _not_from_home(motion, scenario, space)
    gravity = 0.0 if scenario.gravity is None else float(np.linalg.norm(scenario.gravity))
    if gravity > HEAVY:
        yield _warning(
            "gravity_unit",
            f"gravity is {gravity:g} m/s², whatever the file's unit of length; on Earth it is 9.81",
        )
    chosen = {name for run in scenario.task.chosen or () for name in run.velocities}
    on_path = {i for path in scenario.paths for i in range(path.first, path.last)}
    for i, (first, second) in enumerate(pairwise(scenario.waypoints)):
        if i in on_path or first.standing or second.standing:
            continue
        if isinstance(first, CartesianWaypoint) and isinstance(second, CartesianWaypoint):
            yield from _one_place(first, second, chosen)
            if first.name not in chosen:
                yield from _pointing_away(first, second)
            if space.robot is not None:
                message = line_not_held(motion, scenario, space.robot, first, second)
                if message:
                    yield _warning("no_path", message, first)
        here, there = space.targets[i : i + 2]
        if here is not None and there is not None and first.name not in chosen:
            yield from _joints_away(first, second, here, there, space)
    yield from _far_from_points(scenario)
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


def _not_from_home(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """A motion without a start begins at its first waypoint, wherever the arm stands before."""
    if space.robot is None or scenario.task.start is not None:
        return
    home = space.robot.configurations.get("home")
    if home is not None and np.allclose(motion.curve(motion.start_time), home, atol=SAME_PLACE):
        return
    first = scenario.waypoints[0].name
    what, why = f"the way to {first!r}", "the file has no start"
    if np.any(np.abs(motion.curve(motion.start_time, 1)) > SAME_PLACE):
        what, why = f"what leads to {first!r}", "the motion begins at speed"
    yield Finding(
        group="Not planned",
        subject="motion",
        name="",
        quantity="no_start",
        verdict="information",
        message=f"{what}, from home or wherever the arm is, is not planned nor checked: {why}",
        brief=f"{what}: {why}",
    )


def _one_place(
    first: CartesianWaypoint, second: CartesianWaypoint, chosen: Container[str]
) -> Iterator[Finding]:
    """Two waypoints at one place of which one moves: the tool must leave and come back.

    Of waypoints in `chosen` nobody gave the velocity.
    """
    import pinocchio as pin

    apart = pin.log6(first.pose.actInv(second.pose)).vector
    given = [one for one in (first, second) if one.name not in chosen]
    moving = [one for one in given if np.linalg.norm(one.twist.vector) > 0]
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
            f"{called(first.name)}: the velocity points away from the next waypoint "
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
    named = f"{called(first.name)}: the velocity of joint {space.joint_names[moving[0]]!r}"
    if not way.any():
        message = f"{named} is not zero, but the next {called(second.name)} is at the same place"
        yield _warning("one_place", message, first)
    elif (way[moving] * here.velocity[moving] <= 0.0).all():
        message = (
            f"{named} points away from the next {called(second.name)}, and so do those of all "
            "joints that move; is its sign meant?"
        )
        yield _warning("pointing_away", message, first)


def _far_from_points(scenario: Scenario) -> Iterator[Finding]:
    """A curve that swings far out between two of its points: these are few, or uneven."""
    scale, unit = scenario.shown_length
    for path in scenario.paths:
        for any_curve in path.motion.path.curves:
            if not hasattr(any_curve, "arc_lengths"):  # its class is not loaded for lines and arcs
                continue
            curve = cast("ThroughPoints", any_curve)
            lengths, parts = np.diff(curve.arc_lengths), np.linspace(0.0, 1.0, 17)
            s = curve.arc_lengths[:-1, None] + lengths[:, None] * parts
            start, chord = curve.points[:-1, None], np.diff(curve.points, axis=0)[:, None]
            way = curve.position(s.ravel()).reshape(*s.shape, 3) - start
            size = np.linalg.norm(chord, axis=2)
            along = np.clip((way * chord).sum(axis=2) / size**2, 0.0, 1.0)
            off = np.linalg.norm(way - along[:, :, None] * chord, axis=2).max(axis=1)
            i = int((off / size[:, 0]).argmax())
            if off[i] > BULGE * size[i, 0]:
                last, apart = scenario.waypoints[path.last], scale * size[i, 0]
                yield _warning(
                    "curve_between_points",
                    f"the curve through points to {last.name!r} leaves the straight line between "
                    f"points {i} and {i + 1}, {apart:.4g} {unit} apart, by {scale * off[i]:.4g} "
                    f"{unit}: add points there, or leave out points that are much nearer to one "
                    "another",
                    last,
                )


def _balanced_and_uneven(scenario: Scenario, waits: Sequence[int]) -> Iterator[Finding]:
    """Balanced knots close to a short interval leave the long one next to it to one cubic."""
    planner, _, rule = scenario.planner.partition(":")
    given = scenario.knots
    balanced = isinstance(given, int | float) or (isinstance(given, str) and given == "balanced")
    if planner != "modified-hermite" or not (balanced or rule == "balanced"):
        return
    lengths = np.diff(scenario.times)
    known = {i for path in scenario.paths for i in range(path.first, path.last + 1)}
    known.update(end for i in waits for end in (i, i + 1))
    for i, (before, after) in enumerate(pairwise(lengths), start=1):
        if i in known:  # a path's sections don't depend on their neighbours
            continue
        ratio = max(before, after) / min(before, after)
        if ratio > UNEVEN:
            name = scenario.waypoints[i].name
            yield _warning(
                "uneven_times",
                f"{called(name)}: of the intervals beside it, {before:.4g} s and {after:.4g} s, "
                f"one is {ratio:.0f} times as long as the other; above {UNEVEN:g} times balanced "
                "knots make a large jerk there: even out the times or try `knots: paper`",
            )
