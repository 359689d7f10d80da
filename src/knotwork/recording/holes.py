"""Where a log has no samples while its plan goes on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.refined import part
from knotwork.recording.alignment import Alignment
from knotwork.verification import Finding
from knotwork.waypoints import FloatArray

FEW = 5.5
"""A log without a sample for longer than this many of its periods has a hole."""
FEWEST, FAR = 1.75, 0.1
"""So has one without a sample for longer than this many, if a joint of the plan moves meanwhile by
more than this part of its whole range."""
HIDDEN = 4.0
"""A plan that moves no farther than this many standard deviations of the noise stands."""


def hole_findings(alignment: Alignment) -> Iterator[Finding]:
    """Say of each hole in the plan's time that nobody knows what the robot did in it.

    Where the plan moves that fails; where it stands it is warned of. The smoothed curve goes on in
    a hole, but it is a guess there, and so is all that is found of it.
    """
    plan, log = alignment.reference, alignment.curve.log
    time = log.time - alignment.start
    known = np.concatenate(([plan.start_time], time, [plan.end_time]))
    known = np.sort(np.clip(known, plan.start_time, plan.end_time))
    far = FAR * _range(plan.polynomial)
    for i in np.flatnonzero(np.diff(known) > FEWEST * log.period):
        start, end = float(known[i]), float(known[i + 1])
        moved = _range(part(plan.polynomial, start, end))
        moves = moved > HIDDEN * alignment.curve.noise.position
        allowed = FEWEST if (moves & (moved > far)).any() else FEW
        if end - start > allowed * log.period:
            yield _finding(start, end, log.period, allowed, moves=bool(moves.any()))


def _range(curve: PiecewisePolynomial) -> FloatArray:
    """How far each joint moves in all, shape (d,)."""
    found = curve.extrema(0)
    return found.maximum - found.minimum


def _finding(start: float, end: float, period: float, allowed: float, *, moves: bool) -> Finding:
    lasts, limit = end - start, allowed * period
    then = (
        "moves there, so it is not decided what the robot did"
        if moves
        else "stands there, and nothing shows that the robot did, too"
    )
    message = (
        f"the log has no sample from {start:.3f} s to {end:.3f} s: {lasts:.4g} s, "
        f"{lasts / period:.3g} times its interval of {1e3 * period:.4g} ms; the plan {then}"
    )
    return Finding(
        "Log", "motion", "", "hole", "failed" if moves else "warning", message,
        value=lasts, limit=limit, margin=limit - lasts, unit="s",
        time=start, interval=(start, end),
    )  # fmt: skip
