"""Durations of the turns of a repeated block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.scenario.repeats import turns
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding


def cycles(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report the time from the first waypoint of a turn to that of the next."""
    for rows in turns(scenario):
        starts = scenario.times[rows]
        if len(rows) < 2:
            continue
        each = np.diff(starts)
        mean, least, most = float(each.mean()), float(each.min()), float(each.max())
        first, last = (scenario.waypoints[i].name for i in (rows[0], rows[-1]))
        said = f"{len(rows)} turns, {mean:.4g} s from one to the next"
        if most - least > 1e-3:
            said += f" in the mean, {least:.4g} to {most:.4g} s"
        yield Finding(
            "Cycles",
            "cycle",
            first,
            "cycle",
            "information",
            f"{said}, from {first!r} to {last!r}",
            brief=said,
            interval=(float(starts[0]), float(starts[-1])),
        )
