"""Warnings of plausible mistakes in a scenario; they never fail."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, cast

import numpy as np

from knotwork.scenario import Scenario, ScenarioWaypoint
from knotwork.scenario.angle_slips import angle_slips
from knotwork.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding

if TYPE_CHECKING:
    from knotwork.tool_paths import ThroughPoints

SAME_PLACE = 1e-9
"""Joint positions within this distance [rad or m] are equal."""
HEAVY = 100.0
"""Gravity above this [m/s²] is probably in mm/s²."""
BULGE = 0.2
"""Maximum deviation of a plausible curve from the chord between two points, relative to the chord:
even a circle through five points is below it."""


def plausibility(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Warn of values that are plausibly mistakes."""
    units = dict(zip(space.joint_names, space.joint_units, strict=True))
    for message in angle_slips(scenario, units):
        yield _warning("angle_unit", message)
    yield from _not_from_home(motion, scenario, space)
    gravity = 0.0 if scenario.task.gravity is None else float(np.linalg.norm(scenario.task.gravity))
    if gravity > HEAVY:
        yield _warning(
            "gravity_unit",
            f"gravity is {gravity:g} m/s², whatever the file's unit of length; on Earth it is 9.81",
        )
    yield from _far_from_points(scenario)


def _warning(quantity: str, message: str, waypoint: ScenarioWaypoint | None = None) -> Finding:
    return Finding(
        group="Warnings",
        subject="waypoint" if waypoint is not None else "motion",
        name=waypoint.name if waypoint is not None else "",
        quantity=quantity,
        verdict="warning",
        fact=message,
        time=waypoint.time if waypoint is not None else None,
    )


def _not_from_home(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Warn that a motion without a start begins at its first waypoint."""
    if space.robot is None or scenario.task.start is not None:
        return
    home = space.robot.configurations.get("home")
    if home is not None and np.allclose(motion.curve(motion.start_time), home, atol=SAME_PLACE):
        return
    first = scenario.waypoints[0].name
    what, why = f"the approach to {first!r}", "the file has no start"
    if np.any(np.abs(motion.curve(motion.start_time, 1)) > SAME_PLACE):
        what, why = f"the approach to {first!r}", "the motion begins at speed"
    yield Finding(
        group="Not planned",
        subject="motion",
        name="",
        quantity="no_start",
        verdict="information",
        fact=f"{what} is neither planned nor checked: {why}",
        brief=f"{what}: {why}",
    )


def _far_from_points(scenario: Scenario) -> Iterator[Finding]:
    """Warn of a curve that deviates far between two of its points, which are few or uneven."""
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
