"""Warnings of plausible mistakes in a scenario. They never fail a report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, cast

import numpy as np

from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding

if TYPE_CHECKING:
    from knotwork.curves.tool_paths import ThroughPoints

SAME_JOINTS = 1e-9
"""Joint positions within this distance [rad or m] are equal."""
LARGEST_GRAVITY = 100.0
"""Gravity [m/s²] above which the unit is probably mm/s²."""
LARGEST_BULGE = 0.2
"""Maximum deviation of a plausible curve from the chord between two points, relative to the chord.

Even a circle through five points is below it.
"""


def plausibility(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Warn of values that are plausibly mistakes."""
    yield from _not_from_home(motion, scenario, space)
    gravity = 0.0 if scenario.task.gravity is None else float(np.linalg.norm(scenario.task.gravity))
    if gravity > LARGEST_GRAVITY:
        yield Finding(
            "Warnings", "motion", "", "gravity_unit", "warning",
            f"gravity is {gravity:g} m/s², whatever the file's unit of length; on Earth it is 9.81",
        )  # fmt: skip
    yield from _far_from_points(scenario)


def _not_from_home(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Warn that a motion without a start begins at its first waypoint."""
    if space.robot is None or scenario.task.start is not None:
        return
    home = space.robot.configurations.get("home")
    if home is not None and np.allclose(motion.curve(motion.start_time), home, atol=SAME_JOINTS):
        return
    at_speed = np.any(np.abs(motion.curve(motion.start_time, 1)) > SAME_JOINTS)
    cause = "the motion begins at speed" if at_speed else "the file has no start"
    approach = f"the approach to {scenario.waypoints[0].name!r}"
    yield Finding(
        "Not planned", "motion", "", "no_start", "information",
        f"{approach} is neither planned nor checked: {cause}", brief=f"{approach}: {cause}",
    )  # fmt: skip


def _far_from_points(scenario: Scenario) -> Iterator[Finding]:
    """Warn of a curve that deviates far from the line between two of its points.

    Its points are then few or uneven.
    """
    scale, unit = scenario.shown_length
    for path in scenario.paths:
        for any_curve in path.motion.path.curves:
            if not hasattr(any_curve, "arc_lengths"):  # lines and arcs need not load its class
                continue
            curve = cast("ThroughPoints", any_curve)
            lengths, fractions = np.diff(curve.arc_lengths), np.linspace(0.0, 1.0, 17)
            s = curve.arc_lengths[:-1, None] + lengths[:, None] * fractions
            start, chord = curve.points[:-1, None], np.diff(curve.points, axis=0)[:, None]
            offset = curve.position(s.ravel()).reshape(*s.shape, 3) - start
            size = np.linalg.norm(chord, axis=2)
            along = np.clip((offset * chord).sum(axis=2) / size**2, 0.0, 1.0)
            bulge = np.linalg.norm(offset - along[:, :, None] * chord, axis=2).max(axis=1)
            i = int((bulge / size[:, 0]).argmax())
            if bulge[i] > LARGEST_BULGE * size[i, 0]:
                last = scenario.waypoints[path.last]
                yield Finding(
                    "Warnings", "waypoint", last.name, "curve_between_points", "warning",
                    f"the curve through points to {last.name!r} leaves the straight line between "
                    f"points {i} and {i + 1}, {scale * size[i, 0]:.4g} {unit} apart, by "
                    f"{scale * bulge[i]:.4g} {unit}: add points there, or leave out points that "
                    "are much nearer to one another", time=last.time,
                )  # fmt: skip
