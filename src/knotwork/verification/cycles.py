"""Durations of the turns of a repeated block."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.scenario.repetitions import turns
from knotwork.verification.checked_motion import Motion
from knotwork.verification.finding import Finding


def cycles(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report the time from the first waypoint of a turn to that of the next."""
    for rows in turns(scenario):
        starts = scenario.times[rows]
        if len(rows) < 2:
            continue
        durations = np.diff(starts)
        first, last = (scenario.waypoints[i].name for i in (rows[0], rows[-1]))
        text = f"{len(rows)} turns, {durations.mean():.4g} s from one to the next"
        if np.ptp(durations) > 1e-3:
            text += f" in the mean, {durations.min():.4g} to {durations.max():.4g} s"
        yield Finding(
            "Cycles", "cycle", first, "cycle", "information", f"{text}, from {first!r} to {last!r}",
            brief=text, interval=(float(starts[0]), float(starts[-1])),
        )  # fmt: skip
